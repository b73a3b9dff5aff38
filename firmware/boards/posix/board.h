/*
 * The posix board: the firmware as a Linux process. A descriptor is its serial line, another one its body (sensors,
 * motor driver, bumper, battery), a file its EEPROM. The core runs unchanged.
 */
#ifndef BOARD_H
#define BOARD_H

#include "sceann_port.h"

#include <stdint.h>

/* ---- clock.c: CLOCK_MONOTONIC -------------------------------------------------------------------------------------- */

uint64_t clock_now_us(void);

/* ---- line.c: the serial line, paced like a UART of `baud`, or as fast as it goes with 0 ---------------------------- */

void line_open(int fd, uint32_t baud);
sceann_received line_receive(void *board, sceann_message *message);
void line_send(void *board, const sceann_message *message);

/* Sleeps until a byte can have come, a byte can leave, or timeout_us have passed; then moves bytes. */
void line_wait(uint32_t timeout_us);

/* ---- body.c: what hangs on the pins, as records on a socket -------------------------------------------------------
 *
 * Board to body, 16 bytes: kind, count, time in us u32, motors 3 x u16 Q10, 4 zeros. Kinds: 'D' drive these motors,
 * 'S' safe output, 'Q' sensors please (answered by 'A').
 * Body to board, 32 bytes: kind, 0, alarms u16 (SCEANN_ALARM_...), battery in mV u16, sensors 12 x u16, 2 zeros. Kinds:
 * 'A' the answer to 'Q', 'V' values sent unasked (a bumper that is hit between two ticks).
 * A body that leaves 'Q' unanswered for 100 ms is board fault 1. */

#define BODY_TO_BYTES 16
#define BODY_FROM_BYTES 32

void body_open(int fd, uint8_t n_sensors, uint8_t n_motors);
void body_sense(void *board, uint16_t *sensors);
void body_drive(void *board, const int16_t *motors);
void body_safe(void *board);
uint16_t body_alarms(void *board);
uint16_t body_battery_mv(void *board);

#endif
