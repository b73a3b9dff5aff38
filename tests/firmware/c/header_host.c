/* An exported header as a shared library for ctypes. */
#include "net.h"

void header_run(const uint16_t *sensors, uint32_t n_steps, uint16_t *states, int16_t *motors);

void header_run(const uint16_t *sensors, uint32_t n_steps, uint16_t *states, int16_t *motors)
{
    net_t net;
    net_reset(&net);
    for (uint32_t k = 0; k < n_steps; k++) {
        net_step(&net, sensors + k * NET_SENSORS, motors + k * NET_MOTORS);
        for (unsigned i = 0; i < NET_NEURONS; i++) {
            states[k * NET_NEURONS + i] = net.u[i];
        }
    }
}
