#include "uart.h"

#include "sceann_numbers.h"
#include "wiring.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/delay.h>

#define RING 64u
#define NEXT(at) ((uint8_t)((at) + 1u) & (RING - 1u))

typedef struct {
    volatile uint8_t head, tail;
    uint8_t data[RING];
} ring;

static ring in, out;
static volatile bool bad_stop_bit;      /* of a zero byte: a BREAK, perhaps */

ISR(USART_RX_vect)
{
    const uint8_t status = UCSR0A;     /* belongs to the byte, so it is read first */
    const uint8_t byte = UDR0;
    if ((status & _BV(FE0)) != 0u && byte == 0u) {
        bad_stop_bit = true;           /* the byte still ends its frame, whose check sum tells what it is worth */
    }
    const uint8_t next = NEXT(in.head);
    if (next != in.tail) {
        in.data[in.head] = byte;
        in.head = next;
    }
}

ISR(USART_UDRE_vect)
{
    if (out.head == out.tail) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
        return;
    }
    UDR0 = out.data[out.tail];
    out.tail = NEXT(out.tail);
}

void uart_init(void)
{
    UCSR0A = _BV(U2X0);
    UBRR0 = (uint16_t)((F_CPU / 4u / BAUD - 1u) / 2u);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

int16_t uart_get(void)
{
    if (in.head == in.tail) {
        return -1;
    }
    const uint8_t byte = in.data[in.tail];
    in.tail = NEXT(in.tail);
    return byte;
}

void uart_put(uint8_t byte)
{
    const uint8_t next = NEXT(out.head);
    while (next == out.tail) {
    }
    out.data[out.head] = byte;
    out.head = next;
    UCSR0B |= _BV(UDRIE0);
}

bool uart_break(void)
{
    if (!bad_stop_bit) {
        return false;
    }
    bad_stop_bit = false;
    for (uint8_t k = 0; k < SCEANN_BREAK_US / 10u; k++) {
        if ((LINE_PIN & LINE_IN) != 0u) {
            return false;              /* a bad stop bit: whoever sends lets go of the line within a frame */
        }
        _delay_us(10);
    }
    return true;
}

bool uart_has_input(void)
{
    return in.head != in.tail;
}
