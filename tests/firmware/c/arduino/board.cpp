/* Runs the sketch on this computer: its serial port is standard input and output. Before that one line on standard error tells what setup()
 * did with every pin: number, mode, and what was written to it. FULL_BITS is the resolution that the board's core begins with. */
#include "Arduino.h"

#include <poll.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

void setup();
void loop();

SerialPort Serial;

static int bits = FULL_BITS, modes[256], written[256];
static unsigned long baud;

unsigned long micros(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (unsigned long)(uint32_t)(now.tv_sec * 1000000ll + now.tv_nsec / 1000);
}

void pinMode(int pin, int mode)
{
    modes[pin] = mode + 1;
}

void digitalWrite(int pin, int value)
{
    written[pin] = value;
}

int digitalRead(int)
{
    return HIGH;
}

/* three quarters of the scale */
int analogRead(int)
{
    return 3 << (bits - 2);
}

void analogReadResolution(int wanted)
{
    bits = wanted;
}

void analogWrite(int pin, int value)
{
    written[pin] = value;
}

void SerialPort::begin(unsigned long speed)
{
    baud = speed;
}

int SerialPort::available()
{
    struct pollfd input = { 0, POLLIN, 0 };
    return poll(&input, 1, 0) > 0 ? 1 : 0;
}

int SerialPort::read()
{
    uint8_t byte;
    if (::read(0, &byte, 1) != 1) {
        _exit(0);
    }
    return byte;
}

size_t SerialPort::write(const uint8_t *data, size_t n)
{
    return ::write(1, data, n) == (ssize_t)n ? n : 0;
}

int main()
{
    setup();
    fprintf(stderr, "%lu", baud);
    for (int pin = 0; pin < 256; pin++) {
        if (modes[pin] != 0) {
            fprintf(stderr, " %d:%d:%d", pin, modes[pin] - 1, written[pin]);
        }
    }
    fprintf(stderr, "\n");
    for (;;) {
        loop();
        usleep(100);
    }
}
