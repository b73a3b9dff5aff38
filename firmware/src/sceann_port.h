/*
 * What a board supplies: about ten functions and a few constants. How to write one is told in firmware/README.md.
 * Zero what the board has not: functions marked "may be NULL" are then left out.
 *
 * All functions are called from the main loop, never from an interrupt. None may wait for the host: `send` may wait for
 * the line to take bytes that leave at the line's own speed (a UART), otherwise it drops the message.
 */
#ifndef SCEANN_PORT_H
#define SCEANN_PORT_H

#include "sceann_frame.h"
#include "sceann_numbers.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- what the board can do: the descriptor's capability bits ---------------------------------------------------- */

#define SCEANN_HAS_BODY 0x0001u        /* own sensors and motors: modes onboard and tethered */
#define SCEANN_HAS_HIL 0x0002u
#define SCEANN_HAS_STORE 0x0004u       /* genome and last trial survive power loss */
#define SCEANN_HAS_AUTORUN 0x0008u     /* may run a stored genome without a host */
#define SCEANN_HAS_WATCHDOG 0x0010u
#define SCEANN_HAS_BATTERY 0x0020u
#define SCEANN_HAS_BUMPER 0x0040u
#define SCEANN_HAS_BUTTON 0x0080u      /* a start button */

/* ---- what may be wrong: bits that `alarms` returns -------------------------------------------------------------- */

#define SCEANN_ALARM_ESTOP 0x01u       /* a stop button is held */
#define SCEANN_ALARM_BREAK 0x02u       /* a BREAK came since the last call: the line was low for SCEANN_BREAK_US at least */
#define SCEANN_ALARM_BUMPER 0x04u
#define SCEANN_ALARM_BATTERY 0x08u     /* low now; the core waits until it has been so for SCEANN_BATTERY_LOW_US */
#define SCEANN_ALARM_FAULT 0x10u       /* something only the board knows; the high 8 bits of `alarms` say what */
#define SCEANN_ALARM_BUTTON 0x20u      /* no alarm: the start button is held */

typedef enum { SCEANN_WATCHDOG_OFF, SCEANN_WATCHDOG_ON, SCEANN_WATCHDOG_FEED } sceann_watchdog;

/* ---- what survives a reset ---------------------------------------------------------------------------------------
 * A few bytes of RAM that the start-up code leaves alone (`.noinit`). Whatever is in them after power came on is no
 * valid check word. They keep a latched stop, and tell a hanging program from an opened port where a boot loader has
 * cleared the chip's own register. */

typedef struct {
    uint16_t flags, check;
} sceann_kept;

typedef struct sceann_port {
    /* ---- constants */
    char name[22];                     /* filled up with zeros */
    uint8_t node;                      /* 1..127, until the robot is given another one */
    uint8_t n_sensors, n_motors;       /* of the body; 0 without one */
    uint16_t capabilities;             /* SCEANN_HAS_... */
    uint16_t tick_min, tick_max;       /* shortest and longest control period in 0.1 ms */
    uint16_t store_size;               /* bytes; 0 without a store */
    uint8_t unique_id[7];
    uint8_t reset_cause;               /* as in EVENT's table; 0: found out from `kept` */
    sceann_kept *kept;                 /* may be NULL */
    void *board;                       /* handed to every function */

    /* ---- time and link */
    uint32_t (*clock_us)(void *board);                                  /* monotonic, wraps */
    sceann_received (*receive)(void *board, sceann_message *message);   /* never waits */
    void (*send)(void *board, const sceann_message *message);
    void (*listen)(void *board, uint8_t node);      /* CAN: set the filters to this node and id 0; may be NULL */

    /* ---- body */
    void (*sense)(void *board, uint16_t *sensors);          /* n_sensors values, 0..1023 */
    void (*drive)(void *board, const int16_t *motors);      /* n_motors values in Q10, 0..1024 */
    void (*safe)(void *board);                              /* the safe output, at once */
    uint16_t (*alarms)(void *board);                        /* SCEANN_ALARM_... */
    uint16_t (*battery_mv)(void *board);                    /* 0 = not measured */
    void (*light)(void *board, bool on);                    /* tells the state; may be NULL */

    /* ---- store and watchdog
     * A write changes the bytes that it names and no others, whatever happens to the power meanwhile (memory that is
     * erased in sectors needs a layer in between: sceann_flash.h). It may take milliseconds per byte. False: it failed;
     * what is stored is read back all the same. Byte 0 is never used: EEPROMs lose it first when the power fails. */
    void (*store_read)(void *board, uint16_t at, uint8_t *data, uint8_t n);
    bool (*store_write)(void *board, uint16_t at, const uint8_t *data, uint8_t n);
    void (*watchdog)(void *board, sceann_watchdog action);  /* resets the chip when not fed for about 500 ms */
} sceann_port;

#endif
