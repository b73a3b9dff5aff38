/*
 * You learn: how to run an exported controller on a robot that waits for you, and stops by itself.
 * You need:  the robot of docs/first-robot.md (firmware/README.md shows the wiring): five analogue distance sensors on A0..A4, a
 *            motor driver with PWM on 5 and 6 and directions on 4 and 7, bumper, stop and start button on D2, D3 and D8.
 * It takes:  five minutes. Replace walker.h by a header of your own: sceann export RUN --name walker -o walker.h
 *
 * Press the start button: it drives for DRIVE_MS. The bumper, the stop button, the start button or time ends that.
 * Hold the start button for two seconds, wheels off the ground: each motor runs for a moment and says which one it is.
 * The main switch is the emergency stop; the stop button is read by this program, and so is no safety device.
 */
#define WALKER_SELF_TEST
#include "walker.h"

const unsigned long PERIOD_MS = 200;   /* the control period that the run was evolved with: tick_s of its robot */
const unsigned long DRIVE_MS = 15000;  /* the longest drive */
const unsigned long HELD_MS = 2000, BOUNCE_MS = 30;
const uint8_t SPEED_PIN[2] = { 6, 5 }, DIRECTION_PIN[2] = { 7, 4 };   /* motor 0 is the left wheel, motor 1 the right one */
const char *const WHEEL[2] = { "motor 0, D6: the left wheel", "motor 1, D5: the right wheel" };
const uint8_t BUMPER_PIN = 2, STOP_PIN = 3, START_PIN = 8, LIGHT_PIN = 13;   /* switches to ground */

walker_t controller;

bool pressed(uint8_t pin)
{
    return digitalRead(pin) == LOW;
}

void stand_still()
{
    for (uint8_t k = 0; k < 2; k++) {
        analogWrite(SPEED_PIN[k], 0);
        digitalWrite(DIRECTION_PIN[k], LOW);
    }
    digitalWrite(LIGHT_PIN, LOW);
}

void drive(uint8_t wheel, int16_t motor)
{
    digitalWrite(DIRECTION_PIN[wheel], HIGH);
    analogWrite(SPEED_PIN[wheel], motor >= 1020 ? 255 : motor >> 2);
}

/* why nothing may move now; none if it may */
const char *reason_to_stand()
{
    return pressed(STOP_PIN) ? "stop button" : pressed(BUMPER_PIN) ? "bumper" : NULL;
}

void say_which_is_which()
{
    for (uint8_t k = 0; k < 2; k++) {
        Serial.println(WHEEL[k]);
        const unsigned long since_ms = millis();
        while (millis() - since_ms < 1000 && reason_to_stand() == NULL) {
            drive(k, millis() - since_ms < 700 ? 400 : 0);
        }
        stand_still();
    }
    Serial.println("Did they run forwards, the left one first? If not: swap wires as the drawing shows.");
}

void walk()
{
    walker_reset(&controller);
    const unsigned long since_ms = millis();
    unsigned long due_ms = since_ms;
    const char *end = reason_to_stand();
    while (end == NULL) {
        if ((long)(millis() - due_ms) >= 0) {
            due_ms += PERIOD_MS;
            uint16_t sensors[WALKER_SENSORS];
            int16_t motors[WALKER_MOTORS];
            for (uint8_t k = 0; k < WALKER_SENSORS; k++) {
                sensors[k] = (uint16_t)analogRead(A0 + k);
            }
            walker_step(&controller, sensors, motors);
            for (uint8_t k = 0; k < WALKER_MOTORS; k++) {
                drive(k, motors[k]);
                Serial.print(motors[k]);
                Serial.print(k + 1 < WALKER_MOTORS ? ' ' : '\n');
            }
            digitalWrite(LIGHT_PIN, HIGH);
        }
        end = reason_to_stand();
        if (end == NULL && pressed(START_PIN)) {
            end = "start button";
        }
        if (end == NULL && millis() - since_ms >= DRIVE_MS) {
            end = "time is up";
        }
    }
    stand_still();
    Serial.print("stopped: ");
    Serial.println(end);
}

void setup()
{
    for (uint8_t k = 0; k < 2; k++) {
        digitalWrite(SPEED_PIN[k], LOW);
        pinMode(SPEED_PIN[k], OUTPUT);
        digitalWrite(DIRECTION_PIN[k], LOW);
        pinMode(DIRECTION_PIN[k], OUTPUT);
    }
    const uint8_t switches[] = { BUMPER_PIN, STOP_PIN, START_PIN };
    for (uint8_t k = 0; k < sizeof switches; k++) {
        pinMode(switches[k], INPUT_PULLUP);
    }
    pinMode(LIGHT_PIN, OUTPUT);
    Serial.begin(115200);
    const int wrong = walker_self_test();
    if (wrong != 0) {                  /* this compiler or chip computes something else: do not move */
        Serial.print("self-test failed in step ");
        Serial.println(wrong);
        for (;;) {
        }
    }
    Serial.println("self-test passed");
    Serial.println("Press the start button to drive; hold it for two seconds to try the motors.");
}

void loop()
{
    if (!pressed(START_PIN)) {
        return;
    }
    const unsigned long since_ms = millis();
    while (pressed(START_PIN) && millis() - since_ms < HELD_MS) {
    }
    const unsigned long held_ms = millis() - since_ms;
    if (held_ms >= HELD_MS) {
        say_which_is_which();
    } else if (held_ms >= BOUNCE_MS) {
        walk();
    }
    while (pressed(START_PIN)) {       /* a press is one press, however long it lasts */
    }
    delay(BOUNCE_MS);
}
