/*
 * Shared by the Cortex-M boards: vectors, start, SysTick clock, receive ring, watchdog policy, main loop.
 */
#include "chip.h"
#include "sceann_robot.h"

#define SYST_CSR REGISTER(0xE000E010u)
#define SYST_RVR REGISTER(0xE000E014u)
#define SYST_CVR REGISTER(0xE000E018u)
#define SCB_ICSR REGISTER(0xE000ED04u)
#define SYSTICK_PENDING (1u << 26)
#define NVIC_ENABLE(n) (REGISTER(0xE000E100u + 4u * ((n) / 32u)) = 1u << ((n) % 32u))

#define RING 256u                      /* a power of two, at most 256 */
#define SEND_PATIENCE 200000u          /* polls of a full transmitter before a byte is given up: a line is never waited for */

extern uint32_t _sidata, _sdata, _edata, _sbss, _ebss, _estack;        /* cortexm.ld */
int main(void);

static sceann_robot robot;
static sceann_decoder decoder;
static sceann_kept kept __attribute__((section(".noinit")));

/* ---- UART -------------------------------------------------------------------------------------------------------- */

static struct {
    volatile uint8_t head, tail;
    uint8_t data[RING];
} ring;
static volatile bool bad_stop_bit;     /* of a zero byte: a BREAK, perhaps */

static void uart_handler(void)
{
    bool broken = false;
    for (int byte = chip_uart_get(&broken); byte >= 0; byte = chip_uart_get(&broken)) {
        const uint8_t next = (uint8_t)(ring.head + 1u);
        if (next != ring.tail) {
            ring.data[ring.head] = (uint8_t)byte;
            ring.head = next;
        }
    }
    if (broken) {
        bad_stop_bit = true;
    }
}

static sceann_received receive(void *board, sceann_message *message)
{
    (void)board;
    while (ring.head != ring.tail) {
        const uint8_t byte = ring.data[ring.tail];
        ring.tail = (uint8_t)(ring.tail + 1u);
        const sceann_received result = sceann_frame_decode(&decoder, byte, message);
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
        for (uint32_t polls = 0; !chip_uart_put(frame[k]) && polls < SEND_PATIENCE; polls++) {
        }
    }
}

/* ---- time -------------------------------------------------------------------------------------------------------- */

static volatile uint32_t milliseconds;
static uint32_t cycles_per_ms;

static void systick_handler(void)
{
    milliseconds++;
}

__attribute__((weak)) uint32_t chip_clock_us(void)
{
    static uint32_t latest;
    uint32_t ms, left;
    do {
        ms = milliseconds;
        left = SYST_CVR;
    } while (ms != milliseconds || (SCB_ICSR & SYSTICK_PENDING) != 0u);
    const uint32_t now = ms * 1000u + (cycles_per_ms - 1u - left) * 10u / chip_clock_mhz_x10;
    if ((int32_t)(now - latest) > 0) {
        latest = now;                  /* an emulated counter may reload before its interrupt is pending: never go back */
    }
    return latest;
}

static uint32_t clock_us(void *board)
{
    (void)board;
    return chip_clock_us();
}

/* ---- no body ----------------------------------------------------------------------------------------------------- */

static void no_sensors(void *board, uint16_t *sensors)
{
    (void)board;
    (void)sensors;
}

static void no_motors(void *board, const int16_t *motors)
{
    (void)board;
    (void)motors;
}

static void no_output(void *board)
{
    (void)board;
}

__attribute__((weak)) uint16_t chip_switches(void)
{
    return 0;
}

/* A BREAK holds the line low; a bad stop bit lets go of it within a frame. */
static bool is_break(void)
{
    if (!bad_stop_bit) {
        return false;
    }
    bad_stop_bit = false;
    const uint32_t began = chip_clock_us();
    while (chip_clock_us() - began < SCEANN_BREAK_US) {
        if (!chip_line_is_low()) {
            return false;
        }
    }
    return true;
}

static uint16_t alarms(void *board)
{
    (void)board;
    return (uint16_t)(chip_switches() | (is_break() ? SCEANN_ALARM_BREAK : 0u));
}

static uint16_t no_battery(void *board)
{
    (void)board;
    return 0;
}

/* ---- watchdog ---------------------------------------------------------------------------------------------------- */

/* It guards the main loop: without a body there is no control tick that could feed it. */
static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    (void)action;
}

__attribute__((weak)) bool chip_may_sleep(uint32_t us)
{
    (void)us;
    return true;                       /* SysTick wakes it every millisecond */
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

static void idle_handler(void)         /* until the watchdog bites */
{
    for (;;) {
    }
}

__attribute__((weak)) void HardFault_Handler(void)
{
    idle_handler();
}

void Reset_Handler(void)
{
    for (uint32_t *from = &_sidata, *to = &_sdata; to < &_edata;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &_sbss; to < &_ebss;) {
        *to++ = 0;
    }
    main();
    idle_handler();
}

typedef void (*vector)(void);
#define U uart_handler

__attribute__((section(".vectors"), used)) static const vector vectors[16 + 40] = {
    (vector)(uintptr_t)&_estack, Reset_Handler, idle_handler, HardFault_Handler, idle_handler, idle_handler, idle_handler,
    0, 0, 0, 0, idle_handler, idle_handler, 0, idle_handler, systick_handler,
    /* the only peripheral interrupt that is ever enabled is the UART's, whatever its number */
    U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U, U
};

int main(void)
{
    static sceann_port port = { .node = 1,
                                .capabilities = SCEANN_HAS_HIL | SCEANN_HAS_WATCHDOG,
                                .tick_min = 1,
                                .tick_max = 1000,
                                .kept = &kept,
                                .clock_us = clock_us,
                                .receive = receive,
                                .send = send,
                                .sense = no_sensors,
                                .drive = no_motors,
                                .safe = no_output,
                                .alarms = alarms,
                                .battery_mv = no_battery,
                                .store_read = chip_store_read,
                                .store_write = chip_store_write,
                                .watchdog = watchdog };
    chip_init(&port);
    if (chip_clock_mhz_x10 != 0u) {
        cycles_per_ms = chip_clock_mhz_x10 * 100u;
        SYST_RVR = cycles_per_ms - 1u;
        SYST_CVR = 0;
        SYST_CSR = 7;
    }
    NVIC_ENABLE(chip_uart_interrupt);
    sceann_robot_start(&robot, &port);
    chip_watchdog_start();
    for (;;) {
        sceann_robot_poll(&robot);
        chip_watchdog_feed();
        if (!chip_may_sleep(sceann_robot_idle_us(&robot))) {
            continue;
        }
        __asm volatile("cpsid i");     /* masked test, then WFI: an interrupt between the two still wakes the core */
        if (ring.head == ring.tail) {
            __asm volatile("wfi");
        }
        __asm volatile("cpsie i");
    }
}
