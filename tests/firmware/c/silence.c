/* A robot whose host fell silent, for as long as its clock takes to wrap twice: at every tenth of a second of the second
 * and third turn another host asks for it, and must get it. 0 if it always does. */
#include "sceann_internal.h"

static uint32_t clock;
static uint16_t asked;
static uint8_t answer;
static bool ask;

static uint32_t clock_us(void *board)
{
    (void)board;
    return clock;
}

static sceann_received receive(void *board, sceann_message *message)
{
    (void)board;
    if (!ask) {
        return SCEANN_NOTHING;
    }
    ask = false;
    *message = (sceann_message){ .id = 0x401, .length = 8, .data = { 1, SCEANN_LINK_VERSION } };
    sceann_put32(&message->data[2], sceann_arithmetic_id());
    sceann_put16(&message->data[6], asked);
    return SCEANN_MESSAGE;
}

static void send(void *board, const sceann_message *message)
{
    (void)board;
    if (message->id == 0x481) {
        answer = message->data[1];
    }
}

static uint16_t nothing(void *board)
{
    (void)board;
    return 0;
}

static void safe(void *board)
{
    (void)board;
}

static void watchdog(void *board, sceann_watchdog action)
{
    (void)board;
    (void)action;
}

int main(void)
{
    static const sceann_port port = { .node = 1, .capabilities = SCEANN_HAS_HIL, .clock_us = clock_us,
                                      .receive = receive, .send = send, .safe = safe, .alarms = nothing,
                                      .battery_mv = nothing, .watchdog = watchdog };
    static sceann_robot robot, kept;
    sceann_robot_start(&robot, &port);
    asked = 1;
    ask = true;
    sceann_robot_poll(&robot);
    uint64_t time = 0;
    while (time < 2ull << 32) {
        time += 10000u;
        clock = (uint32_t)time;
        sceann_robot_poll(&robot);
        if (time > 2000000u && time % 100000u == 0u) {
            kept = robot;              /* ask, and go on as if nobody had asked */
            asked = 2;
            ask = true;
            answer = 255;
            sceann_robot_poll(&robot);
            if (answer != 0u) {
                return 1;
            }
            robot = kept;
        }
    }
    return 0;
}
