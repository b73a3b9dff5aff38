/*
 * The controller: SCEANN-Q10, version 1 (docs/arithmetic.md), for a network that is known only at run time.
 *
 * A network comes as a genome record (docs/link.md): a header of 9 bytes, then the genome's bits. The same record is
 * uploaded over the link, kept in the store and decoded here. Everything is integer arithmetic: Q10 values in int16_t,
 * sums that cannot overflow because a network has at most 23 sources. A step takes the same time for all sensor values.
 */
#ifndef SCEANN_CONTROLLER_H
#define SCEANN_CONTROLLER_H

#include "sceann_numbers.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- limits ----------------------------------------------------------------------------------------------------
 * SCEANN_MAX_SOURCES may be set lower by a board that is short of memory, never higher: 8192 + 23 * 1024 is the
 * last sum that fits int16_t. */
#ifndef SCEANN_MAX_SOURCES
#define SCEANN_MAX_SOURCES 23u
#endif
#if SCEANN_MAX_SOURCES > 23u
#error "SCEANN_MAX_SOURCES: the sums of more than 23 sources do not fit 16 bits"
#endif
#define SCEANN_MAX_NEURONS (SCEANN_MAX_SOURCES - 1u)

#define SCEANN_RECORD_HEADER 9u
#define SCEANN_MAX_GENOME_BYTES ((2u * SCEANN_MAX_SOURCES * SCEANN_MAX_NEURONS + 7u) / 8u)
#define SCEANN_MAX_RECORD (SCEANN_RECORD_HEADER + SCEANN_MAX_GENOME_BYTES)

#define SCEANN_ONE 1024                /* 1.0 in Q10 */
#define SCEANN_SENSOR_MAX 1023u        /* sensors on the wire have 10 bits */

/* ---- types ----------------------------------------------------------------------------------------------------- */

typedef enum {
    SCEANN_GENOME_OK,
    SCEANN_GENOME_BAD,                 /* a field out of range, or a length that does not fit the sizes */
    SCEANN_GENOME_TOO_LARGE            /* well formed, but more sensors, motors or sources than this build takes */
} sceann_genome_result;

typedef struct {
    uint8_t n_sensors, n_hidden, n_motors;
    uint8_t n_neurons, n_sources;      /* hidden + motors; sensors + hidden + motors */
    bool memoryless;                   /* false: u += net; true: u = net */
    int16_t initial_output;            /* x_i before the first step */
    uint16_t state_hash;               /* CRC-16 over every u since reset */
    uint8_t plus[SCEANN_MAX_NEURONS][(SCEANN_MAX_SOURCES + 7u) / 8u];   /* bit j of row i: w_ij = +1 */
    uint8_t minus[SCEANN_MAX_NEURONS][(SCEANN_MAX_SOURCES + 7u) / 8u];  /* bit j of row i: w_ij = -1 */
    int16_t u[SCEANN_MAX_NEURONS];     /* states, -8192..8192; hidden neurons first, then motors */
    int16_t source[SCEANN_MAX_SOURCES];/* sensors (0..1024), then the neurons' outputs x (0..1024) */
} sceann_controller;

/* ---- networks --------------------------------------------------------------------------------------------------- */

/* Checks the header (SCEANN_RECORD_HEADER bytes) without looking at the genome. */
sceann_genome_result sceann_genome_check(const uint8_t *record);

/* Bits of the genome that coding and sizes in a header ask for. */
uint16_t sceann_genome_bits(const uint8_t *record);

/* Bytes of the whole record that a checked header announces. */
uint16_t sceann_genome_record_size(const uint8_t *record);

/* Decodes a record whose header was checked, and resets. */
void sceann_controller_decode(sceann_controller *controller, const uint8_t *record);

/* CRC-32 of the decoded weights as int8 in row order. */
uint32_t sceann_controller_weights_crc(const sceann_controller *controller);

/* ---- a trial ---------------------------------------------------------------------------------------------------- */

/* Back to the state before the first step: u = 0, x = initial output, hash = 0xFFFF. */
void sceann_controller_reset(sceann_controller *controller);

/* One control step, all neurons at once, from n_sensors wire values 0..1023 (larger ones are cut to 1023). */
void sceann_controller_step(sceann_controller *controller, const uint16_t *sensors);

/* n_motors outputs of the last step, 0..1024. */
const int16_t *sceann_controller_motors(const sceann_controller *controller);

/* ---- arithmetic -------------------------------------------------------------------------------------------------- */

/* f(u) for -8192..8192. */
int16_t sceann_sigmoid(int16_t u);

/* CRC-32 of this build's sigmoid table, computed from the table: 0x2557477E for SCEANN-Q10 version 1. */
uint32_t sceann_arithmetic_id(void);

#ifdef __cplusplus
}
#endif
#endif
