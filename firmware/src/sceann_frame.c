#include "sceann_frame.h"

#include "sceann_crc.h"

#include <string.h>

#define OVERHEAD 4u                    /* id and crc */

uint8_t sceann_frame_encode(const sceann_message *message, uint8_t frame[SCEANN_FRAME_MAX])
{
    uint8_t raw[SCEANN_DATA_MAX + OVERHEAD];
    const uint8_t n = (uint8_t)(message->length + 2u);
    uint16_t crc = SCEANN_CRC16_INIT;

    raw[0] = (uint8_t)message->id;
    raw[1] = (uint8_t)(message->id >> 8);
    memcpy(&raw[2], message->data, message->length);
    for (uint8_t k = 0; k < n; k++) {
        crc = sceann_crc16(crc, raw[k]);
    }
    raw[n] = (uint8_t)(crc >> 8);
    raw[n + 1u] = (uint8_t)crc;

    uint8_t code = 0, end = 1;         /* where the present block's code byte stands; where the next byte goes */
    for (uint8_t k = 0; k < n + 2u; k++) {
        if (raw[k] == 0u) {
            frame[code] = (uint8_t)(end - code);
            code = end;
        } else {
            frame[end] = raw[k];
        }
        end++;
    }
    frame[code] = (uint8_t)(end - code);
    frame[end] = 0;
    return (uint8_t)(end + 1u);
}

static void push(sceann_decoder *d, uint8_t byte)
{
    if (d->n < sizeof d->raw) {
        d->raw[d->n++] = byte;
    } else {
        d->broken = true;
    }
}

static sceann_received finish(const sceann_decoder *d, sceann_message *message)
{
    if (!d->begun) {
        return SCEANN_NOTHING;
    }
    if (d->broken || d->block != 0u || d->n < OVERHEAD) {
        return SCEANN_BROKEN;
    }
    uint16_t crc = SCEANN_CRC16_INIT;
    for (uint8_t k = 0; k < d->n; k++) {
        crc = sceann_crc16(crc, d->raw[k]);
    }
    if (crc != 0u) {                   /* a message followed by its own CRC leaves 0 */
        return SCEANN_BROKEN;
    }
    message->id = (uint16_t)(d->raw[0] | (uint16_t)((uint16_t)d->raw[1] << 8));
    message->length = (uint8_t)(d->n - OVERHEAD);
    memset(message->data, 0, sizeof message->data);
    memcpy(message->data, &d->raw[2], message->length);
    return SCEANN_MESSAGE;
}

sceann_received sceann_frame_decode(sceann_decoder *d, uint8_t byte, sceann_message *message)
{
    if (byte == 0u) {
        const sceann_received result = finish(d, message);
        memset(d, 0, sizeof *d);
        return result;
    }
    if (d->block == 0u) {              /* a code byte; the block before it stood for a 00 in the data */
        if (d->begun) {
            push(d, 0);
        }
        d->begun = true;
        d->block = (uint8_t)(byte - 1u);
    } else {
        push(d, byte);
        d->block--;
    }
    return SCEANN_NOTHING;
}
