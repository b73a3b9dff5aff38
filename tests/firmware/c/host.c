/* The questions of steps.h as a shared library for ctypes. */
#include "steps.h"

static sceann_controller controller;

int host_run(const uint8_t *record, const uint16_t *sensors, uint32_t n_steps, int16_t *states, int16_t *motors,
             uint16_t *state_hash, uint32_t *weights_crc);
void host_sigmoid(const int16_t *u, uint32_t n, int16_t *x);

int host_run(const uint8_t *record, const uint16_t *sensors, uint32_t n_steps, int16_t *states, int16_t *motors,
             uint16_t *state_hash, uint32_t *weights_crc)
{
    const int result = steps_load(&controller, record);
    if (result == 0) {
        steps_run(&controller, sensors, n_steps, states, motors);
        *state_hash = controller.state_hash;
        *weights_crc = sceann_controller_weights_crc(&controller);
    }
    return result;
}

void host_sigmoid(const int16_t *u, uint32_t n, int16_t *x)
{
    for (uint32_t k = 0; k < n; k++) {
        x[k] = sceann_sigmoid(u[k]);
    }
}
