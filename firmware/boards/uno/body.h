/* Analogue sensors, motor driver, switches and battery. */
#ifndef BODY_H
#define BODY_H

#include <stdint.h>

void body_init(void);
void body_sense(void *board, uint16_t *sensors);
void body_drive(void *board, const int16_t *motors);
void body_safe(void *board);
uint16_t body_switches(void);          /* SCEANN_ALARM_ESTOP, _BUMPER, _BATTERY */
uint16_t body_battery_mv(void *board);

#endif
