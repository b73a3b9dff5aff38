/*
 * The STM32F405's CAN driver on a model of the controller's registers: three mailboxes, a receive queue of three, filters with masks,
 * initialisation, a bus that takes nothing. Written from the reference manual (RM0090, chapter 32), not from the driver. 0 if all holds,
 * else the line of what does not.
 */
#include "can.h"

#include <stdio.h>
#include <string.h>

#define CHECK(truth) do { if (!(truth)) { printf("line %d\n", __LINE__); return 1; } } while (0)

static uint32_t registers[0x400 / 4];
static struct { uint32_t id, length, low, high; } queue[3], sent[64];
static unsigned queued, sent_n, overrun;
static bool bus_works = true, answers = true;

uint32_t can_get(uint32_t offset)
{
    switch (offset) {
    case 0x04:
        return answers ? registers[0] & 1u : 0u;
    case 0x08:
        return registers[2];
    case 0x0C:
        return queued;
    case 0x1B0:
        return queue[0].id;
    case 0x1B4:
        return queue[0].length;
    case 0x1B8:
        return queue[0].low;
    case 0x1BC:
        return queue[0].high;
    default:
        return registers[offset / 4];
    }
}

void can_put(uint32_t offset, uint32_t value)
{
    if (offset == 0x0C) {
        if ((value & 0x20u) != 0u && queued > 0) {
            memmove(&queue[0], &queue[1], sizeof queue[0] * 2);
            queued--;
        }
        return;
    }
    registers[offset / 4] = value;
    for (unsigned k = 0; k < 3; k++) {
        const uint32_t box = 0x180u + 0x10u * k;
        if (offset == box && (value & 1u) != 0u) {
            registers[2] &= ~(1u << (26 + k));
            if (bus_works) {
                sent[sent_n].id = value;
                sent[sent_n].length = registers[box / 4 + 1];
                sent[sent_n].low = registers[box / 4 + 2];
                sent[sent_n++].high = registers[box / 4 + 3];
                registers[2] |= 1u << (26 + k);
            }
        }
    }
}

/* A frame on the bus, as the filters see it. */
static void arrive(uint32_t id, uint8_t length, uint32_t low, uint32_t high)
{
    const bool filters_on = (registers[0x200 / 4] & 1u) == 0u;
    for (unsigned k = 0; filters_on && k < 14; k++) {
        const bool active = (registers[0x21C / 4] >> k & 1u) != 0u, mask_mode = (registers[0x204 / 4] >> k & 1u) == 0u;
        const bool wide = (registers[0x20C / 4] >> k & 1u) != 0u;
        const uint32_t want = registers[0x240 / 4 + 2 * k], mask = registers[0x240 / 4 + 2 * k + 1];
        if (active && mask_mode && wide && ((id ^ want) & mask) == 0u) {
            if (queued == 3) {
                overrun++;
                return;
            }
            queue[queued].id = id;
            queue[queued].length = length;
            queue[queued].low = low;
            queue[queued++].high = high;
            return;
        }
    }
}

static uint32_t standard(uint32_t id)
{
    return id << 21;
}

int main(void)
{
    sceann_message m;
    registers[2] = 7u << 26;
    registers[0x200 / 4] = 1;
    CHECK(can_init());
    CHECK((registers[0] & 0x44u) == 0x44u && (registers[0] & 1u) == 0u);       /* oldest first, bus-off recovery, joined */
    const uint32_t timing = registers[0x1C / 4], ts1 = timing >> 16 & 15u, ts2 = timing >> 20 & 7u, brp = timing & 1023u;
    CHECK(42000000u / (brp + 1u) / (1u + ts1 + 1u + ts2 + 1u) == 500000u);

    can_listen(NULL, 5);
    for (unsigned function = 0; function < 16; function++) {                   /* every identifier there is */
        for (unsigned node = 0; node < 128; node++) {
            const uint32_t id = function << 7 | node;
            const bool ours = node == 5 || id == 0;
            arrive(standard(id), 8, 0x04030201u, 0x08070605u);
            CHECK(can_receive(NULL, &m) == (ours ? SCEANN_MESSAGE : SCEANN_NOTHING));
            CHECK(!ours || (m.id == id && m.length == 8 && m.data[0] == 1 && m.data[7] == 8));
            arrive(standard(id) | 2u, 0, 0, 0);                                /* remote */
            arrive(standard(id) | 4u, 8, 0, 0);                                /* extended */
            arrive(standard(id) | 6u, 0, 0, 0);
            CHECK(can_receive(NULL, &m) == SCEANN_NOTHING);
        }
    }
    can_listen(NULL, 9);
    arrive(standard(0x405), 8, 0, 0);
    CHECK(can_receive(NULL, &m) == SCEANN_NOTHING);
    arrive(standard(0x409), 3, 0x00ABCDEFu, 0xFFFFFFFFu);
    CHECK(can_receive(NULL, &m) == SCEANN_MESSAGE && m.length == 3 && m.data[2] == 0xAB && m.data[3] == 0);
    queue[0].id = standard(0) | 2u;                                            /* from before the filters were set */
    queued = 1;
    CHECK(can_receive(NULL, &m) == SCEANN_NOTHING && queued == 0);

    for (uint8_t k = 0; k < 12; k++) {
        const sceann_message out = { 0x701, 8, { k, 1, 2, 3, 4, 5, 6, 7 } };
        can_send(NULL, &out);
        CHECK(sent_n == k + 1u && sent[k].id == (standard(0x701) | 1u) && sent[k].length == 8);
        CHECK((sent[k].low & 255u) == k && sent[k].high == 0x07060504u);
    }
    bus_works = false;                                                         /* bus off: it comes back to the loop */
    for (unsigned k = 0; k < 5; k++) {
        const sceann_message out = { 0x701, 8, { 0 } };
        can_send(NULL, &out);
    }
    CHECK(sent_n == 12);
    bus_works = true;
    registers[2] = 7u << 26;
    const sceann_message out = { 0x081, 0, { 0 } };
    can_send(NULL, &out);
    CHECK(sent_n == 13 && sent[12].length == 0);
    answers = false;
    CHECK(!can_init());
    return 0;
}
