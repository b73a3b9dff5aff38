#include "sceann_internal.h"

#include "sceann_crc.h"

#include <string.h>

#define STATUS(name) SCEANN_LINK_REPLY_STATUS_##name##_CHOICE
#define OP(name) SCEANN_LINK_COMMAND_OP_##name##_CHOICE
#define CHUNK_BYTES SCEANN_CHUNK_BYTES

/* A command's arguments begin at byte 1, the session stands in bytes 6 and 7; what a reply tells begins at byte 2. */
#define AT_SESSION 6u

static bool at_rest(const sceann_robot *robot)
{
    return robot->state == SCEANN_IDLE || robot->state == SCEANN_LOADED;
}

/* ---- who is in charge -------------------------------------------------------------------------------------------- */

static uint8_t hello(sceann_robot *robot, const uint8_t *command, uint8_t *reply)
{
    uint8_t status = STATUS(OK);
    const uint16_t session = sceann_get16(&command[AT_SESSION]);
    if (command[1] != SCEANN_LINK_VERSION) {
        status = STATUS(LINK_VERSION);
    } else if (sceann_get32(&command[2]) != robot->arithmetic_id) {
        status = STATUS(ARITHMETIC);
    } else if (session == 0u) {
        status = STATUS(BAD_ARGUMENT);
    } else if (robot->session != 0u && robot->session != session && !robot->host_silent) {
        status = STATUS(OTHER_HOST);
    } else {
        const bool by_itself = robot->state == SCEANN_RUNNING && robot->trial.id == 0u;
        const bool taken_over = robot->session != session;
        if (by_itself || (taken_over && (robot->state == SCEANN_RUNNING || robot->state == SCEANN_ARMED))) {
            sceann_end_trial(robot, SCEANN_LINK_END_REASON_STOPPED_CHOICE, sceann_rest(robot));
        }
        robot->session = session;
        robot->host_us = robot->port->clock_us(robot->port->board);
        robot->host_silent = false;
        robot->autorun_possible = false;
    }
    reply[2] = SCEANN_LINK_VERSION;
    reply[3] = robot->state;
    sceann_put32(&reply[4], robot->arithmetic_id);
    return status;
}

/* ---- genome ------------------------------------------------------------------------------------------------------ */

static uint8_t chunks_of(const uint8_t *record)
{
    const uint8_t bytes = (uint8_t)(sceann_genome_record_size(record) - SCEANN_RECORD_HEADER);
    return (uint8_t)((uint8_t)(bytes + CHUNK_BYTES - 1u) / CHUNK_BYTES);
}

static uint8_t load(sceann_robot *robot, const uint8_t *command)
{
    sceann_upload *upload = &robot->upload;
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    uint8_t header[SCEANN_RECORD_HEADER] = { command[1] & 15u, command[1] >> 4, command[2] & 15u, command[3],
                                             command[2] >> 4 };
    sceann_put16(&header[5], sceann_genome_bits(header));
    memcpy(&header[7], &command[4], 2);        /* initial output */
    switch (sceann_genome_check(header)) {
    case SCEANN_GENOME_BAD:
        return STATUS(BAD_ARGUMENT);
    case SCEANN_GENOME_TOO_LARGE:
        return STATUS(TOO_LARGE);
    case SCEANN_GENOME_OK:
        break;
    }
    memset(upload, 0, sizeof *upload);
    memcpy(upload->record, header, sizeof header);
    upload->begun = true;
    return STATUS(OK);
}

void sceann_on_genome(sceann_robot *robot, const uint8_t *data)
{
    sceann_upload *upload = &robot->upload;
    const uint8_t chunk = data[0];
    if (!upload->begun || upload->committed || chunk >= chunks_of(upload->record)) {
        return;                        /* COMMIT will tell what is missing */
    }
    const uint16_t at = (uint16_t)(SCEANN_RECORD_HEADER + chunk * CHUNK_BYTES);
    const uint16_t left = (uint16_t)(sceann_genome_record_size(upload->record) - at);
    memcpy(&upload->record[at], &data[1], left < CHUNK_BYTES ? left : CHUNK_BYTES);
    upload->chunks |= (uint32_t)1 << chunk;
}

static uint8_t commit(sceann_robot *robot, const uint8_t *command, uint8_t *reply)
{
    sceann_upload *upload = &robot->upload;
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    if (!upload->begun) {
        return STATUS(NO_GENOME);
    }
    for (uint8_t chunk = 0; chunk < chunks_of(upload->record); chunk++) {
        if ((upload->chunks >> chunk & 1u) == 0u) {
            reply[6] = chunk;
            return STATUS(MISSING_CHUNK);
        }
    }
    uint32_t crc = SCEANN_CRC32_INIT;
    for (uint16_t k = 0; k < sceann_genome_record_size(upload->record); k++) {
        crc = sceann_crc32(crc, upload->record[k]);
    }
    if (~crc != sceann_get32(&command[1])) {
        sceann_put32(&reply[2], ~crc);
        return STATUS(BAD_CRC);
    }
    sceann_use(robot, upload->record);
    upload->committed = true;
    robot->trial.answered = false;     /* no DRIVE of the old network may be repeated */
    sceann_put32(&reply[2], sceann_controller_weights_crc(&robot->controller));
    sceann_enter(robot, SCEANN_LOADED);
    return STATUS(OK);
}

static uint8_t keep(sceann_robot *robot, const uint8_t *command, uint8_t *reply)
{
    const sceann_port *port = robot->port;
    const uint8_t action = command[1];
    const uint16_t wanted = sceann_get16(&command[2]);
    const bool button = action == SCEANN_LINK_COMMAND_STORE_ACTION_BUTTON_CHOICE;
    const bool autorun = button || action == SCEANN_LINK_COMMAND_STORE_ACTION_AUTORUN_CHOICE;
    const uint16_t needed = (uint16_t)(SCEANN_HAS_STORE | (autorun ? SCEANN_HAS_AUTORUN : 0u) |
                                       (button ? SCEANN_HAS_BUTTON : 0u));
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    if ((port->capabilities & needed) != needed) {
        return STATUS(UNSUPPORTED);
    }
    if (action == SCEANN_LINK_COMMAND_STORE_ACTION_ERASE_CHOICE) {
        return sceann_store_erase(&robot->store, port) ? STATUS(OK) : STATUS(STORE_FAILED);
    }
    if (action > SCEANN_LINK_COMMAND_STORE_ACTION_BUTTON_CHOICE ||
        (autorun && (wanted < port->tick_min || wanted > port->tick_max))) {
        return STATUS(BAD_ARGUMENT);
    }
    if (!robot->has_network) {
        return STATUS(NO_GENOME);
    }
    if (autorun && !sceann_fits_body(robot)) {
        return STATUS(WRONG_SIZE);
    }
    const uint16_t period = (uint16_t)(autorun ? wanted : 0u);
    if (!sceann_store_put_genome(&robot->store, port, robot->record,
                                 (uint16_t)(button ? period | SCEANN_BY_BUTTON : period))) {
        return STATUS(STORE_FAILED);
    }
    sceann_put32(&reply[2], robot->store.genome_crc);
    return STATUS(OK);
}

/* ---- trials ------------------------------------------------------------------------------------------------------ */

static bool alarmed(const sceann_robot *robot)
{
    const uint16_t lasting = SCEANN_ALARM_ESTOP | SCEANN_ALARM_BUMPER | SCEANN_ALARM_BATTERY | SCEANN_ALARM_FAULT;
    return (robot->port->alarms(robot->port->board) & lasting) != 0u;
}

static uint8_t arm(sceann_robot *robot, const uint8_t *command)
{
    if (!at_rest(robot) && robot->state != SCEANN_ARMED) {
        return STATUS(BAD_STATE);
    }
    if (alarmed(robot)) {
        return STATUS(ALARM);
    }
    robot->host_us = robot->port->clock_us(robot->port->board);
    robot->armed_period = sceann_get16(&command[1]);
    sceann_enter(robot, SCEANN_ARMED);
    return STATUS(OK);
}

/* What forbids this trial, or OK. */
static uint8_t trial_status(const sceann_robot *robot, uint16_t id, uint16_t max_ticks, uint8_t mode)
{
    const sceann_port *port = robot->port;
    const uint16_t period = robot->armed_period;
    const bool hil = mode == SCEANN_HIL;
    if (id == 0u || max_ticks == 0u || mode > SCEANN_HIL ||
        (!hil && (period < port->tick_min || period > port->tick_max))) {
        return STATUS(BAD_ARGUMENT);
    }
    if ((port->capabilities & (hil ? SCEANN_HAS_HIL : SCEANN_HAS_BODY)) == 0u) {
        return STATUS(UNSUPPORTED);
    }
    if (mode != SCEANN_TETHERED && !robot->has_network) {
        return STATUS(NO_GENOME);
    }
    if (mode == SCEANN_ONBOARD && !sceann_fits_body(robot)) {
        return STATUS(WRONG_SIZE);
    }
    return alarmed(robot) ? STATUS(ALARM) : STATUS(OK);
}

static uint8_t start(sceann_robot *robot, const uint8_t *command, uint8_t *reply)
{
    sceann_trial *trial = &robot->trial;
    const uint16_t id = sceann_get16(&command[1]), max_ticks = sceann_get16(&command[3]);
    sceann_put16(&reply[2], id);
    if (robot->state == SCEANN_RUNNING) {
        const bool repeated = trial->id != 0u && trial->id == id;
        return (uint8_t)(repeated ? STATUS(OK) : STATUS(BAD_STATE));
    }
    if (id != 0u && id == robot->store.last.id) {
        return STATUS(ALREADY_RUN);
    }
    if (robot->state != SCEANN_ARMED) {
        return STATUS(BAD_STATE);
    }
    const uint8_t status = trial_status(robot, id, max_ticks, command[5] & 15u);
    if (status != STATUS(OK)) {
        return status;
    }
    memset(trial, 0, sizeof *trial);
    trial->id = id;
    trial->max_ticks = max_ticks;
    trial->mode = command[5] & 15u;
    trial->telemetry = command[5] >> 4;
    trial->period_us = robot->armed_period * (uint32_t)100u;
    /* nobody could tell later whether a trial ran that is not noted */
    return sceann_note_trial(robot) ? STATUS(OK) : STATUS(STORE_FAILED);
}

static uint8_t stop(sceann_robot *robot)
{
    robot->autorun_possible = false;
    if (robot->state == SCEANN_RUNNING) {
        sceann_end_trial(robot, SCEANN_LINK_END_REASON_STOPPED_CHOICE, sceann_rest(robot));
    } else if (robot->state == SCEANN_ARMED) {
        sceann_enter(robot, sceann_rest(robot));
    }
    return STATUS(OK);
}

static uint8_t clear(sceann_robot *robot)
{
    if (robot->state == SCEANN_SAFE || robot->state == SCEANN_ESTOP) {
        if ((robot->port->alarms(robot->port->board) & (SCEANN_ALARM_ESTOP | SCEANN_ALARM_FAULT)) != 0u) {
            return STATUS(ALARM);
        }
        sceann_keep(robot->port, KEPT_LATCHED, false);
        sceann_enter(robot, sceann_rest(robot));
    }
    return STATUS(OK);
}

/* Another node number, for good: the reply still comes from the old one. */
static uint8_t give_node(sceann_robot *robot, const uint8_t *command)
{
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    if (command[1] == 0u || command[1] > 127u) {
        return STATUS(BAD_ARGUMENT);
    }
    if ((robot->port->capabilities & SCEANN_HAS_STORE) == 0u) {
        return STATUS(UNSUPPORTED);
    }
    return sceann_store_put_node(&robot->store, robot->port, command[1]) ? STATUS(OK) : STATUS(STORE_FAILED);
}

/* ---- dispatch ---------------------------------------------------------------------------------------------------- */

static uint8_t act_on(sceann_robot *robot, uint8_t op, const uint8_t *command, uint8_t *reply)
{
    const bool needs_session = op != OP(HELLO) && op != OP(STOP) && op != OP(LAST);
    if (needs_session && (robot->session == 0u || sceann_get16(&command[AT_SESSION]) != robot->session)) {
        return STATUS(NO_SESSION);
    }
    switch (op) {
    case OP(HELLO):
        return hello(robot, command, reply);
    case OP(LOAD):
        return load(robot, command);
    case OP(COMMIT):
        return commit(robot, command, reply);
    case OP(ARM):
        return arm(robot, command);
    case OP(START):
        return start(robot, command, reply);
    case OP(STOP):
        return stop(robot);
    case OP(CLEAR):
        return clear(robot);
    case OP(STORE):
        return keep(robot, command, reply);
    case OP(LAST):
        sceann_put16(&reply[2], robot->store.last.id);
        reply[4] = robot->store.last.reason;
        sceann_send_end(robot);
        return STATUS(OK);
    case OP(STORED):
        sceann_put32(&reply[2], robot->store.genome_crc);
        sceann_put16(&reply[6], robot->store.bits);
        return robot->store.slot == SCEANN_NO_SLOT ? STATUS(NO_GENOME) : STATUS(OK);
    case OP(NODE):
        return give_node(robot, command);
    default:
        return STATUS(UNKNOWN_OP);
    }
}

void sceann_on_command(sceann_robot *robot, const uint8_t *command)
{
    uint8_t reply[SCEANN_LINK_REPLY_LENGTH] = { command[0] };
    const uint8_t op = command[0] & 15u;
    const bool armed = robot->state == SCEANN_ARMED;

    reply[1] = act_on(robot, op, command, reply);
    sceann_send_reply(robot, reply);
    if (op == OP(HELLO)) {
        sceann_send_descriptor(robot);
    } else if (reply[1] != STATUS(OK)) {
        return;
    } else if (op == OP(NODE)) {
        sceann_set_node(robot, command[1]);
    } else if (op == OP(START) && armed) {
        sceann_begin_trial(robot);
    }
}
