/*
 * Messages on a serial line: COBS(id:u16le data[0..8] crc16:be) 00, at most 14 bytes (docs/link.md).
 *
 * The decoder takes one byte at a time and needs no buffer of the caller's. A frame that fails its check is reported
 * once and dropped; a lone 00 is nothing; whatever was lost, the next 00 brings it back into step.
 */
#ifndef SCEANN_FRAME_H
#define SCEANN_FRAME_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SCEANN_DATA_MAX 8u             /* as in a classic CAN frame */
#define SCEANN_FRAME_MAX 14u           /* bytes on the line, 00 included */

typedef struct {
    uint16_t id;                       /* function + node, 11 bits */
    uint8_t length;                    /* 0..8 */
    uint8_t data[SCEANN_DATA_MAX];
} sceann_message;

typedef enum {
    SCEANN_NOTHING,                    /* no complete frame yet */
    SCEANN_MESSAGE,                    /* a message was received */
    SCEANN_BROKEN                      /* a frame ended and failed its check */
} sceann_received;

typedef struct {
    uint8_t raw[SCEANN_FRAME_MAX - 2u];/* id, data, crc */
    uint8_t n;                         /* bytes in raw */
    uint8_t block;                     /* bytes left in the present COBS block */
    bool begun;                        /* a byte other than 00 came since the last 00 */
    bool broken;                       /* too long */
} sceann_decoder;

/* Writes a message as a frame; returns its length, 6..14. */
uint8_t sceann_frame_encode(const sceann_message *message, uint8_t frame[SCEANN_FRAME_MAX]);

/* Takes the next byte of the line. Zero the decoder before its first byte. */
sceann_received sceann_frame_decode(sceann_decoder *decoder, uint8_t byte, sceann_message *message);

#ifdef __cplusplus
}
#endif
#endif
