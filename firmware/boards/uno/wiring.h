/*
 * What hangs on which pin: an Arduino Uno with the DFRobot 2x2A motor shield (DRI0009) or, pin for pin the same, a DFRobot
 * Romeo, on the two-wheel platform ROB0005 with analogue infrared distance sensors. The picture is in firmware/README.md.
 */
#ifndef WIRING_H
#define WIRING_H

#include <avr/io.h>

/* Sensors on A0, A1, ..., from right to left. The battery takes A5 when there are at most five of them. */
#ifndef SCEANN_UNO_SENSORS
#define SCEANN_UNO_SENSORS 5u
#endif
#if SCEANN_UNO_SENSORS < 1u || SCEANN_UNO_SENSORS > 6u
#error "SCEANN_UNO_SENSORS: an Uno has 1 to 6 analogue inputs"
#endif

/* The robot's number, until it is given another one (`sceann set-node`). */
#ifndef SCEANN_UNO_NODE
#define SCEANN_UNO_NODE 1u
#endif

/* 0: output 0..1 is stop..full speed forward (the paper). 1: output 0..1 is full speed backward..forward, 0.5 is stop. */
#ifndef SCEANN_UNO_REVERSE
#define SCEANN_UNO_REVERSE 0
#endif

/* As in the simulation: motor 0 is the left wheel, motor 1 the right one, and sensors are counted from right to left. Speed
 * by PWM of timer 0, direction high = forward. */
#define MOTOR_PORT PORTD
#define MOTOR_DDR DDRD
#define RIGHT_PWM _BV(PD5)             /* OC0B */
#define RIGHT_FORWARD _BV(PD4)
#define LEFT_PWM _BV(PD6)              /* OC0A */
#define LEFT_FORWARD _BV(PD7)

/* Switches to ground, pulled up inside. */
#define SWITCH_PIN PIND
#define SWITCH_PORT PORTD
#define BUMPER _BV(PD2)
#define STOP_BUTTON _BV(PD3)
#define START_PIN PINB
#define START_PORT PORTB
#define START_BUTTON _BV(PB0)          /* D8 */

/* The board's own light, D13: tells the state. */
#define LIGHT_PORT PORTB
#define LIGHT_DDR DDRB
#define LIGHT _BV(PB5)

/* The line from the host, D0: read to tell a BREAK from a bad stop bit. */
#define LINE_PIN PIND
#define LINE_IN _BV(PD0)

/* Battery through 20 kOhm over 10 kOhm: a third of its voltage. The reference AVcc sags with an empty battery, so it is
 * measured too, by the chip's own band gap of 1.1 V (accurate to 10 %, steady to 1 %). */
#define BATTERY_CHANNEL 5u
#define BAND_GAP_CHANNEL 14u
#define BAND_GAP_MV 1100u
#define BATTERY_MV(battery, band_gap) ((uint16_t)((uint32_t)(battery) * (3u * BAND_GAP_MV) / (band_gap)))
#define BATTERY_LOW_MV 5500u
#define BATTERY_ABSENT_MV 1000u        /* less than this: no divider is there */

#endif
