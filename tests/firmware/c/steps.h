/* What every target is asked: decode this record, take these sensors, tell all states; or the sigmoid of every state. */
#ifndef STEPS_H
#define STEPS_H

#include "sceann_controller.h"

/* n_steps x n_sensors sensors give n_steps x n_neurons states and n_steps x n_motors outputs. */
void steps_run(sceann_controller *c, const uint16_t *sensors, uint32_t n_steps, int16_t *states, int16_t *motors);

/* Checks and decodes a record; 0 if it is fine. */
int steps_load(sceann_controller *c, const uint8_t *record);

#endif
