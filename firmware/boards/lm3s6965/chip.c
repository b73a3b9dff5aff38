/*
 * LM3S6965 as QEMU's lm3s6965evb has it: UART 0 (PL011), a 24C32 EEPROM at I2C address 0x50, watchdog. Old silicon: use
 * it as a virtual board.
 */
#include "chip.h"

#include <string.h>

#define RCGC0 REGISTER(0x400FE100u)
#define RCGC1 REGISTER(0x400FE104u)
#define RCGC2 REGISTER(0x400FE108u)
#define RESET_CAUSE REGISTER(0x400FE05Cu)
#define UART(offset) REGISTER(0x4000C000u + (offset))
#define GPIOA_DATA REGISTER(0x400043FCu)
#define I2C(offset) REGISTER(0x40020000u + (offset))
#define WATCHDOG(offset) REGISTER(0x40000000u + (offset))

const uint32_t chip_clock_mhz_x10 = 125;
const uint8_t chip_uart_interrupt = 5;

/* ---- UART -------------------------------------------------------------------------------------------------------- */

static void uart_init(void)
{
    UART(0x30u) = 0;
    UART(0x24u) = 6;                   /* 12.5 MHz / (16 * 115200) = 6 + 50/64 */
    UART(0x28u) = 50;
    UART(0x2Cu) = 0x70;                /* 8N1, FIFO on */
    UART(0x34u) = 0;                   /* interrupt when 1/8 full */
    UART(0x38u) = 0x50;                /* receive and receive time-out */
    UART(0x30u) = 0x301;
}

int chip_uart_get(bool *bad_stop_bit)
{
    if ((UART(0x18u) & 0x10u) != 0u) {
        UART(0x44u) = 0x50;
        return -1;
    }
    const uint32_t data = UART(0u);
    if ((data & 0x400u) != 0u) {
        *bad_stop_bit = true;
    }
    return (int)(data & 0xFFu);
}

bool chip_line_is_low(void)
{
    return (GPIOA_DATA & 1u) == 0u;
}

bool chip_uart_put(uint8_t byte)
{
    if ((UART(0x18u) & 0x20u) != 0u) {
        return false;
    }
    UART(0u) = byte;
    return true;
}

/* ---- EEPROM: 24C32, pages of 32 bytes, addressed by two bytes ------------------------------------------------------ */

#define EEPROM 0x50u
#define PAGE 32u
#define WRITE_POLLS 20000u             /* a page write takes 5 ms, during which the chip does not answer */

enum { RUN = 1, START = 2, STOP = 4, ACK = 8 };

static bool i2c(uint32_t command)      /* false: no acknowledgement */
{
    I2C(4u) = command;
    while ((I2C(4u) & 1u) != 0u) {
    }
    return (I2C(4u) & 2u) == 0u;
}

static bool seek(uint16_t at)
{
    for (uint32_t polls = 0; polls < WRITE_POLLS; polls++) {
        I2C(0u) = EEPROM << 1;
        I2C(8u) = at >> 8;
        if (i2c(START | RUN)) {
            I2C(8u) = at & 0xFFu;
            return i2c(RUN);
        }
        i2c(STOP);
    }
    return false;
}

void chip_store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    memset(data, 0xFF, n);
    if (n == 0u || !seek(at)) {
        return;
    }
    I2C(0u) = EEPROM << 1 | 1u;
    for (uint8_t k = 0; k < n; k++) {
        const uint32_t first = k == 0u ? START : 0u, last = k + 1u == n ? STOP : ACK;
        i2c(first | last | RUN);
        data[k] = (uint8_t)I2C(8u);
    }
}

bool chip_store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    uint8_t k = 0;
    while (k < n && seek(at)) {
        bool page_ends;
        do {
            I2C(8u) = data[k++];
            at++;
            page_ends = k == n || at % PAGE == 0u;
            if (!i2c(page_ends ? STOP | RUN : RUN)) {
                return false;
            }
        } while (!page_ends);
    }
    return k == n;
}

static bool has_eeprom(void)
{
    I2C(0x20u) = 0x10;                 /* master */
    I2C(0x0Cu) = 5;
    I2C(0u) = EEPROM << 1;
    I2C(8u) = 0;
    const bool found = i2c(START | RUN);
    i2c(STOP);
    return found;
}

/* ---- watchdog: a first time-out interrupts, a second one resets ---------------------------------------------------- */

void chip_watchdog_start(void)
{
    WATCHDOG(0u) = 12500000u / 8u;     /* two times 125 ms */
    WATCHDOG(8u) = 3;                  /* count, and reset at the second time-out */
}

void chip_watchdog_feed(void)
{
    WATCHDOG(0x0Cu) = 1;
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

void chip_init(sceann_port *port)
{
    RCGC0 |= 1u << 3;                  /* watchdog */
    RCGC1 |= 1u << 12 | 1u;            /* I2C 0, UART 0 */
    RCGC2 |= 1u;                       /* GPIO A */
    uart_init();
    memcpy(port->name, "lm3s6965", 9);
    const uint32_t cause = RESET_CAUSE;
    RESET_CAUSE = 0;
    port->reset_cause = (uint8_t)((cause & 8u) != 0u ? 3u : (cause & 2u) != 0u ? 1u : (cause & 1u) != 0u ? 2u : 0u);
    if (has_eeprom()) {
        port->store_size = 4096;
        port->capabilities |= SCEANN_HAS_STORE;
    }
}
