#define _POSIX_C_SOURCE 200809L
#include "board.h"

#include <errno.h>
#include <poll.h>
#include <stdbool.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define ANSWER_US 2000000u
#define PUNCTUAL_US 1000u               /* an answer is rarely later on an idle computer */
#define FAULT_SILENT_BODY 1u
#define FROM_SENSORS 6                 /* where the sensors stand in a record from the body */

static int body = -1;
static uint8_t sensors_n, motors_n;
static uint8_t values[BODY_FROM_BYTES];          /* the newest record */
static uint8_t part[BODY_FROM_BYTES];            /* the record that is coming in */
static size_t part_n;
static bool silent;

void body_open(int fd, uint8_t n_sensors, uint8_t n_motors)
{
    body = fd;
    sensors_n = n_sensors;
    motors_n = n_motors;
}

static uint16_t get16(const uint8_t *p)
{
    return (uint16_t)(p[0] | p[1] << 8);
}

static void tell(uint8_t kind, const int16_t *motors)
{
    uint8_t record[BODY_TO_BYTES] = { kind, motors_n };
    const uint32_t now = (uint32_t)clock_now_us();
    memcpy(&record[2], &now, sizeof now);
    if (motors != NULL) {
        memcpy(&record[6], motors, motors_n * sizeof *motors);
    }
    if (body >= 0) {
        (void)!send(body, record, sizeof record, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

/* Takes what has come, waiting at most timeout_ms for the first byte; the last record's kind, or 0. */
static uint8_t take(int timeout_ms)
{
    uint8_t kind = 0;
    struct pollfd f = { body, POLLIN, 0 };
    while (body >= 0 && poll(&f, 1, timeout_ms) > 0) {
        const ssize_t n = recv(body, part + part_n, sizeof part - part_n, MSG_DONTWAIT);
        if (n <= 0) {
            break;
        }
        part_n += (size_t)n;
        if (part_n == sizeof part) {
            memcpy(values, part, sizeof values);
            part_n = 0;
            kind = values[0];
            if (kind == 'A') {
                break;
            }
        }
    }
    return kind;
}

void body_sense(void *board, uint16_t *sensors)
{
    (void)board;
    tell('Q', NULL);
    const uint64_t asked = clock_now_us();
    silent = true;
    while (silent && clock_now_us() - asked < ANSWER_US) {
        silent = take(1) != 'A';
        board_feed();
    }
    clock_forgive(clock_now_us() - asked, PUNCTUAL_US);
    for (uint8_t k = 0; k < sensors_n; k++) {
        sensors[k] = get16(&values[FROM_SENSORS + 2 * k]);
    }
}

void body_drive(void *board, const int16_t *motors)
{
    (void)board;
    tell('D', motors);
}

void body_safe(void *board)
{
    (void)board;
    tell('S', NULL);
}

uint16_t body_alarms(void *board)
{
    (void)board;
    if (take(0) == 'A') {
        silent = false;    /* late, and there again: its computer was busy */
    }
    const uint16_t fault = silent ? (uint16_t)(SCEANN_ALARM_FAULT | FAULT_SILENT_BODY << 8) : 0u;
    return (uint16_t)(get16(&values[2]) | fault);
}

uint16_t body_battery_mv(void *board)
{
    (void)board;
    return get16(&values[4]);
}
