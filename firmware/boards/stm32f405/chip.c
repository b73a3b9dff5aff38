/*
 * STM32F405 (Adafruit Feather, SparkFun MicroMod, Netduino Plus 2; QEMU's netduinoplus2): 168 MHz from the internal
 * oscillator, USART 1 on PA9 (out) and PA10 (in) or CAN 1 on PB8 and PB9, backup SRAM as store, independent watchdog.
 *
 * The backup SRAM lives as long as the chip or its VBAT pin has power. QEMU models neither it nor the clocks: reading it
 * there is a bus fault, so it is probed before use, and waits for clocks end by their bound.
 */
#include "chip.h"

#include "can.h"

#include <string.h>

#ifndef SCEANN_CAN
#define SCEANN_CAN 0                   /* 1: the link is on CAN, not on the UART */
#endif

#define RCC(offset) REGISTER(0x40023800u + (offset))
#define FLASH_ACR REGISTER(0x40023C00u)
#define PWR_CR REGISTER(0x40007000u)
#define PWR_CSR REGISTER(0x40007004u)
#define GPIOA(offset) REGISTER(0x40020000u + (offset))
#define GPIOB(offset) REGISTER(0x40020400u + (offset))
#define CAN(offset) REGISTER(0x40006400u + (offset))
#define USART(offset) REGISTER(0x40011000u + (offset))
#define IWDG(offset) REGISTER(0x40003000u + (offset))
#define UNIQUE_ID 0x1FFF7A10u
#define BACKUP ((volatile uint8_t *)0x40024000u)

#define PATIENCE 100000u               /* polls of a clock's ready flag */
#define APB2_HZ 84000000u
#define BAUD 115200u

const uint32_t chip_clock_mhz_x10 = 1680;
const uint8_t chip_uart_interrupt = 37;

static void wait_for(volatile uint32_t *flags, uint32_t mask, uint32_t value)
{
    for (uint32_t polls = 0; (*flags & mask) != value && polls < PATIENCE; polls++) {
    }
}

/* ---- clocks: 16 MHz internal oscillator, times 336, through 16 and 2: 168 MHz --------------------------------------- */

static void clock_init(void)
{
    FLASH_ACR = 1u << 10 | 1u << 9 | 1u << 8 | 5u;     /* caches, prefetch, five wait states */
    RCC(0x04u) = 7u << 24 | 336u << 6 | 16u;           /* Q 7, P 2, N 336, M 16, from the internal oscillator */
    RCC(0x00u) |= 1u << 24;
    wait_for(&RCC(0x00u), 1u << 25, 1u << 25);
    RCC(0x08u) = 4u << 13 | 5u << 10 | 2u;             /* APB2 by 2, APB1 by 4, system clock from the PLL */
    wait_for(&RCC(0x08u), 3u << 2, 2u << 2);
}

/* ---- UART -------------------------------------------------------------------------------------------------------- */

static void uart_init(void)
{
    RCC(0x30u) |= 1u;                                  /* GPIO A */
    RCC(0x44u) |= 1u << 4;                             /* USART 1 */
    GPIOA(0x24u) = (GPIOA(0x24u) & ~0xFF0u) | 0x770u;  /* alternate function 7 on PA9, PA10 */
    GPIOA(0x00u) = (GPIOA(0x00u) & ~(0xFu << 18)) | 0xAu << 18;
    GPIOA(0x0Cu) = (GPIOA(0x0Cu) & ~(3u << 20)) | 1u << 20;    /* pull-up on PA10: an open line is no BREAK */
    USART(0x08u) = (APB2_HZ + BAUD / 2u) / BAUD;
    USART(0x0Cu) = 1u << 13 | 1u << 5 | 1u << 3 | 1u << 2;     /* on, receive interrupt, both directions */
}

int chip_uart_get(bool *bad_stop_bit)
{
    const uint32_t status = USART(0u);
    if ((status & (1u << 5)) == 0u) {
        return -1;
    }
    const uint8_t byte = (uint8_t)USART(4u);
    if ((status & 2u) != 0u && byte == 0u) {
        *bad_stop_bit = true;
    }
    return byte;
}

bool chip_line_is_low(void)
{
    return (GPIOA(0x10u) & 1u << 10) == 0u;
}

bool chip_uart_put(uint8_t byte)
{
    if ((USART(0u) & (1u << 7)) == 0u) {
        return false;
    }
    USART(4u) = byte;
    return true;
}

/* ---- CAN: the driver is in can.c -------------------------------------------------------------------------------------- */

uint32_t can_get(uint32_t offset)
{
    return CAN(offset);
}

void can_put(uint32_t offset, uint32_t value)
{
    CAN(offset) = value;
}

#if SCEANN_CAN
static void can_link(sceann_port *port)
{
    RCC(0x30u) |= 1u << 1;                             /* GPIO B */
    RCC(0x40u) |= 1u << 25;                            /* CAN 1 */
    GPIOB(0x24u) = (GPIOB(0x24u) & ~0xFFu) | 0x99u;    /* alternate function 9 on PB8, PB9 */
    GPIOB(0x00u) = (GPIOB(0x00u) & ~(0xFu << 16)) | 0xAu << 16;
    GPIOB(0x0Cu) = (GPIOB(0x0Cu) & ~(3u << 16)) | 1u << 16;
    if (can_init()) {
        port->receive = can_receive;
        port->send = can_send;
        port->listen = can_listen;
    }
}

bool chip_may_sleep(uint32_t us)
{
    (void)us;
    return false;                                      /* frames are polled for */
}
#endif

/* ---- memory that may not be there ---------------------------------------------------------------------------------- */

static volatile bool probing, faulted;
void hard_fault(uint32_t *frame);

void hard_fault(uint32_t *frame)
{
    while (!probing) {                 /* a real fault: until the watchdog bites */
    }
    faulted = true;
    frame[6] += 2u;                    /* return behind the 16-bit load of `readable` */
}

__attribute__((naked)) void HardFault_Handler(void)
{
    __asm volatile("mrs r0, msp\n b hard_fault");
}

static bool readable(uintptr_t address)
{
    uint32_t value;
    probing = true;
    faulted = false;
    __asm volatile("ldrb.n %0, [%1]\n dsb" : "=l"(value) : "l"(address) : "memory");
    probing = false;
    (void)value;
    return !faulted;
}

/* ---- store ------------------------------------------------------------------------------------------------------- */

void chip_store_read(void *board, uint16_t at, uint8_t *data, uint8_t n)
{
    (void)board;
    for (uint8_t k = 0; k < n; k++) {
        data[k] = BACKUP[at + k];
    }
}

bool chip_store_write(void *board, uint16_t at, const uint8_t *data, uint8_t n)
{
    (void)board;
    for (uint8_t k = 0; k < n; k++) {
        BACKUP[at + k] = data[k];
    }
    return true;                       /* the core reads it back */
}

/* Switches the backup SRAM on; true if it holds what is written to its last byte. */
static bool has_store(void)
{
    volatile uint8_t *last = &BACKUP[4095];
    RCC(0x40u) |= 1u << 28;
    PWR_CR |= 1u << 8;
    RCC(0x30u) |= 1u << 18;
    PWR_CSR |= 1u << 9;
    wait_for(&PWR_CSR, 1u << 3, 1u << 3);
    if (!readable((uintptr_t)last)) {
        return false;
    }
    *last = 0xA5u;
    const bool first = *last == 0xA5u;
    *last = 0x5Au;
    return first && *last == 0x5Au;
}

/* ---- watchdog: 32 kHz / 16, 512 steps = 256 ms --------------------------------------------------------------------- */

void chip_watchdog_start(void)
{
    IWDG(0u) = 0x5555u;
    IWDG(4u) = 2;
    IWDG(8u) = 511;
    IWDG(0u) = 0xCCCCu;
}

void chip_watchdog_feed(void)
{
    IWDG(0u) = 0xAAAAu;
}

/* ---- start ------------------------------------------------------------------------------------------------------- */

void chip_init(sceann_port *port)
{
    clock_init();
    uart_init();
    memcpy(port->name, "stm32f405", 10);
#if SCEANN_CAN
    can_link(port);
#endif
    if (readable(UNIQUE_ID)) {
        memcpy(port->unique_id, (const void *)UNIQUE_ID, sizeof port->unique_id);
    }
    const uint32_t cause = RCC(0x74u);
    RCC(0x74u) |= 1u << 24;
    port->reset_cause = (uint8_t)((cause & (1u << 29)) != 0u   ? 3u
                                  : (cause & (1u << 27)) != 0u ? 1u
                                  : (cause & (1u << 28)) != 0u ? 5u
                                  : (cause & (1u << 26)) != 0u ? 2u
                                                               : 0u);
    if (has_store()) {
        port->store_size = 4095;
        port->capabilities |= SCEANN_HAS_STORE;
    }
}
