/*
 * SCEANN firmware: one header for everything. A board's main file needs sceann_robot.h (which brings the port with it);
 * a sketch that only runs an exported controller needs none of this, only the exported header.
 */
#ifndef SCEANN_H
#define SCEANN_H

#include "sceann_controller.h"
#include "sceann_crc.h"
#include "sceann_frame.h"
#include "sceann_port.h"
#include "sceann_robot.h"
#include "sceann_store.h"

#endif
