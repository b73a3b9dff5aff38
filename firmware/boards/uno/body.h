/* Analogue sensors, motor driver, switches and battery. */
#ifndef BODY_H
#define BODY_H

#include <stdbool.h>
#include <stdint.h>

void body_init(void);
void body_sense(void *board, uint16_t *sensors);
void body_drive(void *board, const int16_t *motors);
void body_safe(void *board);
uint16_t body_switches(void);          /* SCEANN_ALARM_ESTOP, _BUMPER, _BATTERY, _BUTTON */
void body_measure_battery(void);       /* half a millisecond */
void body_light(void *board, bool on);
uint16_t body_battery_mv(void *board);

#endif
