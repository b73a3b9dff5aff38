/*
 * sceann_link.c: the robot link's messages, generated from sceann.dbc by tools/generate_link with cantools. Do not edit.
 * What the messages mean is written in docs/link.md.
 *
 * @copyright Copyright (c) 2018-2019 Erik Moqvist
 *
 * @par License
 * The MIT License (MIT)
 *
 * Permission is hereby granted, free of charge, to any person
 * obtaining a copy of this software and associated documentation
 * files (the "Software"), to deal in the Software without
 * restriction, including without limitation the rights to use, copy,
 * modify, merge, publish, distribute, sublicense, and/or sell copies
 * of the Software, and to permit persons to whom the Software is
 * furnished to do so, subject to the following conditions:
 *
 * The above copyright notice and this permission notice shall be
 * included in all copies or substantial portions of the Software.
 *
 * THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND,
 * EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
 * MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
 * NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS
 * BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
 * ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN
 * CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
 * SOFTWARE.
 */

#include <string.h>

#include "sceann_link.h"

static inline uint8_t pack_left_shift_u8(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value << shift) & mask);
}

static inline uint8_t pack_left_shift_u16(
    uint16_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value << shift) & mask);
}

static inline uint8_t pack_left_shift_u32(
    uint32_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value << shift) & mask);
}

static inline uint8_t pack_right_shift_u16(
    uint16_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value >> shift) & mask);
}

static inline uint8_t pack_right_shift_u32(
    uint32_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value >> shift) & mask);
}

static inline uint16_t unpack_left_shift_u16(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint16_t)((uint16_t)(value & mask) << shift);
}

static inline uint32_t unpack_left_shift_u32(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint32_t)((uint32_t)(value & mask) << shift);
}

static inline uint8_t unpack_right_shift_u8(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint8_t)((uint8_t)(value & mask) >> shift);
}

static inline uint16_t unpack_right_shift_u16(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint16_t)((uint16_t)(value & mask) >> shift);
}

static inline uint32_t unpack_right_shift_u32(
    uint8_t value,
    uint8_t shift,
    uint8_t mask)
{
    return (uint32_t)((uint32_t)(value & mask) >> shift);
}

int sceann_link_event_pack(
    uint8_t *dst_p,
    const struct sceann_link_event_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u8(src_p->code, 0u, 0xffu);
    dst_p[1] |= pack_left_shift_u8(src_p->state, 0u, 0xffu);
    dst_p[2] |= pack_left_shift_u16(src_p->tick, 0u, 0xffu);
    dst_p[3] |= pack_right_shift_u16(src_p->tick, 8u, 0xffu);
    dst_p[4] |= pack_left_shift_u16(src_p->argument, 0u, 0xffu);
    dst_p[5] |= pack_right_shift_u16(src_p->argument, 8u, 0xffu);
    dst_p[6] |= pack_left_shift_u16(src_p->trial_id, 0u, 0xffu);
    dst_p[7] |= pack_right_shift_u16(src_p->trial_id, 8u, 0xffu);

    return (8);
}

int sceann_link_end_pack(
    uint8_t *dst_p,
    const struct sceann_link_end_t *src_p,
    size_t size)
{
    if (size < 7u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 7);

    dst_p[0] |= pack_left_shift_u16(src_p->trial_id, 0u, 0xffu);
    dst_p[1] |= pack_right_shift_u16(src_p->trial_id, 8u, 0xffu);
    dst_p[2] |= pack_left_shift_u8(src_p->reason, 0u, 0xffu);
    dst_p[3] |= pack_left_shift_u16(src_p->ticks, 0u, 0xffu);
    dst_p[4] |= pack_right_shift_u16(src_p->ticks, 8u, 0xffu);
    dst_p[5] |= pack_left_shift_u16(src_p->state_hash, 0u, 0xffu);
    dst_p[6] |= pack_right_shift_u16(src_p->state_hash, 8u, 0xffu);

    return (7);
}

int sceann_link_sense_pack(
    uint8_t *dst_p,
    const struct sceann_link_sense_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u16(src_p->sensor0, 0u, 0xffu);
    dst_p[1] |= pack_right_shift_u16(src_p->sensor0, 8u, 0x03u);
    dst_p[1] |= pack_left_shift_u16(src_p->sensor1, 2u, 0xfcu);
    dst_p[2] |= pack_right_shift_u16(src_p->sensor1, 6u, 0x0fu);
    dst_p[2] |= pack_left_shift_u16(src_p->sensor2, 4u, 0xf0u);
    dst_p[3] |= pack_right_shift_u16(src_p->sensor2, 4u, 0x3fu);
    dst_p[3] |= pack_left_shift_u16(src_p->sensor3, 6u, 0xc0u);
    dst_p[4] |= pack_right_shift_u16(src_p->sensor3, 2u, 0xffu);
    dst_p[5] |= pack_left_shift_u16(src_p->sensor4, 0u, 0xffu);
    dst_p[6] |= pack_right_shift_u16(src_p->sensor4, 8u, 0x03u);
    dst_p[6] |= pack_left_shift_u16(src_p->sensor5, 2u, 0xfcu);
    dst_p[7] |= pack_right_shift_u16(src_p->sensor5, 6u, 0x0fu);
    dst_p[7] |= pack_left_shift_u8(src_p->tick, 4u, 0xf0u);

    return (8);
}

int sceann_link_sense_page2_pack(
    uint8_t *dst_p,
    const struct sceann_link_sense_page2_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u16(src_p->sensor6, 0u, 0xffu);
    dst_p[1] |= pack_right_shift_u16(src_p->sensor6, 8u, 0x03u);
    dst_p[1] |= pack_left_shift_u16(src_p->sensor7, 2u, 0xfcu);
    dst_p[2] |= pack_right_shift_u16(src_p->sensor7, 6u, 0x0fu);
    dst_p[2] |= pack_left_shift_u16(src_p->sensor8, 4u, 0xf0u);
    dst_p[3] |= pack_right_shift_u16(src_p->sensor8, 4u, 0x3fu);
    dst_p[3] |= pack_left_shift_u16(src_p->sensor9, 6u, 0xc0u);
    dst_p[4] |= pack_right_shift_u16(src_p->sensor9, 2u, 0xffu);
    dst_p[5] |= pack_left_shift_u16(src_p->sensor10, 0u, 0xffu);
    dst_p[6] |= pack_right_shift_u16(src_p->sensor10, 8u, 0x03u);
    dst_p[6] |= pack_left_shift_u16(src_p->sensor11, 2u, 0xfcu);
    dst_p[7] |= pack_right_shift_u16(src_p->sensor11, 6u, 0x0fu);
    dst_p[7] |= pack_left_shift_u8(src_p->tick, 4u, 0xf0u);

    return (8);
}

int sceann_link_sense_in_unpack(
    struct sceann_link_sense_in_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    dst_p->sensor0 = unpack_right_shift_u16(src_p[0], 0u, 0xffu);
    dst_p->sensor0 |= unpack_left_shift_u16(src_p[1], 8u, 0x03u);
    dst_p->sensor1 = unpack_right_shift_u16(src_p[1], 2u, 0xfcu);
    dst_p->sensor1 |= unpack_left_shift_u16(src_p[2], 6u, 0x0fu);
    dst_p->sensor2 = unpack_right_shift_u16(src_p[2], 4u, 0xf0u);
    dst_p->sensor2 |= unpack_left_shift_u16(src_p[3], 4u, 0x3fu);
    dst_p->sensor3 = unpack_right_shift_u16(src_p[3], 6u, 0xc0u);
    dst_p->sensor3 |= unpack_left_shift_u16(src_p[4], 2u, 0xffu);
    dst_p->sensor4 = unpack_right_shift_u16(src_p[5], 0u, 0xffu);
    dst_p->sensor4 |= unpack_left_shift_u16(src_p[6], 8u, 0x03u);
    dst_p->sensor5 = unpack_right_shift_u16(src_p[6], 2u, 0xfcu);
    dst_p->sensor5 |= unpack_left_shift_u16(src_p[7], 6u, 0x0fu);
    dst_p->tick = unpack_right_shift_u8(src_p[7], 4u, 0xf0u);

    return (0);
}

int sceann_link_sense_in_page2_unpack(
    struct sceann_link_sense_in_page2_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    dst_p->sensor6 = unpack_right_shift_u16(src_p[0], 0u, 0xffu);
    dst_p->sensor6 |= unpack_left_shift_u16(src_p[1], 8u, 0x03u);
    dst_p->sensor7 = unpack_right_shift_u16(src_p[1], 2u, 0xfcu);
    dst_p->sensor7 |= unpack_left_shift_u16(src_p[2], 6u, 0x0fu);
    dst_p->sensor8 = unpack_right_shift_u16(src_p[2], 4u, 0xf0u);
    dst_p->sensor8 |= unpack_left_shift_u16(src_p[3], 4u, 0x3fu);
    dst_p->sensor9 = unpack_right_shift_u16(src_p[3], 6u, 0xc0u);
    dst_p->sensor9 |= unpack_left_shift_u16(src_p[4], 2u, 0xffu);
    dst_p->sensor10 = unpack_right_shift_u16(src_p[5], 0u, 0xffu);
    dst_p->sensor10 |= unpack_left_shift_u16(src_p[6], 8u, 0x03u);
    dst_p->sensor11 = unpack_right_shift_u16(src_p[6], 2u, 0xfcu);
    dst_p->sensor11 |= unpack_left_shift_u16(src_p[7], 6u, 0x0fu);
    dst_p->tick = unpack_right_shift_u8(src_p[7], 4u, 0xf0u);

    return (0);
}

int sceann_link_drive_pack(
    uint8_t *dst_p,
    const struct sceann_link_drive_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u8(src_p->tick, 0u, 0xffu);
    dst_p[1] |= pack_left_shift_u8(src_p->hash, 0u, 0xffu);
    dst_p[2] |= pack_left_shift_u16(src_p->motor0, 0u, 0xffu);
    dst_p[3] |= pack_right_shift_u16(src_p->motor0, 8u, 0xffu);
    dst_p[4] |= pack_left_shift_u16(src_p->motor1, 0u, 0xffu);
    dst_p[5] |= pack_right_shift_u16(src_p->motor1, 8u, 0xffu);
    dst_p[6] |= pack_left_shift_u16(src_p->motor2, 0u, 0xffu);
    dst_p[7] |= pack_right_shift_u16(src_p->motor2, 8u, 0xffu);

    return (8);
}

int sceann_link_drive_in_unpack(
    struct sceann_link_drive_in_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    dst_p->tick = unpack_right_shift_u8(src_p[0], 0u, 0xffu);
    dst_p->hash = unpack_right_shift_u8(src_p[1], 0u, 0xffu);
    dst_p->motor0 = unpack_right_shift_u16(src_p[2], 0u, 0xffu);
    dst_p->motor0 |= unpack_left_shift_u16(src_p[3], 8u, 0xffu);
    dst_p->motor1 = unpack_right_shift_u16(src_p[4], 0u, 0xffu);
    dst_p->motor1 |= unpack_left_shift_u16(src_p[5], 8u, 0xffu);
    dst_p->motor2 = unpack_right_shift_u16(src_p[6], 0u, 0xffu);
    dst_p->motor2 |= unpack_left_shift_u16(src_p[7], 8u, 0xffu);

    return (0);
}

int sceann_link_genome_unpack(
    struct sceann_link_genome_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    dst_p->chunk = unpack_right_shift_u8(src_p[0], 0u, 0xffu);
    dst_p->byte0 = unpack_right_shift_u8(src_p[1], 0u, 0xffu);
    dst_p->byte1 = unpack_right_shift_u8(src_p[2], 0u, 0xffu);
    dst_p->byte2 = unpack_right_shift_u8(src_p[3], 0u, 0xffu);
    dst_p->byte3 = unpack_right_shift_u8(src_p[4], 0u, 0xffu);
    dst_p->byte4 = unpack_right_shift_u8(src_p[5], 0u, 0xffu);
    dst_p->byte5 = unpack_right_shift_u8(src_p[6], 0u, 0xffu);
    dst_p->byte6 = unpack_right_shift_u8(src_p[7], 0u, 0xffu);

    return (0);
}

int sceann_link_command_unpack(
    struct sceann_link_command_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    dst_p->op = unpack_right_shift_u8(src_p[0], 0u, 0x0fu);
    dst_p->sequence = unpack_right_shift_u8(src_p[0], 4u, 0xf0u);

    switch (dst_p->op) {

    case 1:
        dst_p->link_version = unpack_right_shift_u8(src_p[1], 0u, 0xffu);
        dst_p->session = unpack_right_shift_u16(src_p[2], 0u, 0xffu);
        dst_p->session |= unpack_left_shift_u16(src_p[3], 8u, 0xffu);
        dst_p->arithmetic_id = unpack_right_shift_u32(src_p[4], 0u, 0xffu);
        dst_p->arithmetic_id |= unpack_left_shift_u32(src_p[5], 8u, 0xffu);
        dst_p->arithmetic_id |= unpack_left_shift_u32(src_p[6], 16u, 0xffu);
        dst_p->arithmetic_id |= unpack_left_shift_u32(src_p[7], 24u, 0xffu);
        break;

    case 2:
        dst_p->coding = unpack_right_shift_u8(src_p[1], 0u, 0xffu);
        dst_p->neuron = unpack_right_shift_u8(src_p[2], 0u, 0xffu);
        dst_p->sensors = unpack_right_shift_u8(src_p[3], 0u, 0xffu);
        dst_p->hidden = unpack_right_shift_u8(src_p[4], 0u, 0xffu);
        dst_p->motors = unpack_right_shift_u8(src_p[5], 0u, 0xffu);
        dst_p->bits = unpack_right_shift_u16(src_p[6], 0u, 0xffu);
        dst_p->bits |= unpack_left_shift_u16(src_p[7], 8u, 0xffu);
        break;

    case 3:
        dst_p->genome_crc = unpack_right_shift_u32(src_p[1], 0u, 0xffu);
        dst_p->genome_crc |= unpack_left_shift_u32(src_p[2], 8u, 0xffu);
        dst_p->genome_crc |= unpack_left_shift_u32(src_p[3], 16u, 0xffu);
        dst_p->genome_crc |= unpack_left_shift_u32(src_p[4], 24u, 0xffu);
        dst_p->initial_output = unpack_right_shift_u16(src_p[5], 0u, 0xffu);
        dst_p->initial_output |= unpack_left_shift_u16(src_p[6], 8u, 0xffu);
        break;

    case 4:
        break;

    case 5:
        dst_p->trial_id = unpack_right_shift_u16(src_p[1], 0u, 0xffu);
        dst_p->trial_id |= unpack_left_shift_u16(src_p[2], 8u, 0xffu);
        dst_p->max_ticks = unpack_right_shift_u16(src_p[3], 0u, 0xffu);
        dst_p->max_ticks |= unpack_left_shift_u16(src_p[4], 8u, 0xffu);
        dst_p->tick_period = unpack_right_shift_u16(src_p[5], 0u, 0xffu);
        dst_p->tick_period |= unpack_left_shift_u16(src_p[6], 8u, 0xffu);
        dst_p->mode = unpack_right_shift_u8(src_p[7], 0u, 0x0fu);
        dst_p->telemetry = unpack_right_shift_u8(src_p[7], 4u, 0xf0u);
        break;

    case 6:
        break;

    case 7:
        break;

    case 8:
        dst_p->store_action = unpack_right_shift_u8(src_p[1], 0u, 0xffu);
        dst_p->autorun_tick_period = unpack_right_shift_u16(src_p[2], 0u, 0xffu);
        dst_p->autorun_tick_period |= unpack_left_shift_u16(src_p[3], 8u, 0xffu);
        break;

    case 9:
        break;

    case 10:
        break;

    default:
        break;
    }

    return (0);
}

int sceann_link_reply_pack(
    uint8_t *dst_p,
    const struct sceann_link_reply_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u8(src_p->op, 0u, 0x0fu);
    dst_p[0] |= pack_left_shift_u8(src_p->sequence, 4u, 0xf0u);
    dst_p[1] |= pack_left_shift_u8(src_p->status, 0u, 0xffu);

    switch (src_p->op) {

    case 1:
        dst_p[2] |= pack_left_shift_u8(src_p->link_version, 0u, 0xffu);
        dst_p[3] |= pack_left_shift_u8(src_p->state, 0u, 0xffu);
        dst_p[4] |= pack_left_shift_u32(src_p->arithmetic_id, 0u, 0xffu);
        dst_p[5] |= pack_right_shift_u32(src_p->arithmetic_id, 8u, 0xffu);
        dst_p[6] |= pack_right_shift_u32(src_p->arithmetic_id, 16u, 0xffu);
        dst_p[7] |= pack_right_shift_u32(src_p->arithmetic_id, 24u, 0xffu);
        break;

    case 2:
        break;

    case 3:
        dst_p[2] |= pack_left_shift_u32(src_p->crc, 0u, 0xffu);
        dst_p[3] |= pack_right_shift_u32(src_p->crc, 8u, 0xffu);
        dst_p[4] |= pack_right_shift_u32(src_p->crc, 16u, 0xffu);
        dst_p[5] |= pack_right_shift_u32(src_p->crc, 24u, 0xffu);
        dst_p[6] |= pack_left_shift_u8(src_p->missing_chunk, 0u, 0xffu);
        break;

    case 4:
        break;

    case 5:
        dst_p[2] |= pack_left_shift_u16(src_p->trial_id, 0u, 0xffu);
        dst_p[3] |= pack_right_shift_u16(src_p->trial_id, 8u, 0xffu);
        break;

    case 6:
        break;

    case 7:
        break;

    case 8:
        dst_p[2] |= pack_left_shift_u32(src_p->stored_crc, 0u, 0xffu);
        dst_p[3] |= pack_right_shift_u32(src_p->stored_crc, 8u, 0xffu);
        dst_p[4] |= pack_right_shift_u32(src_p->stored_crc, 16u, 0xffu);
        dst_p[5] |= pack_right_shift_u32(src_p->stored_crc, 24u, 0xffu);
        break;

    case 9:
        dst_p[2] |= pack_left_shift_u16(src_p->last_trial_id, 0u, 0xffu);
        dst_p[3] |= pack_right_shift_u16(src_p->last_trial_id, 8u, 0xffu);
        dst_p[4] |= pack_left_shift_u8(src_p->last_reason, 0u, 0xffu);
        break;

    case 10:
        dst_p[2] |= pack_left_shift_u32(src_p->stored_genome_crc, 0u, 0xffu);
        dst_p[3] |= pack_right_shift_u32(src_p->stored_genome_crc, 8u, 0xffu);
        dst_p[4] |= pack_right_shift_u32(src_p->stored_genome_crc, 16u, 0xffu);
        dst_p[5] |= pack_right_shift_u32(src_p->stored_genome_crc, 24u, 0xffu);
        dst_p[6] |= pack_left_shift_u16(src_p->bits, 0u, 0xffu);
        dst_p[7] |= pack_right_shift_u16(src_p->bits, 8u, 0xffu);
        break;

    default:
        break;
    }

    return (8);
}

int sceann_link_host_heartbeat_unpack(
    struct sceann_link_host_heartbeat_t *dst_p,
    const uint8_t *src_p,
    size_t size)
{
    if (size < 5u) {
        return (-EINVAL);
    }

    dst_p->host_state = unpack_right_shift_u8(src_p[0], 0u, 0xffu);
    dst_p->trial_id = unpack_right_shift_u16(src_p[1], 0u, 0xffu);
    dst_p->trial_id |= unpack_left_shift_u16(src_p[2], 8u, 0xffu);
    dst_p->session = unpack_right_shift_u16(src_p[3], 0u, 0xffu);
    dst_p->session |= unpack_left_shift_u16(src_p[4], 8u, 0xffu);

    return (0);
}

int sceann_link_heartbeat_pack(
    uint8_t *dst_p,
    const struct sceann_link_heartbeat_t *src_p,
    size_t size)
{
    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u8(src_p->state, 0u, 0xffu);
    dst_p[1] |= pack_left_shift_u32(src_p->uptime, 0u, 0xffu);
    dst_p[2] |= pack_right_shift_u32(src_p->uptime, 8u, 0xffu);
    dst_p[3] |= pack_right_shift_u32(src_p->uptime, 16u, 0xffu);
    dst_p[4] |= pack_right_shift_u32(src_p->uptime, 24u, 0xffu);
    dst_p[5] |= pack_left_shift_u16(src_p->battery, 0u, 0xffu);
    dst_p[6] |= pack_right_shift_u16(src_p->battery, 8u, 0xffu);
    dst_p[7] |= pack_left_shift_u8(src_p->receive_errors, 0u, 0xffu);

    return (8);
}

int sceann_link_neuron_states_pack(
    uint8_t *dst_p,
    const struct sceann_link_neuron_states_t *src_p,
    size_t size)
{
    uint16_t u0;
    uint16_t u1;
    uint16_t u2;

    if (size < 8u) {
        return (-EINVAL);
    }

    memset(&dst_p[0], 0, 8);

    dst_p[0] |= pack_left_shift_u8(src_p->first, 0u, 0xffu);
    dst_p[1] |= pack_left_shift_u8(src_p->tick, 0u, 0xffu);
    u0 = (uint16_t)src_p->u0;
    dst_p[2] |= pack_left_shift_u16(u0, 0u, 0xffu);
    dst_p[3] |= pack_right_shift_u16(u0, 8u, 0xffu);
    u1 = (uint16_t)src_p->u1;
    dst_p[4] |= pack_left_shift_u16(u1, 0u, 0xffu);
    dst_p[5] |= pack_right_shift_u16(u1, 8u, 0xffu);
    u2 = (uint16_t)src_p->u2;
    dst_p[6] |= pack_left_shift_u16(u2, 0u, 0xffu);
    dst_p[7] |= pack_right_shift_u16(u2, 8u, 0xffu);

    return (8);
}
