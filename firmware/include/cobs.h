/* Consistent overhead byte stuffing (Cheshire and Baker, 1999): frames without zero bytes. */
#ifndef COBS_H
#define COBS_H

#include <stddef.h>
#include <stdint.h>

/* Number of bytes at the start of data (at most 254) before the first zero: one COBS block is
 * this number plus one, then these bytes. */
size_t cobs_block(size_t length, const uint8_t data[]);

enum cobs_status {
    COBS_OK = 0,
    COBS_ZERO,  /* a zero byte within the frame */
    COBS_SHORT, /* the last block is cut off */
};

/* Decodes `length` bytes in place (a frame without its closing zero) and stores the decoded
 * length, which is smaller than `length` unless both are 0. Reads and writes only
 * bytes[0 ... length-1]; after an error their content is unspecified. */
enum cobs_status cobs_decode(size_t length, uint8_t bytes[], size_t *decoded);

#endif
