/* Entry point for Frama-C Eva. From any state of the frame reader that keeps its invariant, any byte
 * leads to a state that keeps it, touches nothing else, and yields a frame within the reader. */
#include "frame.h"

extern int Frama_C_interval(int low, int high);

void any_byte(void);

void any_byte(void)
{
    static struct frame_reader reader;
    struct frame frame;
    uint8_t sum = 0;
    for (size_t i = 0; i < sizeof reader.bytes; i++) {
        reader.bytes[i] = (uint8_t)Frama_C_interval(0, 255);
    }
    reader.used = (size_t)Frama_C_interval(0, FRAME_ENCODED + 1);
    if (frame_push(&reader, (uint8_t)Frama_C_interval(0, 255), &frame) == FRAME_OK) {
        for (size_t i = 0; i < frame.length; i++) {
            sum = (uint8_t)(sum + frame.payload[i]);
        }
    }
    /*@ assert reader.used <= FRAME_ENCODED + 1; */
}
