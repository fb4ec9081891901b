#include "frame.h"

#include "bytes.h"
#include "cobs.h"
#include "crc.h"

static uint16_t check_of(uint16_t request_check, size_t length, const uint8_t bytes[])
{
    uint8_t before[2];
    (void)put16(before, request_check);
    return crc_check_end(crc_check(crc_check(CRC_CHECK_START, sizeof before, before), length, bytes));
}

enum frame_status frame_open(size_t length, uint8_t bytes[], struct frame *frame)
{
    size_t size = 0;
    if (cobs_decode(length, bytes, &size) != COBS_OK) {
        return FRAME_BAD_COBS;
    }
    if (size < (size_t)FRAME_HEADER + (size_t)FRAME_TRAILER) {
        return FRAME_TOO_SHORT;
    }
    const uint8_t *const trailer = bytes + size - FRAME_TRAILER;
    if (crc_ccitt(CRC_CCITT_START, size - 2U, bytes) != get16(trailer + 2)) {
        return FRAME_BAD_CRC;
    }
    const uint16_t check = get16(trailer);
    if (check_of(0U, size - FRAME_TRAILER, bytes) != check) {
        return FRAME_BAD_CHECK;
    }
    frame->version = bytes[0];
    frame->kind = bytes[1];
    frame->sequence = get16(bytes + 2);
    frame->session = get16(bytes + 4);
    frame->check = check;
    frame->length = size - FRAME_HEADER - FRAME_TRAILER;
    frame->payload = bytes + FRAME_HEADER;
    return FRAME_OK;
}

enum frame_status frame_push(struct frame_reader *reader, uint8_t byte, struct frame *frame)
{
    if (byte != 0U) {
        if (reader->used < sizeof reader->bytes) {
            reader->bytes[reader->used] = byte;
        }
        if (reader->used <= sizeof reader->bytes) {
            reader->used++;
        }
        return FRAME_MORE;
    }
    const size_t used = reader->used;
    reader->used = 0;
    if (used == 0U) {
        return FRAME_MORE;
    }
    if (used > sizeof reader->bytes) {
        return FRAME_TOO_LONG;
    }
    return frame_open(used, reader->bytes, frame);
}

size_t frame_seal(const struct frame *frame, uint16_t request_check, uint8_t bytes[])
{
    bytes[0] = frame->version;
    bytes[1] = frame->kind;
    (void)put16(bytes + 2, frame->sequence);
    (void)put16(bytes + 4, frame->session);
    const size_t checked = FRAME_HEADER + frame->length;
    (void)put16(bytes + checked, check_of(request_check, checked, bytes));
    (void)put16(bytes + checked + 2, crc_ccitt(CRC_CCITT_START, checked + 2U, bytes));
    return checked + FRAME_TRAILER;
}
