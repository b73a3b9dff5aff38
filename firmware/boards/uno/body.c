#include "body.h"

#include "sceann_port.h"
#include "wiring.h"

#include <avr/io.h>

#define SETTLING 8u                    /* conversions until the band gap, which is a weak source, can be read */

static uint16_t battery_mv;

static uint16_t convert(uint8_t channel)
{
    ADMUX = (uint8_t)(_BV(REFS0) | channel);   /* reference AVcc */
    ADCSRA |= _BV(ADSC);
    while ((ADCSRA & _BV(ADSC)) != 0u) {
    }
    return ADC;
}

void body_init(void)
{
    body_safe((void *)0);
    MOTOR_DDR |= RIGHT_PWM | RIGHT_FORWARD | LEFT_PWM | LEFT_FORWARD;
    SWITCH_PORT |= BUMPER | STOP_BUTTON;
    START_PORT |= START_BUTTON;
    LIGHT_DDR |= LIGHT;
    TCCR0B = _BV(CS01) | _BV(CS00);            /* 16 MHz / 64 / 256 = 977 Hz */
    ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1);      /* 250 kHz: 54 us per conversion, still 9 good bits */
}

void body_sense(void *board, uint16_t *sensors)
{
    (void)board;
    for (uint8_t k = 0; k < SCEANN_UNO_SENSORS; k++) {
        sensors[k] = convert(k);
    }
}

/* PWM duty 0..255 of a motor output 0..1024; *forward says which way. */
static uint8_t duty(int16_t output, bool *forward)
{
#if SCEANN_UNO_REVERSE
    const int16_t speed = (int16_t)(2 * output - 1024);
    *forward = speed >= 0;
    const uint16_t magnitude = (uint16_t)(speed < 0 ? -speed : speed);
#else
    *forward = true;
    const uint16_t magnitude = (uint16_t)output;
#endif
    return magnitude >= 1020u ? 255u : (uint8_t)(magnitude >> 2);
}

void body_drive(void *board, const int16_t *motors)
{
    (void)board;
    bool right_forward, left_forward;
    const uint8_t left = duty(motors[0], &left_forward), right = duty(motors[1], &right_forward);
    uint8_t directions = (uint8_t)(MOTOR_PORT & ~(RIGHT_FORWARD | LEFT_FORWARD));
    if (right_forward) {
        directions |= RIGHT_FORWARD;
    }
    if (left_forward) {
        directions |= LEFT_FORWARD;
    }
    MOTOR_PORT = directions;
    OCR0B = right;
    OCR0A = left;
    /* duty 0 would still give a pulse of one clock: let go of the pin instead, it is low */
    TCCR0A = (uint8_t)(_BV(WGM01) | _BV(WGM00) | (right != 0u ? _BV(COM0B1) : 0) | (left != 0u ? _BV(COM0A1) : 0));
}

void body_safe(void *board)
{
    (void)board;
    TCCR0A = _BV(WGM01) | _BV(WGM00);
    MOTOR_PORT &= (uint8_t)~(RIGHT_PWM | LEFT_PWM | RIGHT_FORWARD | LEFT_FORWARD);
    OCR0A = 0;
    OCR0B = 0;
}

uint16_t body_switches(void)
{
    const uint8_t pins = SWITCH_PIN;
    uint16_t alarms = 0;
    if ((pins & STOP_BUTTON) == 0u) {
        alarms |= SCEANN_ALARM_ESTOP;
    }
    if ((pins & BUMPER) == 0u) {
        alarms |= SCEANN_ALARM_BUMPER;
    }
    if ((START_PIN & START_BUTTON) == 0u) {
        alarms |= SCEANN_ALARM_BUTTON;
    }
    if (battery_mv >= BATTERY_ABSENT_MV && battery_mv < BATTERY_LOW_MV) {
        alarms |= SCEANN_ALARM_BATTERY;
    }
    return alarms;
}

void body_measure_battery(void)
{
    if (SCEANN_UNO_SENSORS > BATTERY_CHANNEL) {
        return;
    }
    const uint16_t battery = convert(BATTERY_CHANNEL);
    uint16_t band_gap = 0;
    for (uint8_t k = 0; k < SETTLING; k++) {
        band_gap = convert(BAND_GAP_CHANNEL);
    }
    battery_mv = band_gap == 0u ? 0u : BATTERY_MV(battery, band_gap);
}

void body_light(void *board, bool on)
{
    (void)board;
    if (on) {
        LIGHT_PORT |= LIGHT;
    } else {
        LIGHT_PORT &= (uint8_t)~LIGHT;
    }
}

uint16_t body_battery_mv(void *board)
{
    (void)board;
    return battery_mv >= BATTERY_ABSENT_MV ? battery_mv : 0u;
}
