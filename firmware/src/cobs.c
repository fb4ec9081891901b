#include "cobs.h"

#include <stdbool.h>

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
    size_t to = 0; /* never beyond `from` */
    uint8_t left = 0; /* bytes still to come in this block */
    bool zero = false; /* a zero stands between this block and the next */
    for (size_t from = 0; from < length; from++) {
        const uint8_t byte = bytes[from];
        if (byte == 0U) {
            return COBS_ZERO;
        }
        if (left > 0U) {
            left--;
            bytes[to] = byte;
            to++;
        } else {
            if (zero) {
                bytes[to] = 0U;
                to++;
            }
            left = (uint8_t)(byte - 1U);
            /* A full block carries no zero of its own. */
            zero = left < LONGEST_BLOCK;
        }
    }
    *decoded = to;
    return (left == 0U) ? COBS_OK : COBS_SHORT;
}
