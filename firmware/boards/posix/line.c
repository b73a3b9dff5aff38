#define _GNU_SOURCE
#include "board.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#define QUEUE 4096u
#define UART_RING 64u                  /* what a microcontroller keeps before it waits for its line */

typedef struct {
    uint8_t data[QUEUE];
    size_t n;                          /* bytes waiting, data[0] first */
    double free_us;                    /* paced: when the line is free for the next byte */
} queue;

static int line = -1, alive = -1;
static double byte_us;                 /* 10 bits; 0 = not paced */
static queue in, out;
static sceann_decoder decoder;

void line_open(int fd, uint32_t baud)
{
    line = fd;
    byte_us = baud == 0u ? 0.0 : 1e7 / baud;
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
    prctl(PR_SET_TIMERSLACK, 1000ul);  /* paced bytes leave within microseconds, not 50 us late */
}

void line_ends_with(int fd)
{
    alive = fd;
}

static void drop(queue *q, size_t n)
{
    q->n -= n;
    memmove(q->data, q->data + n, q->n);
}

/* Bytes of the queue whose time on the line is over. */
static size_t ready(const queue *q, double now_us)
{
    if (byte_us == 0.0) {
        return q->n;
    }
    const double over = (now_us - q->free_us) / byte_us;
    return over <= 0.0 ? 0u : over >= (double)q->n ? q->n : (size_t)over;
}

static void taken(queue *q, size_t n)
{
    q->free_us += (double)n * byte_us;
    drop(q, n);
}

static void append(queue *q, const uint8_t *data, size_t n)
{
    const double now = (double)clock_now_us();
    if (q->n == 0u && q->free_us < now) {
        q->free_us = now;              /* the line was idle: its first byte starts now */
    }
    memcpy(q->data + q->n, data, n);
    q->n += n;
}

static void move_out(void)
{
    const size_t n = ready(&out, (double)clock_now_us());
    if (n == 0u) {
        return;
    }
    const ssize_t written = write(line, out.data, n);
    if (byte_us != 0.0) {
        taken(&out, n);                /* a UART does not wait for a reader: what nobody takes is lost */
    } else if (written > 0) {
        drop(&out, (size_t)written);
    }
}

static void move_in(void)
{
    uint8_t data[1024];
    const size_t room = QUEUE - in.n < sizeof data ? QUEUE - in.n : sizeof data;
    const ssize_t n = read(line, data, room);
    if (n > 0) {
        append(&in, data, (size_t)n);
    }
}

sceann_received line_receive(void *board, sceann_message *message)
{
    (void)board;
    if (in.n == 0u) {
        move_in();
    }
    const size_t n = ready(&in, (double)clock_now_us());
    for (size_t k = 0; k < n; k++) {
        const sceann_received result = sceann_frame_decode(&decoder, in.data[k], message);
        if (result != SCEANN_NOTHING) {
            taken(&in, k + 1u);
            return result;
        }
    }
    taken(&in, n);
    return SCEANN_NOTHING;
}

static void sleep_us(double us)
{
    const struct timespec t = { (time_t)(us / 1e6), (long)((us - 1e6 * (double)(time_t)(us / 1e6)) * 1e3) };
    if (us > 0.0) {
        nanosleep(&t, NULL);
    }
}

void line_send(void *board, const sceann_message *message)
{
    (void)board;
    uint8_t frame[SCEANN_FRAME_MAX];
    const uint8_t n = sceann_frame_encode(message, frame);
    if (byte_us != 0.0) {
        while (out.n + n > UART_RING) {
            sleep_us(byte_us);
            move_out();
        }
    } else if (out.n + n > QUEUE) {
        return;                        /* nobody reads: dropped, as a USB adapter does */
    }
    append(&out, frame, n);
    move_out();
}

void line_wait(uint32_t timeout_us, uint32_t allowed_us)
{
    const double now = (double)clock_now_us();
    double timeout = (double)timeout_us;
    short events = in.n < QUEUE ? POLLIN : 0;
    if (byte_us != 0.0) {
        /* wake for whole frames on the way out and for every byte on the way in */
        if (out.n > 0u && out.free_us + byte_us - now < timeout) {
            timeout = out.free_us + byte_us * (double)out.n - now;
        }
        if (in.n > 0u && in.free_us + byte_us - now < timeout) {
            timeout = in.free_us + byte_us - now;
        }
        timeout = timeout > (double)timeout_us ? (double)timeout_us : timeout;
    } else {
        if (in.n > 0u) {
            timeout = 0.0;
        }
        if (out.n > 0u) {
            events |= POLLOUT;
        }
    }
    timeout = timeout < 0.0 ? 0.0 : timeout;
    struct pollfd fs[2] = { { line, events, 0 }, { alive, 0, 0 } };
    const struct pollfd *f = &fs[0];
    const struct timespec t = { (time_t)(timeout / 1e6), (long)((timeout - 1e6 * (double)(time_t)(timeout / 1e6)) * 1e3) };
    const int ready_n = ppoll(fs, 2, &t, NULL);
    const double overslept = (double)clock_now_us() - now - timeout;
    if (overslept > 0.0) {
        clock_forgive((uint64_t)overslept, allowed_us);
    }
    if (fs[1].revents != 0) {
        exit(0);
    }
    if (ready_n > 0) {
        if (f->revents & (POLLHUP | POLLERR | POLLNVAL)) {
            sleep_us(1000.0);          /* unplugged: wait for the next opening of the terminal */
        }
        if (f->revents & POLLIN) {
            move_in();
        }
    }
    move_out();
}
