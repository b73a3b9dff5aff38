/*
 * The store in flash on simulated memory whose power fails at every byte that is programmed and at every erasure, half-done bytes and
 * half-done erasures included. After each cut the store is opened again: the write that was cut off is there whole or not at all, every
 * other byte is as it was, and it can be written to. Exit status 0 if that holds everywhere; the number of cuts on standard output.
 */
#include "sceann_flash.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SECTOR 1100u                   /* small, so that the sectors take turns often */

static uint8_t memory[2u * SECTOR];
static long left;                      /* bytes until the power fails; negative: never */
static jmp_buf dark;
static unsigned noise = 1;

static unsigned random_bits(void)
{
    noise = noise * 1103515245u + 12345u;
    return noise >> 16;
}

static bool cut(void)
{
    return left >= 0 && left-- == 0;
}

static bool read_flash(void *chip, uint32_t at, uint8_t *data, uint16_t n)
{
    (void)chip;
    memcpy(data, memory + at, n);
    return true;
}

static bool program(void *chip, uint32_t at, const uint8_t *data, uint16_t n)
{
    (void)chip;
    for (uint16_t k = 0; k < n; k++) {
        if (cut()) {
            memory[at + k] &= (uint8_t)(data[k] | random_bits());      /* some of its bits */
            longjmp(dark, 1);
        }
        memory[at + k] &= data[k];
    }
    return true;
}

static bool erase(void *chip, uint32_t at)
{
    (void)chip;
    for (uint32_t k = 0; k < SECTOR; k++) {
        if (k % 64u == 0u && cut()) {
            for (uint32_t j = k; j < SECTOR; j++) {
                memory[at + j] |= (uint8_t)random_bits();
            }
            longjmp(dark, 1);
        }
        memory[at + k] = 0xFF;
    }
    return true;
}

static const sceann_flash_device device = { SECTOR, NULL, read_flash, program, erase };
static uint8_t expected[SCEANN_STORE_BYTES];

static void require(bool truth, long cuts)
{
    if (!truth) {
        printf("after cut %ld\n", cuts);
        exit(1);
    }
}

int main(void)
{
    static sceann_flash flash;
    static uint8_t start[2u * SECTOR], old[SCEANN_STORE_BYTES];
    volatile long cuts = 0;            /* not in a register: longjmp would forget it */
    memset(memory, 0xFF, sizeof memory);
    memset(expected, 0xFF, sizeof expected);
    require(sceann_flash_open(&flash, &device), -1);
    for (unsigned round = 0; round < 60u; round++) {
        uint8_t data[64];
        const uint8_t n = (uint8_t)(1u + random_bits() % sizeof data);
        const uint16_t at = (uint16_t)(random_bits() % (SCEANN_STORE_BYTES - n));
        for (uint8_t k = 0; k < n; k++) {
            data[k] = (uint8_t)random_bits();
        }
        memcpy(start, memory, sizeof start);
        memcpy(old, expected, sizeof old);
        memcpy(&expected[at], data, n);
        for (long budget = 0;; budget++) {
            memcpy(memory, start, sizeof start);
            left = -1;
            require(sceann_flash_open(&flash, &device), cuts);
            left = budget;
            volatile bool whole = false;
            if (setjmp(dark) == 0) {
                whole = sceann_flash_write(&flash, at, data, n);
                require(whole, cuts);
            }
            left = -1;
            require(sceann_flash_open(&flash, &device), cuts);
            const bool now = memcmp(flash.bytes, expected, sizeof expected) == 0;
            require(now || (!whole && memcmp(flash.bytes, old, sizeof old) == 0), cuts);
            /* and it goes on: the same write again, and one more */
            require(sceann_flash_write(&flash, at, data, n), cuts);
            require(sceann_flash_open(&flash, &device), cuts);
            require(memcmp(flash.bytes, expected, sizeof expected) == 0, cuts);
            cuts++;
            if (whole) {
                break;
            }
        }
    }
    printf("%ld\n", cuts);
    return 0;
}
