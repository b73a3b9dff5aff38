/*
 * What the robot's source files tell each other, upwards only: sceann_robot.c (the loop, deadlines, alarms) calls
 * sceann_command.c (requests), both call sceann_trial.c (states and trials), and all call sceann_telemetry.c (messages
 * out). Not for users.
 */
#ifndef SCEANN_INTERNAL_H
#define SCEANN_INTERNAL_H

#include "sceann_link.h"
#include "sceann_robot.h"
#include "sceann_wire.h"

/* Message functions; identifier = function + node. */
#define FUNCTION(name) ((uint16_t)(SCEANN_LINK_##name##_FRAME_ID - 1u))

#define NO_PAGE 0xFFu

enum { TELEMETRY_SENSE = 1, TELEMETRY_DRIVE = 2, TELEMETRY_STATES = 4 };

/* ---- sceann_telemetry.c ------------------------------------------------------------------------------------------ */

void sceann_send_event(const sceann_robot *robot, uint8_t code, uint16_t argument);
void sceann_send_end(const sceann_robot *robot);
void sceann_send_heartbeat(const sceann_robot *robot);
void sceann_send_descriptor(const sceann_robot *robot);
void sceann_send_sense(const sceann_robot *robot, uint16_t tick);
void sceann_send_drive(sceann_robot *robot, uint16_t tick);    /* keeps the message in trial.last_drive */
void sceann_send_states(const sceann_robot *robot, uint16_t tick);
void sceann_unpack_sensors(const uint8_t *data, uint16_t *sensors);   /* one page of SENSE_IN */
void sceann_send_reply(const sceann_robot *robot, const uint8_t *data);

/* ---- sceann_trial.c ---------------------------------------------------------------------------------------------- */

static inline uint32_t sceann_now_us(const sceann_robot *robot)
{
    return robot->port->clock_us(robot->port->board);
}

/* Bits of sceann_kept. */
enum { KEPT_LATCHED = 1, KEPT_GUARDED = 2 };

bool sceann_kept_valid(const sceann_port *port);       /* it is ours, from before the reset */
bool sceann_kept_has(const sceann_port *port, uint8_t bit);
void sceann_keep(const sceann_port *port, uint8_t bit, bool on);

/* Changes the state and tells the host. */
void sceann_enter(sceann_robot *robot, sceann_state state);

/* The state that a robot at rest is in: LOADED with a network, else IDLE. */
sceann_state sceann_rest(const sceann_robot *robot);

/* The network in use has the body's numbers of sensors and motors. */
bool sceann_fits_body(const sceann_robot *robot);

/* Answers to this node number from now on. */
void sceann_set_node(sceann_robot *robot, uint8_t node);

/* Makes a checked record the network in use. */
void sceann_use(sceann_robot *robot, const uint8_t *record);

/* A trial that drives the robot's own motors runs. */
bool sceann_drives(const sceann_robot *robot);

/* Notes the trial that robot->trial describes as unfinished; false: the store does not take it. */
bool sceann_note_trial(sceann_robot *robot);

/* Starts the trial that robot->trial describes (id, max_ticks, mode, telemetry, period_us). */
void sceann_begin_trial(sceann_robot *robot);

/* Motors safe, then: records and reports the end of the trial, if one runs, and enters `next`. */
void sceann_end_trial(sceann_robot *robot, uint8_t reason, sceann_state next);

/* Runs the stored network without a host. */
void sceann_autorun(sceann_robot *robot);

void sceann_timed_tick(sceann_robot *robot);
void sceann_on_drive_in(sceann_robot *robot, const sceann_message *message);
void sceann_on_sense_in(sceann_robot *robot, const sceann_message *message, bool second_page);

/* ---- sceann_command.c -------------------------------------------------------------------------------------------- */

void sceann_on_command(sceann_robot *robot, const uint8_t *data);
void sceann_on_genome(sceann_robot *robot, const uint8_t *data);

#endif
