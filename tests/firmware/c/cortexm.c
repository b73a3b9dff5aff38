/* The same questions from a file, by semihosting: blocks {kind u32, n u32, record 136 bytes, sensors} in `questions`, states,
 * motor outputs and sigmoid values in `answers`. Exit status 0 when the file ends. */
#include "steps.h"

#define CHUNK 256u
#define RECORD 136u                    /* of the largest network, rounded up */

enum { SYS_OPEN = 1, SYS_WRITE = 5, SYS_READ = 6, SYS_EXIT_EXTENDED = 0x20 };
enum { END, RUN, SIGMOID };

extern uint32_t _sidata, _sdata, _edata, _sbss, _ebss, _estack;
void Reset_Handler(void);

static int semihost(int operation, void *argument)
{
    register int r0 __asm("r0") = operation;
    register void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void leave(uint32_t status)
{
    uint32_t arguments[2] = { 0x20026u, status };
    semihost(SYS_EXIT_EXTENDED, arguments);
}

static int open_file(const char *name, uint32_t length, uint32_t mode)
{
    uint32_t arguments[3] = { (uint32_t)(uintptr_t)name, mode, length };
    return semihost(SYS_OPEN, arguments);
}

static void transfer(int operation, int file, void *data, uint32_t n)
{
    uint32_t arguments[3] = { (uint32_t)file, (uint32_t)(uintptr_t)data, n };
    if (semihost(operation, arguments) != 0) {
        leave(2);
    }
}

static void run(int in, int out, uint32_t n)
{
    static sceann_controller c;
    static uint8_t record[RECORD];
    static uint16_t sensors[CHUNK * SCEANN_MAX_SENSORS];
    static int16_t states[CHUNK * SCEANN_MAX_NEURONS], motors[CHUNK * SCEANN_MAX_MOTORS];

    transfer(SYS_READ, in, record, sizeof record);
    if (steps_load(&c, record) != 0) {
        leave(3);
    }
    while (n > 0u) {
        const uint32_t now = n < CHUNK ? n : CHUNK;
        transfer(SYS_READ, in, sensors, now * c.n_sensors * 2u);
        steps_run(&c, sensors, now, states, motors);
        transfer(SYS_WRITE, out, states, now * c.n_neurons * 2u);
        transfer(SYS_WRITE, out, motors, now * c.n_motors * 2u);
        n -= now;
    }
}

static void sigmoid(int out)
{
    for (int32_t u = -8192; u <= 8192; u++) {
        int16_t x = sceann_sigmoid((int16_t)u);
        transfer(SYS_WRITE, out, &x, sizeof x);
    }
}

void Reset_Handler(void)
{
    for (uint32_t *from = &_sidata, *to = &_sdata; to < &_edata;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &_sbss; to < &_ebss;) {
        *to++ = 0;
    }
    const int in = open_file("questions", 9, 1), out = open_file("answers", 7, 5);
    for (;;) {
        uint32_t head[2];
        transfer(SYS_READ, in, head, sizeof head);
        switch (head[0]) {
        case RUN:
            run(in, out, head[1]);
            break;
        case SIGMOID:
            sigmoid(out);
            break;
        default:
            leave(0);
        }
    }
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = { &_estack, (void *)(uintptr_t)Reset_Handler };
