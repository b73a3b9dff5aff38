/*
 * sceann_link.h: the robot link's messages, generated from sceann.dbc by tools/generate_link with cantools. Do not edit.
 * What the messages mean is written in docs/link.md.
 *
 * @copyright Copyright (c) 2018-2019 Erik Moqvist
 *
 * @par License
 * The MIT License (MIT)
 *
 * Permission is hereby granted, free of charge, to any person
 * obtaining a copy of this software and associated documentation
 * files (the "Software"), to deal in the Software without
 * restriction, including without limitation the rights to use, copy,
 * modify, merge, publish, distribute, sublicense, and/or sell copies
 * of the Software, and to permit persons to whom the Software is
 * furnished to do so, subject to the following conditions:
 *
 * The above copyright notice and this permission notice shall be
 * included in all copies or substantial portions of the Software.
 *
 * THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND,
 * EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
 * MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
 * NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS
 * BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN
 * ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN
 * CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
 * SOFTWARE.
 */

#ifndef SCEANN_LINK_H
#define SCEANN_LINK_H

#ifdef __cplusplus
extern "C" {
#endif

#include <stdint.h>
#include <stdbool.h>
#include <stddef.h>

#ifndef EINVAL
#    define EINVAL 22
#endif

/* Frame ids. */
#define SCEANN_LINK_EVENT_FRAME_ID (0x81u)
#define SCEANN_LINK_END_FRAME_ID (0x101u)
#define SCEANN_LINK_SENSE_FRAME_ID (0x181u)
#define SCEANN_LINK_SENSE_PAGE2_FRAME_ID (0x581u)
#define SCEANN_LINK_SENSE_IN_FRAME_ID (0x201u)
#define SCEANN_LINK_SENSE_IN_PAGE2_FRAME_ID (0x601u)
#define SCEANN_LINK_DRIVE_FRAME_ID (0x281u)
#define SCEANN_LINK_DRIVE_IN_FRAME_ID (0x301u)
#define SCEANN_LINK_GENOME_FRAME_ID (0x381u)
#define SCEANN_LINK_COMMAND_FRAME_ID (0x401u)
#define SCEANN_LINK_REPLY_FRAME_ID (0x481u)
#define SCEANN_LINK_DESCRIPTOR_FRAME_ID (0x501u)
#define SCEANN_LINK_HOST_HEARTBEAT_FRAME_ID (0x681u)
#define SCEANN_LINK_HEARTBEAT_FRAME_ID (0x701u)
#define SCEANN_LINK_NEURON_STATES_FRAME_ID (0x781u)

/* Frame lengths in bytes. */
#define SCEANN_LINK_EVENT_LENGTH (8u)
#define SCEANN_LINK_END_LENGTH (7u)
#define SCEANN_LINK_SENSE_LENGTH (8u)
#define SCEANN_LINK_SENSE_PAGE2_LENGTH (8u)
#define SCEANN_LINK_SENSE_IN_LENGTH (8u)
#define SCEANN_LINK_SENSE_IN_PAGE2_LENGTH (8u)
#define SCEANN_LINK_DRIVE_LENGTH (8u)
#define SCEANN_LINK_DRIVE_IN_LENGTH (8u)
#define SCEANN_LINK_GENOME_LENGTH (8u)
#define SCEANN_LINK_COMMAND_LENGTH (8u)
#define SCEANN_LINK_REPLY_LENGTH (8u)
#define SCEANN_LINK_DESCRIPTOR_LENGTH (8u)
#define SCEANN_LINK_HOST_HEARTBEAT_LENGTH (5u)
#define SCEANN_LINK_HEARTBEAT_LENGTH (8u)
#define SCEANN_LINK_NEURON_STATES_LENGTH (8u)

/* Extended or standard frame types. */
#define SCEANN_LINK_EVENT_IS_EXTENDED (0)
#define SCEANN_LINK_END_IS_EXTENDED (0)
#define SCEANN_LINK_SENSE_IS_EXTENDED (0)
#define SCEANN_LINK_SENSE_PAGE2_IS_EXTENDED (0)
#define SCEANN_LINK_SENSE_IN_IS_EXTENDED (0)
#define SCEANN_LINK_SENSE_IN_PAGE2_IS_EXTENDED (0)
#define SCEANN_LINK_DRIVE_IS_EXTENDED (0)
#define SCEANN_LINK_DRIVE_IN_IS_EXTENDED (0)
#define SCEANN_LINK_GENOME_IS_EXTENDED (0)
#define SCEANN_LINK_COMMAND_IS_EXTENDED (0)
#define SCEANN_LINK_REPLY_IS_EXTENDED (0)
#define SCEANN_LINK_DESCRIPTOR_IS_EXTENDED (0)
#define SCEANN_LINK_HOST_HEARTBEAT_IS_EXTENDED (0)
#define SCEANN_LINK_HEARTBEAT_IS_EXTENDED (0)
#define SCEANN_LINK_NEURON_STATES_IS_EXTENDED (0)

/* Frame cycle times in milliseconds. */


/* Signal choices. */
#define SCEANN_LINK_EVENT_CODE_BOOT_CHOICE (1u)
#define SCEANN_LINK_EVENT_CODE_STATE_CHANGE_CHOICE (2u)
#define SCEANN_LINK_EVENT_CODE_OVERRUN_CHOICE (3u)
#define SCEANN_LINK_EVENT_CODE_BUMPER_CHOICE (4u)
#define SCEANN_LINK_EVENT_CODE_BATTERY_LOW_CHOICE (5u)
#define SCEANN_LINK_EVENT_CODE_FAULT_CHOICE (6u)
#define SCEANN_LINK_EVENT_CODE_TICK_MISMATCH_CHOICE (7u)

#define SCEANN_LINK_EVENT_STATE_BOOT_CHOICE (0u)
#define SCEANN_LINK_EVENT_STATE_IDLE_CHOICE (1u)
#define SCEANN_LINK_EVENT_STATE_LOADED_CHOICE (2u)
#define SCEANN_LINK_EVENT_STATE_ARMED_CHOICE (3u)
#define SCEANN_LINK_EVENT_STATE_RUNNING_CHOICE (4u)
#define SCEANN_LINK_EVENT_STATE_SAFE_CHOICE (5u)
#define SCEANN_LINK_EVENT_STATE_ESTOP_CHOICE (6u)

#define SCEANN_LINK_END_REASON_MAX_TICKS_CHOICE (0u)
#define SCEANN_LINK_END_REASON_LINK_LOST_CHOICE (16u)
#define SCEANN_LINK_END_REASON_BATTERY_LOW_CHOICE (17u)
#define SCEANN_LINK_END_REASON_FAULT_CHOICE (19u)
#define SCEANN_LINK_END_REASON_ESTOP_CHOICE (20u)
#define SCEANN_LINK_END_REASON_OVERRUN_CHOICE (21u)
#define SCEANN_LINK_END_REASON_STOPPED_CHOICE (32u)
#define SCEANN_LINK_END_REASON_BUMPER_CHOICE (33u)
#define SCEANN_LINK_END_REASON_UNFINISHED_CHOICE (255u)

#define SCEANN_LINK_COMMAND_OP_HELLO_CHOICE (1u)
#define SCEANN_LINK_COMMAND_OP_LOAD_CHOICE (2u)
#define SCEANN_LINK_COMMAND_OP_COMMIT_CHOICE (3u)
#define SCEANN_LINK_COMMAND_OP_ARM_CHOICE (4u)
#define SCEANN_LINK_COMMAND_OP_START_CHOICE (5u)
#define SCEANN_LINK_COMMAND_OP_STOP_CHOICE (6u)
#define SCEANN_LINK_COMMAND_OP_CLEAR_CHOICE (7u)
#define SCEANN_LINK_COMMAND_OP_STORE_CHOICE (8u)
#define SCEANN_LINK_COMMAND_OP_LAST_CHOICE (9u)
#define SCEANN_LINK_COMMAND_OP_STORED_CHOICE (10u)

#define SCEANN_LINK_COMMAND_CODING_SCEANN1_CHOICE (1u)
#define SCEANN_LINK_COMMAND_CODING_SCEANN2_CHOICE (2u)
#define SCEANN_LINK_COMMAND_CODING_SCEANN3_CHOICE (3u)

#define SCEANN_LINK_COMMAND_STORE_ACTION_ERASE_CHOICE (0u)
#define SCEANN_LINK_COMMAND_STORE_ACTION_KEEP_CHOICE (1u)
#define SCEANN_LINK_COMMAND_STORE_ACTION_AUTORUN_CHOICE (2u)

#define SCEANN_LINK_COMMAND_NEURON_ACCUMULATING_CHOICE (0u)
#define SCEANN_LINK_COMMAND_NEURON_MEMORYLESS_CHOICE (1u)

#define SCEANN_LINK_COMMAND_MODE_ONBOARD_CHOICE (0u)
#define SCEANN_LINK_COMMAND_MODE_TETHERED_CHOICE (1u)
#define SCEANN_LINK_COMMAND_MODE_HIL_CHOICE (2u)

#define SCEANN_LINK_REPLY_OP_HELLO_CHOICE (1u)
#define SCEANN_LINK_REPLY_OP_LOAD_CHOICE (2u)
#define SCEANN_LINK_REPLY_OP_COMMIT_CHOICE (3u)
#define SCEANN_LINK_REPLY_OP_ARM_CHOICE (4u)
#define SCEANN_LINK_REPLY_OP_START_CHOICE (5u)
#define SCEANN_LINK_REPLY_OP_STOP_CHOICE (6u)
#define SCEANN_LINK_REPLY_OP_CLEAR_CHOICE (7u)
#define SCEANN_LINK_REPLY_OP_STORE_CHOICE (8u)
#define SCEANN_LINK_REPLY_OP_LAST_CHOICE (9u)
#define SCEANN_LINK_REPLY_OP_STORED_CHOICE (10u)

#define SCEANN_LINK_REPLY_STATUS_OK_CHOICE (0u)
#define SCEANN_LINK_REPLY_STATUS_BAD_STATE_CHOICE (1u)
#define SCEANN_LINK_REPLY_STATUS_BAD_ARGUMENT_CHOICE (2u)
#define SCEANN_LINK_REPLY_STATUS_NO_SESSION_CHOICE (3u)
#define SCEANN_LINK_REPLY_STATUS_OTHER_HOST_CHOICE (4u)
#define SCEANN_LINK_REPLY_STATUS_LINK_VERSION_CHOICE (5u)
#define SCEANN_LINK_REPLY_STATUS_ARITHMETIC_CHOICE (6u)
#define SCEANN_LINK_REPLY_STATUS_TOO_LARGE_CHOICE (7u)
#define SCEANN_LINK_REPLY_STATUS_MISSING_CHUNK_CHOICE (8u)
#define SCEANN_LINK_REPLY_STATUS_BAD_CRC_CHOICE (9u)
#define SCEANN_LINK_REPLY_STATUS_NO_GENOME_CHOICE (10u)
#define SCEANN_LINK_REPLY_STATUS_WRONG_SIZE_CHOICE (11u)
#define SCEANN_LINK_REPLY_STATUS_ALREADY_RUN_CHOICE (12u)
#define SCEANN_LINK_REPLY_STATUS_STORE_FAILED_CHOICE (13u)
#define SCEANN_LINK_REPLY_STATUS_UNSUPPORTED_CHOICE (14u)
#define SCEANN_LINK_REPLY_STATUS_ALARM_CHOICE (15u)
#define SCEANN_LINK_REPLY_STATUS_UNKNOWN_OP_CHOICE (16u)

#define SCEANN_LINK_REPLY_STATE_BOOT_CHOICE (0u)
#define SCEANN_LINK_REPLY_STATE_IDLE_CHOICE (1u)
#define SCEANN_LINK_REPLY_STATE_LOADED_CHOICE (2u)
#define SCEANN_LINK_REPLY_STATE_ARMED_CHOICE (3u)
#define SCEANN_LINK_REPLY_STATE_RUNNING_CHOICE (4u)
#define SCEANN_LINK_REPLY_STATE_SAFE_CHOICE (5u)
#define SCEANN_LINK_REPLY_STATE_ESTOP_CHOICE (6u)

#define SCEANN_LINK_REPLY_LAST_REASON_MAX_TICKS_CHOICE (0u)
#define SCEANN_LINK_REPLY_LAST_REASON_LINK_LOST_CHOICE (16u)
#define SCEANN_LINK_REPLY_LAST_REASON_BATTERY_LOW_CHOICE (17u)
#define SCEANN_LINK_REPLY_LAST_REASON_FAULT_CHOICE (19u)
#define SCEANN_LINK_REPLY_LAST_REASON_ESTOP_CHOICE (20u)
#define SCEANN_LINK_REPLY_LAST_REASON_OVERRUN_CHOICE (21u)
#define SCEANN_LINK_REPLY_LAST_REASON_STOPPED_CHOICE (32u)
#define SCEANN_LINK_REPLY_LAST_REASON_BUMPER_CHOICE (33u)
#define SCEANN_LINK_REPLY_LAST_REASON_UNFINISHED_CHOICE (255u)

#define SCEANN_LINK_HOST_HEARTBEAT_HOST_STATE_IDLE_CHOICE (0u)
#define SCEANN_LINK_HOST_HEARTBEAT_HOST_STATE_TRIAL_CHOICE (1u)

#define SCEANN_LINK_HEARTBEAT_STATE_BOOT_CHOICE (0u)
#define SCEANN_LINK_HEARTBEAT_STATE_IDLE_CHOICE (1u)
#define SCEANN_LINK_HEARTBEAT_STATE_LOADED_CHOICE (2u)
#define SCEANN_LINK_HEARTBEAT_STATE_ARMED_CHOICE (3u)
#define SCEANN_LINK_HEARTBEAT_STATE_RUNNING_CHOICE (4u)
#define SCEANN_LINK_HEARTBEAT_STATE_SAFE_CHOICE (5u)
#define SCEANN_LINK_HEARTBEAT_STATE_ESTOP_CHOICE (6u)

/* Frame Names. */
#define SCEANN_LINK_EVENT_NAME "Event"
#define SCEANN_LINK_END_NAME "End"
#define SCEANN_LINK_SENSE_NAME "Sense"
#define SCEANN_LINK_SENSE_PAGE2_NAME "SensePage2"
#define SCEANN_LINK_SENSE_IN_NAME "SenseIn"
#define SCEANN_LINK_SENSE_IN_PAGE2_NAME "SenseInPage2"
#define SCEANN_LINK_DRIVE_NAME "Drive"
#define SCEANN_LINK_DRIVE_IN_NAME "DriveIn"
#define SCEANN_LINK_GENOME_NAME "Genome"
#define SCEANN_LINK_COMMAND_NAME "Command"
#define SCEANN_LINK_REPLY_NAME "Reply"
#define SCEANN_LINK_DESCRIPTOR_NAME "Descriptor"
#define SCEANN_LINK_HOST_HEARTBEAT_NAME "HostHeartbeat"
#define SCEANN_LINK_HEARTBEAT_NAME "Heartbeat"
#define SCEANN_LINK_NEURON_STATES_NAME "NeuronStates"

/* Signal Names. */
#define SCEANN_LINK_EVENT_CODE_NAME "Code"
#define SCEANN_LINK_EVENT_STATE_NAME "State"
#define SCEANN_LINK_EVENT_TICK_NAME "Tick"
#define SCEANN_LINK_EVENT_ARGUMENT_NAME "Argument"
#define SCEANN_LINK_EVENT_TRIAL_ID_NAME "TrialId"
#define SCEANN_LINK_END_TRIAL_ID_NAME "TrialId"
#define SCEANN_LINK_END_REASON_NAME "Reason"
#define SCEANN_LINK_END_TICKS_NAME "Ticks"
#define SCEANN_LINK_END_STATE_HASH_NAME "StateHash"
#define SCEANN_LINK_SENSE_SENSOR0_NAME "Sensor0"
#define SCEANN_LINK_SENSE_SENSOR1_NAME "Sensor1"
#define SCEANN_LINK_SENSE_SENSOR2_NAME "Sensor2"
#define SCEANN_LINK_SENSE_SENSOR3_NAME "Sensor3"
#define SCEANN_LINK_SENSE_SENSOR4_NAME "Sensor4"
#define SCEANN_LINK_SENSE_SENSOR5_NAME "Sensor5"
#define SCEANN_LINK_SENSE_TICK_NAME "Tick"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR6_NAME "Sensor6"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR7_NAME "Sensor7"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR8_NAME "Sensor8"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR9_NAME "Sensor9"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR10_NAME "Sensor10"
#define SCEANN_LINK_SENSE_PAGE2_SENSOR11_NAME "Sensor11"
#define SCEANN_LINK_SENSE_PAGE2_TICK_NAME "Tick"
#define SCEANN_LINK_SENSE_IN_SENSOR0_NAME "Sensor0"
#define SCEANN_LINK_SENSE_IN_SENSOR1_NAME "Sensor1"
#define SCEANN_LINK_SENSE_IN_SENSOR2_NAME "Sensor2"
#define SCEANN_LINK_SENSE_IN_SENSOR3_NAME "Sensor3"
#define SCEANN_LINK_SENSE_IN_SENSOR4_NAME "Sensor4"
#define SCEANN_LINK_SENSE_IN_SENSOR5_NAME "Sensor5"
#define SCEANN_LINK_SENSE_IN_TICK_NAME "Tick"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR6_NAME "Sensor6"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR7_NAME "Sensor7"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR8_NAME "Sensor8"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR9_NAME "Sensor9"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR10_NAME "Sensor10"
#define SCEANN_LINK_SENSE_IN_PAGE2_SENSOR11_NAME "Sensor11"
#define SCEANN_LINK_SENSE_IN_PAGE2_TICK_NAME "Tick"
#define SCEANN_LINK_DRIVE_TICK_NAME "Tick"
#define SCEANN_LINK_DRIVE_HASH_NAME "Hash"
#define SCEANN_LINK_DRIVE_MOTOR0_NAME "Motor0"
#define SCEANN_LINK_DRIVE_MOTOR1_NAME "Motor1"
#define SCEANN_LINK_DRIVE_MOTOR2_NAME "Motor2"
#define SCEANN_LINK_DRIVE_IN_TICK_NAME "Tick"
#define SCEANN_LINK_DRIVE_IN_HASH_NAME "Hash"
#define SCEANN_LINK_DRIVE_IN_MOTOR0_NAME "Motor0"
#define SCEANN_LINK_DRIVE_IN_MOTOR1_NAME "Motor1"
#define SCEANN_LINK_DRIVE_IN_MOTOR2_NAME "Motor2"
#define SCEANN_LINK_GENOME_CHUNK_NAME "Chunk"
#define SCEANN_LINK_GENOME_BYTE0_NAME "Byte0"
#define SCEANN_LINK_GENOME_BYTE1_NAME "Byte1"
#define SCEANN_LINK_GENOME_BYTE2_NAME "Byte2"
#define SCEANN_LINK_GENOME_BYTE3_NAME "Byte3"
#define SCEANN_LINK_GENOME_BYTE4_NAME "Byte4"
#define SCEANN_LINK_GENOME_BYTE5_NAME "Byte5"
#define SCEANN_LINK_GENOME_BYTE6_NAME "Byte6"
#define SCEANN_LINK_COMMAND_OP_NAME "Op"
#define SCEANN_LINK_COMMAND_SEQUENCE_NAME "Sequence"
#define SCEANN_LINK_COMMAND_LINK_VERSION_NAME "LinkVersion"
#define SCEANN_LINK_COMMAND_CODING_NAME "Coding"
#define SCEANN_LINK_COMMAND_GENOME_CRC_NAME "GenomeCrc"
#define SCEANN_LINK_COMMAND_TRIAL_ID_NAME "TrialId"
#define SCEANN_LINK_COMMAND_STORE_ACTION_NAME "StoreAction"
#define SCEANN_LINK_COMMAND_SESSION_NAME "Session"
#define SCEANN_LINK_COMMAND_NEURON_NAME "Neuron"
#define SCEANN_LINK_COMMAND_AUTORUN_TICK_PERIOD_NAME "AutorunTickPeriod"
#define SCEANN_LINK_COMMAND_SENSORS_NAME "Sensors"
#define SCEANN_LINK_COMMAND_MAX_TICKS_NAME "MaxTicks"
#define SCEANN_LINK_COMMAND_ARITHMETIC_ID_NAME "ArithmeticId"
#define SCEANN_LINK_COMMAND_HIDDEN_NAME "Hidden"
#define SCEANN_LINK_COMMAND_MOTORS_NAME "Motors"
#define SCEANN_LINK_COMMAND_INITIAL_OUTPUT_NAME "InitialOutput"
#define SCEANN_LINK_COMMAND_TICK_PERIOD_NAME "TickPeriod"
#define SCEANN_LINK_COMMAND_BITS_NAME "Bits"
#define SCEANN_LINK_COMMAND_MODE_NAME "Mode"
#define SCEANN_LINK_COMMAND_TELEMETRY_NAME "Telemetry"
#define SCEANN_LINK_REPLY_OP_NAME "Op"
#define SCEANN_LINK_REPLY_SEQUENCE_NAME "Sequence"
#define SCEANN_LINK_REPLY_STATUS_NAME "Status"
#define SCEANN_LINK_REPLY_LINK_VERSION_NAME "LinkVersion"
#define SCEANN_LINK_REPLY_CRC_NAME "Crc"
#define SCEANN_LINK_REPLY_TRIAL_ID_NAME "TrialId"
#define SCEANN_LINK_REPLY_STORED_CRC_NAME "StoredCrc"
#define SCEANN_LINK_REPLY_LAST_TRIAL_ID_NAME "LastTrialId"
#define SCEANN_LINK_REPLY_STORED_GENOME_CRC_NAME "StoredGenomeCrc"
#define SCEANN_LINK_REPLY_STATE_NAME "State"
#define SCEANN_LINK_REPLY_ARITHMETIC_ID_NAME "ArithmeticId"
#define SCEANN_LINK_REPLY_LAST_REASON_NAME "LastReason"
#define SCEANN_LINK_REPLY_MISSING_CHUNK_NAME "MissingChunk"
#define SCEANN_LINK_REPLY_BITS_NAME "Bits"
#define SCEANN_LINK_DESCRIPTOR_PAGE_NAME "Page"
#define SCEANN_LINK_DESCRIPTOR_LINK_VERSION_NAME "LinkVersion"
#define SCEANN_LINK_DESCRIPTOR_FIRMWARE_MAJOR_NAME "FirmwareMajor"
#define SCEANN_LINK_DESCRIPTOR_MAX_SENSORS_NAME "MaxSensors"
#define SCEANN_LINK_DESCRIPTOR_UNIQUE_ID_LOW_NAME "UniqueIdLow"
#define SCEANN_LINK_DESCRIPTOR_NAME0_NAME "Name0"
#define SCEANN_LINK_DESCRIPTOR_NAME7_NAME "Name7"
#define SCEANN_LINK_DESCRIPTOR_NAME14_NAME "Name14"
#define SCEANN_LINK_DESCRIPTOR_SENSORS_NAME "Sensors"
#define SCEANN_LINK_DESCRIPTOR_FIRMWARE_MINOR_NAME "FirmwareMinor"
#define SCEANN_LINK_DESCRIPTOR_MAX_MOTORS_NAME "MaxMotors"
#define SCEANN_LINK_DESCRIPTOR_MOTORS_NAME "Motors"
#define SCEANN_LINK_DESCRIPTOR_FIRMWARE_PATCH_NAME "FirmwarePatch"
#define SCEANN_LINK_DESCRIPTOR_MAX_SOURCES_NAME "MaxSources"
#define SCEANN_LINK_DESCRIPTOR_ARITHMETIC_ID_NAME "ArithmeticId"
#define SCEANN_LINK_DESCRIPTOR_CAPABILITIES_NAME "Capabilities"
#define SCEANN_LINK_DESCRIPTOR_TICK_PERIOD_MIN_NAME "TickPeriodMin"
#define SCEANN_LINK_DESCRIPTOR_UNIQUE_ID_HIGH_NAME "UniqueIdHigh"
#define SCEANN_LINK_DESCRIPTOR_NAME4_NAME "Name4"
#define SCEANN_LINK_DESCRIPTOR_NAME11_NAME "Name11"
#define SCEANN_LINK_DESCRIPTOR_NAME18_NAME "Name18"
#define SCEANN_LINK_DESCRIPTOR_NODE_NAME "Node"
#define SCEANN_LINK_DESCRIPTOR_TICK_PERIOD_MAX_NAME "TickPeriodMax"
#define SCEANN_LINK_DESCRIPTOR_PAGES_NAME "Pages"
#define SCEANN_LINK_HOST_HEARTBEAT_HOST_STATE_NAME "HostState"
#define SCEANN_LINK_HOST_HEARTBEAT_TRIAL_ID_NAME "TrialId"
#define SCEANN_LINK_HOST_HEARTBEAT_SESSION_NAME "Session"
#define SCEANN_LINK_HEARTBEAT_STATE_NAME "State"
#define SCEANN_LINK_HEARTBEAT_UPTIME_NAME "Uptime"
#define SCEANN_LINK_HEARTBEAT_BATTERY_NAME "Battery"
#define SCEANN_LINK_HEARTBEAT_RECEIVE_ERRORS_NAME "ReceiveErrors"
#define SCEANN_LINK_NEURON_STATES_FIRST_NAME "First"
#define SCEANN_LINK_NEURON_STATES_TICK_NAME "Tick"
#define SCEANN_LINK_NEURON_STATES_U0_NAME "U0"
#define SCEANN_LINK_NEURON_STATES_U1_NAME "U1"
#define SCEANN_LINK_NEURON_STATES_U2_NAME "U2"

/**
 * Signals in message Event.
 *
 * Something happened on the robot.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_event_t {
    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t code;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t state;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t tick;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t argument;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t trial_id;
};

/**
 * Signals in message End.
 *
 * A trial ended; also the answer to LAST.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_end_t {
    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t trial_id;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t reason;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t ticks;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t state_hash;
};

/**
 * Signals in message Sense.
 *
 * Sensors 0..5 as the robot used them in this tick.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_sense_t {
    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor0;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor1;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor2;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor3;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor4;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor5;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;
};

/**
 * Signals in message SensePage2.
 *
 * Sensors 6..11 of the same tick.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_sense_page2_t {
    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor6;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor7;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor8;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor9;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor10;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor11;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;
};

/**
 * Signals in message SenseIn.
 *
 * Sensors 0..5 injected by the host (mode HIL): this message is the tick.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_sense_in_t {
    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor0;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor1;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor2;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor3;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor4;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor5;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;
};

/**
 * Signals in message SenseInPage2.
 *
 * Sensors 6..11 injected by the host.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_sense_in_page2_t {
    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor6;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor7;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor8;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor9;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor10;

    /**
     * Range: 0..1023 (0..1023 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t sensor11;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;
};

/**
 * Signals in message Drive.
 *
 * Motor outputs of this tick; only 2 + 2 * motors bytes are sent.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_drive_t {
    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t hash;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor0;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor1;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor2;
};

/**
 * Signals in message DriveIn.
 *
 * Motor outputs from the host's controller (mode tethered); 2 + 2 * motors bytes.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_drive_in_t {
    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t hash;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor0;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor1;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t motor2;
};

/**
 * Signals in message Genome.
 *
 * Seven bytes of the genome that LOAD announced.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_genome_t {
    /**
     * Range: 0..18 (0..18 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t chunk;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte0;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte1;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte2;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte3;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte4;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte5;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t byte6;
};

/**
 * Signals in message Command.
 *
 * A request; every request is answered by one Reply with the same Op and Sequence.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_command_t {
    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t op;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t sequence;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t link_version;

    /**
     * Range: 1..3 (1..3 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t coding;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t genome_crc;

    /**
     * Range: 1..65535 (1..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t trial_id;

    /**
     * Range: 0..2 (0..2 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t store_action;

    /**
     * Range: 1..65535 (1..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t session;

    /**
     * Range: 0..1 (0..1 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t neuron;

    /**
     * Range: 0..65535 (0..6553.5 ms)
     * Scale: 0.1
     * Offset: 0
     */
    uint16_t autorun_tick_period;

    /**
     * Range: 1..12 (1..12 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t sensors;

    /**
     * Range: 1..65535 (1..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t max_ticks;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t arithmetic_id;

    /**
     * Range: 0..21 (0..21 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t hidden;

    /**
     * Range: 1..3 (1..3 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t motors;

    /**
     * Range: 0..1024 (0..1024 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t initial_output;

    /**
     * Range: 1..65535 (0.1..6553.5 ms)
     * Scale: 0.1
     * Offset: 0
     */
    uint16_t tick_period;

    /**
     * Range: 1..1012 (1..1012 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t bits;

    /**
     * Range: 0..2 (0..2 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t mode;

    /**
     * Range: 0..7 (0..7 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t telemetry;
};

/**
 * Signals in message Reply.
 *
 * The answer to a Command.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_reply_t {
    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t op;

    /**
     * Range: 0..15 (0..15 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t sequence;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t status;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t link_version;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t crc;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t trial_id;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t stored_crc;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t last_trial_id;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t stored_genome_crc;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t state;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t arithmetic_id;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t last_reason;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t missing_chunk;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t bits;
};

/**
 * Signals in message Descriptor.
 *
 * What this robot is; all pages follow an accepted or refused HELLO.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_descriptor_t {
    /**
     * Range: 0..6 (0..6 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t page;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t link_version;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t firmware_major;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t max_sensors;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t unique_id_low;

    /**
     * ASCII, padded with zeros, first character in the lowest byte.
     *
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name0;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name7;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name14;

    /**
     * Range: 0..12 (0..12 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t sensors;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t firmware_minor;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t max_motors;

    /**
     * Range: 0..3 (0..3 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t motors;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t firmware_patch;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t max_sources;

    /**
     * Range: 0..4294967295 (0..4294967295 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t arithmetic_id;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t capabilities;

    /**
     * Range: 1..65535 (0.1..6553.5 ms)
     * Scale: 0.1
     * Offset: 0
     */
    uint16_t tick_period_min;

    /**
     * Range: 0..16777215 (0..16777215 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t unique_id_high;

    /**
     * Range: 0..16777215 (0..16777215 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name4;

    /**
     * Range: 0..16777215 (0..16777215 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name11;

    /**
     * Range: 0..16777215 (0..16777215 -)
     * Scale: 1
     * Offset: 0
     */
    uint32_t name18;

    /**
     * Range: 1..127 (1..127 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t node;

    /**
     * Range: 1..65535 (0.1..6553.5 ms)
     * Scale: 0.1
     * Offset: 0
     */
    uint16_t tick_period_max;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t pages;
};

/**
 * Signals in message HostHeartbeat.
 *
 * The host is alive; 10 per second. Only the session that said HELLO counts.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_host_heartbeat_t {
    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t host_state;

    /**
     * Range: 0..65535 (0..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t trial_id;

    /**
     * Range: 1..65535 (1..65535 -)
     * Scale: 1
     * Offset: 0
     */
    uint16_t session;
};

/**
 * Signals in message Heartbeat.
 *
 * The robot is alive; 10 per second.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_heartbeat_t {
    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t state;

    /**
     * Range: 0..4294967295 (0..4294967295 ms)
     * Scale: 1
     * Offset: 0
     */
    uint32_t uptime;

    /**
     * Range: 0..65535 (0..65535 mV)
     * Scale: 1
     * Offset: 0
     */
    uint16_t battery;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t receive_errors;
};

/**
 * Signals in message NeuronStates.
 *
 * Up to three neuron states after this tick (telemetry bit 2): neurons First, First + 1, First + 2.
 *
 * All signal values are as on the CAN bus.
 */
struct sceann_link_neuron_states_t {
    /**
     * Range: 0..21 (0..21 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t first;

    /**
     * Range: 0..255 (0..255 -)
     * Scale: 1
     * Offset: 0
     */
    uint8_t tick;

    /**
     * Range: -8192..8192 (-8192..8192 -)
     * Scale: 1
     * Offset: 0
     */
    int16_t u0;

    /**
     * Range: -8192..8192 (-8192..8192 -)
     * Scale: 1
     * Offset: 0
     */
    int16_t u1;

    /**
     * Range: -8192..8192 (-8192..8192 -)
     * Scale: 1
     * Offset: 0
     */
    int16_t u2;
};

/**
 * Pack message Event.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_event_pack(
    uint8_t *dst_p,
    const struct sceann_link_event_t *src_p,
    size_t size);

/**
 * Pack message End.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_end_pack(
    uint8_t *dst_p,
    const struct sceann_link_end_t *src_p,
    size_t size);

/**
 * Pack message Sense.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_sense_pack(
    uint8_t *dst_p,
    const struct sceann_link_sense_t *src_p,
    size_t size);

/**
 * Pack message SensePage2.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_sense_page2_pack(
    uint8_t *dst_p,
    const struct sceann_link_sense_page2_t *src_p,
    size_t size);

/**
 * Unpack message SenseIn.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_sense_in_unpack(
    struct sceann_link_sense_in_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Unpack message SenseInPage2.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_sense_in_page2_unpack(
    struct sceann_link_sense_in_page2_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Pack message Drive.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_drive_pack(
    uint8_t *dst_p,
    const struct sceann_link_drive_t *src_p,
    size_t size);

/**
 * Unpack message DriveIn.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_drive_in_unpack(
    struct sceann_link_drive_in_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Unpack message Genome.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_genome_unpack(
    struct sceann_link_genome_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Unpack message Command.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_command_unpack(
    struct sceann_link_command_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Pack message Reply.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_reply_pack(
    uint8_t *dst_p,
    const struct sceann_link_reply_t *src_p,
    size_t size);

/**
 * Unpack message HostHeartbeat.
 *
 * @param[out] dst_p Object to unpack the message into.
 * @param[in] src_p Message to unpack.
 * @param[in] size Size of src_p.
 *
 * @return zero(0) or negative error code.
 */
int sceann_link_host_heartbeat_unpack(
    struct sceann_link_host_heartbeat_t *dst_p,
    const uint8_t *src_p,
    size_t size);

/**
 * Pack message Heartbeat.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_heartbeat_pack(
    uint8_t *dst_p,
    const struct sceann_link_heartbeat_t *src_p,
    size_t size);

/**
 * Pack message NeuronStates.
 *
 * @param[out] dst_p Buffer to pack the message into.
 * @param[in] src_p Data to pack.
 * @param[in] size Size of dst_p.
 *
 * @return Size of packed data, or negative error code.
 */
int sceann_link_neuron_states_pack(
    uint8_t *dst_p,
    const struct sceann_link_neuron_states_t *src_p,
    size_t size);


#ifdef __cplusplus
}
#endif

#endif
