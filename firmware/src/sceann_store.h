/*
 * What survives power loss: the genome (replaced atomically) and the last trial (a ring, to spread the wear).
 *
 * Genome: two slots, written in turn, each with a counter and a CRC-32; the newest valid one counts. A write that power
 * loss breaks off leaves the other slot, and so the old genome. Last trial: each record goes to the next place of the
 * ring with a counter and a CRC-16; the newest valid one counts, and a place that is worn out is passed over.
 */
#ifndef SCEANN_STORE_H
#define SCEANN_STORE_H

#include "sceann_port.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint16_t id;                       /* 0 = no trial yet */
    uint8_t reason;                    /* SCEANN_LINK_END_REASON_... */
    uint16_t ticks;
    uint16_t state_hash;
} sceann_last_trial;

typedef struct {
    uint8_t slot;                      /* the newest valid genome slot: 0, 1, or SCEANN_NO_SLOT */
    uint8_t counter;                   /* its counter */
    uint16_t autorun_period;           /* 0.1 ms; 0 = no autorun; SCEANN_BY_BUTTON: when the start button is pressed */
    uint8_t node;                      /* 0 = none was given */
    uint16_t bits;                     /* of the stored genome */
    uint32_t genome_crc;               /* CRC-32 of the stored genome record */
    uint8_t ring_at;                   /* where the newest trial record stands */
    uint16_t ring_counter;
    sceann_last_trial last;            /* kept here also without a store */
} sceann_store;

#define SCEANN_NO_SLOT 2u
#define SCEANN_BY_BUTTON 0x8000u

/* Looks for what is stored. Works without a store too, and then finds nothing. */
void sceann_store_open(sceann_store *store, const sceann_port *port);

/* Reads the stored genome record (of at most SCEANN_MAX_RECORD bytes) that sceann_store_open found. */
void sceann_store_get_genome(const sceann_store *store, const sceann_port *port, uint8_t *record);

/* Writes a genome record into the free slot and reads it back; false if it does not hold. */
bool sceann_store_put_genome(sceann_store *store, const sceann_port *port, const uint8_t *record,
                             uint16_t autorun_period);

/* Forgets both genomes; false if one can still be read. */
bool sceann_store_erase(sceann_store *store, const sceann_port *port);

/* Notes this node number for good; false if it does not hold. */
bool sceann_store_put_node(sceann_store *store, const sceann_port *port, uint8_t node);

/* Notes store->last; false if a store is there and does not take it. */
bool sceann_store_put_last(sceann_store *store, const sceann_port *port);

#ifdef __cplusplus
}
#endif
#endif
