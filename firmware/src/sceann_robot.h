/*
 * The robot: link, trial state machine and safety rules (docs/link.md) over one port.
 *
 *     static sceann_robot robot;
 *     sceann_robot_start(&robot, &port);
 *     for (;;) {
 *         sceann_robot_poll(&robot);
 *         wait until a byte comes or sceann_robot_idle_us(&robot) have passed
 *     }
 *
 * All state is in the context. Motors are driven in RUNNING only, and made safe before anything else is done about
 * whatever ended it.
 */
#ifndef SCEANN_ROBOT_H
#define SCEANN_ROBOT_H

#include "sceann_controller.h"
#include "sceann_frame.h"
#include "sceann_numbers.h"
#include "sceann_port.h"
#include "sceann_store.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- states ------------------------------------------------------------------------------------------------------- */

typedef enum {
    SCEANN_BOOT,
    SCEANN_IDLE,
    SCEANN_LOADED,
    SCEANN_ARMED,
    SCEANN_RUNNING,
    SCEANN_SAFE,
    SCEANN_ESTOP
} sceann_state;

typedef enum { SCEANN_ONBOARD, SCEANN_TETHERED, SCEANN_HIL } sceann_mode;

/* One upload: a genome record that fills up chunk by chunk, beside the one in use. */
typedef struct {
    bool begun;                        /* LOAD came */
    bool committed;                    /* the record has become the network in use */
    uint32_t chunks;                   /* bit c: chunk c has arrived */
    uint8_t record[SCEANN_MAX_RECORD];
} sceann_upload;

/* The running trial, or the last one. */
typedef struct {
    uint16_t id;                       /* 0: autorun */
    uint16_t max_ticks;                /* 0: no limit, autorun only */
    uint16_t tick;                     /* the tick that comes next */
    uint8_t mode;                      /* sceann_mode */
    uint8_t telemetry;                 /* START's bits */
    uint8_t overruns;                  /* in a row */
    uint8_t first_page_tick;           /* HIL: tick bits of the first page that waits for its second, or NO_PAGE */
    bool driven;                       /* tethered: DRIVE_IN of the present tick has come */
    bool answered;                     /* HIL: last_drive holds the answer to tick - 1 */
    uint32_t period_us;
    uint32_t due_us;                   /* when the next tick is due */
    uint16_t sensors[SCEANN_MAX_SENSORS];
    sceann_message last_drive;
} sceann_trial;

typedef struct sceann_robot {
    const sceann_port *port;
    uint8_t state;                     /* sceann_state */
    uint8_t node;                      /* 1..127 */
    uint8_t reset_cause;               /* as in EVENT's table */
    uint8_t receive_errors;            /* stays at 255 */
    bool has_network;                  /* `controller` is that of `record` */
    bool battery_low;                  /* for SCEANN_BATTERY_LOW_US and longer */
    bool button;                       /* the start button was held at the last look */
    bool host_silent;                  /* the session was not heard for SCEANN_SESSION_US */
    uint16_t session;                  /* 0 = no host yet */
    uint16_t armed_period;             /* of the trial that ARM prepared, 0.1 ms */
    uint32_t arithmetic_id;
    uint32_t host_us;                  /* when the session was last heard */
    uint32_t heartbeat_us;             /* when our last heartbeat was sent */
    uint32_t battery_us;               /* when the battery was last seen full enough */
    uint32_t uptime_ms, millisecond_us;/* since start; when the last of them was full */
    bool autorun_possible;             /* nothing has come from a host or a hand since boot */
    sceann_controller controller;
    uint8_t record[SCEANN_MAX_RECORD]; /* of the network in use */
    sceann_upload upload;
    sceann_trial trial;
    sceann_store store;
} sceann_robot;

/* Safe output, stored genome, BOOT event, then IDLE or LOADED. */
void sceann_robot_start(sceann_robot *robot, const sceann_port *port);

/* Everything that is due now: messages, alarms, deadlines, one tick. Call it in a loop. */
void sceann_robot_poll(sceann_robot *robot);

/* How long the loop may sleep when no byte comes, at most 10 ms. */
uint32_t sceann_robot_idle_us(const sceann_robot *robot);

#ifdef __cplusplus
}
#endif
#endif
