/*
 * libFuzzer's entry: the input is what arrives on the line, byte by byte, with a few bytes that mean time and trouble instead. The
 * robot is the whole core over a port made of memory; the first byte says what was in its store and in its RAM, and what its store takes.
 *
 * Asserted in every state: motors move in RUNNING only and outside HIL, and never beyond 0..1024.
 */
#include "sceann_robot.h"

#include <stdlib.h>
#include <string.h>

#define STORE 1024u

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const uint8_t *input, *end;
static uint32_t clock_us;
static uint8_t store[STORE];
static uint16_t alarm_bits;
static bool store_fails;
static sceann_kept kept;
static sceann_robot robot;
static sceann_decoder decoder;

static void require(bool truth)
{
    if (!truth) {
        abort();
    }
}

static uint32_t now(void *board)
{
    (void)board;
    return clock_us += 50u;
}

/* An input byte of 0xF0..0xFF after a frame's 00 is an event, not a byte of the line. */
static bool event(uint8_t byte)
{
    if (byte < 0xF0u) {
        return false;
    }
    switch (byte) {
    case 0xFEu:
        alarm_bits ^= SCEANN_ALARM_BUMPER;
        break;
    case 0xFDu:
        alarm_bits ^= SCEANN_ALARM_ESTOP;
        break;
    case 0xFCu:
        alarm_bits ^= (uint16_t)(SCEANN_ALARM_FAULT | 7u << 8);
        break;
    case 0xFBu:
        alarm_bits ^= SCEANN_ALARM_BUTTON;
        break;
    case 0xFAu:
        alarm_bits ^= SCEANN_ALARM_BATTERY;
        break;
    default:                           /* time passes: half a millisecond and more, or a second */
        clock_us += (uint32_t)1 << (byte & 15u) << 5;
        break;
    }
    return true;
}

static sceann_received receive(void *board, sceann_message *message)
{
    (void)board;
    bool between_frames = true;
    while (input < end) {
        const uint8_t byte = *input++;
        if (between_frames && !decoder.begun && event(byte)) {
            return SCEANN_NOTHING;
        }
        between_frames = byte == 0u;
        const sceann_received result = sceann_frame_decode(&decoder, byte, message);
        if (result != SCEANN_NOTHING) {
            require(result != SCEANN_MESSAGE || message->length <= SCEANN_DATA_MAX);
            return result;
        }
    }
    return SCEANN_NOTHING;
}

static void send(void *board, const sceann_message *message)
{
    (void)board;
    uint8_t frame[SCEANN_FRAME_MAX];
    sceann_decoder echo = { { 0 }, 0, 0, false, false };
    sceann_message back;
    const uint8_t n = sceann_frame_encode(message, frame);
    require(n <= SCEANN_FRAME_MAX && frame[n - 1u] == 0u);
    for (uint8_t k = 0; k + 1u < n; k++) {
        require(frame[k] != 0u && sceann_frame_decode(&echo, frame[k], &back) == SCEANN_NOTHING);
    }
    require(sceann_frame_decode(&echo, 0, &back) == SCEANN_MESSAGE && back.id == message->id &&
            back.length == message->length && memcmp(back.data, message->data, back.length) == 0);
}

static void sense(void *board, uint16_t *sensors)
{
    (void)board;
    for (uint8_t k = 0; k < 3u; k++) {
        sensors[k] = (uint16_t)(clock_us >> k);        /* too large now and then: the core cuts it */
    }
}

static void drive(void *board, const int16_t *motors)
{
    (void)board;
    require(robot.state == SCEANN_RUNNING && robot.trial.mode != SCEANN_HIL);
    require(motors[0] >= 0 && motors[0] <= 1024 && motors[1] >= 0 && motors[1] <= 1024);
}

static void safe(void *board)
{
    (void)board;
}

static uint16_t alarms(void *board)
{
    (void)board;
    return alarm_bits;
}

static uint16_t battery(void *board)
{
    (void)board;
    return 7400;
}

static void store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    require(at + n <= STORE);
    memcpy(data, store + at, n);
}

static bool store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    require(at + n <= STORE);
    require(at > 0u);                  /* the first byte to be lost in a brown-out */
    if (store_fails) {
        return false;
    }
    memcpy(store + at, data, n);
    return true;
}

static void listen(void *board, uint8_t node)
{
    (void)board;
    require(node >= 1u && node <= 127u);
}

static void light(void *board, bool on)
{
    (void)board;
    (void)on;
}

static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    (void)action;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static sceann_port port = { .name = "fuzz", .node = 1, .n_sensors = 3, .n_motors = 2, .capabilities = 0xFF,
                                      .tick_min = 1, .tick_max = 2500, .store_size = STORE, .clock_us = now,
                                      .receive = receive, .send = send, .sense = sense, .drive = drive, .safe = safe,
                                      .alarms = alarms, .battery_mv = battery, .store_read = store_read,
                                      .store_write = store_write, .watchdog = watchdog, .listen = listen, .light = light,
                                      .kept = &kept };
    if (size == 0u) {
        return 0;
    }
    /* an odd first byte: the input is also what power loss or another program left in the store */
    memset(store, 0xFF, sizeof store);
    if ((data[0] & 1u) != 0u) {
        memcpy(store, data + 1, size - 1u < STORE ? size - 1u : STORE);
    }
    store_fails = (data[0] & 4u) != 0u;
    port.store_size = (data[0] & 16u) != 0u ? 0u : STORE;
    port.capabilities = (data[0] & 16u) != 0u ? SCEANN_HAS_HIL : 0xFFu;
    /* what a reset left: nothing, a latched stop, or a watchdog that was on */
    kept.flags = (uint16_t)(0x5CE0u | (data[0] >> 5 & 3u));
    kept.check = (data[0] & 8u) != 0u ? (uint16_t)(kept.flags ^ 0xA53Cu) : 0u;
    input = data + 1;
    end = data + size;
    clock_us = 0;
    alarm_bits = 0;
    memset(&decoder, 0, sizeof decoder);
    sceann_robot_start(&robot, &port);
    for (unsigned polls = 0; input < end || polls < 16u; polls++) {
        sceann_robot_poll(&robot);
        require(sceann_robot_idle_us(&robot) <= 10000u);
        require(robot.state <= SCEANN_ESTOP);
        polls = input < end ? 0u : polls;
    }
    return 0;
}
