#include "sceann_internal.h"

#include <string.h>

#define DESCRIPTOR_PAGES 7u
#define DESCRIPTOR_BYTES 7u            /* of a page, behind its number */

static void send(const sceann_robot *robot, uint16_t function, const uint8_t *data, uint8_t length)
{
    sceann_message message;
    message.id = (uint16_t)(function + robot->port->node);
    message.length = length;
    memcpy(message.data, data, length);
    robot->port->send(robot->port->board, &message);
}

void sceann_send_event(const sceann_robot *robot, uint8_t code, uint16_t argument)
{
    const struct sceann_link_event_t event = { .code = code,
                                               .state = robot->state,
                                               .tick = robot->trial.tick,
                                               .argument = argument,
                                               .trial_id = robot->trial.id };
    uint8_t data[SCEANN_LINK_EVENT_LENGTH];
    (void)sceann_link_event_pack(data, &event, sizeof data);
    send(robot, FUNCTION(EVENT), data, sizeof data);
}

void sceann_send_end(const sceann_robot *robot)
{
    const sceann_last_trial *last = &robot->store.last;
    const struct sceann_link_end_t end = {
        .trial_id = last->id, .reason = last->reason, .ticks = last->ticks, .state_hash = last->state_hash
    };
    uint8_t data[SCEANN_LINK_END_LENGTH];
    (void)sceann_link_end_pack(data, &end, sizeof data);
    send(robot, FUNCTION(END), data, sizeof data);
}

void sceann_send_heartbeat(const sceann_robot *robot)
{
    const struct sceann_link_heartbeat_t heartbeat = { .state = robot->state,
                                                       .uptime = robot->uptime_ms,
                                                       .battery = robot->port->battery_mv(robot->port->board),
                                                       .receive_errors = robot->receive_errors };
    uint8_t data[SCEANN_LINK_HEARTBEAT_LENGTH];
    (void)sceann_link_heartbeat_pack(data, &heartbeat, sizeof data);
    send(robot, FUNCTION(HEARTBEAT), data, sizeof data);
}

static void put16(uint8_t *p, uint16_t value)
{
    p[0] = (uint8_t)value;
    p[1] = (uint8_t)(value >> 8);
}

/* The seven bytes of a descriptor page. Packed by hand, because most of them are bytes already: cantools' function for
 * this message would take a tenth of an ATmega328P's budget. */
static void descriptor_page(const sceann_robot *robot, uint8_t page, uint8_t *p)
{
    const sceann_port *port = robot->port;
    switch (page) {
    case 0:
        p[0] = SCEANN_LINK_VERSION;
        p[1] = port->n_sensors;
        p[2] = port->n_motors;
        put16(&p[3], (uint16_t)robot->arithmetic_id);
        put16(&p[5], (uint16_t)(robot->arithmetic_id >> 16));
        break;
    case 1:
        p[0] = SCEANN_FIRMWARE_MAJOR;
        p[1] = SCEANN_FIRMWARE_MINOR;
        p[2] = SCEANN_FIRMWARE_PATCH;
        put16(&p[3], port->capabilities);
        p[5] = port->node;
        p[6] = DESCRIPTOR_PAGES;
        break;
    case 2:
        p[0] = SCEANN_MAX_SENSORS;
        p[1] = SCEANN_MAX_MOTORS;
        p[2] = SCEANN_MAX_SOURCES;
        put16(&p[3], port->tick_min);
        put16(&p[5], port->tick_max);
        break;
    case 3:
        memcpy(p, port->unique_id, DESCRIPTOR_BYTES);
        break;
    default:
        memcpy(p, &port->name[DESCRIPTOR_BYTES * (page - 4u)], DESCRIPTOR_BYTES);
        break;
    }
}

void sceann_send_descriptor(const sceann_robot *robot)
{
    for (uint8_t page = 0; page < DESCRIPTOR_PAGES; page++) {
        uint8_t data[1u + DESCRIPTOR_BYTES];
        data[0] = page;
        descriptor_page(robot, page, &data[1]);
        send(robot, FUNCTION(DESCRIPTOR), data, sizeof data);
    }
}

/* Both pages have the same layout. */
static void send_sense_page(const sceann_robot *robot, uint16_t function, const uint16_t *s, uint16_t tick)
{
    const struct sceann_link_sense_t page = { .sensor0 = s[0], .sensor1 = s[1], .sensor2 = s[2], .sensor3 = s[3],
                                              .sensor4 = s[4], .sensor5 = s[5], .tick = (uint8_t)(tick & 15u) };
    uint8_t data[SCEANN_LINK_SENSE_LENGTH];
    (void)sceann_link_sense_pack(data, &page, sizeof data);
    send(robot, function, data, sizeof data);
}

void sceann_send_sense(const sceann_robot *robot, uint16_t tick)
{
    send_sense_page(robot, FUNCTION(SENSE), &robot->trial.sensors[0], tick);
    if (robot->port->n_sensors > 6u) {
        send_sense_page(robot, FUNCTION(SENSE_PAGE2), &robot->trial.sensors[6], tick);
    }
}

void sceann_send_drive(sceann_robot *robot, uint16_t tick)
{
    const sceann_controller *c = &robot->controller;
    const int16_t *motors = sceann_controller_motors(c);
    const struct sceann_link_drive_t drive = { .tick = (uint8_t)tick,
                                               .hash = (uint8_t)c->state_hash,
                                               .motor0 = (uint16_t)motors[0],
                                               .motor1 = c->n_motors > 1u ? (uint16_t)motors[1] : 0u,
                                               .motor2 = c->n_motors > 2u ? (uint16_t)motors[2] : 0u };
    sceann_message *message = &robot->trial.last_drive;
    message->id = (uint16_t)(FUNCTION(DRIVE) + robot->port->node);
    message->length = (uint8_t)(2u + 2u * c->n_motors);
    (void)sceann_link_drive_pack(message->data, &drive, sizeof message->data);
    robot->port->send(robot->port->board, message);
}

void sceann_send_states(const sceann_robot *robot, uint16_t tick)
{
    const sceann_controller *c = &robot->controller;
    for (uint8_t i = 0; i < c->n_neurons; i = (uint8_t)(i + 3u)) {
        const struct sceann_link_neuron_states_t states = { .first = i,
                                                            .tick = (uint8_t)tick,
                                                            .u0 = c->u[i],
                                                            .u1 = i + 1u < c->n_neurons ? c->u[i + 1u] : 0,
                                                            .u2 = i + 2u < c->n_neurons ? c->u[i + 2u] : 0 };
        uint8_t data[SCEANN_LINK_NEURON_STATES_LENGTH];
        (void)sceann_link_neuron_states_pack(data, &states, sizeof data);
        send(robot, FUNCTION(NEURON_STATES), data, sizeof data);
    }
}

void sceann_send_reply(const sceann_robot *robot, const struct sceann_link_reply_t *reply)
{
    uint8_t data[SCEANN_LINK_REPLY_LENGTH];
    (void)sceann_link_reply_pack(data, reply, sizeof data);
    send(robot, FUNCTION(REPLY), data, sizeof data);
}
