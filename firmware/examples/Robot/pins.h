/*
 * What hangs on which pin, board by board. Sensors are analogue inputs, sensor 0 first: the one furthest to the right. Motor 0
 * is the left wheel, motor 1 the right one, as in the simulation. A pin that you do not use is NONE.
 *
 * For another board copy a block, put its pins in, and say its name with -DROBOT_PINS or at the end of the list.
 */
#ifndef PINS_H
#define PINS_H

#define NONE 255

#if defined(ARDUINO_ARCH_ESP32)
/* ESP32 (DevKit), ESP32-C3, ESP32-S3: analogue inputs of converter 1 only, the other one does not work beside Wi-Fi */
#if defined(CONFIG_IDF_TARGET_ESP32C3)
/* not GPIO2: it must be high when the chip starts. The button BOOT (GPIO9) starts a champion. The serial port takes two pins */
#define BOARD_NAME "esp32c3"
static const uint8_t SENSOR_PINS[] = { 0, 1, 3, 4 };
static const uint8_t SPEED_PINS[] = { 5, 6 }, DIRECTION_PINS[] = { 7, 10 };
#if defined(ARDUINO_USB_CDC_ON_BOOT) && ARDUINO_USB_CDC_ON_BOOT
enum { BUMPER_PIN = 20, STOP_PIN = 21, START_PIN = 9, LIGHT_PIN = 8 };     /* Serial is the chip's own USB: 18 and 19 */
#else
enum { BUMPER_PIN = 18, STOP_PIN = 19, START_PIN = 9, LIGHT_PIN = 8 };     /* Serial is UART 0: 20 and 21 */
#endif
#elif defined(CONFIG_IDF_TARGET_ESP32S3)
#define BOARD_NAME "esp32s3"
static const uint8_t SENSOR_PINS[] = { 1, 2, 4, 5, 6 };
static const uint8_t SPEED_PINS[] = { 9, 10 }, DIRECTION_PINS[] = { 11, 12 };
enum { BUMPER_PIN = 13, STOP_PIN = 14, START_PIN = 15, LIGHT_PIN = 16 };
#else
#define BOARD_NAME "esp32"
static const uint8_t SENSOR_PINS[] = { 32, 33, 34, 35, 36 };
static const uint8_t SPEED_PINS[] = { 16, 17 }, DIRECTION_PINS[] = { 18, 19 };
enum { BUMPER_PIN = 21, STOP_PIN = 22, START_PIN = 23, LIGHT_PIN = 2 };
#endif
#elif defined(ARDUINO_ARCH_RP2040)
#define BOARD_NAME "pico arduino"      /* Raspberry Pi Pico: three analogue inputs */
static const uint8_t SENSOR_PINS[] = { 26, 27, 28 };
static const uint8_t SPEED_PINS[] = { 16, 17 }, DIRECTION_PINS[] = { 18, 19 };
enum { BUMPER_PIN = 14, STOP_PIN = 15, START_PIN = 13, LIGHT_PIN = 25 };
#elif defined(TEENSYDUINO)
#define BOARD_NAME "teensy"            /* Teensy 3.x, 4.x */
static const uint8_t SENSOR_PINS[] = { A0, A1, A2, A3, A4 };
static const uint8_t SPEED_PINS[] = { 5, 6 }, DIRECTION_PINS[] = { 4, 7 };
enum { BUMPER_PIN = 2, STOP_PIN = 3, START_PIN = 8, LIGHT_PIN = 13 };
#elif defined(ARDUINO_BBC_MICROBIT_V2)
#define BOARD_NAME "microbit 2"        /* pins 0, 1, 2 and 10 are analogue; button A starts */
static const uint8_t SENSOR_PINS[] = { 0, 1, 2 };
static const uint8_t SPEED_PINS[] = { 13, 14 }, DIRECTION_PINS[] = { 15, 16 };
enum { BUMPER_PIN = 8, STOP_PIN = 9, START_PIN = 5, LIGHT_PIN = NONE };
#else
/* Uno, Nano, Uno R4, Nano 33 and all boards of their shape: pin for pin the drawing in firmware/README.md */
#if defined(ARDUINO_ARCH_RENESAS)
#define BOARD_NAME "uno r4"
#elif defined(ARDUINO_ARCH_SAMD) || defined(ARDUINO_ARCH_MBED)
#define BOARD_NAME "nano 33"
#elif defined(ARDUINO_AVR_NANO)
#define BOARD_NAME "nano"
#else
#define BOARD_NAME "uno arduino"
#endif
static const uint8_t SENSOR_PINS[] = { A0, A1, A2, A3, A4 };
static const uint8_t SPEED_PINS[] = { 6, 5 }, DIRECTION_PINS[] = { 7, 4 };
enum { BUMPER_PIN = 2, STOP_PIN = 3, START_PIN = 8, LIGHT_PIN = 13 };
#endif

#endif
