/*
 * Arduino Uno and other ATmega328P boards at 16 MHz: clock on timer 1, UART 0, EEPROM, watchdog; the body is in body.c.
 */
#include "body.h"
#include "sceann_robot.h"
#include "uart.h"
#include "wiring.h"

#include <avr/boot.h>
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

static sceann_robot robot;
static sceann_decoder decoder;
static volatile uint32_t timer1_overflows;
static uint8_t reset_flags __attribute__((section(".noinit")));
static sceann_kept kept __attribute__((section(".noinit")));

/* Before main: a watchdog that has bitten stays on, and would bite again during the start. */
void keep_reset_flags(void) __attribute__((naked, used, section(".init3")));
void keep_reset_flags(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

/* ---- clock: timer 1 at 2 MHz ------------------------------------------------------------------------------------- */

ISR(TIMER1_OVF_vect)
{
    timer1_overflows++;
}

EMPTY_INTERRUPT(TIMER1_COMPA_vect)     /* only wakes the loop */

static uint32_t clock_us(void *board)
{
    (void)board;
    uint32_t overflows;
    uint16_t count;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        count = TCNT1;
        overflows = timer1_overflows;
        if ((TIFR1 & _BV(TOV1)) != 0u && count < 0x8000u) {
            overflows++;
        }
    }
    return (overflows << 15) + (count >> 1);
}

/* ---- link -------------------------------------------------------------------------------------------------------- */

static sceann_received receive(void *board, sceann_message *message)
{
    (void)board;
    for (int16_t byte = uart_get(); byte >= 0; byte = uart_get()) {
        const sceann_received result = sceann_frame_decode(&decoder, (uint8_t)byte, message);
        if (result != SCEANN_NOTHING) {
            return result;
        }
    }
    return SCEANN_NOTHING;
}

static void send(void *board, const sceann_message *message)
{
    (void)board;
    uint8_t frame[SCEANN_FRAME_MAX];
    const uint8_t n = sceann_frame_encode(message, frame);
    for (uint8_t k = 0; k < n; k++) {
        uart_put(frame[k]);
    }
}

static uint16_t alarms(void *board)
{
    (void)board;
    static uint8_t measured;
    const uint8_t turn = (uint8_t)timer1_overflows;    /* of 32.8 ms */
    if (turn != measured) {
        measured = turn;
        body_measure_battery();
    }
    return (uint16_t)(body_switches() | (uart_break() ? SCEANN_ALARM_BREAK : 0u));
}

/* ---- store and watchdog ------------------------------------------------------------------------------------------ */

static void store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    eeprom_read_block(data, (const void *)at, n);
}

static bool store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    eeprom_update_block(data, (void *)at, n);
    return true;                       /* the chip does not tell; the core reads it back */
}

#if SCEANN_WATCHDOG_US != 500000u
#error "the chip has watchdog periods of its own: 250, 500 or 1000 ms"
#endif

static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    switch (action) {
    case SCEANN_WATCHDOG_ON:
        wdt_enable(WDTO_500MS);
        break;
    case SCEANN_WATCHDOG_FEED:
        wdt_reset();
        break;
    case SCEANN_WATCHDOG_OFF:
        wdt_disable();
        break;
    }
}

/* The boot loader that Unos ship with clears the register: 0, and the core finds out by `kept`. */
static uint8_t reset_cause(void)
{
    if ((reset_flags & _BV(WDRF)) != 0u) {
        return 3;
    }
    if ((reset_flags & _BV(PORF)) != 0u) {
        return 1;
    }
    if ((reset_flags & _BV(BORF)) != 0u) {
        return 4;
    }
    return (reset_flags & _BV(EXTRF)) != 0u ? 2u : 0u;
}

/* The chip's serial number: lot, wafer and place on it, from the signature row. */
static void read_serial_number(uint8_t *bytes)
{
    for (uint8_t k = 0; k < 7u; k++) {
        bytes[k] = boot_signature_byte_get((uint8_t)(0x0Eu + k));
    }
}

/* ---- the board --------------------------------------------------------------------------------------------------- */

/* 0.1 ms: SENSE and DRIVE of a tick and now and then a heartbeat or a reply on the line, and what there is to compute:
 * conversions, the battery, a step of the largest network. */
#define TICK_MIN ((uint16_t)(3u * SCEANN_FRAME_MAX * 100000UL / BAUD + 22u))

static sceann_port port = { .name = "uno",
                            .node = SCEANN_UNO_NODE,
                            .n_sensors = SCEANN_UNO_SENSORS,
                            .n_motors = 2,
                            .capabilities = SCEANN_HAS_BODY | SCEANN_HAS_HIL | SCEANN_HAS_STORE | SCEANN_HAS_AUTORUN |
                                            SCEANN_HAS_WATCHDOG | SCEANN_HAS_BUMPER | SCEANN_HAS_BUTTON |
                                            (SCEANN_UNO_SENSORS <= BATTERY_CHANNEL ? SCEANN_HAS_BATTERY : 0u),
                            .tick_min = TICK_MIN,
                            .tick_max = 2500,      /* 250 ms: the watchdog wants a tick every 500 ms */
                            .store_size = E2END + 1u,
                            .clock_us = clock_us,
                            .receive = receive,
                            .send = send,
                            .sense = body_sense,
                            .drive = body_drive,
                            .safe = body_safe,
                            .alarms = alarms,
                            .battery_mv = body_battery_mv,
                            .light = body_light,
                            .kept = &kept,
                            .store_read = store_read,
                            .store_write = store_write,
                            .watchdog = watchdog };

/* Sleeps until a byte comes or the time is over, in steps of at most one turn of timer 1. */
static void wait_us(uint32_t us)
{
    if (us < 100u) {
        return;
    }
    OCR1A = (uint16_t)(TCNT1 + (uint16_t)(us << 1));
    cli();
    if (!uart_has_input()) {
        sleep_enable();
        sei();                         /* the instruction after it still runs: no wake-up is lost */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

int main(void)
{
    body_init();
    uart_init();
    TCCR1A = 0;
    TCCR1B = _BV(CS11);
    TIMSK1 = _BV(TOIE1) | _BV(OCIE1A);
    port.reset_cause = reset_cause();
    read_serial_number(port.unique_id);
    SMCR = 0;                          /* sleep mode idle */
    sei();
    sceann_robot_start(&robot, &port);
    for (;;) {
        sceann_robot_poll(&robot);
        wait_us(sceann_robot_idle_us(&robot));
    }
}
