/*
 * Raspberry Pi Pico (RP2040): UART 0 on GP0 (out) and GP1 (in), sensors on GP26 to GP28, motors by PWM on GP16 (left) and
 * GP17 (right) with directions on GP18 and GP19, bumper GP14, stop button GP15, start button GP13, light GP25. The last
 * 8 KB of the 2 MB of flash are the store.
 */
#include "chip.h"

#include "sceann_flash.h"

#include <string.h>

#define SET(address) REGISTER((address) + 0x2000u)
#define CLEAR(address) REGISTER((address) + 0x3000u)
#define RESETS 0x4000C000u
#define CLOCKS(offset) REGISTER(0x40008000u + (offset))
#define XOSC 0x40024000u
#define PLL_SYS 0x40028000u
#define PLL_USB 0x4002C000u
#define IO(pin) REGISTER(0x40014004u + 8u * (pin))
#define PAD(pin) REGISTER(0x4001C004u + 4u * (pin))
#define UART(offset) REGISTER(0x40034000u + (offset))
#define ADC(offset) REGISTER(0x4004C000u + (offset))
#define PWM0(offset) REGISTER(0x40050000u + (offset))      /* slice 0: GP16 and GP17 */
#define WATCHDOG 0x40058000u
#define TIMER_RAW REGISTER(0x40054028u)
#define CHIP_RESET REGISTER(0x40064008u)
#define SIO_IN REGISTER(0xD0000004u)
#define SIO_OUT_SET REGISTER(0xD0000014u)
#define SIO_OUT_CLEAR REGISTER(0xD0000018u)
#define SIO_ENABLE_SET REGISTER(0xD0000024u)

#define PIN_RX 1u
#define PIN_START 13u
#define PIN_BUMPER 14u
#define PIN_STOP 15u
#define PIN_LEFT 16u
#define PIN_RIGHT 17u
#define PIN_LEFT_FORWARD 18u
#define PIN_RIGHT_FORWARD 19u
#define PIN_LIGHT 25u
#define PIN_SENSOR0 26u
#define N_SENSORS 3u
#define FUNCTION_UART 2u
#define FUNCTION_PWM 4u
#define FUNCTION_SIO 5u
#define PAD_INPUT_PULL_UP 0x5Au
#define PATIENCE 1000000u

const uint32_t chip_clock_mhz_x10 = 0;
const uint8_t chip_uart_interrupt = 20;

static void wait_for(volatile uint32_t *flags, uint32_t mask)
{
    for (uint32_t polls = 0; (*flags & mask) == 0u && polls < PATIENCE; polls++) {
    }
}

static void out_of_reset(uint32_t blocks)
{
    CLEAR(RESETS) = blocks;
    wait_for(&REGISTER(RESETS + 8u), blocks);
}

/* ---- clocks: crystal 12 MHz, core 125 MHz, converter 48 MHz, timer and watchdog 1 MHz ------------------------------- */

static void pll(uintptr_t base, uint32_t feedback, uint32_t dividers)
{
    REGISTER(base) = 1;
    REGISTER(base + 8u) = feedback;
    CLEAR(base + 4u) = 0x21u;
    wait_for(&REGISTER(base), 1u << 31);
    REGISTER(base + 0xCu) = dividers;
    CLEAR(base + 4u) = 8u;
}

static void clock_init(void)
{
    REGISTER(XOSC) = 0xAA0u;
    REGISTER(XOSC + 0xCu) = 47;
    SET(XOSC) = 0xFABu << 12;
    wait_for(&REGISTER(XOSC + 4u), 1u << 31);
    CLOCKS(0x30u) = 2;                 /* reference from the crystal */
    wait_for(&CLOCKS(0x38u), 4u);
    out_of_reset(1u << 12 | 1u << 13);
    pll(PLL_SYS, 125, 6u << 16 | 2u << 12);
    pll(PLL_USB, 100, 5u << 16 | 5u << 12);
    CLOCKS(0x3Cu) = 1;                 /* core from its PLL */
    wait_for(&CLOCKS(0x44u), 2u);
    CLOCKS(0x48u) = 1u << 11;          /* peripherals from the core */
    CLOCKS(0x60u) = 1u << 11;          /* converter */
    REGISTER(WATCHDOG + 0x2Cu) = 1u << 9 | 12u;
}

uint32_t chip_clock_us(void)
{
    return TIMER_RAW;
}

bool chip_may_sleep(uint32_t us)
{
    (void)us;
    return false;                      /* no timer interrupt: the loop polls */
}

/* ---- UART ---------------------------------------------------------------------------------------------------------- */

static void uart_init(void)
{
    out_of_reset(1u << 21 | 1u << 22);
    IO(0) = FUNCTION_UART;
    IO(PIN_RX) = FUNCTION_UART;
    PAD(PIN_RX) = PAD_INPUT_PULL_UP;   /* an open line is no BREAK */
    UART(0x24u) = 67;                  /* 125 MHz / 16 / 115200 = 67 + 52/64 */
    UART(0x28u) = 52;
    UART(0x2Cu) = 0x70;
    UART(0x34u) = 0;
    UART(0x38u) = 0x50;
    UART(0x30u) = 0x301;
}

int chip_uart_get(bool *bad_stop_bit)
{
    if ((UART(0x18u) & 0x10u) != 0u) {
        UART(0x44u) = 0x7F0u;
        return -1;
    }
    const uint32_t data = UART(0u);
    if ((data & 0x500u) != 0u && (data & 0xFFu) == 0u) {
        *bad_stop_bit = true;
    }
    return (int)(data & 0xFFu);
}

bool chip_line_is_low(void)
{
    return (SIO_IN & 1u << PIN_RX) == 0u;
}

bool chip_uart_put(uint8_t byte)
{
    if ((UART(0x18u) & 0x20u) != 0u) {
        return false;
    }
    UART(0u) = byte;
    return true;
}

/* ---- body ---------------------------------------------------------------------------------------------------------- */

static void safe(void *board)
{
    (void)board;
    PWM0(0x0Cu) = 0;
    SIO_OUT_CLEAR = 1u << PIN_LEFT_FORWARD | 1u << PIN_RIGHT_FORWARD;
}

static void motor_init(void)
{
    out_of_reset(1u << 5 | 1u << 8 | 1u << 14);        /* pins, pads, PWM */
    PWM0(0x10u) = 1023;                /* duty 0..1024 of 1024 */
    PWM0(0x04u) = 6u << 4;             /* 125 MHz / 6 / 1024 = 20 kHz */
    PWM0(0x0Cu) = 0;
    PWM0(0x00u) = 1;
    IO(PIN_LEFT) = FUNCTION_PWM;
    IO(PIN_RIGHT) = FUNCTION_PWM;
    const uint32_t outputs = 1u << PIN_LEFT_FORWARD | 1u << PIN_RIGHT_FORWARD | 1u << PIN_LIGHT;
    SIO_OUT_CLEAR = outputs;
    SIO_ENABLE_SET = outputs;
    IO(PIN_LEFT_FORWARD) = FUNCTION_SIO;
    IO(PIN_RIGHT_FORWARD) = FUNCTION_SIO;
    IO(PIN_LIGHT) = FUNCTION_SIO;
    static const uint8_t switches[] = { PIN_START, PIN_BUMPER, PIN_STOP };
    for (uint8_t k = 0; k < sizeof switches; k++) {
        PAD(switches[k]) = PAD_INPUT_PULL_UP;
        IO(switches[k]) = FUNCTION_SIO;
    }
}

static void drive(void *board, const int16_t *motors)
{
    (void)board;
    SIO_OUT_SET = 1u << PIN_LEFT_FORWARD | 1u << PIN_RIGHT_FORWARD;
    PWM0(0x0Cu) = (uint32_t)motors[0] | (uint32_t)motors[1] << 16;
}

static void sensor_init(void)
{
    out_of_reset(1u);
    ADC(0u) = 1;
    wait_for(&ADC(0u), 0x100u);
    for (uint32_t k = 0; k < N_SENSORS; k++) {
        PAD(PIN_SENSOR0 + k) = 0x80u;  /* analogue: no input buffer, no pulls */
    }
}

static void sense(void *board, uint16_t *sensors)
{
    (void)board;
    for (uint32_t k = 0; k < N_SENSORS; k++) {
        ADC(0u) = 1u | k << 12;
        ADC(0u) = 1u | 4u | k << 12;
        wait_for(&ADC(0u), 0x100u);
        sensors[k] = (uint16_t)(ADC(4u) >> 2);         /* 12 bits */
    }
}

uint16_t chip_switches(void)
{
    const uint32_t levels = SIO_IN;
    return (uint16_t)(((levels & 1u << PIN_STOP) == 0u ? SCEANN_ALARM_ESTOP : 0u) |
                      ((levels & 1u << PIN_BUMPER) == 0u ? SCEANN_ALARM_BUMPER : 0u) |
                      ((levels & 1u << PIN_START) == 0u ? SCEANN_ALARM_BUTTON : 0u));
}

static void light(void *board, bool on)
{
    (void)board;
    if (on) {
        SIO_OUT_SET = 1u << PIN_LIGHT;
    } else {
        SIO_OUT_CLEAR = 1u << PIN_LIGHT;
    }
}

/* ---- store: the last two sectors of flash, written by the functions in the chip's ROM ------------------------------- */

#define XIP_BASE 0x10000000u
#define STORE (2040u * 1024u)
#define SECTOR 4096u
#define PAGE 256u

typedef void (*rom_function)(void);
typedef void (*rom_erase)(uint32_t at, uint32_t n, uint32_t block, uint32_t command);
typedef void (*rom_program)(uint32_t at, const uint8_t *data, uint32_t n);

static struct {
    rom_function connect, leave_xip, flush, enter_xip;
    rom_erase erase;
    rom_program program;
} rom;

/* A word at the beginning of the ROM, which compilers take for NULL. */
static uint16_t rom_word(uint32_t at)
{
    uint32_t word;
    __asm volatile("ldrh %0, [%1]" : "=l"(word) : "l"(at));
    return (uint16_t)word;
}

static void *rom_look_up(char a, char b)
{
    typedef void *(*look_up)(const uint16_t *table, uint32_t code);
    const look_up find = (look_up)(uintptr_t)rom_word(0x18u);
    return find((const uint16_t *)(uintptr_t)rom_word(0x14u), (uint32_t)(uint8_t)b << 8 | (uint8_t)a);
}

static bool rom_init(void)
{
    rom.connect = (rom_function)(uintptr_t)rom_look_up('I', 'F');
    rom.leave_xip = (rom_function)(uintptr_t)rom_look_up('E', 'X');
    rom.erase = (rom_erase)(uintptr_t)rom_look_up('R', 'E');
    rom.program = (rom_program)(uintptr_t)rom_look_up('R', 'P');
    rom.flush = (rom_function)(uintptr_t)rom_look_up('F', 'C');
    rom.enter_xip = (rom_function)(uintptr_t)rom_look_up('C', 'X');
    return rom.connect != NULL && rom.leave_xip != NULL && rom.erase != NULL && rom.program != NULL &&
           rom.flush != NULL && rom.enter_xip != NULL;
}

/* From RAM, with interrupts off: meanwhile there is no flash to run from. */
__attribute__((noinline, section(".data.in_ram"))) static void with_flash(uint32_t at, const uint8_t *page)
{
    __asm volatile("cpsid i" ::: "memory");
    rom.connect();
    rom.leave_xip();
    if (page == NULL) {
        rom.erase(at, SECTOR, 1u << 16, 0xD8u);
    } else {
        rom.program(at, page, PAGE);
    }
    rom.flush();
    rom.enter_xip();
    __asm volatile("cpsie i" ::: "memory");
}

static bool flash_read(void *chip, uint32_t at, uint8_t *data, uint16_t n)
{
    (void)chip;
    memcpy(data, (const void *)(uintptr_t)(XIP_BASE + STORE + at), n);
    return true;
}

/* Whole pages are programmed; 0xFF leaves a byte as it is. */
static bool flash_program(void *chip, uint32_t at, const uint8_t *data, uint16_t n)
{
    (void)chip;
    static uint8_t page[PAGE];
    for (uint16_t done = 0; done < n;) {
        const uint32_t in_page = (at + done) % PAGE;
        const uint16_t room = (uint16_t)(PAGE - in_page), part = (uint16_t)(n - done < room ? n - done : room);
        memset(page, 0xFF, sizeof page);
        memcpy(&page[in_page], &data[done], part);
        with_flash(STORE + at + done - in_page, page);
        done = (uint16_t)(done + part);
    }
    return true;
}

static bool flash_erase(void *chip, uint32_t at)
{
    (void)chip;
    with_flash(STORE + at, NULL);
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

/* ---- watchdog: the control tick's, as the port asks for it ---------------------------------------------------------- */

static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    if (action == SCEANN_WATCHDOG_OFF) {
        CLEAR(WATCHDOG) = 1u << 30;
        return;
    }
    REGISTER(WATCHDOG + 4u) = 2u * SCEANN_WATCHDOG_US;     /* it counts twice per tick (RP2040-E1) */
    if (action == SCEANN_WATCHDOG_ON) {
        REGISTER(0x40010008u) = 0x1FFFCu;                  /* everything but the oscillators */
        SET(WATCHDOG) = 1u << 30;
    }
}

void chip_watchdog_start(void)
{
}

void chip_watchdog_feed(void)
{
}

/* ---- start --------------------------------------------------------------------------------------------------------- */

void chip_init(sceann_port *port)
{
    motor_init();
    clock_init();
    uart_init();
    sensor_init();
    memcpy(port->name, "pico", 5);
    port->n_sensors = N_SENSORS;
    port->n_motors = 2;
    port->capabilities |= SCEANN_HAS_BODY | SCEANN_HAS_BUMPER | SCEANN_HAS_BUTTON | SCEANN_HAS_AUTORUN;
    port->tick_min = 60;               /* 6 ms: what a tick puts on the line at 115,200 baud */
    port->tick_max = 2500;
    port->sense = sense;
    port->drive = drive;
    port->safe = safe;
    port->light = light;
    port->watchdog = watchdog;
    const uint32_t causes = CHIP_RESET;
    port->reset_cause = (uint8_t)(REGISTER(WATCHDOG + 8u) != 0u     ? 3u
                                  : (causes & 0x100u) != 0u         ? 1u
                                  : (causes & 0x10000u) != 0u       ? 2u
                                                                    : 0u);
    if (rom_init() && sceann_flash_open(&flash, &device)) {
        port->store_size = SCEANN_STORE_BYTES;
        port->capabilities |= SCEANN_HAS_STORE;
    }
}
