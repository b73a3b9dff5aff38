#include "sceann_internal.h"

#include <string.h>

#define EVENT(name) SCEANN_LINK_EVENT_CODE_##name##_CHOICE
#define REASON(name) SCEANN_LINK_END_REASON_##name##_CHOICE

#define MESSAGES_PER_POLL 8u           /* so that a flood cannot keep the tick waiting */
#define IDLE_US 10000u

static uint32_t now_us(const sceann_robot *robot)
{
    return robot->port->clock_us(robot->port->board);
}

static bool passed(uint32_t now, uint32_t due)
{
    return now - due < 0x80000000u;
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

sceann_state sceann_rest(const sceann_robot *robot)
{
    return robot->has_network ? SCEANN_LOADED : SCEANN_IDLE;
}

void sceann_enter(sceann_robot *robot, sceann_state state)
{
    const uint8_t before = robot->state;
    if (before != (uint8_t)state) {
        robot->state = (uint8_t)state;
        sceann_send_event(robot, EVENT(STATE_CHANGE), before);
    }
}

/* ---- trials ------------------------------------------------------------------------------------------------------ */

static bool drives(const sceann_robot *robot)
{
    return robot->state == SCEANN_RUNNING && robot->trial.mode != SCEANN_HIL;
}

void sceann_begin_trial(sceann_robot *robot)
{
    const sceann_port *port = robot->port;
    sceann_trial *trial = &robot->trial;

    trial->first_page_tick = NO_PAGE;
    if (trial->mode != SCEANN_TETHERED) {
        sceann_controller_reset(&robot->controller);
    }
    if (trial->id != 0u) {
        robot->store.last = (sceann_last_trial){ .id = trial->id, .reason = REASON(UNFINISHED), .state_hash = 0xFFFFu };
        sceann_store_put_last(&robot->store, port);
    }
    sceann_enter(robot, SCEANN_RUNNING);
    if (drives(robot)) {
        port->watchdog(port->board, SCEANN_WATCHDOG_ON);
    }
    trial->due_us = now_us(robot);
    robot->host_us = trial->due_us;
}

void sceann_end_trial(sceann_robot *robot, uint8_t reason, sceann_state next)
{
    const sceann_port *port = robot->port;
    port->safe(port->board);
    if (robot->state != SCEANN_RUNNING) {
        sceann_enter(robot, next);
        return;
    }
    port->watchdog(port->board, SCEANN_WATCHDOG_OFF);
    if (robot->trial.id == 0u) {
        sceann_enter(robot, next);
        return;
    }
    sceann_last_trial *last = &robot->store.last;
    last->id = robot->trial.id;
    last->reason = reason;
    last->ticks = robot->trial.tick;
    last->state_hash = robot->trial.mode == SCEANN_TETHERED ? 0xFFFFu : robot->controller.state_hash;
    sceann_send_end(robot);
    sceann_enter(robot, next);
    sceann_store_put_last(&robot->store, port);
}

/* ---- ticks ------------------------------------------------------------------------------------------------------- */

/* Counts an overrun; true if it was one too many and the trial has ended. */
static bool overrun(sceann_robot *robot)
{
    sceann_trial *trial = &robot->trial;
    trial->overruns++;
    const bool too_many = trial->overruns >= SCEANN_OVERRUN_LIMIT;
    if (too_many) {
        robot->port->safe(robot->port->board);
    }
    sceann_send_event(robot, EVENT(OVERRUN), trial->overruns);
    if (too_many) {
        sceann_end_trial(robot, REASON(OVERRUN), SCEANN_SAFE);
    }
    return too_many;
}

static void sense(sceann_robot *robot)
{
    uint16_t *sensors = robot->trial.sensors;
    robot->port->sense(robot->port->board, sensors);
    for (uint8_t k = 0; k < robot->port->n_sensors; k++) {
        sensors[k] = sensors[k] > SCEANN_SENSOR_MAX ? SCEANN_SENSOR_MAX : sensors[k];
    }
}

/* A tick of the robot's own clock: modes onboard and tethered. */
static void timed_tick(sceann_robot *robot)
{
    sceann_trial *trial = &robot->trial;
    const sceann_port *port = robot->port;
    const uint32_t now = now_us(robot);
    const bool tethered = trial->mode == SCEANN_TETHERED;

    if (!passed(now, trial->due_us)) {
        return;
    }
    bool late = now - trial->due_us >= trial->period_us;
    if (tethered && trial->tick > 0u && !trial->driven) {
        late = true;
    }
    if (!late) {
        trial->overruns = 0;
    } else if (overrun(robot)) {
        return;
    }
    if (trial->max_ticks != 0u && trial->tick == trial->max_ticks) {
        sceann_end_trial(robot, REASON(MAX_TICKS), sceann_rest(robot));
        return;
    }
    port->watchdog(port->board, SCEANN_WATCHDOG_FEED);
    sense(robot);
    if (tethered) {
        trial->driven = false;
        sceann_send_sense(robot, trial->tick);
    } else {
        sceann_controller_step(&robot->controller, trial->sensors);
        port->drive(port->board, sceann_controller_motors(&robot->controller));
        if (trial->telemetry & TELEMETRY_SENSE) {
            sceann_send_sense(robot, trial->tick);
        }
        if (trial->telemetry & TELEMETRY_STATES) {
            sceann_send_states(robot, trial->tick);
        }
        if (trial->telemetry & TELEMETRY_DRIVE) {
            sceann_send_drive(robot, trial->tick);
        }
    }
    trial->tick++;
    trial->due_us = (now - trial->due_us >= trial->period_us ? now : trial->due_us) + trial->period_us;
}

static void on_drive_in(sceann_robot *robot, const sceann_message *message)
{
    sceann_trial *trial = &robot->trial;
    struct sceann_link_drive_in_t drive;
    if (robot->state != SCEANN_RUNNING || trial->mode != SCEANN_TETHERED) {
        return;
    }
    (void)sceann_link_drive_in_unpack(&drive, message->data, sizeof message->data);
    const int16_t motors[SCEANN_MAX_MOTORS] = { (int16_t)drive.motor0, (int16_t)drive.motor1, (int16_t)drive.motor2 };
    for (uint8_t k = 0; k < SCEANN_MAX_MOTORS; k++) {
        if (motors[k] < 0 || motors[k] > SCEANN_ONE) {
            return;
        }
    }
    if (trial->tick == 0u || drive.tick != (uint8_t)(trial->tick - 1u)) {
        sceann_send_event(robot, EVENT(TICK_MISMATCH), drive.tick);
        return;
    }
    trial->driven = true;
    robot->port->drive(robot->port->board, motors);
}

/* ---- HIL: the host's sensors are the tick ------------------------------------------------------------------------ */

static void hil_step(sceann_robot *robot)
{
    sceann_trial *trial = &robot->trial;
    sceann_controller_step(&robot->controller, trial->sensors);
    if (trial->telemetry & TELEMETRY_STATES) {
        sceann_send_states(robot, trial->tick);
    }
    sceann_send_drive(robot, trial->tick);
    trial->answered = true;
    trial->first_page_tick = NO_PAGE;
    trial->tick++;
    if (trial->tick == trial->max_ticks) {
        sceann_end_trial(robot, REASON(MAX_TICKS), sceann_rest(robot));
    }
}

/* The host did not get our answer: give it again. True if these tick bits are those of the tick before. */
static bool answer_again(const sceann_robot *robot, uint8_t tick_bits, bool completes)
{
    const sceann_trial *trial = &robot->trial;
    if (!trial->answered || tick_bits != (uint8_t)((trial->tick - 1u) & 15u)) {
        return false;
    }
    if (completes) {
        robot->port->send(robot->port->board, &trial->last_drive);
        if (robot->state != SCEANN_RUNNING) {
            sceann_send_end(robot);
        }
    }
    return true;
}

static void on_sense_in(sceann_robot *robot, const sceann_message *message, bool second_page)
{
    sceann_trial *trial = &robot->trial;
    struct sceann_link_sense_in_t in;
    /* both pages have the same layout */
    (void)sceann_link_sense_in_unpack(&in, message->data, sizeof message->data);

    if (trial->mode != SCEANN_HIL || (robot->state != SCEANN_RUNNING && !trial->answered)) {
        return;
    }
    const bool two_pages = robot->controller.n_sensors > 6u;
    const bool expected = robot->state == SCEANN_RUNNING && in.tick == (uint8_t)(trial->tick & 15u);
    if (!expected) {
        if (!answer_again(robot, in.tick, second_page == two_pages) && robot->state == SCEANN_RUNNING) {
            sceann_send_event(robot, EVENT(TICK_MISMATCH), in.tick);
        }
        return;
    }
    if (second_page && trial->first_page_tick != in.tick) {
        return;                        /* its first page was lost: the host will send both again */
    }
    uint16_t *s = &trial->sensors[second_page ? 6 : 0];
    s[0] = in.sensor0;
    s[1] = in.sensor1;
    s[2] = in.sensor2;
    s[3] = in.sensor3;
    s[4] = in.sensor4;
    s[5] = in.sensor5;
    if (second_page == two_pages) {
        hil_step(robot);
    } else {
        trial->first_page_tick = in.tick;
    }
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

static void on_host_heartbeat(sceann_robot *robot, const sceann_message *message)
{
    struct sceann_link_host_heartbeat_t heartbeat;
    (void)sceann_link_host_heartbeat_unpack(&heartbeat, message->data, sizeof message->data);
    if (heartbeat.session == robot->session && robot->session != 0u) {
        robot->host_us = now_us(robot);
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
    sceann_end_trial(robot, REASON(ESTOP), SCEANN_ESTOP);
}

/* Shortest valid length of a message to the robot; 0xFF for what is no message to a robot. */
static uint8_t least_length(const sceann_robot *robot, uint16_t function)
{
    switch (function) {
    case FUNCTION(SENSE_IN):
    case FUNCTION(SENSE_IN_PAGE2):
    case FUNCTION(GENOME):
    case FUNCTION(COMMAND):
        return SCEANN_DATA_MAX;
    case FUNCTION(DRIVE_IN):
        return (uint8_t)(2u + 2u * robot->port->n_motors);
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
    if ((message->id & 0x7Fu) != robot->port->node) {
        return;
    }
    const uint16_t function = (uint16_t)(message->id & 0xFF80u);
    const uint8_t least = least_length(robot, function);
    if (message->length < least) {
        count_error(robot);
        return;
    }
    switch (function) {
    case FUNCTION(SENSE_IN):
        on_sense_in(robot, message, false);
        break;
    case FUNCTION(SENSE_IN_PAGE2):
        on_sense_in(robot, message, true);
        break;
    case FUNCTION(DRIVE_IN):
        on_drive_in(robot, message);
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

static void check_alarms(sceann_robot *robot)
{
    const uint16_t alarms = robot->port->alarms(robot->port->board);
    if ((alarms & (SCEANN_ALARM_ESTOP | SCEANN_ALARM_BREAK)) != 0u) {
        emergency_stop(robot);
    } else if (robot->state != SCEANN_RUNNING && robot->state != SCEANN_ARMED) {
        return;
    } else if ((alarms & SCEANN_ALARM_FAULT) != 0u) {
        robot->port->safe(robot->port->board);
        sceann_send_event(robot, EVENT(FAULT), alarms >> 8);
        sceann_end_trial(robot, REASON(FAULT), SCEANN_SAFE);
    } else if ((alarms & SCEANN_ALARM_BUMPER) != 0u && robot->state == SCEANN_RUNNING) {
        robot->port->safe(robot->port->board);
        sceann_send_event(robot, EVENT(BUMPER), 0);
        sceann_end_trial(robot, REASON(BUMPER), sceann_rest(robot));
    } else if ((alarms & SCEANN_ALARM_BATTERY) != 0u && robot->state == SCEANN_RUNNING) {
        robot->port->safe(robot->port->board);
        sceann_send_event(robot, EVENT(BATTERY_LOW), robot->port->battery_mv(robot->port->board));
        sceann_end_trial(robot, REASON(BATTERY_LOW), sceann_rest(robot));
    }
}

static void check_host(sceann_robot *robot)
{
    const bool needs_host = robot->state == SCEANN_ARMED || (robot->state == SCEANN_RUNNING && robot->trial.id != 0u);
    if (needs_host && now_us(robot) - robot->host_us >= SCEANN_HOST_DEADLINE_US) {
        sceann_end_trial(robot, REASON(LINK_LOST), SCEANN_SAFE);
    }
}

static void check_autorun(sceann_robot *robot)
{
    if (!robot->autorun_possible || robot->uptime_ms < SCEANN_AUTORUN_US / 1000u) {
        return;
    }
    robot->autorun_possible = false;
    if (robot->store.autorun_period == 0u || robot->state != SCEANN_LOADED ||
        (robot->port->capabilities & SCEANN_HAS_AUTORUN) == 0u) {
        return;
    }
    memset(&robot->trial, 0, sizeof robot->trial);
    robot->trial.mode = SCEANN_ONBOARD;
    robot->trial.period_us = robot->store.autorun_period * (uint32_t)100u;
    sceann_begin_trial(robot);
}

static void keep_time(sceann_robot *robot)
{
    const uint32_t now = now_us(robot);
    while (now - robot->millisecond_us >= 1000u) {     /* no division: it costs an AVR 70 bytes and 600 cycles */
        robot->millisecond_us += 1000u;
        robot->uptime_ms++;
    }
    if (now - robot->heartbeat_us >= SCEANN_HEARTBEAT_US) {
        robot->heartbeat_us = now;
        sceann_send_heartbeat(robot);
    }
}

/* ---- the loop ---------------------------------------------------------------------------------------------------- */

void sceann_robot_start(sceann_robot *robot, const sceann_port *port)
{
    port->safe(port->board);
    memset(robot, 0, sizeof *robot);
    robot->port = port;
    robot->state = SCEANN_BOOT;
    robot->arithmetic_id = sceann_arithmetic_id();
    robot->millisecond_us = robot->heartbeat_us = port->clock_us(port->board);
    sceann_store_open(&robot->store, port);
    if (robot->store.slot != SCEANN_NO_SLOT) {
        sceann_store_get_genome(&robot->store, port, robot->upload.record);
        sceann_controller_decode(&robot->controller, robot->upload.record);
        robot->upload.committed = true;
        robot->has_network = true;
    }
    robot->autorun_possible = true;
    sceann_send_event(robot, EVENT(BOOT), port->reset_cause);
    sceann_enter(robot, sceann_rest(robot));
}

void sceann_robot_poll(sceann_robot *robot)
{
    check_alarms(robot);
    receive(robot);
    check_host(robot);
    if (drives(robot)) {
        timed_tick(robot);
    }
    check_autorun(robot);
    keep_time(robot);
}

uint32_t sceann_robot_idle_us(const sceann_robot *robot)
{
    if (!drives(robot)) {
        return IDLE_US;
    }
    const uint32_t now = now_us(robot);
    const uint32_t left = robot->trial.due_us - now;
    return passed(now, robot->trial.due_us) ? 0u : left < IDLE_US ? left : IDLE_US;
}
