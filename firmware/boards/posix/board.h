/*
 * The posix board: the firmware as a Linux process. A descriptor is its serial line, another one its body (sensors,
 * motor driver, bumper, battery), a file its EEPROM. The core runs unchanged.
 */
#ifndef BOARD_H
#define BOARD_H

#include "sceann_port.h"

#include <stdint.h>

/* ---- clock.c: CLOCK_MONOTONIC -------------------------------------------------------------------------------------- */

uint64_t clock_now_us(void);           /* of this computer */

/* The robot's own: it stands still while this computer is late, so that a busy computer makes a slow robot and not a
 * broken one. */
uint64_t clock_robot_us(void);

/* This computer was `late_us` late; what is more than `allowed_us` of it never happened to the robot. */
void clock_forgive(uint64_t late_us, uint64_t allowed_us);

/* ---- line.c: the serial line, paced like a UART of `baud`, or as fast as it goes with 0 ---------------------------- */

void line_open(int fd, uint32_t baud);
void line_ends_with(int fd);           /* ends the program when the other end of this pipe is closed */
sceann_received line_receive(void *board, sceann_message *message);
void line_send(void *board, const sceann_message *message);

/* Sleeps until a byte can have come, a byte can leave, or timeout_us have passed; then moves bytes. Waking
 * later than allowed_us is forgiven (clock_forgive). */
void line_wait(uint32_t timeout_us, uint32_t allowed_us);

/* ---- body.c: what hangs on the pins, as records on a socket -------------------------------------------------------
 *
 * Board to body, 16 bytes: kind, count, time in us u32, motors 3 x u16 Q10, 4 zeros. Kinds: 'D' drive these motors,
 * 'S' safe output, 'Q' sensors please (answered by 'A').
 * Body to board, 32 bytes: kind, 0, alarms u16 (SCEANN_ALARM_...), battery in mV u16, sensors 12 x u16, 2 zeros. Kinds:
 * 'A' the answer to 'Q', 'V' values sent unasked (a bumper that is hit between two ticks).
 * The robot's time stands still while it waits for an answer: the body is simulated, and its computer may be busy. A
 * body that leaves 'Q' unanswered for two seconds is board fault 1. */

#define BODY_TO_BYTES 16
#define BODY_FROM_BYTES 32

void body_open(int fd, uint8_t n_sensors, uint8_t n_motors);
void body_sense(void *board, uint16_t *sensors);
void body_drive(void *board, const int16_t *motors);
void body_safe(void *board);
uint16_t body_alarms(void *board);
uint16_t body_battery_mv(void *board);

/* ---- main.c ------------------------------------------------------------------------------------------------------- */

void board_feed(void);                 /* feeds the watchdog if it is on: waiting for a body is not hanging */

#endif
