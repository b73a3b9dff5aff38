/* One exported header in a loop that the simulator drives: cycles between the two writes to GPIOR0 are those of a step, with AS_FUNCTION
 * those of calling a function that does it. With EMPTY the loop alone, whose size is subtracted. */
#include <avr/io.h>
#include <stdint.h>

#ifndef EMPTY
#include "net.h"
static net_t net;

#ifdef AS_FUNCTION
/* as in a program with several controllers, or several places that step one */
static void __attribute__((noinline)) step(net_t *c, const uint16_t *sensors, int16_t *motors)
{
    net_step(c, sensors, motors);
    __asm__ __volatile__("" ::: "memory");
}
#else
#define step net_step
#endif
#endif

struct {
    volatile uint8_t command;          /* 0 when done */
    uint8_t result;
    uint16_t sensors[12];
    int16_t motors[3];
    uint16_t states[22];
} mailbox;

int main(void)
{
#ifndef EMPTY
    net_reset(&net);
#endif
    for (;;) {
        if (mailbox.command == 0u) {
            continue;
        }
#ifndef EMPTY
        GPIOR0 = 1;
        __asm__ __volatile__("" ::: "memory");
        step(&net, mailbox.sensors, mailbox.motors);
        __asm__ __volatile__("" ::: "memory");
        GPIOR0 = 0;
#ifdef COPY_STATES
        for (uint8_t k = 0; k < NET_NEURONS; k++) {
            mailbox.states[k] = net.u[k];
        }
#endif
#ifdef NET_SELF_TEST
        mailbox.result = (uint8_t)net_self_test();
#endif
#endif
        mailbox.command = 0;
    }
}
