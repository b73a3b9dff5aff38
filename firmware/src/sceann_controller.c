#include "sceann_controller.h"

#include "sceann_crc.h"
#include "sceann_table.h"
#include "sceann_wire.h"

enum { CODING_SCEANN1 = 1, CODING_SCEANN2 = 2, CODING_SCEANN3 = 3 };

enum { AT_CODING, AT_NEURON, AT_SENSORS, AT_HIDDEN, AT_MOTORS, AT_BITS, AT_INITIAL_OUTPUT = 7 };

#define THRESHOLD 8192u
#define NODES 130u

/* T[k] = floor(1024 sigma((k - 64) / 8) + 1/2), T[129] = T[128]; tested against the decimal definition. */
static const uint16_t sigmoid_table[NODES] SCEANN_TABLE = {
    0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 4, 4, 5, 5, 6, 7, 8, 9, 10, 11, 13, 14, 16, 18, 21,
    24, 27, 30, 34, 38, 43, 49, 55, 62, 69, 78, 87, 98, 109, 122, 136, 152, 168, 187, 207, 228, 251, 275, 301,
    329, 357, 387, 417, 448, 480, 512, 544, 576, 607, 637, 667, 695, 723, 749, 773, 796, 817, 837, 856, 872,
    888, 902, 915, 926, 937, 946, 955, 962, 969, 975, 981, 986, 990, 994, 997, 1000, 1003, 1006, 1008, 1010,
    1011, 1013, 1014, 1015, 1016, 1017, 1018, 1019, 1019, 1020, 1020, 1021, 1021, 1021, 1022, 1022, 1022, 1022,
    1023, 1023, 1023, 1023, 1023, 1023, 1023, 1023, 1024, 1024, 1024, 1024, 1024
};

/* ---- networks --------------------------------------------------------------------------------------------------- */

uint16_t sceann_genome_bits(const uint8_t *record)
{
    const uint16_t neurons = (uint16_t)(record[AT_HIDDEN] + record[AT_MOTORS]);
    const uint16_t sources = (uint16_t)(record[AT_SENSORS] + neurons);
    switch (record[AT_CODING]) {
    case CODING_SCEANN1:
        return (uint16_t)(neurons * (1u + sources));
    case CODING_SCEANN2:
        return (uint16_t)(neurons * 2u * sources);
    default:
        return (uint16_t)(neurons * sources);
    }
}

sceann_genome_result sceann_genome_check(const uint8_t *record)
{
    const uint16_t sources = (uint16_t)(record[AT_SENSORS] + record[AT_HIDDEN] + record[AT_MOTORS]);
    if (record[AT_CODING] < CODING_SCEANN1 || record[AT_CODING] > CODING_SCEANN3 || record[AT_NEURON] > 1u ||
        record[AT_SENSORS] == 0u || record[AT_MOTORS] == 0u ||
        sceann_get16(&record[AT_INITIAL_OUTPUT]) > (uint16_t)SCEANN_ONE) {
        return SCEANN_GENOME_BAD;
    }
    if (record[AT_SENSORS] > SCEANN_MAX_SENSORS || record[AT_MOTORS] > SCEANN_MAX_MOTORS ||
        sources > SCEANN_MAX_SOURCES) {
        return SCEANN_GENOME_TOO_LARGE;
    }
    return sceann_get16(&record[AT_BITS]) == sceann_genome_bits(record) ? SCEANN_GENOME_OK : SCEANN_GENOME_BAD;
}

uint16_t sceann_genome_record_size(const uint8_t *record)
{
    return (uint16_t)(SCEANN_RECORD_HEADER + (sceann_get16(&record[AT_BITS]) + 7u) / 8u);
}

static bool bit_at(const uint8_t *genome, uint16_t k)
{
    return ((unsigned)genome[k >> 3] << (k & 7u) & 0x80u) != 0u;
}

void sceann_controller_decode(sceann_controller *c, const uint8_t *record)
{
    const uint8_t *genome = record + SCEANN_RECORD_HEADER;
    const uint8_t coding = record[AT_CODING];

    c->n_sensors = record[AT_SENSORS];
    c->n_hidden = record[AT_HIDDEN];
    c->n_motors = record[AT_MOTORS];
    c->n_neurons = (uint8_t)(c->n_hidden + c->n_motors);
    c->n_sources = (uint8_t)(c->n_sensors + c->n_neurons);
    c->memoryless = record[AT_NEURON] != 0u;
    c->initial_output = (int16_t)sceann_get16(&record[AT_INITIAL_OUTPUT]);

    uint16_t block = 0;                /* first bit of the neuron's block */
    for (uint8_t i = 0; i < c->n_neurons; i++) {
        for (uint8_t k = 0; k < sizeof c->plus[0]; k++) {
            c->plus[i][k] = 0;
            c->minus[i][k] = 0;
        }
        for (uint8_t j = 0; j < c->n_sources; j++) {
            bool positive, present = true;
            if (coding == CODING_SCEANN1) {
                positive = bit_at(genome, block);
                present = bit_at(genome, (uint16_t)(block + 1u + j));
            } else {
                positive = bit_at(genome, (uint16_t)(block + j));
                if (coding == CODING_SCEANN2) {
                    present = bit_at(genome, (uint16_t)(block + c->n_sources + j));
                }
            }
            if (present) {
                uint8_t *row = positive ? c->plus[i] : c->minus[i];
                row[j >> 3] = (uint8_t)(row[j >> 3] | 1u << (j & 7u));
            }
        }
        block = (uint16_t)(block + (coding == CODING_SCEANN1   ? 1u + c->n_sources
                                    : coding == CODING_SCEANN2 ? 2u * c->n_sources
                                                               : c->n_sources));
    }
    sceann_controller_reset(c);
}

uint32_t sceann_controller_weights_crc(const sceann_controller *c)
{
    uint32_t crc = SCEANN_CRC32_INIT;
    for (uint8_t i = 0; i < c->n_neurons; i++) {
        for (uint8_t j = 0; j < c->n_sources; j++) {
            const unsigned plus = (unsigned)c->plus[i][j >> 3] >> (j & 7u) & 1u;
            const unsigned minus = (unsigned)c->minus[i][j >> 3] >> (j & 7u) & 1u;
            crc = sceann_crc32(crc, (uint8_t)(plus - minus));
        }
    }
    return ~crc;
}

/* ---- a trial ---------------------------------------------------------------------------------------------------- */

void sceann_controller_reset(sceann_controller *c)
{
    for (uint8_t i = 0; i < c->n_neurons; i++) {
        c->u[i] = 0;
        c->source[c->n_sensors + i] = c->initial_output;
    }
    c->state_hash = SCEANN_CRC16_INIT;
}

/* sum_j w_ij x_j. Which branches are taken depends on the weights only, never on the values. */
static int16_t net_input(const uint8_t *plus, const uint8_t *minus, const int16_t *source, uint8_t n)
{
    int16_t sum = 0;
    uint8_t p = 0, m = 0;
    for (uint8_t j = 0; j < n; j++) {
        if ((j & 7u) == 0u) {
            p = *plus++;
            m = *minus++;
        }
        if (p & 1u) {
            sum = (int16_t)(sum + *source);
        }
        if (m & 1u) {
            sum = (int16_t)(sum - *source);
        }
        p = (uint8_t)(p >> 1);
        m = (uint8_t)(m >> 1);
        source++;
    }
    return sum;
}

/* 0xFFFF when u is within the threshold, else 0: a mask instead of a branch. The difference 16384 - (u + 8192) is
 * negative as int16_t exactly for u beyond the threshold, because every sum stays within +-31744. */
static uint16_t within_threshold(int16_t u)
{
    const uint16_t left = (uint16_t)(2u * THRESHOLD - (uint16_t)((uint16_t)u + THRESHOLD));
    const uint16_t right = (uint16_t)((uint16_t)u + THRESHOLD);
    const uint8_t beyond = (uint8_t)((uint8_t)(left >> 8) | (uint8_t)(right >> 8));
    return (uint16_t)((uint16_t)(beyond >> 7) - 1u);
}

void sceann_controller_step(sceann_controller *c, const uint16_t *sensors)
{
    for (uint8_t j = 0; j < c->n_sensors; j++) {
        const uint16_t r = sensors[j] > SCEANN_SENSOR_MAX ? SCEANN_SENSOR_MAX : sensors[j];
        c->source[j] = (int16_t)(r + (r >> 9));
    }
    uint16_t keep[SCEANN_MAX_NEURONS];
    for (uint8_t i = 0; i < c->n_neurons; i++) {
        int16_t u = net_input(c->plus[i], c->minus[i], c->source, c->n_sources);
        if (!c->memoryless) {
            u = (int16_t)(u + c->u[i]);
        }
        keep[i] = within_threshold(u);
        c->u[i] = (int16_t)((uint16_t)u & keep[i]);
    }
    for (uint8_t i = 0; i < c->n_neurons; i++) {
        const int16_t u = c->u[i];
        const int16_t x = sceann_sigmoid(u);
        c->source[c->n_sensors + i] = c->memoryless ? (int16_t)((uint16_t)x & keep[i]) : x;
        c->state_hash = sceann_crc16(c->state_hash, (uint8_t)u);
        c->state_hash = sceann_crc16(c->state_hash, (uint8_t)((uint16_t)u >> 8));
    }
}

const int16_t *sceann_controller_motors(const sceann_controller *c)
{
    return &c->source[c->n_sensors + c->n_hidden];
}

/* ---- arithmetic -------------------------------------------------------------------------------------------------- */

int16_t sceann_sigmoid(int16_t u)
{
    const uint16_t z = (uint16_t)((uint16_t)u + THRESHOLD);
    const uint16_t *node = &sigmoid_table[z >> 7];
    const uint16_t low = SCEANN_TABLE_WORD(node);
    const uint8_t slope = (uint8_t)(SCEANN_TABLE_WORD(node + 1) - low);   /* at most 32 */
    const uint8_t fraction = (uint8_t)(z & 127u);
    return (int16_t)(low + (uint16_t)((uint16_t)((unsigned)slope * fraction + 64u) >> 7));
}

uint32_t sceann_arithmetic_id(void)
{
    uint32_t crc = SCEANN_CRC32_INIT;
    for (uint8_t k = 0; k < NODES; k++) {
        const uint16_t value = SCEANN_TABLE_WORD(&sigmoid_table[k]);
        crc = sceann_crc32(crc, (uint8_t)value);
        crc = sceann_crc32(crc, (uint8_t)(value >> 8));
    }
    return ~crc;
}
