#include "sceann_internal.h"

#include <string.h>

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

/* Up to `n` characters of the name from `at` on as a little-endian number, filled up with zeros. */
static uint32_t characters(const char *name, uint8_t at, uint8_t n)
{
    const size_t length = strlen(name);
    uint32_t value = 0;
    for (uint8_t k = n; k > 0u; k--) {
        const size_t from = (size_t)at + k - 1u;
        value = value << 8 | (from < length ? (uint8_t)name[from] : 0u);
    }
    return value;
}

void sceann_send_descriptor(const sceann_robot *robot)
{
    const sceann_port *port = robot->port;
    struct sceann_link_descriptor_t page;
    memset(&page, 0, sizeof page);
    page.link_version = SCEANN_LINK_VERSION;
    page.sensors = port->n_sensors;
    page.motors = port->n_motors;
    page.arithmetic_id = robot->arithmetic_id;
    page.firmware_major = SCEANN_FIRMWARE_MAJOR;
    page.firmware_minor = SCEANN_FIRMWARE_MINOR;
    page.firmware_patch = SCEANN_FIRMWARE_PATCH;
    page.capabilities = port->capabilities;
    page.node = port->node;
    page.pages = 7;
    page.max_sensors = SCEANN_MAX_SENSORS;
    page.max_motors = SCEANN_MAX_MOTORS;
    page.max_sources = SCEANN_MAX_SOURCES;
    page.tick_period_min = port->tick_min;
    page.tick_period_max = port->tick_max;
    page.unique_id_low = port->unique_id_low;
    page.unique_id_high = port->unique_id_high;
    page.name0 = characters(port->name, 0, 4);
    page.name4 = characters(port->name, 4, 3);
    page.name7 = characters(port->name, 7, 4);
    page.name11 = characters(port->name, 11, 3);
    page.name14 = characters(port->name, 14, 4);
    page.name18 = characters(port->name, 18, 3);
    for (page.page = 0; page.page < page.pages; page.page++) {
        uint8_t data[SCEANN_LINK_DESCRIPTOR_LENGTH];
        (void)sceann_link_descriptor_pack(data, &page, sizeof data);
        send(robot, FUNCTION(DESCRIPTOR), data, sizeof data);
    }
}

void sceann_send_sense(const sceann_robot *robot, uint16_t tick)
{
    const uint16_t *s = robot->trial.sensors;
    uint8_t data[SCEANN_LINK_SENSE_LENGTH];
    const struct sceann_link_sense_t first = { .sensor0 = s[0], .sensor1 = s[1], .sensor2 = s[2], .sensor3 = s[3],
                                               .sensor4 = s[4], .sensor5 = s[5], .tick = (uint8_t)(tick & 15u) };
    (void)sceann_link_sense_pack(data, &first, sizeof data);
    send(robot, FUNCTION(SENSE), data, sizeof data);
    if (robot->port->n_sensors > 6u) {
        const struct sceann_link_sense_page2_t second = { .sensor6 = s[6],   .sensor7 = s[7],
                                                          .sensor8 = s[8],   .sensor9 = s[9],
                                                          .sensor10 = s[10], .sensor11 = s[11],
                                                          .tick = (uint8_t)(tick & 15u) };
        (void)sceann_link_sense_page2_pack(data, &second, sizeof data);
        send(robot, FUNCTION(SENSE_PAGE2), data, sizeof data);
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
