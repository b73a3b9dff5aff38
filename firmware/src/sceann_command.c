#include "sceann_internal.h"

#include "sceann_crc.h"

#include <string.h>

#define STATUS(name) SCEANN_LINK_REPLY_STATUS_##name##_CHOICE
#define OP(name) SCEANN_LINK_COMMAND_OP_##name##_CHOICE
#define CHUNK_BYTES 7u

typedef struct sceann_link_command_t command_t;
typedef struct sceann_link_reply_t reply_t;

static bool at_rest(const sceann_robot *robot)
{
    return robot->state == SCEANN_IDLE || robot->state == SCEANN_LOADED;
}

/* ---- who is in charge -------------------------------------------------------------------------------------------- */

static uint8_t hello(sceann_robot *robot, const command_t *command, reply_t *reply)
{
    const uint32_t now = robot->port->clock_us(robot->port->board);
    uint8_t status = STATUS(OK);
    if (command->link_version != SCEANN_LINK_VERSION) {
        status = STATUS(LINK_VERSION);
    } else if (command->arithmetic_id != robot->arithmetic_id) {
        status = STATUS(ARITHMETIC);
    } else if (command->session == 0u) {
        status = STATUS(BAD_ARGUMENT);
    } else if (robot->session != 0u && robot->session != command->session &&
               now - robot->host_us < SCEANN_SESSION_US) {
        status = STATUS(OTHER_HOST);
    } else {
        if (robot->state == SCEANN_RUNNING && robot->session != command->session) {
            sceann_end_trial(robot, SCEANN_LINK_END_REASON_STOPPED_CHOICE, sceann_rest(robot));
        }
        robot->session = command->session;
        robot->host_us = now;
        robot->autorun_possible = false;
    }
    reply->link_version = SCEANN_LINK_VERSION;
    reply->state = robot->state;
    reply->arithmetic_id = robot->arithmetic_id;
    return status;
}

/* ---- genome ------------------------------------------------------------------------------------------------------ */

static uint8_t chunks_of(const uint8_t *record)
{
    const uint8_t bytes = (uint8_t)(sceann_genome_record_size(record) - SCEANN_RECORD_HEADER);
    return (uint8_t)((uint8_t)(bytes + CHUNK_BYTES - 1u) / CHUNK_BYTES);
}

static uint8_t load(sceann_robot *robot, const uint8_t *data)
{
    sceann_upload *upload = &robot->upload;
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    uint8_t header[SCEANN_RECORD_HEADER] = { 0 };
    memcpy(header, &data[1], CHUNK_BYTES);     /* the command's arguments are the record's first bytes */
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

static uint8_t commit(sceann_robot *robot, const command_t *command, reply_t *reply)
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
            reply->missing_chunk = chunk;
            return STATUS(MISSING_CHUNK);
        }
    }
    if (command->initial_output > (uint16_t)SCEANN_ONE) {
        return STATUS(BAD_ARGUMENT);
    }
    upload->record[SCEANN_RECORD_HEADER - 2u] = (uint8_t)command->initial_output;
    upload->record[SCEANN_RECORD_HEADER - 1u] = (uint8_t)(command->initial_output >> 8);
    uint32_t crc = SCEANN_CRC32_INIT;
    for (uint16_t k = 0; k < sceann_genome_record_size(upload->record); k++) {
        crc = sceann_crc32(crc, upload->record[k]);
    }
    if (~crc != command->genome_crc) {
        reply->crc = ~crc;
        return STATUS(BAD_CRC);
    }
    sceann_controller_decode(&robot->controller, upload->record);
    upload->committed = true;
    robot->has_network = true;
    robot->trial.answered = false;     /* no DRIVE of the old network may be repeated */
    reply->crc = sceann_controller_weights_crc(&robot->controller);
    sceann_enter(robot, SCEANN_LOADED);
    return STATUS(OK);
}

static uint8_t keep(sceann_robot *robot, const command_t *command, reply_t *reply)
{
    const sceann_port *port = robot->port;
    const bool autorun = command->store_action == SCEANN_LINK_COMMAND_STORE_ACTION_AUTORUN_CHOICE;
    if (!at_rest(robot)) {
        return STATUS(BAD_STATE);
    }
    if ((port->capabilities & SCEANN_HAS_STORE) == 0u ||
        (autorun && (port->capabilities & SCEANN_HAS_AUTORUN) == 0u)) {
        return STATUS(UNSUPPORTED);
    }
    if (command->store_action == SCEANN_LINK_COMMAND_STORE_ACTION_ERASE_CHOICE) {
        return sceann_store_erase(&robot->store, port) ? STATUS(OK) : STATUS(STORE_FAILED);
    }
    if (command->store_action > SCEANN_LINK_COMMAND_STORE_ACTION_AUTORUN_CHOICE ||
        (autorun && (command->autorun_tick_period < port->tick_min || command->autorun_tick_period > port->tick_max))) {
        return STATUS(BAD_ARGUMENT);
    }
    if (!robot->upload.committed) {
        return STATUS(NO_GENOME);
    }
    const sceann_controller *c = &robot->controller;
    if (autorun && (c->n_sensors != port->n_sensors || c->n_motors != port->n_motors)) {
        return STATUS(WRONG_SIZE);
    }
    if (!sceann_store_put_genome(&robot->store, port, robot->upload.record,
                                 autorun ? command->autorun_tick_period : 0u)) {
        return STATUS(STORE_FAILED);
    }
    reply->stored_crc = robot->store.genome_crc;
    return STATUS(OK);
}

/* ---- trials ------------------------------------------------------------------------------------------------------ */

static bool alarmed(const sceann_robot *robot)
{
    const uint16_t lasting = SCEANN_ALARM_ESTOP | SCEANN_ALARM_BUMPER | SCEANN_ALARM_BATTERY | SCEANN_ALARM_FAULT;
    return (robot->port->alarms(robot->port->board) & lasting) != 0u;
}

static uint8_t arm(sceann_robot *robot)
{
    if (!at_rest(robot) && robot->state != SCEANN_ARMED) {
        return STATUS(BAD_STATE);
    }
    if (alarmed(robot)) {
        return STATUS(ALARM);
    }
    robot->host_us = robot->port->clock_us(robot->port->board);
    sceann_enter(robot, SCEANN_ARMED);
    return STATUS(OK);
}

/* What forbids this trial, or OK. */
static uint8_t trial_status(const sceann_robot *robot, const command_t *command)
{
    const sceann_port *port = robot->port;
    const sceann_controller *c = &robot->controller;
    const bool hil = command->mode == SCEANN_LINK_COMMAND_MODE_HIL_CHOICE;
    if (command->trial_id == 0u || command->max_ticks == 0u || command->mode > SCEANN_LINK_COMMAND_MODE_HIL_CHOICE ||
        (!hil && (command->tick_period < port->tick_min || command->tick_period > port->tick_max))) {
        return STATUS(BAD_ARGUMENT);
    }
    if ((port->capabilities & (hil ? SCEANN_HAS_HIL : SCEANN_HAS_BODY)) == 0u) {
        return STATUS(UNSUPPORTED);
    }
    if (command->mode != SCEANN_LINK_COMMAND_MODE_TETHERED_CHOICE && !robot->has_network) {
        return STATUS(NO_GENOME);
    }
    if (command->mode == SCEANN_LINK_COMMAND_MODE_ONBOARD_CHOICE &&
        (c->n_sensors != port->n_sensors || c->n_motors != port->n_motors)) {
        return STATUS(WRONG_SIZE);
    }
    return alarmed(robot) ? STATUS(ALARM) : STATUS(OK);
}

static uint8_t start(sceann_robot *robot, const command_t *command, reply_t *reply)
{
    sceann_trial *trial = &robot->trial;
    reply->trial_id = command->trial_id;
    if (robot->state == SCEANN_RUNNING) {
        const bool repeated = trial->id != 0u && trial->id == command->trial_id;
        return (uint8_t)(repeated ? STATUS(OK) : STATUS(BAD_STATE));
    }
    if (command->trial_id != 0u && command->trial_id == robot->store.last.id) {
        return STATUS(ALREADY_RUN);
    }
    if (robot->state != SCEANN_ARMED) {
        return STATUS(BAD_STATE);
    }
    const uint8_t status = trial_status(robot, command);
    if (status == STATUS(OK)) {
        memset(trial, 0, sizeof *trial);
        trial->id = command->trial_id;
        trial->max_ticks = command->max_ticks;
        trial->mode = command->mode;
        trial->telemetry = command->telemetry;
        trial->period_us = command->tick_period * (uint32_t)100u;
    }
    return status;
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
        sceann_enter(robot, sceann_rest(robot));
    }
    return STATUS(OK);
}

/* ---- dispatch ---------------------------------------------------------------------------------------------------- */

void sceann_on_command(sceann_robot *robot, const uint8_t *data)
{
    command_t command;
    reply_t reply;
    memset(&command, 0, sizeof command);
    memset(&reply, 0, sizeof reply);
    (void)sceann_link_command_unpack(&command, data, SCEANN_LINK_COMMAND_LENGTH);
    reply.op = command.op;
    reply.sequence = command.sequence;

    const bool needs_session = command.op != OP(HELLO) && command.op != OP(STOP) && command.op != OP(LAST);
    if (needs_session && robot->session == 0u) {
        reply.status = STATUS(NO_SESSION);
        sceann_send_reply(robot, &reply);
        return;
    }
    switch (command.op) {
    case OP(HELLO):
        reply.status = hello(robot, &command, &reply);
        break;
    case OP(LOAD):
        reply.status = load(robot, data);
        break;
    case OP(COMMIT):
        reply.status = commit(robot, &command, &reply);
        break;
    case OP(ARM):
        reply.status = arm(robot);
        break;
    case OP(START): {
        const bool armed = robot->state == SCEANN_ARMED;
        reply.status = start(robot, &command, &reply);
        if (armed && reply.status == STATUS(OK)) {
            sceann_send_reply(robot, &reply);
            sceann_begin_trial(robot);
            return;
        }
        break;
    }
    case OP(STOP):
        reply.status = stop(robot);
        break;
    case OP(CLEAR):
        reply.status = clear(robot);
        break;
    case OP(STORE):
        reply.status = keep(robot, &command, &reply);
        break;
    case OP(LAST):
        reply.last_trial_id = robot->store.last.id;
        reply.last_reason = robot->store.last.reason;
        sceann_send_end(robot);
        break;
    case OP(STORED):
        reply.stored_genome_crc = robot->store.genome_crc;
        reply.bits = robot->store.bits;
        reply.status = robot->store.slot == SCEANN_NO_SLOT ? STATUS(NO_GENOME) : STATUS(OK);
        break;
    default:
        reply.status = STATUS(UNKNOWN_OP);
        break;
    }
    sceann_send_reply(robot, &reply);
    if (command.op == OP(HELLO)) {
        sceann_send_descriptor(robot);
    }
}
