/* The portable Arduino API as every core declares it, on this computer: what the sketch asks of it is noted, analogue inputs give
 * what a converter with the resolution that was asked for gives. For tests of pin tables and of boards whose core is not to be had here. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2

/* far from all digital pins */
enum { A0 = 100, A1, A2, A3, A4, A5 };

unsigned long micros(void);
void pinMode(int pin, int mode);
void digitalWrite(int pin, int value);
int digitalRead(int pin);
int analogRead(int pin);
void analogReadResolution(int bits);
void analogWrite(int pin, int value);

struct SerialPort {
    void begin(unsigned long baud);
    int available();
    int read();
    size_t write(const uint8_t *data, size_t n);
};
extern SerialPort Serial;

#endif
