#include "cobs.h"

enum { LONGEST_BLOCK = 254 };

size_t cobs_block(size_t length, const uint8_t data[])
{
    size_t count = 0;
    while (count < length && count < LONGEST_BLOCK && data[count] != 0U) {
        count++;
    }
    return count;
}

enum cobs_status cobs_decode(size_t length, uint8_t bytes[], size_t *decoded)
{
    size_t from = 0;
    size_t to = 0;
    while (from < length) {
        const uint8_t code = bytes[from];
        from++;
        if (code == 0U) {
            return COBS_ZERO;
        }
        if ((size_t)code - 1U > length - from) {
            return COBS_SHORT;
        }
        for (uint8_t left = (uint8_t)(code - 1U); left > 0U; left--) {
            if (bytes[from] == 0U) {
                return COBS_ZERO;
            }
            bytes[to] = bytes[from];
            to++;
            from++;
        }
        /* A full block carries no zero of its own, nor does the last one. */
        if (code <= LONGEST_BLOCK && from < length) {
            bytes[to] = 0U;
            to++;
        }
    }
    *decoded = to;
    return COBS_OK;
}
