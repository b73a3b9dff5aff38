/*
 * Little-endian numbers in messages and records.
 */
#ifndef SCEANN_WIRE_H
#define SCEANN_WIRE_H

#include <stdint.h>

uint16_t sceann_get16(const uint8_t *p);
uint32_t sceann_get32(const uint8_t *p);
void sceann_put16(uint8_t *p, uint16_t value);
void sceann_put32(uint8_t *p, uint32_t value);

#endif
