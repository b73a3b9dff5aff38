/*
 * A store in flash that is erased in sectors: bytes can be written one by one, and power may fail at every moment.
 *
 * Two sectors take turns. One holds a snapshot of all bytes and behind it the writes since then, each with a check sum.
 * When it is full, the other one is erased and gets a new snapshot, whose header is written last; the header with the
 * higher number counts. A write that power loss cuts off is there whole or not at all; all other bytes stay.
 */
#ifndef SCEANN_FLASH_H
#define SCEANN_FLASH_H

#include "sceann_numbers.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A block device, as the chip has it. Every function may fail. Addresses count from the first of the two sectors. */
typedef struct {
    uint32_t sector_size;              /* bytes; at least SCEANN_STORE_BYTES + 64 */
    void *chip;                        /* handed to every function */
    bool (*read)(void *chip, uint32_t at, uint8_t *data, uint16_t n);
    bool (*program)(void *chip, uint32_t at, const uint8_t *data, uint16_t n);     /* into erased bytes (0xFF) */
    bool (*erase)(void *chip, uint32_t at);                                        /* one sector */
} sceann_flash_device;

typedef struct {
    const sceann_flash_device *device;
    uint8_t sector;                    /* the one that counts, 0 or 1 */
    bool full;                         /* nothing can be put behind what is there */
    uint32_t number;                   /* of its header; 0: nothing was ever written */
    uint32_t end;                      /* first free byte, within the sector */
    uint8_t bytes[SCEANN_STORE_BYTES]; /* what is stored */
} sceann_flash;

/* Finds what is stored; 0xFF everywhere in new memory. False: the device cannot be read. */
bool sceann_flash_open(sceann_flash *flash, const sceann_flash_device *device);

void sceann_flash_read(const sceann_flash *flash, uint16_t at, uint8_t *data, uint8_t n);

/* False: it failed, and what was stored before is still stored. */
bool sceann_flash_write(sceann_flash *flash, uint16_t at, const uint8_t *data, uint8_t n);

#ifdef __cplusplus
}
#endif
#endif
