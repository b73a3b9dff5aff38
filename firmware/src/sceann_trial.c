#include "sceann_internal.h"

#include <string.h>

#define EVENT(name) SCEANN_LINK_EVENT_CODE_##name##_CHOICE
#define REASON(name) SCEANN_LINK_END_REASON_##name##_CHOICE

#define KEPT_FLAGS 0x5CE0u             /* with our two bits added */
#define KEPT_CHECK 0xA53Cu

static bool passed(uint32_t now, uint32_t due)
{
    return now - due < 0x80000000u;
}

/* ---- what survives a reset --------------------------------------------------------------------------------------- */

bool sceann_kept_valid(const sceann_port *port)
{
    const sceann_kept *kept = port->kept;
    return kept != NULL && (kept->flags & 0xFFFCu) == KEPT_FLAGS && (uint16_t)(kept->flags ^ kept->check) == KEPT_CHECK;
}

bool sceann_kept_has(const sceann_port *port, uint8_t bit)
{
    return sceann_kept_valid(port) && (port->kept->flags & bit) != 0u;
}

void sceann_keep(const sceann_port *port, uint8_t bit, bool on)
{
    if (port->kept != NULL) {
        const uint16_t flags = sceann_kept_valid(port) ? port->kept->flags : KEPT_FLAGS;
        port->kept->flags = (uint16_t)(on ? flags | bit : flags & (uint16_t)~bit);
        port->kept->check = (uint16_t)(port->kept->flags ^ KEPT_CHECK);
    }
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

bool sceann_fits_body(const sceann_robot *robot)
{
    return robot->has_network && robot->controller.n_sensors == robot->port->n_sensors &&
           robot->controller.n_motors == robot->port->n_motors;
}

void sceann_set_node(sceann_robot *robot, uint8_t node)
{
    robot->node = node;
    if (robot->port->listen != NULL) {
        robot->port->listen(robot->port->board, node);
    }
}

void sceann_use(sceann_robot *robot, const uint8_t *record)
{
    memcpy(robot->record, record, sizeof robot->record);
    sceann_controller_decode(&robot->controller, robot->record);
    robot->has_network = true;
}

/* ---- trials ------------------------------------------------------------------------------------------------------ */

bool sceann_drives(const sceann_robot *robot)
{
    return robot->state == SCEANN_RUNNING && robot->trial.mode != SCEANN_HIL;
}

bool sceann_note_trial(sceann_robot *robot)
{
    const sceann_last_trial before = robot->store.last;
    robot->store.last =
        (sceann_last_trial){ .id = robot->trial.id, .reason = REASON(UNFINISHED), .state_hash = 0xFFFFu };
    const bool kept = sceann_store_put_last(&robot->store, robot->port);
    if (!kept) {
        robot->store.last = before;    /* this trial does not run */
    }
    return kept;
}

void sceann_begin_trial(sceann_robot *robot)
{
    const sceann_port *port = robot->port;
    sceann_trial *trial = &robot->trial;

    trial->first_page_tick = NO_PAGE;
    if (trial->mode != SCEANN_TETHERED) {
        sceann_controller_reset(&robot->controller);
    }
    sceann_enter(robot, SCEANN_RUNNING);
    if (sceann_drives(robot)) {
        sceann_keep(port, KEPT_GUARDED, true);
        port->watchdog(port->board, SCEANN_WATCHDOG_ON);
    }
    trial->due_us = sceann_now_us(robot);
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
    sceann_keep(port, KEPT_GUARDED, false);
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
    if (!sceann_store_put_last(&robot->store, port)) {
        sceann_send_event(robot, EVENT(STORE_FAILED), last->id);
    }
}

void sceann_autorun(sceann_robot *robot)
{
    memset(&robot->trial, 0, sizeof robot->trial);
    robot->trial.mode = SCEANN_ONBOARD;
    robot->trial.period_us = (robot->store.autorun_period & 0x7FFFu) * (uint32_t)100u;
    sceann_begin_trial(robot);
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
void sceann_timed_tick(sceann_robot *robot)
{
    sceann_trial *trial = &robot->trial;
    const sceann_port *port = robot->port;
    const uint32_t now = sceann_now_us(robot);
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

void sceann_on_drive_in(sceann_robot *robot, const sceann_message *message)
{
    sceann_trial *trial = &robot->trial;
    const uint8_t *data = message->data;
    int16_t motors[SCEANN_MAX_MOTORS];
    if (robot->state != SCEANN_RUNNING || trial->mode != SCEANN_TETHERED || data[1] != (uint8_t)robot->session) {
        return;                        /* also from a host that is not in charge any more */
    }
    for (uint8_t k = 0; k < SCEANN_MAX_MOTORS; k++) {
        motors[k] = (int16_t)sceann_get16(&data[2u + 2u * k]);
        if (motors[k] < 0 || motors[k] > SCEANN_ONE) {
            return;
        }
    }
    if (trial->tick == 0u || data[0] != (uint8_t)(trial->tick - 1u)) {
        sceann_send_event(robot, EVENT(TICK_MISMATCH), data[0]);
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

void sceann_on_sense_in(sceann_robot *robot, const sceann_message *message, bool second_page)
{
    sceann_trial *trial = &robot->trial;
    const uint8_t tick_bits = message->data[7] >> 4;

    if (trial->mode != SCEANN_HIL || (robot->state != SCEANN_RUNNING && !trial->answered)) {
        return;
    }
    const bool two_pages = robot->controller.n_sensors > 6u;
    const bool expected = robot->state == SCEANN_RUNNING && tick_bits == (uint8_t)(trial->tick & 15u);
    if (!expected) {
        if (!answer_again(robot, tick_bits, second_page == two_pages) && robot->state == SCEANN_RUNNING) {
            sceann_send_event(robot, EVENT(TICK_MISMATCH), tick_bits);
        }
        return;
    }
    if (second_page && trial->first_page_tick != tick_bits) {
        return;                        /* its first page was lost: the host will send both again */
    }
    sceann_unpack_sensors(message->data, &trial->sensors[second_page ? SCEANN_SENSORS_PER_PAGE : 0u]);
    if (second_page == two_pages) {
        hil_step(robot);
    } else {
        trial->first_page_tick = tick_bits;
    }
}
