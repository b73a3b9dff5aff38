/*
 * What the robot's source files tell each other: sceann_robot.c (states, ticks, deadlines), sceann_command.c (requests)
 * and sceann_telemetry.c (messages out). Not for users.
 */
#ifndef SCEANN_INTERNAL_H
#define SCEANN_INTERNAL_H

#include "sceann_link.h"
#include "sceann_robot.h"

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
void sceann_send_reply(const sceann_robot *robot, const struct sceann_link_reply_t *reply);

/* ---- sceann_command.c -------------------------------------------------------------------------------------------- */

void sceann_on_command(sceann_robot *robot, const uint8_t *data);
void sceann_on_genome(sceann_robot *robot, const uint8_t *data);

/* ---- sceann_robot.c ---------------------------------------------------------------------------------------------- */

/* Changes the state and tells the host. */
void sceann_enter(sceann_robot *robot, sceann_state state);

/* The state that a robot at rest is in: LOADED with a network, else IDLE. */
sceann_state sceann_rest(const sceann_robot *robot);

/* Starts the trial that robot->trial describes (id, max_ticks, mode, telemetry, period_us). */
void sceann_begin_trial(sceann_robot *robot);

/* Motors safe, then: records and reports the end of the trial, if one runs, and enters `next`. */
void sceann_end_trial(sceann_robot *robot, uint8_t reason, sceann_state next);

#endif
