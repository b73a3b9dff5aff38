/* The same questions through a mailbox in an AVR's memory; the simulator reads and writes it from outside. */
#include "sceann_controller.h"

#include <avr/io.h>
#include <string.h>

enum { LOAD = 1, STEP = 2, SIGMOID = 3 };

struct {
    volatile uint8_t command;          /* 0 when done */
    uint8_t result;
    uint8_t in[SCEANN_MAX_RECORD];
    int16_t out[SCEANN_MAX_NEURONS + SCEANN_MAX_MOTORS];
} mailbox;
static sceann_controller controller;

int main(void)
{
    for (;;) {
        switch (mailbox.command) {
        case LOAD:
            mailbox.result = (uint8_t)sceann_genome_check(mailbox.in);
            if (mailbox.result == SCEANN_GENOME_OK) {
                sceann_controller_decode(&controller, mailbox.in);
            }
            break;
        case STEP: {
            uint16_t sensors[SCEANN_MAX_SENSORS];
            memcpy(sensors, mailbox.in, sizeof sensors);
            GPIOR0 = 1;
            sceann_controller_step(&controller, sensors);
            GPIOR0 = 0;
            memcpy(mailbox.out, controller.u, controller.n_neurons * sizeof *mailbox.out);
            memcpy(&mailbox.out[controller.n_neurons], sceann_controller_motors(&controller),
                   controller.n_motors * sizeof *mailbox.out);
            break;
        }
        case SIGMOID: {
            int16_t u;
            memcpy(&u, mailbox.in, sizeof u);
            mailbox.out[0] = sceann_sigmoid(u);
            break;
        }
        default:
            continue;
        }
        mailbox.command = 0;
    }
}
