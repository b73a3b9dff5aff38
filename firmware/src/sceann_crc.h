/*
 * The two check sums of the link: CRC-16 for frames and state hashes, CRC-32 for genomes, weights and tables.
 */
#ifndef SCEANN_CRC_H
#define SCEANN_CRC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SCEANN_CRC16_INIT 0xFFFFu
#define SCEANN_CRC32_INIT 0xFFFFFFFFu

/* Polynomial 0x1021, no reflection, no final xor; 0x29B1 for "123456789" from SCEANN_CRC16_INIT. */
uint16_t sceann_crc16(uint16_t crc, uint8_t byte);

/* zlib's CRC-32 as a running value: start with SCEANN_CRC32_INIT, invert the last value (~crc) for the result. */
uint32_t sceann_crc32(uint32_t crc, uint8_t byte);

#ifdef __cplusplus
}
#endif
#endif
