#define _POSIX_C_SOURCE 200809L
#include "board.h"

#include <time.h>

uint64_t clock_now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

static uint64_t forgiven_us;

uint64_t clock_robot_us(void)
{
    return clock_now_us() - forgiven_us;
}

void clock_forgive(uint64_t late_us, uint64_t allowed_us)
{
    if (late_us > allowed_us) {
        forgiven_us += late_us - allowed_us;
    }
}
