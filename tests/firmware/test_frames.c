/* Reads lines "KIND SEQUENCE SESSION REQUEST_CHECK CHECK PAYLOAD WIRE" (hex) and checks that the
 * firmware's frames are these bytes, and these bytes its frames. An empty payload is "-". */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bytes.h"
#include "cobs.h"
#include "frame.h"

void port_received(uint8_t byte) { (void)byte; }

static size_t unhex(const char *text, uint8_t *bytes)
{
    size_t count = 0;
    if (text[0] == '-') {
        return 0;
    }
    for (; text[2 * count] != '\0'; count++) {
        const char pair[3] = {text[2 * count], text[2 * count + 1], '\0'};
        bytes[count] = (uint8_t)strtoul(pair, NULL, 16);
    }
    return count;
}

int main(void)
{
    static char payload_text[4096], wire_text[4096];
    static uint8_t wire[2048], sealed[2048], encoded[2048];
    unsigned int kind, sequence, session, request_check, check;
    int lines = 0;
    while (scanf("%x %x %x %x %x %4095s %4095s", &kind, &sequence, &session, &request_check, &check,
                 payload_text, wire_text) == 7) {
        const size_t wire_length = unhex(wire_text, wire);
        const size_t length = unhex(payload_text, sealed + FRAME_HEADER);
        const struct frame frame = {.version = 1, .kind = (uint8_t)kind,
                                    .sequence = (uint16_t)sequence, .session = (uint16_t)session,
                                    .length = length};
        const size_t size = frame_seal(&frame, (uint16_t)request_check, sealed);
        size_t out = 0, at = 0;
        encoded[out++] = 0;
        for (;;) {
            const size_t count = cobs_block(size - at, sealed + at);
            encoded[out++] = (uint8_t)(count + 1);
            memcpy(encoded + out, sealed + at, count);
            out += count;
            at += count;
            if (at >= size) {
                break;
            }
            at += count < 254;
        }
        encoded[out++] = 0;
        if (out != wire_length || memcmp(encoded, wire, out) != 0) {
            printf("line %d: encoded otherwise\n", lines);
            return 1;
        }
        if (get16(sealed + size - 4) != check) {
            printf("line %d: check\n", lines);
            return 1;
        }
        static struct frame_reader reader;
        struct frame got;
        enum frame_status status = FRAME_MORE;
        for (size_t i = 0; i < wire_length; i++) {
            status = frame_push(&reader, wire[i], &got);
        }
        /* What answers a request is not itself a request: its check begins otherwise. */
        const enum frame_status wanted = (request_check == 0) ? FRAME_OK : FRAME_BAD_CHECK;
        if (status != wanted) {
            printf("line %d: status %d\n", lines, (int)status);
            return 1;
        }
        if (status == FRAME_OK &&
            (got.kind != kind || got.sequence != sequence || got.session != session ||
             got.length != length ||
             (length > 0 && memcmp(got.payload, sealed + FRAME_HEADER, length) != 0))) {
            printf("line %d: decoded otherwise\n", lines);
            return 1;
        }
        lines++;
    }
    printf("%d\n", lines);
    return 0;
}
