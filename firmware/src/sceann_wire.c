#include "sceann_wire.h"

uint16_t sceann_get16(const uint8_t *p)
{
    return (uint16_t)(p[0] | (uint16_t)((uint16_t)p[1] << 8));
}

uint32_t sceann_get32(const uint8_t *p)
{
    return sceann_get16(p) | (uint32_t)sceann_get16(p + 2) << 16;
}

void sceann_put16(uint8_t *p, uint16_t value)
{
    p[0] = (uint8_t)value;
    p[1] = (uint8_t)(value >> 8);
}

void sceann_put32(uint8_t *p, uint32_t value)
{
    sceann_put16(p, (uint16_t)value);
    sceann_put16(p + 2, (uint16_t)(value >> 16));
}
