/*
 * BBC micro:bit, version 1 (nRF51822, Cortex-M0): the UART behind its USB socket, timer 0 as clock, the last 8 KB of flash
 * as store, watchdog. No body: it runs controllers for a body that the host simulates. QEMU's machine microbit.
 */
#include "chip.h"

#include "sceann_flash.h"

#include <string.h>

#define UART(offset) REGISTER(0x40002000u + (offset))
#define TIMER(offset) REGISTER(0x40008000u + (offset))
#define WATCHDOG(offset) REGISTER(0x40010000u + (offset))
#define NVMC(offset) REGISTER(0x4001E000u + (offset))
#define GPIO_IN REGISTER(0x50000510u)
#define RESET_REASON REGISTER(0x40000400u)
#define DEVICE_ID(k) REGISTER(0x10000060u + 4u * (k))

#define PIN_TX 24u                     /* to the interface chip, which is the USB socket */
#define PIN_RX 25u
#define STORE 0x0003E000u
#define SECTOR 4096u
#define PAGE 1024u

const uint32_t chip_clock_mhz_x10 = 0;
const uint8_t chip_uart_interrupt = 2;

/* ---- clock: timer 0 at 1 MHz, 32 bits ------------------------------------------------------------------------------ */

static void timer_init(void)
{
    TIMER(0x508u) = 3;                 /* 32 bits */
    TIMER(0x510u) = 4;                 /* 16 MHz / 16 */
    TIMER(0x000u) = 1;
}

uint32_t chip_clock_us(void)
{
    TIMER(0x040u) = 1;                 /* capture */
    return TIMER(0x540u);
}

bool chip_may_sleep(uint32_t us)
{
    (void)us;
    return false;                      /* no timer interrupt: the loop polls */
}

/* ---- UART ---------------------------------------------------------------------------------------------------------- */

static void uart_init(void)
{
    UART(0x50Cu) = PIN_TX;
    UART(0x514u) = PIN_RX;
    UART(0x524u) = 0x01D7E000u;        /* 115,200 baud */
    UART(0x500u) = 4;
    UART(0x304u) = 1u << 2;            /* interrupt when a byte came */
    UART(0x000u) = 1;
    UART(0x008u) = 1;
}

int chip_uart_get(bool *bad_stop_bit)
{
    if (UART(0x108u) == 0u) {
        return -1;
    }
    UART(0x108u) = 0;
    const uint32_t errors = UART(0x480u);
    UART(0x480u) = errors;
    const uint8_t byte = (uint8_t)UART(0x518u);
    if ((errors & 0xCu) != 0u && byte == 0u) {
        *bad_stop_bit = true;
    }
    return byte;
}

bool chip_line_is_low(void)
{
    return (GPIO_IN & 1u << PIN_RX) == 0u;
}

bool chip_uart_put(uint8_t byte)
{
    static bool sending;
    if (sending && UART(0x11Cu) == 0u) {
        return false;
    }
    UART(0x11Cu) = 0;
    UART(0x51Cu) = byte;
    sending = true;
    return true;
}

/* ---- store --------------------------------------------------------------------------------------------------------- */

static void wait_for_flash(void)
{
    for (uint32_t polls = 0; NVMC(0x400u) == 0u && polls < 1000000u; polls++) {
    }
}

static bool flash_read(void *chip, uint32_t at, uint8_t *data, uint16_t n)
{
    (void)chip;
    memcpy(data, (const void *)(uintptr_t)(STORE + at), n);
    return true;
}

static bool flash_program(void *chip, uint32_t at, const uint8_t *data, uint16_t n)
{
    (void)chip;
    NVMC(0x504u) = 1;                  /* words are written whole; `at` and `n` are multiples of four */
    for (uint16_t k = 0; k < n; k = (uint16_t)(k + 4u)) {
        uint32_t word;
        memcpy(&word, &data[k], sizeof word);
        REGISTER(STORE + at + k) = word;
        wait_for_flash();
    }
    NVMC(0x504u) = 0;
    return true;
}

static bool flash_erase(void *chip, uint32_t at)
{
    (void)chip;
    NVMC(0x504u) = 2;
    for (uint32_t page = 0; page < SECTOR; page += PAGE) {
        NVMC(0x508u) = STORE + at + page;
        wait_for_flash();
    }
    NVMC(0x504u) = 0;
    return true;
}

static const sceann_flash_device device = { SECTOR, NULL, flash_read, flash_program, flash_erase };
static sceann_flash flash;

void chip_store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    sceann_flash_read(&flash, at, data, n);
}

bool chip_store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    return sceann_flash_write(&flash, at, data, n);
}

/* ---- watchdog: 32 kHz, half a second ------------------------------------------------------------------------------- */

void chip_watchdog_start(void)
{
    WATCHDOG(0x504u) = 16384;
    WATCHDOG(0x508u) = 1;
    WATCHDOG(0x000u) = 1;
}

void chip_watchdog_feed(void)
{
    WATCHDOG(0x600u) = 0x6E524635u;
}

/* ---- start --------------------------------------------------------------------------------------------------------- */

void chip_init(sceann_port *port)
{
    timer_init();
    uart_init();
    memcpy(port->name, "microbit", 9);
    for (uint8_t k = 0; k < sizeof port->unique_id; k++) {
        port->unique_id[k] = (uint8_t)(DEVICE_ID(k / 4u) >> 8 * (k % 4u));
    }
    const uint32_t cause = RESET_REASON;
    RESET_REASON = cause;
    port->reset_cause = (uint8_t)((cause & 2u) != 0u ? 3u : (cause & 1u) != 0u ? 2u : (cause & 4u) != 0u ? 5u : 0u);
    if (sceann_flash_open(&flash, &device)) {
        port->store_size = SCEANN_STORE_BYTES;
        port->capabilities |= SCEANN_HAS_STORE;
    }
}
