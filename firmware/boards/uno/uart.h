/* UART 0 with interrupts: both directions through rings of 64 bytes, BREAK seen. */
#ifndef UART_H
#define UART_H

#include <stdbool.h>
#include <stdint.h>

#ifndef BAUD
#define BAUD 115200UL
#endif

void uart_init(void);
int16_t uart_get(void);                /* the next byte, or -1 */
void uart_put(uint8_t byte);           /* waits while the ring is full */
bool uart_break(void);                 /* a BREAK is on the line; looks for SCEANN_BREAK_US if it may be one */
bool uart_has_input(void);

#endif
