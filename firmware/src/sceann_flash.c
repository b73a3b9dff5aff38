#include "sceann_flash.h"

#include "sceann_crc.h"
#include "sceann_wire.h"

#include <string.h>

/* A header: magic u32, number u32, CRC-32 of number and snapshot u32, 4 bytes unused. */
#define MAGIC 0x53434531u
#define HEADER 16u
#define LOG_START (HEADER + SCEANN_STORE_BYTES)

#if (SCEANN_STORE_BYTES) % 4u != 0u
#error "flash memory is programmed in words: SCEANN_STORE_BYTES must be a multiple of 4"
#endif

/* A write: at u16, n u8, data, CRC-16 over all of it (big-endian, so that the whole gives 0); padded to 4 bytes. */
#define ENTRY_HEAD 3u
#define ENTRY_MAX 260u
#define ERASED 0xFFFFu

static uint32_t start_of(const sceann_flash *flash, uint8_t sector)
{
    return sector * flash->device->sector_size;
}

static uint16_t padded(uint16_t n)
{
    return (uint16_t)((n + 3u) & ~3u);
}

static uint32_t snapshot_crc(uint32_t number, const uint8_t *bytes)
{
    uint8_t head[4];
    uint32_t crc = SCEANN_CRC32_INIT;
    sceann_put32(head, number);
    for (uint8_t k = 0; k < sizeof head; k++) {
        crc = sceann_crc32(crc, head[k]);
    }
    for (uint16_t k = 0; k < SCEANN_STORE_BYTES; k++) {
        crc = sceann_crc32(crc, bytes[k]);
    }
    return ~crc;
}

/* Reads a sector's snapshot; its number, or 0 if it does not hold. */
static uint32_t load(const sceann_flash *flash, uint8_t sector, uint8_t *bytes)
{
    const sceann_flash_device *device = flash->device;
    uint8_t header[HEADER];
    const uint32_t start = start_of(flash, sector);
    if (!device->read(device->chip, start, header, HEADER) || sceann_get32(&header[0]) != MAGIC ||
        !device->read(device->chip, start + HEADER, bytes, SCEANN_STORE_BYTES)) {
        return 0;
    }
    const uint32_t number = sceann_get32(&header[4]);
    return snapshot_crc(number, bytes) == sceann_get32(&header[8]) ? number : 0u;
}

static uint16_t crc16(const uint8_t *data, uint16_t n)
{
    uint16_t crc = SCEANN_CRC16_INIT;
    for (uint16_t k = 0; k < n; k++) {
        crc = sceann_crc16(crc, data[k]);
    }
    return crc;
}

/* Applies the writes behind the snapshot. What is no whole write was cut off, and nothing may be put behind it. */
static void replay(sceann_flash *flash)
{
    const sceann_flash_device *device = flash->device;
    const uint32_t start = start_of(flash, flash->sector);
    uint8_t entry[ENTRY_MAX];
    flash->end = LOG_START;
    flash->full = true;
    while (flash->end + ENTRY_HEAD + 2u <= device->sector_size) {
        if (!device->read(device->chip, start + flash->end, entry, ENTRY_HEAD)) {
            return;
        }
        const uint16_t at = sceann_get16(&entry[0]), n = entry[2], size = (uint16_t)(ENTRY_HEAD + n + 2u);
        if (at == ERASED && n == 0xFFu) {
            break;
        }
        if ((uint32_t)at + n > SCEANN_STORE_BYTES || flash->end + size > device->sector_size ||
            !device->read(device->chip, start + flash->end, entry, size) || crc16(entry, size) != 0u) {
            return;
        }
        memcpy(&flash->bytes[at], &entry[ENTRY_HEAD], n);
        flash->end += padded(size);
    }
    /* behind the last write everything must be erased: a cut-off write may have left its head as it was */
    for (uint32_t k = flash->end; k < device->sector_size; k++) {
        if (!device->read(device->chip, start + k, entry, 1) || entry[0] != 0xFFu) {
            return;
        }
    }
    flash->full = false;
}

bool sceann_flash_open(sceann_flash *flash, const sceann_flash_device *device)
{
    memset(flash, 0, sizeof *flash);
    flash->device = device;
    uint32_t numbers[2];
    for (uint8_t sector = 0; sector < 2u; sector++) {
        numbers[sector] = load(flash, sector, flash->bytes);
    }
    flash->sector = numbers[1] != 0u && (numbers[0] == 0u || (int32_t)(numbers[1] - numbers[0]) > 0) ? 1u : 0u;
    flash->number = load(flash, flash->sector, flash->bytes);
    if (flash->number == 0u) {
        uint8_t byte;
        memset(flash->bytes, 0xFF, sizeof flash->bytes);
        flash->full = true;
        flash->sector = 1;             /* the first snapshot goes into sector 0 */
        return device->read(device->chip, 0, &byte, 1);
    }
    replay(flash);
    return true;
}

void sceann_flash_read(const sceann_flash *flash, uint16_t at, uint8_t *data, uint8_t n)
{
    memcpy(data, &flash->bytes[at], n);
}

/* All bytes into the other sector, which then counts. */
static bool turn(sceann_flash *flash)
{
    const sceann_flash_device *device = flash->device;
    const uint8_t other = (uint8_t)(1u - flash->sector);
    const uint32_t start = start_of(flash, other);
    const uint32_t number = flash->number + 1u;
    uint8_t header[HEADER], back[HEADER];
    memset(header, 0xFF, sizeof header);
    sceann_put32(&header[0], MAGIC);
    sceann_put32(&header[4], number);
    sceann_put32(&header[8], snapshot_crc(number, flash->bytes));
    if (!device->erase(device->chip, start) ||
        !device->program(device->chip, start + HEADER, flash->bytes, SCEANN_STORE_BYTES) ||
        !device->program(device->chip, start, header, HEADER) ||
        !device->read(device->chip, start, back, HEADER) || memcmp(back, header, HEADER) != 0) {
        return false;
    }
    for (uint16_t k = 0; k < SCEANN_STORE_BYTES; k++) {
        if (!device->read(device->chip, start + HEADER + k, back, 1) || back[0] != flash->bytes[k]) {
            return false;
        }
    }
    flash->sector = other;
    flash->number = number;
    flash->end = LOG_START;
    flash->full = false;
    return true;
}

static bool append(sceann_flash *flash, uint16_t at, const uint8_t *data, uint8_t n)
{
    const sceann_flash_device *device = flash->device;
    const uint16_t size = (uint16_t)(ENTRY_HEAD + n + 2u);
    if (flash->full || flash->end + padded(size) > device->sector_size) {
        return false;
    }
    uint8_t entry[ENTRY_MAX], back[ENTRY_MAX];
    memset(entry, 0xFF, sizeof entry);
    sceann_put16(&entry[0], at);
    entry[2] = n;
    memcpy(&entry[ENTRY_HEAD], data, n);
    const uint16_t crc = crc16(entry, (uint16_t)(ENTRY_HEAD + n));
    entry[ENTRY_HEAD + n] = (uint8_t)(crc >> 8);
    entry[ENTRY_HEAD + n + 1u] = (uint8_t)crc;
    const uint32_t place = start_of(flash, flash->sector) + flash->end;
    if (!device->program(device->chip, place, entry, padded(size)) ||
        !device->read(device->chip, place, back, size) || memcmp(back, entry, size) != 0) {
        flash->full = true;            /* what is there is no whole write */
        return false;
    }
    flash->end += padded(size);
    return true;
}

bool sceann_flash_write(sceann_flash *flash, uint16_t at, const uint8_t *data, uint8_t n)
{
    if ((uint32_t)at + n > SCEANN_STORE_BYTES) {
        return false;
    }
    if (memcmp(&flash->bytes[at], data, n) == 0) {
        return true;
    }
    uint8_t before[UINT8_MAX];
    const bool appended = append(flash, at, data, n);
    memcpy(before, &flash->bytes[at], n);
    memcpy(&flash->bytes[at], data, n);
    if (!appended && !turn(flash)) {
        memcpy(&flash->bytes[at], before, n);
        return false;
    }
    return true;
}
