#include "node.h"

#include "cobs.h"
#include "messages.h"

/* Bytes between the wire and the node: port_received() alone writes `head`, take() alone `tail`. */
#if PORT_RECEIVE_BYTES <= 256
typedef uint8_t queue_index;
#else
typedef uint16_t queue_index;
#endif

static uint8_t queue[PORT_RECEIVE_BYTES];
static volatile queue_index head;
static volatile queue_index tail;
static volatile uint8_t lost;

static struct frame_reader reader;
static struct messages messages;
static uint8_t outgoing[PORT_FRAME_BYTES];

static queue_index after(queue_index index)
{
    return (queue_index)((index + 1U) & (PORT_RECEIVE_BYTES - 1U));
}

void port_received(uint8_t byte)
{
    const queue_index next = after(head);
    if (next == tail) {
        lost = (uint8_t)(lost + 1U);
        return;
    }
    queue[head] = byte;
    head = next;
}

static bool take(uint8_t *byte)
{
    if (tail == head) {
        return false;
    }
    *byte = queue[tail];
    tail = after(tail);
    return true;
}

/* Waits for room, and keeps receiving meanwhile: the link is used both ways at once. */
static void send_byte(uint8_t byte)
{
    while (!port_write(byte)) {
        port_poll();
    }
    port_poll();
}

static void send(size_t length, const uint8_t frame[])
{
    size_t at = 0;
    bool more = true;
    send_byte(0);
    while (more) {
        const size_t count = cobs_block(length - at, frame + at);
        send_byte((uint8_t)(count + 1U));
        for (size_t i = 0; i < count; i++) {
            send_byte(frame[at + i]);
        }
        at += count;
        more = at < length;
        /* Shorter blocks stand for a zero; when that is the last byte, an empty block follows. */
        if (more && count < 254U) {
            at++;
        }
    }
    send_byte(0);
}

bool node_init(void)
{
    return model_init() && messages_fit();
}

static bool receive(void)
{
    uint8_t byte = 0;
    bool busy = false;
    port_poll();
    while (take(&byte)) {
        struct frame request;
        busy = true;
        switch (frame_push(&reader, byte, &request)) {
        case FRAME_OK:
            messages.statistics.frames++;
            send(messages_answer(&messages, &request, outgoing), outgoing);
            return true;
        case FRAME_MORE:
            break;
        default:
            messages.statistics.damaged++;
            break;
        }
    }
    return busy;
}

static bool due(void)
{
    /* The difference is right across the wrap of both. */
    return messages.period_us != 0U && port_time_us() - messages.next_us < 0x80000000U;
}

bool node_step(void)
{
    bool busy = receive();
    if (lost != 0U) {
        messages.statistics.overrun += lost;
        lost = 0;
    }
    if (due()) {
        const uint32_t scheduled_us = messages.next_us;
        messages.next_us += messages.period_us;
        /* Late by whole periods: their samples are skipped, not sent in a burst, and the next one
         * is on the grid of times again. */
        if (due()) {
            const uint32_t late_us = port_time_us() - messages.next_us;
            messages.next_us += (late_us / messages.period_us + 1U) * messages.period_us;
        }
        const size_t length = messages_sample(&messages, scheduled_us, outgoing);
        if (length > 0U) {
            send(length, outgoing);
        }
        busy = true;
    }
    return busy;
}
