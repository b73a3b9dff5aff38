/*
 * You learn: how to run an exported controller.
 * You need:  an Uno-class board, five analogue distance sensors on A0..A4, a motor driver with PWM on 5 and 6 and
 *            directions on 4 and 7 (firmware/README.md shows the wiring). It also runs on a bare board.
 * It takes:  five minutes. Replace walker.h by a header of your own: sceann export RUN --name walker -o walker.h
 */
#define WALKER_SELF_TEST
#include "walker.h"

const unsigned long PERIOD_MS = 200;   /* the control period that the run was evolved with */
const uint8_t SPEED_PIN[2] = { 6, 5 }, DIRECTION_PIN[2] = { 7, 4 };   /* motor 0 is the left wheel, motor 1 the right one */

walker_t controller;
unsigned long due_ms;

void setup()
{
    for (uint8_t k = 0; k < 2; k++) {
        pinMode(SPEED_PIN[k], OUTPUT);
        pinMode(DIRECTION_PIN[k], OUTPUT);
        digitalWrite(DIRECTION_PIN[k], HIGH);
    }
    Serial.begin(115200);
    const int wrong = walker_self_test();
    if (wrong != 0) {                  /* this compiler or chip computes something else: do not move */
        Serial.print("self-test failed in step ");
        Serial.println(wrong);
        for (;;) {
        }
    }
    Serial.println("self-test passed");
    walker_reset(&controller);
    due_ms = millis();
}

void loop()
{
    if ((long)(millis() - due_ms) < 0) {
        return;
    }
    due_ms += PERIOD_MS;

    uint16_t sensors[WALKER_SENSORS];
    int16_t motors[WALKER_MOTORS];
    for (uint8_t k = 0; k < WALKER_SENSORS; k++) {
        sensors[k] = (uint16_t)analogRead(A0 + k);
    }
    walker_step(&controller, sensors, motors);
    for (uint8_t k = 0; k < WALKER_MOTORS; k++) {
        analogWrite(SPEED_PIN[k], motors[k] >= 1020 ? 255 : motors[k] >> 2);
        Serial.print(motors[k]);
        Serial.print(k + 1 < WALKER_MOTORS ? ' ' : '\n');
    }
}
