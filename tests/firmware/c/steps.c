#include "steps.h"

#include <string.h>

int steps_load(sceann_controller *c, const uint8_t *record)
{
    const sceann_genome_result result = sceann_genome_check(record);
    if (result == SCEANN_GENOME_OK) {
        sceann_controller_decode(c, record);
    }
    return (int)result;
}

void steps_run(sceann_controller *c, const uint16_t *sensors, uint32_t n_steps, int16_t *states, int16_t *motors)
{
    for (uint32_t k = 0; k < n_steps; k++) {
        sceann_controller_step(c, sensors);
        memcpy(states, c->u, c->n_neurons * sizeof *states);
        memcpy(motors, sceann_controller_motors(c), c->n_motors * sizeof *motors);
        sensors += c->n_sensors;
        states += c->n_neurons;
        motors += c->n_motors;
    }
}
