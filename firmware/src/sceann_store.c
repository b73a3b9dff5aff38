#include "sceann_store.h"

#include "sceann_controller.h"
#include "sceann_crc.h"
#include "sceann_wire.h"

#include <string.h>

/* Byte 0 is left alone. The node, here and behind the ring, so that a write cut off leaves one: magic, node, node inverted. */
#define NODE_START 1u
#define NODE_RECORD 3u
#define NODE_MAGIC 0x4Eu

/* A genome slot: magic, counter, autorun period u16, CRC-32 over the three fields and the record, record. */
#define MAGIC 0x51u
#define SLOT_HEADER 8u
#define SLOT_SIZE (SLOT_HEADER + SCEANN_MAX_RECORD)
#define SLOTS_START (NODE_START + NODE_RECORD)

/* A trial record: counter u16, id u16, reason, ticks u16, hash u16, CRC-16 (big-endian, so that the whole gives 0). */
#define RING_START (SLOTS_START + 2u * SLOT_SIZE)
#define RING_RECORD 11u
#define RING_PLACES 60u
#define RING_TRIES 4u                  /* places that are tried before the store counts as broken */

#define NODE_AGAIN (RING_START + RING_PLACES * RING_RECORD)

static uint16_t slot_start(uint8_t slot)
{
    return (uint16_t)(slot == 0u ? SLOTS_START : SLOTS_START + SLOT_SIZE);
}

static bool has_genomes(const sceann_port *port)
{
    return port->store_size >= RING_START;
}

static uint8_t ring_places(const sceann_port *port)
{
    if (port->store_size < RING_START + RING_PLACES * RING_RECORD) {
        return 0;
    }
    return RING_PLACES;
}

/* ---- genomes ----------------------------------------------------------------------------------------------------- */

static uint32_t crc_fields(const uint8_t *header)
{
    uint32_t crc = SCEANN_CRC32_INIT;
    for (uint8_t k = 0; k < 4u; k++) {
        crc = sceann_crc32(crc, header[k]);
    }
    return crc;
}

/* Reads a slot's header and checks the whole slot; fills the fields of `found` when it holds. */
static bool slot_valid(const sceann_port *port, uint8_t slot, sceann_store *found)
{
    uint8_t header[SLOT_HEADER], record[SCEANN_RECORD_HEADER];
    uint16_t at = slot_start(slot);

    port->store_read(port->board, at, header, SLOT_HEADER);
    port->store_read(port->board, (uint16_t)(at + SLOT_HEADER), record, SCEANN_RECORD_HEADER);
    if (header[0] != MAGIC || sceann_genome_check(record) != SCEANN_GENOME_OK) {
        return false;
    }
    uint32_t crc = crc_fields(header), genome_crc = SCEANN_CRC32_INIT;
    at = (uint16_t)(at + SLOT_HEADER);
    for (uint16_t left = sceann_genome_record_size(record); left > 0u; left--, at++) {
        uint8_t byte;
        port->store_read(port->board, at, &byte, 1);
        crc = sceann_crc32(crc, byte);
        genome_crc = sceann_crc32(genome_crc, byte);
    }
    if (~crc != sceann_get32(&header[4])) {
        return false;
    }
    found->slot = slot;
    found->counter = header[1];
    found->autorun_period = sceann_get16(&header[2]);
    found->bits = sceann_get16(&record[5]);
    found->genome_crc = ~genome_crc;
    return true;
}

static void find_genome(sceann_store *store, const sceann_port *port)
{
    sceann_store second = *store;
    store->slot = SCEANN_NO_SLOT;
    store->autorun_period = 0;
    store->bits = 0;
    store->genome_crc = 0;
    if (!has_genomes(port)) {
        return;
    }
    const bool first_valid = slot_valid(port, 0, store);
    if (slot_valid(port, 1, &second) && (!first_valid || (uint8_t)(second.counter - store->counter) < 128u)) {
        *store = second;
    }
}

void sceann_store_get_genome(const sceann_store *store, const sceann_port *port, uint8_t *record)
{
    const uint16_t at = (uint16_t)(slot_start(store->slot) + SLOT_HEADER);
    port->store_read(port->board, at, record, SCEANN_RECORD_HEADER);
    port->store_read(port->board, (uint16_t)(at + SCEANN_RECORD_HEADER), record + SCEANN_RECORD_HEADER,
                     (uint8_t)(sceann_genome_record_size(record) - SCEANN_RECORD_HEADER));
}

bool sceann_store_put_genome(sceann_store *store, const sceann_port *port, const uint8_t *record,
                             uint16_t autorun_period)
{
    if (!has_genomes(port)) {
        return false;
    }
    const uint8_t slot = store->slot == 0u ? 1u : 0u;
    const uint8_t counter = (uint8_t)(store->slot == SCEANN_NO_SLOT ? 1u : store->counter + 1u);
    const uint16_t at = slot_start(slot), size = sceann_genome_record_size(record);
    uint8_t header[SLOT_HEADER] = { MAGIC, counter };
    sceann_put16(&header[2], autorun_period);
    uint32_t crc = crc_fields(header);
    for (uint16_t k = 0; k < size; k++) {
        crc = sceann_crc32(crc, record[k]);
    }
    sceann_put32(&header[4], ~crc);
    const bool written = port->store_write(port->board, (uint16_t)(at + SLOT_HEADER), record, (uint8_t)size) &&
                         port->store_write(port->board, at, header, SLOT_HEADER);
    find_genome(store, port);
    return written && store->slot == slot && store->counter == counter;
}

bool sceann_store_erase(sceann_store *store, const sceann_port *port)
{
    if (!has_genomes(port)) {
        return false;
    }
    /* the older slot first: broken off in between, the newest genome is still the one that counts */
    const uint8_t newest = store->slot == SCEANN_NO_SLOT ? 0u : store->slot, gone = 0;
    (void)port->store_write(port->board, slot_start((uint8_t)(1u - newest)), &gone, 1);
    (void)port->store_write(port->board, slot_start(newest), &gone, 1);
    find_genome(store, port);
    return store->slot == SCEANN_NO_SLOT;
}

/* ---- the node ---------------------------------------------------------------------------------------------------- */

/* The node that is noted at this place, or 0. */
static uint8_t node_at(const sceann_port *port, uint16_t at)
{
    uint8_t record[NODE_RECORD];
    if (port->store_size < at + NODE_RECORD) {
        return 0;
    }
    port->store_read(port->board, at, record, NODE_RECORD);
    const bool valid = record[0] == NODE_MAGIC && (uint8_t)(record[1] ^ record[2]) == 0xFFu && record[1] < 128u;
    return valid ? record[1] : 0u;
}

static void find_node(sceann_store *store, const sceann_port *port)
{
    const uint8_t node = node_at(port, NODE_START);
    store->node = node != 0u ? node : node_at(port, NODE_AGAIN);
}

bool sceann_store_put_node(sceann_store *store, const sceann_port *port, uint8_t node)
{
    const uint8_t record[NODE_RECORD] = { NODE_MAGIC, node, (uint8_t)~node };
    if (port->store_size < NODE_AGAIN + NODE_RECORD) {
        return false;
    }
    const bool written = port->store_write(port->board, NODE_START, record, NODE_RECORD) &&
                         port->store_write(port->board, NODE_AGAIN, record, NODE_RECORD);
    find_node(store, port);
    return written && store->node == node;
}

/* ---- the last trial ---------------------------------------------------------------------------------------------- */

static bool ring_record_valid(const uint8_t *record)
{
    uint16_t crc = SCEANN_CRC16_INIT;
    for (uint8_t k = 0; k < RING_RECORD; k++) {
        crc = sceann_crc16(crc, record[k]);
    }
    return crc == 0u;                  /* a record followed by its own CRC leaves 0 */
}

bool sceann_store_put_last(sceann_store *store, const sceann_port *port)
{
    const uint8_t places = ring_places(port);
    if (places == 0u) {
        return true;
    }
    uint8_t record[RING_RECORD];
    uint16_t crc = SCEANN_CRC16_INIT;
    store->ring_counter++;
    sceann_put16(&record[0], store->ring_counter);
    sceann_put16(&record[2], store->last.id);
    record[4] = store->last.reason;
    sceann_put16(&record[5], store->last.ticks);
    sceann_put16(&record[7], store->last.state_hash);
    for (uint8_t k = 0; k < RING_RECORD - 2u; k++) {
        crc = sceann_crc16(crc, record[k]);
    }
    record[9] = (uint8_t)(crc >> 8);
    record[10] = (uint8_t)crc;
    for (uint8_t k = 0; k < RING_TRIES; k++) {
        uint8_t back[RING_RECORD];
        store->ring_at++;
        if (store->ring_at >= places) {
            store->ring_at = 0;
        }
        const uint16_t at = (uint16_t)(RING_START + store->ring_at * RING_RECORD);
        const bool written = port->store_write(port->board, at, record, RING_RECORD);
        port->store_read(port->board, at, back, RING_RECORD);
        if (written && memcmp(back, record, RING_RECORD) == 0) {
            return true;
        }
    }
    return false;
}

static void find_last(sceann_store *store, const sceann_port *port)
{
    bool found = false;
    for (uint8_t place = 0; place < ring_places(port); place++) {
        uint8_t record[RING_RECORD];
        port->store_read(port->board, (uint16_t)(RING_START + place * RING_RECORD), record, RING_RECORD);
        const uint16_t counter = sceann_get16(&record[0]);
        if (!ring_record_valid(record) || (found && (uint16_t)(counter - store->ring_counter) >= 0x8000u)) {
            continue;
        }
        found = true;
        store->ring_at = place;
        store->ring_counter = counter;
        store->last.id = sceann_get16(&record[2]);
        store->last.reason = record[4];
        store->last.ticks = sceann_get16(&record[5]);
        store->last.state_hash = sceann_get16(&record[7]);
    }
}

void sceann_store_open(sceann_store *store, const sceann_port *port)
{
    *store = (sceann_store){ .slot = SCEANN_NO_SLOT };
    find_genome(store, port);
    find_node(store, port);
    find_last(store, port);
}
