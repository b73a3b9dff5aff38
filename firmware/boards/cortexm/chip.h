/*
 * What a Cortex-M chip supplies to the shared main loop in cortexm.c. A board without a body of its own runs a controller
 * for a body that the host simulates (mode HIL); one with a body puts its functions into the port in chip_init.
 */
#ifndef CHIP_H
#define CHIP_H

#include "sceann_port.h"

#include <stdbool.h>
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* ---- the chip: stm32f405/chip.c, lm3s6965/chip.c ------------------------------------------------------------------ */

extern const uint32_t chip_clock_mhz_x10;      /* tenths of a MHz that SysTick counts; 0: chip_clock_us is there */
extern const uint8_t chip_uart_interrupt;      /* its number */

void HardFault_Handler(void);          /* a chip may bring its own */
void chip_init(sceann_port *port);             /* clocks, UART, store; fills in name, store, id, reset cause */
int chip_uart_get(bool *bad_stop_bit);         /* the next received byte, or -1; called from the interrupt */
bool chip_line_is_low(void);                   /* the level of the receiving pin */
bool chip_uart_put(uint8_t byte);              /* false while the transmitter is full */
uint32_t chip_clock_us(void);                  /* a timer of the chip's own; may be left out */
uint16_t chip_switches(void);                  /* SCEANN_ALARM_... of a body; may be left out */
void chip_store_read(void *board, uint16_t at, uint8_t *data, uint8_t n);
bool chip_store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n);
bool chip_may_sleep(uint32_t us);              /* something will wake the core in time; may be left out */
void chip_watchdog_start(void);                /* both chips' watchdogs cannot be stopped again */
void chip_watchdog_feed(void);

#endif
