#include "sceann_crc.h"

#if defined(__AVR__)
#include <util/crc16.h>

uint16_t sceann_crc16(uint16_t crc, uint8_t byte)
{
    return _crc_xmodem_update(crc, byte);
}

#else

uint16_t sceann_crc16(uint16_t crc, uint8_t byte)
{
    uint16_t x = (uint16_t)((crc >> 8) ^ byte);
    x = (uint16_t)(x ^ (x >> 4));
    return (uint16_t)((unsigned)crc << 8 ^ (unsigned)x << 12 ^ (unsigned)x << 5 ^ x);
}

#endif

uint32_t sceann_crc32(uint32_t crc, uint8_t byte)
{
    crc ^= byte;
    for (uint8_t bit = 0; bit < 8u; bit++) {
        crc = (crc >> 1) ^ (0xEDB88320u & (uint32_t)(0u - (crc & 1u)));
    }
    return crc;
}
