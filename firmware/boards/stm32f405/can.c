#include "can.h"

#include <string.h>

#define MCR 0x000u                     /* master control */
#define MSR 0x004u
#define TSR 0x008u                     /* transmit status */
#define RF0R 0x00Cu                    /* receive queue 0 */
#define BTR 0x01Cu                     /* bit timing */
#define MAILBOX(k) (0x180u + 0x10u * (k))
#define RI0R 0x1B0u
#define RDT0R 0x1B4u
#define RDL0R 0x1B8u
#define RDH0R 0x1BCu
#define FMR 0x200u                     /* filters */
#define FM1R 0x204u
#define FS1R 0x20Cu
#define FFA1R 0x214u
#define FA1R 0x21Cu
#define FILTER(k) (0x240u + 8u * (k))

#define INIT_REQUEST 1u
#define INIT_DONE 1u
#define OLDEST_FIRST (1u << 2)         /* frames leave in the order in which they were sent */
#define BUS_OFF_RECOVERY (1u << 6)     /* by itself, after 128 times 11 quiet bits */
#define MAILBOX_EMPTY(k) (1u << (26u + (k)))
#define TRANSMIT 1u
#define REMOTE (1u << 1)
#define EXTENDED (1u << 2)
#define STANDARD_ID 21u                /* where an 11-bit identifier begins */
#define RECEIVED 3u
#define RELEASE (1u << 5)

/* 42 MHz / 6 = 7 MHz: 14 quanta a bit, sampled behind the twelfth */
#define TIMING (1u << 20 | 10u << 16 | 5u)
#define PATIENCE 20000u                /* polls: longer than three frames take on a bus that works */

static bool wait_for(uint32_t offset, uint32_t mask, uint32_t value)
{
    for (uint32_t polls = 0; polls < PATIENCE; polls++) {
        if ((can_get(offset) & mask) == value) {
            return true;
        }
    }
    return false;
}

bool can_init(void)
{
    can_put(MCR, INIT_REQUEST | OLDEST_FIRST | BUS_OFF_RECOVERY);
    if (!wait_for(MSR, INIT_DONE, INIT_DONE)) {
        return false;
    }
    can_put(BTR, TIMING);
    can_put(MCR, OLDEST_FIRST | BUS_OFF_RECOVERY);
    (void)wait_for(MSR, INIT_DONE, 0);         /* it joins when it has seen 11 quiet bits; a bus without a cable never is */
    return true;
}

void can_listen(void *board, uint8_t node)
{
    (void)board;
    can_put(FMR, can_get(FMR) | 1u);
    can_put(FA1R, 0);
    can_put(FM1R, 0);                  /* identifier and mask */
    can_put(FS1R, 3u);                 /* of 32 bits */
    can_put(FFA1R, 0);                 /* into queue 0 */
    can_put(FILTER(0), (uint32_t)node << STANDARD_ID);
    can_put(FILTER(0) + 4u, 0x7Fu << STANDARD_ID | EXTENDED | REMOTE);
    can_put(FILTER(1), 0);
    can_put(FILTER(1) + 4u, 0x7FFu << STANDARD_ID | EXTENDED | REMOTE);
    can_put(FA1R, 3u);
    can_put(FMR, can_get(FMR) & ~1u);
}

sceann_received can_receive(void *board, sceann_message *message)
{
    (void)board;
    if ((can_get(RF0R) & RECEIVED) == 0u) {
        return SCEANN_NOTHING;
    }
    const uint32_t id = can_get(RI0R), low = can_get(RDL0R), high = can_get(RDH0R);
    const uint8_t length = (uint8_t)(can_get(RDT0R) & 15u);
    can_put(RF0R, RELEASE);
    if ((id & (EXTENDED | REMOTE)) != 0u) {
        return SCEANN_NOTHING;         /* the filters keep them out; a frame from before they were set may be here */
    }
    message->id = (uint16_t)(id >> STANDARD_ID);
    message->length = length > SCEANN_DATA_MAX ? (uint8_t)SCEANN_DATA_MAX : length;
    memset(message->data, 0, sizeof message->data);
    for (uint8_t k = 0; k < message->length; k++) {
        message->data[k] = (uint8_t)((k < 4u ? low : high) >> 8u * (k & 3u));
    }
    return SCEANN_MESSAGE;
}

void can_send(void *board, const sceann_message *message)
{
    (void)board;
    for (uint32_t polls = 0; polls < PATIENCE; polls++) {
        const uint32_t status = can_get(TSR);
        for (uint8_t k = 0; k < 3u; k++) {
            if ((status & MAILBOX_EMPTY(k)) != 0u) {
                const uint8_t *d = message->data;
                can_put(MAILBOX(k) + 4u, message->length);
                can_put(MAILBOX(k) + 8u, (uint32_t)d[0] | (uint32_t)d[1] << 8 | (uint32_t)d[2] << 16 | (uint32_t)d[3] << 24);
                can_put(MAILBOX(k) + 12u, (uint32_t)d[4] | (uint32_t)d[5] << 8 | (uint32_t)d[6] << 16 | (uint32_t)d[7] << 24);
                can_put(MAILBOX(k), (uint32_t)message->id << STANDARD_ID | TRANSMIT);
                return;
            }
        }
    }
}
