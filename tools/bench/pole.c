/* Pole balancing in C, tuned by hand: 64 trials side by side, a lane loaded anew when its trial ends.
 * With EXACT it computes what the lane engine computes, to the bit, with the hash of all states; without, it is free to
 * use short polynomials and reciprocals, and hashes nothing. The yardsticks of tools/bench; not part of the product. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 64
#define N_NEURONS 4
#define N_SOURCES 6

typedef struct {
    float x[LANES], v[LANES], angle[LANES], rate[LANES];
    int16_t w[N_NEURONS][N_SOURCES][LANES], source[N_SOURCES][LANES], u[N_NEURONS][LANES];
    int32_t step[LANES], trial[LANES], ended[LANES];
    uint16_t hash[LANES];
} lanes_t;

#ifdef EXACT
static float sine(float a)
{
    float t = a * a, p = 1.36115963e-10f;
    p = p * t + -2.47283665e-08f;
    p = p * t + 2.75358005e-06f;
    p = p * t + -0.000198405316f;
    p = p * t + 0.00833332124f;
    p = p * t + -0.166666659f;
    p = p * t + 0.999999999f;
    return a * p;
}

static float cosine(float a)
{
    float t = a * a, p = -9.72173356e-12f;
    p = p * t + 2.06033299e-09f;
    p = p * t + -2.75347674e-07f;
    p = p * t + 2.48005513e-05f;
    p = p * t + -0.0013888863f;
    p = p * t + 0.0416666635f;
    p = p * t + -0.499999999f;
    return p * t + 1.0f;
}

static uint16_t crc_byte(uint16_t crc, uint16_t byte)
{
    uint16_t x = (uint16_t)((crc >> 8) ^ byte);
    x = (uint16_t)(x ^ (x >> 4));
    return (uint16_t)((crc << 8) ^ (x << 12) ^ (x << 5) ^ x);
}

#define LIMIT 0.628318548f
#define DIVIDED(a, b) ((a) / (b))
#else
static float sine(float a)
{
    float t = a * a;
    return a * (1.0f + t * (-1.0f / 6 + t * (1.0f / 120 + t * (-1.0f / 5040 + t * (1.0f / 362880)))));
}

static float cosine(float a)
{
    float t = a * a;
    return 1.0f + t * (-0.5f + t * (1.0f / 24 + t * (-1.0f / 720 + t * (1.0f / 40320))));
}

#define LIMIT 0.62831853f
#define DIVIDED(a, b) ((a) * (1 / (b)))
#endif

void balance(const int8_t *weights, int64_t n, float start_rad, int32_t max_steps, const int32_t *table, int32_t *steps,
             uint16_t *hashes, float *final_states)
{
    static _Thread_local lanes_t s;
    int64_t next = 0, running = 0;
    memset(&s, 0, sizeof s);
    for (int l = 0; l < LANES; l++) {
        s.trial[l] = -1;
        s.ended[l] = 1;
    }
    for (;;) {
        int any = 0;
        for (int l = 0; l < LANES; l++) any |= s.ended[l];
        if (any) {
            for (int l = 0; l < LANES; l++) {
                if (!s.ended[l]) continue;
                if (s.trial[l] >= 0) {
                    steps[s.trial[l]] = s.step[l];
#ifdef EXACT
                    hashes[s.trial[l]] = s.hash[l];
                    const float final[4] = {s.x[l], s.v[l], s.angle[l], s.rate[l]};
                    memcpy(final_states + 4 * (int64_t)s.trial[l], final, sizeof final);
#else
                    (void)hashes, (void)final_states;
#endif
                    running--;
                    s.trial[l] = -1;
                }
                if (next >= n) continue;
                const int8_t *w = weights + next * N_NEURONS * N_SOURCES;
                for (int i = 0; i < N_NEURONS; i++) {
                    s.u[i][l] = 0;
                    s.source[2 + i][l] = 512;
                    for (int j = 0; j < N_SOURCES; j++) s.w[i][j][l] = *w++;
                }
                s.x[l] = s.v[l] = s.rate[l] = 0;
                s.angle[l] = start_rad;
                s.hash[l] = 0xFFFF;
                s.step[l] = 0;
                s.trial[l] = (int32_t)next++;
                s.ended[l] = 0;
                running++;
            }
            if (!running) return;
        }
        for (int l = 0; l < LANES; l++) {
            float a = DIVIDED(s.x[l] + 2.4f, 2.0f * 2.4f), b = DIVIDED(s.angle[l] + LIMIT, 2.0f * LIMIT);
            a = a > 0 ? a : 0, b = b > 0 ? b : 0;
            a = a < 1 ? a : 1, b = b < 1 ? b : 1;
            int32_t p = (int32_t)(a * 1023 + 0.5f), q = (int32_t)(b * 1023 + 0.5f);
            s.source[0][l] = (int16_t)(p + (p >> 9));
            s.source[1][l] = (int16_t)(q + (q >> 9));
        }
        for (int i = 0; i < N_NEURONS; i++) {
            int16_t net[LANES];
            memcpy(net, s.u[i], sizeof net);
            for (int j = 0; j < N_SOURCES; j++)
                for (int l = 0; l < LANES; l++) net[l] = (int16_t)(net[l] + s.w[i][j][l] * s.source[j][l]);
            for (int l = 0; l < LANES; l++) s.u[i][l] = (net[l] > 8192 || net[l] < -8192) ? 0 : net[l];
        }
        for (int i = 0; i < N_NEURONS; i++)
            for (int l = 0; l < LANES; l++) {
                int32_t z = s.u[i][l] + 8192, e = table[z >> 7];
                s.source[2 + i][l] = (int16_t)((e >> 8) + (((e & 255) * (z & 127) + 64) >> 7));
            }
#ifdef EXACT
        for (int i = 0; i < N_NEURONS; i++)
            for (int l = 0; l < LANES; l++) {
                uint16_t word = (uint16_t)s.u[i][l];
                s.hash[l] = crc_byte(crc_byte(s.hash[l], word & 255), word >> 8);
            }
#endif
        for (int l = 0; l < LANES; l++) {
            float force = 10.0f * (2.0f * (float)s.source[5][l] * (1 / 1024.0f) - 1.0f);
            float sn = sine(s.angle[l]), c = cosine(s.angle[l]);
            float thrust = DIVIDED(force + 0.05f * s.rate[l] * s.rate[l] * sn, 1.1f);
            float angular = (9.8f * sn - c * thrust) / (0.5f * ((float)(4.0 / 3.0) - DIVIDED(0.1f * c * c, 1.1f)));
            float linear = thrust - DIVIDED(0.05f * angular * c, 1.1f);
            s.x[l] += 0.02f * s.v[l];
            s.v[l] += 0.02f * linear;
            s.angle[l] += 0.02f * s.rate[l];
            s.rate[l] += 0.02f * angular;
            s.step[l]++;
            int out = fabsf(s.x[l]) > 2.4f || fabsf(s.angle[l]) > LIMIT || s.step[l] >= max_steps;
            s.ended[l] = s.trial[l] < 0 ? 1 : out;
        }
    }
}
