/*
 * The STM32F405's CAN controller (bxCAN 1): classic frames at 500 kbit/s on PB8 (in) and PB9 (out), to a transceiver such as
 * the SN65HVD230. Build the board with -DSCEANN_CAN=1 for the link on CAN instead of the UART.
 */
#ifndef CAN_H
#define CAN_H

#include "sceann_frame.h"

#include <stdbool.h>
#include <stdint.h>

/* Mode, bit timing, no filter yet: nothing is received. False: the controller does not answer. */
bool can_init(void);

/* Lets data frames with 11-bit identifiers for this node and the stop of all nodes through, and nothing else. */
void can_listen(void *board, uint8_t node);

sceann_received can_receive(void *board, sceann_message *message);     /* never waits */
void can_send(void *board, const sceann_message *message);             /* drops what the bus does not take */

/* ---- what the driver stands on: registers of the controller; a test brings its own -------------------------------- */

uint32_t can_get(uint32_t offset);
void can_put(uint32_t offset, uint32_t value);

#endif
