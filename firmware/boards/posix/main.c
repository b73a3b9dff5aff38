/*
 * The firmware as a Linux process:
 *
 *   sceann-posix --link FD [--body FD --sensors N --motors N] [--store FILE] [--baud N] [--node N] [--name TEXT] [--id N]
 *                [--alive FD]
 *
 * --link   the serial line: an inherited socket or pseudo-terminal
 * --body   sensors and motor driver, records as in board.h; without it the board serves HIL only
 * --store  the EEPROM, 1024 bytes, made if absent; without it nothing survives
 * --baud   pace the line like a UART of that rate (8N1); as fast as it goes without it
 * --alive  a pipe: when nobody is left who could write to it, the process that this robot belongs to is gone, and it ends
 *
 * The watchdog starts the program anew with reset cause 3, as a chip does. SIGUSR1 makes the main loop hang, so that a
 * test can see it bite.
 */
#define _GNU_SOURCE
#include "board.h"
#include "sceann_robot.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#define STORE_SIZE 1024u
#define EXIT_USAGE 2
#define PUNCTUAL_US 10000u             /* how late this computer may be before the robot's time stands still */

static int store = -1;
static char **arguments;               /* of this process, with the reset cause in the last one */
static char reset_cause[] = "1:00000000";       /* and what `kept` held: RAM that survives a reset */
static sceann_kept kept;
static volatile sig_atomic_t hang;

static uint32_t clock_us(void *board)
{
    (void)board;
    return (uint32_t)clock_robot_us();
}

static void store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    memset(data, 0xFF, n);
    (void)!pread(store, data, n, at);
}

static bool store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    return pwrite(store, data, n, at) == (ssize_t)n;
}

static bool guarded;

static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    guarded = action != SCEANN_WATCHDOG_OFF;
    const struct itimerval timer = { { 0, 0 }, { 0, action == SCEANN_WATCHDOG_OFF ? 0 : SCEANN_WATCHDOG_US } };
    setitimer(ITIMER_REAL, &timer, NULL);
}

void board_feed(void)
{
    if (guarded) {
        watchdog(NULL, SCEANN_WATCHDOG_FEED);
    }
}

static void on_watchdog(int signal)
{
    (void)signal;
    reset_cause[0] = '3';
    reset_cause[1] = ':';
    const uint32_t word = (uint32_t)kept.flags << 16 | kept.check;
    for (int k = 0; k < 8; k++) {
        reset_cause[2 + k] = "0123456789abcdef"[word >> (28 - 4 * k) & 15u];
    }
    execv("/proc/self/exe", arguments);
    _exit(70);
}

static void on_hang(int signal)
{
    (void)signal;
    hang = 1;
}

static void usage(const char *what, const char *got)
{
    fprintf(stderr, "sceann-posix: %s, got %s\n", what, got);
    exit(EXIT_USAGE);
}

static long number(const char *option, const char *text, long low, long high)
{
    char *end;
    char message[96];
    const long value = strtol(text, &end, 10);
    if (*text == '\0' || *end != '\0' || value < low || value > high) {
        snprintf(message, sizeof message, "--%s: expected a number %ld..%ld", option, low, high);
        usage(message, text);
    }
    return value;
}

static void set_unique_id(uint8_t *bytes, long id)
{
    for (int k = 0; k < 7; k++) {
        bytes[k] = (uint8_t)(id >> 8 * k);
    }
}

static void open_store(const char *path, sceann_port *port)
{
    store = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    struct stat status;
    if (store < 0 || fstat(store, &status) != 0) {
        usage("--store: expected a file that can be written", path);
    }
    uint8_t blank[STORE_SIZE];
    memset(blank, 0xFF, sizeof blank);
    if (status.st_size < (off_t)STORE_SIZE &&
        pwrite(store, blank + status.st_size, STORE_SIZE - (size_t)status.st_size, status.st_size) < 0) {
        usage("--store: expected room for 1024 bytes", path);
    }
    port->store_size = STORE_SIZE;
    port->capabilities |= SCEANN_HAS_STORE | SCEANN_HAS_AUTORUN;
}

static void catch_signals(void)
{
    struct sigaction action = { .sa_handler = on_watchdog };
    sigset_t set;
    sigaction(SIGALRM, &action, NULL);
    action.sa_handler = on_hang;
    sigaction(SIGUSR1, &action, NULL);
    sigemptyset(&set);
    sigaddset(&set, SIGALRM);          /* blocked when the watchdog's handler started this program anew */
    sigprocmask(SIG_UNBLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);          /* a store that takes nothing is an error, not an end */
}

int main(int argc, char **argv)
{
    enum { LINK = 1, BODY, SENSORS, MOTORS, STORE, BAUD, NODE, NAME, ID, ALIVE, CAUSE };
    static const struct option options[] = {
        { "link", 1, NULL, LINK },   { "body", 1, NULL, BODY }, { "sensors", 1, NULL, SENSORS },
        { "motors", 1, NULL, MOTORS }, { "store", 1, NULL, STORE }, { "baud", 1, NULL, BAUD },
        { "node", 1, NULL, NODE },   { "name", 1, NULL, NAME }, { "id", 1, NULL, ID },
        { "alive", 1, NULL, ALIVE }, { "reset-cause", 1, NULL, CAUSE }, { NULL, 0, NULL, 0 }
    };
    static sceann_port port = { .name = "posix",
                                .node = 1,
                                .capabilities = SCEANN_HAS_HIL | SCEANN_HAS_WATCHDOG,
                                .tick_min = 1,
                                .tick_max = 2500,
                                .kept = &kept,
                                .clock_us = clock_us,
                                .receive = line_receive,
                                .send = line_send,
                                .sense = body_sense,
                                .drive = body_drive,
                                .safe = body_safe,
                                .alarms = body_alarms,
                                .battery_mv = body_battery_mv,
                                .store_read = store_read,
                                .store_write = store_write,
                                .watchdog = watchdog };
    int link = -1, body = -1, option;
    uint32_t baud = 0;

    arguments = calloc((size_t)argc + 3u, sizeof *arguments);
    if (arguments == NULL) {
        return 1;
    }
    memcpy(arguments, argv, (size_t)argc * sizeof *argv);
    while ((option = getopt_long(argc, argv, "", options, NULL)) != -1) {
        switch (option) {
        case LINK: link = (int)number("link", optarg, 0, 1 << 20); break;
        case BODY: body = (int)number("body", optarg, 0, 1 << 20); break;
        case SENSORS: port.n_sensors = (uint8_t)number("sensors", optarg, 1, SCEANN_MAX_SENSORS); break;
        case MOTORS: port.n_motors = (uint8_t)number("motors", optarg, 1, SCEANN_MAX_MOTORS); break;
        case STORE: open_store(optarg, &port); break;
        case BAUD: baud = (uint32_t)number("baud", optarg, 300, 4000000); break;
        case NODE: port.node = (uint8_t)number("node", optarg, 1, 127); break;
        case NAME: strncpy(port.name, optarg, sizeof port.name - 1u); break;
        case ID: set_unique_id(port.unique_id, number("id", optarg, 0, 0xFFFFFFFFFFFFL)); break;
        case ALIVE: line_ends_with((int)number("alive", optarg, 0, 1 << 20)); break;
        case CAUSE: {
            const unsigned long word = strtoul(optarg + 2, NULL, 16);
            port.reset_cause = (uint8_t)(optarg[0] - '0');
            kept = (sceann_kept){ (uint16_t)(word >> 16), (uint16_t)word };
            break;
        }
        default: return EXIT_USAGE;
        }
    }
    if (link < 0) {
        usage("--link: expected the descriptor of the serial line", "none");
    }
    if ((body >= 0) != (port.n_sensors != 0u && port.n_motors != 0u)) {
        usage("expected --body, --sensors and --motors together", "only some of them");
    }
    if (body >= 0) {
        port.capabilities |= SCEANN_HAS_BODY | SCEANN_HAS_BATTERY | SCEANN_HAS_BUMPER | SCEANN_HAS_BUTTON;
    }
    if (port.reset_cause == 0u) {
        port.reset_cause = 1;
        arguments[argc] = "--reset-cause";
        arguments[argc + 1] = reset_cause;
    } else {
        arguments[argc - 1] = reset_cause;
    }
    catch_signals();
    line_open(link, baud);
    body_open(body, port.n_sensors, port.n_motors);

    static sceann_robot robot;
    sceann_robot_start(&robot, &port);
    for (;;) {
        sceann_robot_poll(&robot);
        while (hang) {
        }
        const uint32_t half = robot.trial.period_us / 2u;
        const bool running = robot.state == SCEANN_RUNNING && robot.trial.mode != SCEANN_HIL;
        line_wait(sceann_robot_idle_us(&robot), running && half < PUNCTUAL_US ? half : PUNCTUAL_US);
    }
}
