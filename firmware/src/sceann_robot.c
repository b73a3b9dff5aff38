#include "sceann_internal.h"

#include "sceann_table.h"

#include <string.h>

#define EVENT(name) SCEANN_LINK_EVENT_CODE_##name##_CHOICE
#define REASON(name) SCEANN_LINK_END_REASON_##name##_CHOICE

#define MESSAGES_PER_POLL 8u           /* so that a flood cannot keep the tick waiting */
#define IDLE_US 10000u

#define RESET_POWER 1u
#define RESET_PIN 2u
#define RESET_WATCHDOG 3u

/* ---- messages ---------------------------------------------------------------------------------------------------- */

static void on_host_heartbeat(sceann_robot *robot, const sceann_message *message)
{
    if (robot->session != 0u && sceann_get16(&message->data[3]) == robot->session) {
        robot->host_us = sceann_now_us(robot);
        robot->host_silent = false;
    }
}

static void count_error(sceann_robot *robot)
{
    if (robot->receive_errors < 255u) {
        robot->receive_errors++;
    }
}

static void emergency_stop(sceann_robot *robot)
{
    robot->autorun_possible = false;
    sceann_keep(robot->port, KEPT_LATCHED, true);
    sceann_end_trial(robot, REASON(ESTOP), SCEANN_ESTOP);
}

/* Shortest valid length of a message to the robot; 0xFF for what is no message to a robot. */
static uint8_t least_length(uint16_t function)
{
    switch (function) {
    case FUNCTION(SENSE_IN):
    case FUNCTION(SENSE_IN_PAGE2):
    case FUNCTION(DRIVE_IN):
    case FUNCTION(GENOME):
    case FUNCTION(COMMAND):
        return SCEANN_DATA_MAX;
    case FUNCTION(HOST_HEARTBEAT):
        return SCEANN_LINK_HOST_HEARTBEAT_LENGTH;
    default:
        return 0xFFu;
    }
}

static void on_message(sceann_robot *robot, const sceann_message *message)
{
    if (message->id == 0u) {
        emergency_stop(robot);
        return;
    }
    if ((message->id & 0x7Fu) != robot->node) {
        return;
    }
    const uint16_t function = (uint16_t)(message->id & 0xFF80u);
    const uint8_t least = least_length(function);
    if (message->length < least) {
        count_error(robot);
        return;
    }
    switch (function) {
    case FUNCTION(SENSE_IN):
        sceann_on_sense_in(robot, message, false);
        break;
    case FUNCTION(SENSE_IN_PAGE2):
        sceann_on_sense_in(robot, message, true);
        break;
    case FUNCTION(DRIVE_IN):
        sceann_on_drive_in(robot, message);
        break;
    case FUNCTION(GENOME):
        sceann_on_genome(robot, message->data);
        break;
    case FUNCTION(COMMAND):
        sceann_on_command(robot, message->data);
        break;
    default:
        on_host_heartbeat(robot, message);
        break;
    }
}

static void receive(sceann_robot *robot)
{
    sceann_message message;
    for (uint8_t k = 0; k < MESSAGES_PER_POLL; k++) {
        switch (robot->port->receive(robot->port->board, &message)) {
        case SCEANN_NOTHING:
            return;
        case SCEANN_BROKEN:
            count_error(robot);
            break;
        case SCEANN_MESSAGE:
            on_message(robot, &message);
            break;
        }
    }
}

/* ---- deadlines and alarms ---------------------------------------------------------------------------------------- */

/* One low sample is a motor that starts; a battery that stays low is empty. */
static void check_battery(sceann_robot *robot, bool low)
{
    const uint32_t now = sceann_now_us(robot);
    if (!low) {
        robot->battery_us = now;
        robot->battery_low = false;
    } else if (now - robot->battery_us >= SCEANN_BATTERY_LOW_US) {
        robot->battery_low = true;     /* stays, whatever the clock does: it wraps */
    }
}

/* The start button: a champion without a host begins and ends. One that is held while the robot starts, or while something
 * forbids it, must be let go first. */
static void check_button(sceann_robot *robot, bool held, bool forbidden)
{
    const bool pressed = held && !robot->button;
    robot->button = held;
    if (!pressed) {
        return;
    }
    if (robot->state == SCEANN_RUNNING && robot->trial.id == 0u) {
        sceann_end_trial(robot, REASON(STOPPED), sceann_rest(robot));
    } else if (!forbidden && robot->state == SCEANN_LOADED && robot->store.autorun_period != 0u && sceann_fits_body(robot) &&
               (robot->session == 0u || robot->host_silent)) {
        sceann_autorun(robot);
    }
}

static void check_alarms(sceann_robot *robot)
{
    const sceann_port *port = robot->port;
    const uint16_t alarms = port->alarms(port->board);
    check_battery(robot, (alarms & SCEANN_ALARM_BATTERY) != 0u);
    if ((alarms & (SCEANN_ALARM_ESTOP | SCEANN_ALARM_BREAK)) != 0u) {
        emergency_stop(robot);
        return;
    }
    if (robot->state == SCEANN_RUNNING || robot->state == SCEANN_ARMED) {
        const bool running = robot->state == SCEANN_RUNNING;
        if ((alarms & SCEANN_ALARM_FAULT) != 0u) {
            port->safe(port->board);
            sceann_send_event(robot, EVENT(FAULT), alarms >> 8);
            sceann_end_trial(robot, REASON(FAULT), SCEANN_SAFE);
        } else if (running && (alarms & SCEANN_ALARM_BUMPER) != 0u) {
            port->safe(port->board);
            sceann_send_event(robot, EVENT(BUMPER), 0);
            sceann_end_trial(robot, REASON(BUMPER), sceann_rest(robot));
        } else if (running && robot->battery_low) {
            port->safe(port->board);
            sceann_send_event(robot, EVENT(BATTERY_LOW), port->battery_mv(port->board));
            sceann_end_trial(robot, REASON(BATTERY_LOW), sceann_rest(robot));
        }
    }
    const uint16_t forbidding = SCEANN_ALARM_BUMPER | SCEANN_ALARM_BATTERY | SCEANN_ALARM_FAULT;
    check_button(robot, (alarms & SCEANN_ALARM_BUTTON) != 0u, (alarms & forbidding) != 0u);
}

static void check_host(sceann_robot *robot)
{
    /* a sticky flag: the time since a host was heard wraps after 71.6 minutes */
    if (sceann_now_us(robot) - robot->host_us >= SCEANN_SESSION_US) {
        robot->host_silent = true;
    }
    const bool needs_host = robot->state == SCEANN_ARMED || (robot->state == SCEANN_RUNNING && robot->trial.id != 0u);
    if (needs_host && sceann_now_us(robot) - robot->host_us >= SCEANN_HOST_DEADLINE_US) {
        sceann_end_trial(robot, REASON(LINK_LOST), SCEANN_SAFE);
    }
}

static void check_autorun(sceann_robot *robot)
{
    if (!robot->autorun_possible || robot->uptime_ms < SCEANN_AUTORUN_US / 1000u) {
        return;
    }
    robot->autorun_possible = false;
    const uint16_t period = robot->store.autorun_period;
    if (period == 0u || (period & SCEANN_BY_BUTTON) != 0u || robot->state != SCEANN_LOADED ||
        (robot->port->capabilities & SCEANN_HAS_AUTORUN) == 0u) {
        return;
    }
    if (!sceann_fits_body(robot)) {
        /* the network of another body: flashed with other sensors, the board keeps its store */
        sceann_send_event(robot, EVENT(NO_AUTORUN), 0);
        return;
    }
    sceann_autorun(robot);
}

/* ---- the light: sixteen eighths of a second for each state, first one in the lowest bit --------------------------- */

static const uint16_t light_patterns[] SCEANN_TABLE = {
    [SCEANN_BOOT] = 0x0000u,   [SCEANN_IDLE] = 0x0001u,    [SCEANN_LOADED] = 0x0005u, [SCEANN_ARMED] = 0x5555u,
    [SCEANN_RUNNING] = 0xFFFFu, [SCEANN_SAFE] = 0x00FFu,   [SCEANN_ESTOP] = 0x0F0Fu,
};

static void show(const sceann_robot *robot)
{
    const sceann_port *port = robot->port;
    if (port->light != NULL) {
        const uint16_t pattern = SCEANN_TABLE_WORD(&light_patterns[robot->state]);
        port->light(port->board, (pattern >> ((uint8_t)(robot->uptime_ms >> 7) & 15u) & 1u) != 0u);
    }
}

static void keep_time(sceann_robot *robot)
{
    const uint32_t now = sceann_now_us(robot);
    while (now - robot->millisecond_us >= 1000u) {     /* no division: it costs an AVR 70 bytes and 600 cycles */
        robot->millisecond_us += 1000u;
        robot->uptime_ms++;
    }
    if (now - robot->heartbeat_us >= SCEANN_HEARTBEAT_US) {
        robot->heartbeat_us = now;
        sceann_send_heartbeat(robot);
    }
    show(robot);
}

/* ---- the loop ---------------------------------------------------------------------------------------------------- */

/* Why the chip started. Boot loaders clear the chip's register; then it is told by what RAM still holds. */
static uint8_t cause(const sceann_port *port)
{
    if (port->reset_cause != 0u || port->kept == NULL) {
        return port->reset_cause;
    }
    if (!sceann_kept_valid(port)) {
        return RESET_POWER;
    }
    return sceann_kept_has(port, KEPT_GUARDED) ? RESET_WATCHDOG : RESET_PIN;
}

void sceann_robot_start(sceann_robot *robot, const sceann_port *port)
{
    port->safe(port->board);
    memset(robot, 0, sizeof *robot);
    robot->port = port;
    robot->state = SCEANN_BOOT;
    robot->arithmetic_id = sceann_arithmetic_id();
    robot->millisecond_us = robot->heartbeat_us = robot->battery_us = port->clock_us(port->board);
    robot->reset_cause = cause(port);
    sceann_keep(port, KEPT_GUARDED, false);
    sceann_store_open(&robot->store, port);
    sceann_set_node(robot, robot->store.node != 0u ? robot->store.node : port->node);
    if (robot->store.slot != SCEANN_NO_SLOT) {
        sceann_store_get_genome(&robot->store, port, robot->upload.record);
        sceann_use(robot, robot->upload.record);
    }
    robot->autorun_possible = robot->button = true;
    sceann_send_event(robot, EVENT(BOOT), robot->reset_cause);
    if (sceann_kept_has(port, KEPT_LATCHED)) {
        emergency_stop(robot);         /* nobody has cleared it */
    } else {
        sceann_enter(robot, sceann_rest(robot));
    }
}

void sceann_robot_poll(sceann_robot *robot)
{
    check_alarms(robot);
    receive(robot);
    check_host(robot);
    if (sceann_drives(robot)) {
        sceann_timed_tick(robot);
    }
    check_autorun(robot);
    keep_time(robot);
}

uint32_t sceann_robot_idle_us(const sceann_robot *robot)
{
    if (!sceann_drives(robot)) {
        return IDLE_US;
    }
    const uint32_t now = sceann_now_us(robot);
    const uint32_t left = robot->trial.due_us - now;       /* has wrapped when the tick is late */
    return left >= 0x80000000u ? 0u : left < IDLE_US ? left : IDLE_US;
}
