/*
 * You learn: how any board with the Arduino API becomes a robot that sceann evolves on.
 * You need:  a board from pins.h (or one that you add there), analogue distance sensors, a motor driver with a speed (PWM)
 *            and a direction pin per motor, a bumper and a stop button to ground; 10 kOhm from every motor pin to ground.
 * It takes:  ten minutes. Upload it, then: sceann doctor, and sceann verify RUN --port PORT proves it bit for bit.
 *
 * Only the portable API is used: Serial, analogRead (10 bits), analogWrite, digitalRead, digitalWrite, micros. Hence no hardware
 * watchdog and no BREAK; where the core has a byte-wise EEPROM (AVR) genomes and the last trial survive power loss.
 */
#include "pins.h"

#include <sceann.h>
#if defined(ARDUINO_ARCH_AVR)
#include <EEPROM.h>
#endif

const unsigned long BAUD_RATE = 115200;
const uint8_t N_SENSORS = sizeof SENSOR_PINS, N_MOTORS = sizeof SPEED_PINS;

sceann_robot robot;
sceann_decoder decoder;
sceann_port port;
bool light_on;

uint32_t clock_us(void *)
{
    return micros();
}

sceann_received receive(void *, sceann_message *message)
{
    while (Serial.available() > 0) {
        const sceann_received result = sceann_frame_decode(&decoder, (uint8_t)Serial.read(), message);
        if (result != SCEANN_NOTHING) {
            return result;
        }
    }
    return SCEANN_NOTHING;
}

void send(void *, const sceann_message *message)
{
    uint8_t frame[SCEANN_FRAME_MAX];
    Serial.write(frame, sceann_frame_encode(message, frame));
}

void sense(void *, uint16_t *sensors)
{
    for (uint8_t k = 0; k < N_SENSORS; k++) {
        sensors[k] = (uint16_t)analogRead(SENSOR_PINS[k]);
    }
}

void drive(void *, const int16_t *motors)
{
    for (uint8_t k = 0; k < N_MOTORS; k++) {
        digitalWrite(DIRECTION_PINS[k], HIGH);
        analogWrite(SPEED_PINS[k], motors[k] >= 1020 ? 255 : motors[k] >> 2);
    }
}

void safe(void *)
{
    for (uint8_t k = 0; k < N_MOTORS; k++) {
        analogWrite(SPEED_PINS[k], 0);
        digitalWrite(DIRECTION_PINS[k], LOW);
    }
}

bool pressed(uint8_t pin)
{
    return pin != NONE && digitalRead(pin) == LOW;
}

uint16_t alarms(void *)
{
    return (uint16_t)((pressed(STOP_PIN) ? SCEANN_ALARM_ESTOP : 0) | (pressed(BUMPER_PIN) ? SCEANN_ALARM_BUMPER : 0) |
                      (pressed(START_PIN) ? SCEANN_ALARM_BUTTON : 0));
}

uint16_t battery_mv(void *)
{
    return 0;
}

void light(void *, bool on)
{
    if (LIGHT_PIN != NONE && on != light_on) {
        light_on = on;
        digitalWrite(LIGHT_PIN, on ? HIGH : LOW);
    }
}

void store_read(void *, uint16_t at, uint8_t *data, uint8_t n)
{
#if defined(ARDUINO_ARCH_AVR)
    for (uint8_t k = 0; k < n; k++) {
        data[k] = EEPROM.read(at + k);
    }
#else
    memset(data, 0xFF, n);
    (void)at;
#endif
}

bool store_write(void *, uint16_t at, const uint8_t *data, uint8_t n)
{
#if defined(ARDUINO_ARCH_AVR)
    for (uint8_t k = 0; k < n; k++) {
        EEPROM.update(at + k, data[k]);
    }
    return true;                       /* the core reads it back */
#else
    (void)at;
    (void)data;
    (void)n;
    return false;
#endif
}

void no_watchdog(void *, sceann_watchdog)
{
}

void setup()
{
    for (uint8_t k = 0; k < N_MOTORS; k++) {
        digitalWrite(SPEED_PINS[k], LOW);
        pinMode(SPEED_PINS[k], OUTPUT);
        digitalWrite(DIRECTION_PINS[k], LOW);
        pinMode(DIRECTION_PINS[k], OUTPUT);
    }
    const uint8_t switches[] = { BUMPER_PIN, STOP_PIN, START_PIN };
    for (uint8_t k = 0; k < sizeof switches; k++) {
        if (switches[k] != NONE) {
            pinMode(switches[k], INPUT_PULLUP);
        }
    }
    if (LIGHT_PIN != NONE) {
        pinMode(LIGHT_PIN, OUTPUT);
    }
#if !defined(ARDUINO_ARCH_AVR)
    analogReadResolution(10);          /* an ESP32 would give 12 bits */
#endif
    Serial.begin(BAUD_RATE);

    strncpy(port.name, BOARD_NAME, sizeof port.name - 1);
    port.node = 1;
    port.n_sensors = N_SENSORS;
    port.n_motors = N_MOTORS;
    port.capabilities = SCEANN_HAS_BODY | SCEANN_HAS_HIL | SCEANN_HAS_BUMPER | SCEANN_HAS_BUTTON;
#if defined(ARDUINO_ARCH_AVR)
    port.capabilities |= SCEANN_HAS_STORE | SCEANN_HAS_AUTORUN;
    port.store_size = 1024;
#endif
    port.tick_min = 80;                /* 8 ms: an Uno's five analogRead take 0.6, a tick's messages 3 to 4 */
    port.tick_max = 2500;
    port.clock_us = clock_us;
    port.receive = receive;
    port.send = send;
    port.sense = sense;
    port.drive = drive;
    port.safe = safe;
    port.alarms = alarms;
    port.battery_mv = battery_mv;
    port.light = light;
    port.store_read = store_read;
    port.store_write = store_write;
    port.watchdog = no_watchdog;
    sceann_robot_start(&robot, &port);
}

void loop()
{
    sceann_robot_poll(&robot);
}
