/*
 * Constant tables in flash: plain `const` everywhere except on AVR, whose flash is a separate address space.
 */
#ifndef SCEANN_TABLE_H
#define SCEANN_TABLE_H

#include <stdint.h>

#if defined(__AVR__)
#include <avr/pgmspace.h>
#define SCEANN_TABLE PROGMEM
#define SCEANN_TABLE_WORD(address) pgm_read_word(address)
#else
#define SCEANN_TABLE
#define SCEANN_TABLE_WORD(address) (*(address))
#endif

#endif
