#include "sceann_internal.h"

#include <string.h>

#define DESCRIPTOR_PAGES 7u
#define DESCRIPTOR_BYTES 7u            /* of a page, behind its number */

static void send(const sceann_robot *robot, uint16_t function, const uint8_t *data, uint8_t length)
{
    sceann_message message;
    message.id = (uint16_t)(function + robot->node);
    message.length = length;
    memcpy(message.data, data, length);
    robot->port->send(robot->port->board, &message);
}

void sceann_send_event(const sceann_robot *robot, uint8_t code, uint16_t argument)
{
    uint8_t data[SCEANN_LINK_EVENT_LENGTH] = { code, robot->state };
    sceann_put16(&data[2], robot->trial.tick);
    sceann_put16(&data[4], argument);
    sceann_put16(&data[6], robot->trial.id);
    send(robot, FUNCTION(EVENT), data, sizeof data);
}

void sceann_send_end(const sceann_robot *robot)
{
    const sceann_last_trial *last = &robot->store.last;
    uint8_t data[SCEANN_LINK_END_LENGTH];
    sceann_put16(&data[0], last->id);
    data[2] = last->reason;
    sceann_put16(&data[3], last->ticks);
    sceann_put16(&data[5], last->state_hash);
    send(robot, FUNCTION(END), data, sizeof data);
}

void sceann_send_heartbeat(const sceann_robot *robot)
{
    uint8_t data[SCEANN_LINK_HEARTBEAT_LENGTH];
    data[0] = robot->state;
    sceann_put32(&data[1], robot->uptime_ms);
    sceann_put16(&data[5], robot->port->battery_mv(robot->port->board));
    data[7] = robot->receive_errors;
    send(robot, FUNCTION(HEARTBEAT), data, sizeof data);
}

/* The seven bytes of a descriptor page. */
static void descriptor_page(const sceann_robot *robot, uint8_t page, uint8_t *p)
{
    const sceann_port *port = robot->port;
    switch (page) {
    case 0:
        p[0] = SCEANN_LINK_VERSION;
        p[1] = port->n_sensors;
        p[2] = port->n_motors;
        sceann_put32(&p[3], robot->arithmetic_id);
        break;
    case 1:
        p[0] = SCEANN_FIRMWARE_MAJOR;
        p[1] = SCEANN_FIRMWARE_MINOR;
        p[2] = SCEANN_FIRMWARE_PATCH;
        sceann_put16(&p[3], port->capabilities);
        p[5] = robot->node;
        p[6] = DESCRIPTOR_PAGES;
        break;
    case 2:
        p[0] = SCEANN_MAX_SENSORS;
        p[1] = SCEANN_MAX_MOTORS;
        p[2] = SCEANN_MAX_SOURCES;
        sceann_put16(&p[3], port->tick_min);
        sceann_put16(&p[5], port->tick_max);
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

/* Sensor k of a page stands in bits 10k..10k+9, as in the DBC. */
void sceann_unpack_sensors(const uint8_t *data, uint16_t *sensors)
{
    for (uint8_t k = 0; k < SCEANN_SENSORS_PER_PAGE; k++) {
        const uint8_t bit = (uint8_t)(10u * k);
        const uint8_t *p = &data[bit >> 3];
        sensors[k] = (uint16_t)((uint16_t)(p[0] | (uint16_t)((uint16_t)p[1] << 8)) >> (bit & 7u)) & 1023u;
    }
}

static void send_sense_page(const sceann_robot *robot, uint16_t function, const uint16_t *sensors, uint16_t tick)
{
    uint8_t data[SCEANN_LINK_SENSE_LENGTH] = { 0 };
    for (uint8_t k = 0; k < SCEANN_SENSORS_PER_PAGE; k++) {
        const uint8_t bit = (uint8_t)(10u * k);
        const uint16_t bits = (uint16_t)(sensors[k] << (bit & 7u));
        uint8_t *p = &data[bit >> 3];
        p[0] = (uint8_t)(p[0] | (uint8_t)bits);
        p[1] = (uint8_t)(bits >> 8);
    }
    data[7] = (uint8_t)(data[7] | (uint8_t)(tick << 4));
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
    sceann_message *message = &robot->trial.last_drive;
    message->id = (uint16_t)(FUNCTION(DRIVE) + robot->node);
    message->length = SCEANN_LINK_DRIVE_LENGTH;
    memset(message->data, 0, sizeof message->data);
    message->data[0] = (uint8_t)tick;
    message->data[1] = (uint8_t)c->state_hash;
    for (uint8_t k = 0; k < c->n_motors; k++) {
        sceann_put16(&message->data[2u + 2u * k], (uint16_t)motors[k]);
    }
    robot->port->send(robot->port->board, message);
}

void sceann_send_states(const sceann_robot *robot, uint16_t tick)
{
    const sceann_controller *c = &robot->controller;
    for (uint8_t i = 0; i < c->n_neurons; i = (uint8_t)(i + 3u)) {
        uint8_t data[SCEANN_LINK_NEURON_STATES_LENGTH] = { i, (uint8_t)tick };
        for (uint8_t k = 0; k < 3u && i + k < c->n_neurons; k++) {
            sceann_put16(&data[2u + 2u * k], (uint16_t)c->u[i + k]);
        }
        send(robot, FUNCTION(NEURON_STATES), data, sizeof data);
    }
}

void sceann_send_reply(const sceann_robot *robot, const uint8_t *data)
{
    send(robot, FUNCTION(REPLY), data, SCEANN_LINK_REPLY_LENGTH);
}
