/* libFuzzer: bytes from the wire through the frame reader into the message handler. The first byte
 * chooses: raw bytes as they are, or each piece sealed into an intact frame, so that the fuzzer gets
 * past the checks. */
#include <stdlib.h>
#include <string.h>

#include "bytes.h"
#include "messages.h"

static uint32_t time_us;

void port_received(uint8_t byte) { (void)byte; }
void port_init(void) {}
void port_poll(void) {}
void port_idle(void) {}
bool port_write(uint8_t byte) { (void)byte; return true; }
uint32_t port_time_us(void) { return time_us += 7; }

bool port_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    for (uint8_t i = 0; i < count; i++) {
        codes[i] = (int16_t)(conversion * (i + 1U));
    }
    return true;
}

static struct messages messages;

static void check_answer(const struct frame *request)
{
    uint8_t answer[PORT_FRAME_BYTES];
    const size_t length = messages_answer(&messages, request, answer);
    if (length < FRAME_HEADER + FRAME_TRAILER || length > PORT_FRAME_BYTES) {
        abort();
    }
    if ((answer[1] & 0x80U) == 0U || get16(answer + 2) != request->sequence) {
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct frame_reader reader;
    uint8_t sample[PORT_FRAME_BYTES];
    memset(&messages, 0, sizeof messages);
    memset(&reader, 0, sizeof reader);
    if (!model_init() || !messages_fit() || size == 0) {
        return 0;
    }
    if (data[0] % 2U == 0U) {
        for (size_t i = 1; i < size; i++) {
            struct frame request;
            if (frame_push(&reader, data[i], &request) == FRAME_OK) {
                check_answer(&request);
            }
        }
        return 0;
    }
    messages.session = 0x0101;
    size_t at = 1;
    while (size - at >= 3) {
        uint8_t payload[FRAME_PAYLOAD];
        const size_t left = size - at - 3;
        size_t length = get16(data + at + 1) % FRAME_PAYLOAD;
        length = length < left ? length : left;
        memcpy(payload, data + at + 3, length);
        const struct frame request = {FRAME_VERSION, data[at], 1, 0x0101, 0, length, payload};
        messages.session = 0x0101;
        check_answer(&request);
        if (messages_sample(&messages, 0, sample) > PORT_FRAME_BYTES) {
            abort();
        }
        at += 3 + length;
    }
    return 0;
}
