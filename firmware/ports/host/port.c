/* The UART is stdin and stdout, time is the host's, and the converter is the file adc.bin. */
#include "port.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

enum { OUTGOING = 256, POLL_EVERY = 64 };

static uint8_t outgoing[OUTGOING];
static size_t waiting;
static unsigned int polls;
static int converter = -1;

static void flush(void)
{
    size_t at = 0;
    while (at < waiting) {
        const ssize_t done = write(STDOUT_FILENO, outgoing + at, waiting - at);
        if (done <= 0) {
            exit(EXIT_SUCCESS); /* nobody listens any more */
        }
        at += (size_t)done;
    }
    waiting = 0;
}

static void receive(int wait_ms)
{
    uint8_t bytes[256];
    struct pollfd input = {STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, wait_ms) <= 0) {
        return;
    }
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
    if (count <= 0) {
        exit(EXIT_SUCCESS); /* unplugged */
    }
    for (ssize_t i = 0; i < count; i++) {
        port_received(bytes[i]);
    }
}

void port_init(void)
{
    converter = open("adc.bin", O_RDONLY | O_CLOEXEC);
}

/* The node polls after every byte; a system call every time would cost more than the node. */
void port_poll(void)
{
    polls++;
    if (polls % POLL_EVERY == 0U) {
        receive(0);
    }
}

bool port_write(uint8_t byte)
{
    outgoing[waiting] = byte;
    waiting++;
    if (waiting == OUTGOING) {
        flush();
    }
    return true;
}

uint32_t port_time_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000000U + (uint64_t)now.tv_nsec / 1000U);
}

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    uint8_t row[2 * 64];
    const off_t size = (converter < 0) ? 0 : lseek(converter, 0, SEEK_END);
    const off_t stride = (off_t)2 * count;
    if (size < stride || (size_t)stride > sizeof row) {
        return false;
    }
    const off_t at = (off_t)(conversion % (uint64_t)(size / stride)) * stride;
    if (pread(converter, row, (size_t)stride, at) != (ssize_t)stride) {
        return false;
    }
    for (uint8_t i = 0; i < count; i++) {
        codes[i] = (int16_t)(row[2 * i] | (uint16_t)(row[2 * i + 1] << 8));
    }
    return true;
}

void port_idle(void)
{
    flush();
    receive(1);
}
