/*
 * An AVR chip inside the calling process: libsimavr behind a small C interface for ctypes (simavr.py). Cycle-exact and
 * repeatable: nothing here waits for the host's clock.
 */
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define QUEUE 65536u
#define BREAK 0x100u                   /* in the input queue: a BREAK instead of a byte */

typedef struct {
    uint16_t data[QUEUE];
    unsigned head, tail;
} queue;

typedef struct {
    avr_t *avr;
    avr_irq_t *uart_input;
    queue to_chip, from_chip;
    int uart_ready;
    uint64_t mark_cycle;               /* when the marker register was last written with a value other than 0 */
    avr_ioport_external_t external[8]; /* ports A to H: levels from outside */
    uint64_t marked_min, marked_max;   /* cycles from there to the write of 0 */
} chip;

static unsigned used(const queue *q)
{
    return (q->head + QUEUE - q->tail) % QUEUE;
}

static int put(queue *q, uint16_t value)
{
    if (used(q) == QUEUE - 1u) {
        return 0;
    }
    q->data[q->head] = value;
    q->head = (q->head + 1u) % QUEUE;
    return 1;
}

static uint16_t take(queue *q)
{
    const uint16_t value = q->data[q->tail];
    q->tail = (q->tail + 1u) % QUEUE;
    return value;
}

static void no_sleep(avr_t *avr, avr_cycle_count_t howlong)
{
    (void)avr;
    (void)howlong;
}

static void no_log(avr_t *avr, const int level, const char *format, va_list arguments)
{
    (void)avr;
    (void)level;
    (void)format;
    (void)arguments;
}

void chip_pin(chip *c, char port, int pin, int level);

/* ---- UART 0 ------------------------------------------------------------------------------------------------------ */

static void feed(chip *c)              /* while the simulated receiver has room */
{
    while (c->uart_ready && used(&c->to_chip) > 0u) {
        const uint16_t value = take(&c->to_chip);
        avr_raise_irq(c->uart_input, value == BREAK ? UART_INPUT_FE : value);
    }
}

static void on_output(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)put(&((chip *)param)->from_chip, (uint8_t)value);
}

static void on_xon(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)value;
    ((chip *)param)->uart_ready = 1;
    feed(param);
}

static void on_xoff(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)value;
    ((chip *)param)->uart_ready = 0;
}

/* ---- cycle marker: firmware writes a value before and 0 after what is to be measured -------------------------------- */

static void on_mark(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    chip *c = param;
    avr->data[address] = value;
    if (value != 0u) {
        c->mark_cycle = avr->cycle;
        return;
    }
    const uint64_t cycles = avr->cycle - c->mark_cycle;
    c->marked_min = cycles < c->marked_min ? cycles : c->marked_min;
    c->marked_max = cycles > c->marked_max ? cycles : c->marked_max;
}

void chip_mark_at(chip *c, unsigned io_address)
{
    c->marked_min = UINT64_MAX;
    c->marked_max = 0;
    avr_register_io_write(c->avr, (avr_io_addr_t)io_address, on_mark, c);
}

uint64_t chip_marked_min(const chip *c)
{
    return c->marked_min;
}

uint64_t chip_marked_max(const chip *c)
{
    return c->marked_max;
}

/* What is outside stays at the pins in a reset, whatever caused it; the simulator would forget it. */
static void keep_pins(avr_t *avr)
{
    static const uint16_t registers[] = { 0, 0x23, 0x26, 0x29 };       /* PINB, PINC, PIND */
    const chip *c = avr->custom.data;
    for (unsigned k = 1; k < 4u; k++) {
        avr->data[registers[k]] = (uint8_t)(c->external[k].value & c->external[k].mask);
    }
}

/* ---- life -------------------------------------------------------------------------------------------------------- */

/* `image` is an ELF file, or a binary one that is put at reset_pc (a boot loader). */
chip *chip_new(const char *image, int is_binary, const char *mcu, uint32_t hz, uint32_t reset_pc, uint8_t reset_flags)
{
    avr_global_logger_set(no_log);
    avr_t *avr = avr_make_mcu_by_name(mcu);
    chip *c = calloc(1, sizeof *c);
    if (avr == NULL || c == NULL) {
        free(c);
        return NULL;
    }
    avr_init(avr);
    if (is_binary) {
        FILE *file = fopen(image, "rb");
        memset(avr->flash, 0xFF, avr->flashend + 1u);
        if (file == NULL || fread(avr->flash + reset_pc, 1, avr->flashend + 1u - reset_pc, file) == 0u) {
            free(c);
            return NULL;
        }
        fclose(file);
        avr->frequency = hz;
        avr->codeend = avr->flashend;
    } else {
        elf_firmware_t firmware;
        memset(&firmware, 0, sizeof firmware);
        if (elf_read_firmware(image, &firmware) != 0) {
            free(c);
            return NULL;
        }
        firmware.frequency = hz;
        avr_load_firmware(avr, &firmware);
    }
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->pc = avr->reset_pc = reset_pc;
    avr->data[0x54] = reset_flags;     /* MCUSR */
    avr->sleep = no_sleep;
    c->avr = avr;
    avr->custom.data = c;
    avr->reset = keep_pins;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    c->uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_output, c);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), on_xon, c);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), on_xoff, c);
    return c;
}

void chip_free(chip *c)
{
    avr_terminate(c->avr);
    free(c);
}

int chip_write(chip *c, const uint8_t *data, int n)     /* bytes accepted */
{
    int k = 0;
    while (k < n && put(&c->to_chip, data[k])) {
        k++;
    }
    feed(c);
    return k;
}

static avr_cycle_count_t release_line(avr_t *avr, avr_cycle_count_t when, void *param)
{
    (void)avr;
    (void)when;
    chip_pin(param, 'D', 0, 1);
    return 0;
}

/* The line is low for so many cycles: a zero byte without its stop bit. */
void chip_low(chip *c, uint64_t cycles)
{
    chip_pin(c, 'D', 0, 0);
    avr_cycle_timer_register(c->avr, cycles, release_line, c);
    (void)put(&c->to_chip, BREAK);
    feed(c);
}

/* A reset with these flags in MCUSR; RAM and registers of the program stay as they are. */
void chip_reset(chip *c, uint8_t flags)
{
    avr_reset(c->avr);
    c->avr->data[0x54] = flags;
}

void chip_supply(chip *c, uint32_t millivolts)
{
    c->avr->vcc = c->avr->avcc = c->avr->aref = millivolts;
}

/* More of a program, such as a boot loader beside an application. */
void chip_flash(chip *c, unsigned at, const uint8_t *data, unsigned n)
{
    memcpy(c->avr->flash + at, data, n);
    c->avr->codeend = c->avr->flashend;
}

void chip_start_at(chip *c, unsigned at)
{
    c->avr->pc = c->avr->reset_pc = at;
}

int chip_read(chip *c, uint8_t *data, int n)
{
    int k = 0;
    while (k < n && used(&c->from_chip) > 0u) {
        data[k++] = (uint8_t)take(&c->from_chip);
    }
    return k;
}

int chip_waiting(const chip *c)
{
    return (int)used(&c->from_chip);
}

/* Runs until `want` bytes wait (0: do not care), at most so many cycles; simavr's state (6 done, 7 crashed). */
int chip_run(chip *c, int want, uint64_t cycles)
{
    const uint64_t end = c->avr->cycle + cycles;
    int state = c->avr->state;
    while (c->avr->cycle < end && (want == 0 || used(&c->from_chip) < (unsigned)want)) {
        state = avr_run(c->avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            break;
        }
    }
    return state;
}

uint64_t chip_cycles(const chip *c)
{
    return c->avr->cycle;
}

/* ---- memory and pins --------------------------------------------------------------------------------------------- */

void chip_peek(const chip *c, unsigned at, uint8_t *data, unsigned n)
{
    memcpy(data, c->avr->data + at, n);
}

void chip_poke(chip *c, unsigned at, const uint8_t *data, unsigned n)
{
    memcpy(c->avr->data + at, data, n);
}

/* `steps` times: `in` (n_in bytes) goes to at_in, `command` to at_flag, the chip runs until the flag is 0, and n_out
 * bytes from at_out go to `out`. 0 when all is done, else simavr's state (or -1: no end within max_cycles). */
int chip_exchange(chip *c, unsigned at_flag, uint8_t command, unsigned at_in, const uint8_t *in, unsigned n_in,
                  unsigned at_out, uint8_t *out, unsigned n_out, unsigned steps, uint64_t max_cycles)
{
    for (unsigned k = 0; k < steps; k++) {
        const uint64_t end = c->avr->cycle + max_cycles;
        memcpy(c->avr->data + at_in, in + (size_t)k * n_in, n_in);
        c->avr->data[at_flag] = command;
        while (c->avr->data[at_flag] != 0u) {
            const int state = avr_run(c->avr);
            if (state == cpu_Done || state == cpu_Crashed) {
                return state;
            }
            if (c->avr->cycle > end) {
                return -1;
            }
        }
        memcpy(out + (size_t)k * n_out, c->avr->data + at_out, n_out);
    }
    return 0;
}

/* The program hangs from now on, deaf to interrupts: only the watchdog can help. */
void chip_hang(chip *c)
{
    static const uint8_t loop[] = { 0x00, 0x00, 0xFE, 0xCF };  /* nop, and back to it */
    const uint32_t at = 0x7E00u - sizeof loop;     /* below a boot loader */
    memcpy(c->avr->flash + at, loop, sizeof loop);
    c->avr->pc = at;
    c->avr->sreg[S_I] = 0;
    c->avr->state = cpu_Running;       /* it may have been asleep */
}

void chip_adc(chip *c, int channel, uint32_t millivolts)
{
    avr_raise_irq(avr_io_getirq(c->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + channel), millivolts);
}

void chip_pin(chip *c, char port, int pin, int level)
{
    /* what is outside wins over the pull-up, also when the program writes the port again */
    avr_ioport_external_t *external = &c->external[port - 'A'];
    const unsigned bit = 1u << pin;
    external->name = (unsigned long)port & 0x7Fu;
    external->mask = (external->mask | bit) & 0xFFu;
    external->value = (level ? external->value | bit : external->value & ~bit) & 0xFFu;
    avr_ioctl(c->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), external);
    avr_raise_irq(avr_io_getirq(c->avr, AVR_IOCTL_IOPORT_GETIRQ(port), IOPORT_IRQ_PIN0 + pin), (uint32_t)level);
}

unsigned chip_eeprom_size(const chip *c)
{
    return c->avr->e2end + 1u;
}

void chip_eeprom_set(chip *c, uint8_t *data, unsigned n)
{
    avr_eeprom_desc_t d = { .ee = data, .offset = 0, .size = n };
    avr_ioctl(c->avr, AVR_IOCTL_EEPROM_SET, &d);
}

void chip_eeprom_get(chip *c, uint8_t *data, unsigned n)
{
    avr_eeprom_desc_t d = { .ee = NULL, .offset = 0, .size = n };      /* NULL: simavr answers with its own buffer */
    avr_ioctl(c->avr, AVR_IOCTL_EEPROM_GET, &d);
    if (d.ee != NULL) {
        memcpy(data, d.ee, n);
    }
}
