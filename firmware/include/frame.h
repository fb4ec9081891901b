/* Frames: header, payload, two checks. The byte table is in firmware/README.md. */
#ifndef FRAME_H
#define FRAME_H

#include <stddef.h>
#include <stdint.h>

#include "port.h"

enum {
    FRAME_VERSION = 1,
    FRAME_HEADER = 6,
    FRAME_TRAILER = 4,
    FRAME_PAYLOAD = PORT_FRAME_BYTES - FRAME_HEADER - FRAME_TRAILER,
    /* One COBS byte per 254, and one more. */
    FRAME_ENCODED = PORT_FRAME_BYTES + PORT_FRAME_BYTES / 254 + 1,
};

/* An intact frame. `payload` points into the reader and is valid until its next byte. */
struct frame {
    uint8_t version;
    uint8_t kind;
    uint16_t sequence;
    uint16_t session;
    uint16_t check; /* the frame's own: what the check of its answer begins with */
    size_t length;
    const uint8_t *payload;
};

enum frame_status {
    FRAME_OK = 0,    /* the byte closed an intact frame */
    FRAME_MORE,      /* not closed yet, or nothing between two zeros */
    FRAME_TOO_LONG,  /* closed, longer than PORT_FRAME_BYTES */
    FRAME_TOO_SHORT, /* closed, no room for header and trailer */
    FRAME_BAD_COBS,
    FRAME_BAD_CRC,
    FRAME_BAD_CHECK,
};

/* All zero to begin with. */
struct frame_reader {
    size_t used; /* more than FRAME_ENCODED: too long, waiting for the next zero */
    uint8_t bytes[FRAME_ENCODED];
};

/* Takes one byte from the wire. Writes *frame only when it returns FRAME_OK; after any other
 * status but FRAME_MORE it starts over with the next byte. */
enum frame_status frame_push(struct frame_reader *reader, uint8_t byte, struct frame *frame);

/* Decodes and checks the `length` bytes between two zeros, in place. */
enum frame_status frame_open(size_t length, uint8_t bytes[], struct frame *frame);

/* Writes header and trailer around the frame->length payload bytes that already stand at
 * bytes + FRAME_HEADER; frame->payload is not used. `request_check` is the check of the frame that
 * this one answers, 0 where it answers none. Returns the length of the whole frame, before COBS. */
size_t frame_seal(const struct frame *frame, uint16_t request_check, uint8_t bytes[]);

#endif
