/* Which sensors can still be believed, from the codes alone.
 *
 * rail:  the code has lain at an end of the converter (disconnected, shorted) for
 *        HEALTH_RAIL_SAMPLES conversions.
 * stuck: the code has stayed exactly the same for a window of HEALTH_WINDOW conversions in which
 *        another channel has moved by HEALTH_MOTION_CODES: a body at rest is not a fault.
 *
 * A sensor is believed again after a window without rails in which it moved. Only the first
 * HEALTH_CHANNELS channels are watched.
 */
#ifndef HEALTH_H
#define HEALTH_H

#include <stdint.h>

#include "model.h"

enum {
    HEALTH_CHANNELS = 32,
    HEALTH_RAIL_SAMPLES = 3,
    HEALTH_WINDOW = 20,
    HEALTH_MOTION_CODES = 40,
    HEALTH_LOWEST_CODE = 0,
};

/* Full scale of the converter; the build sets it from the model's ADC bits. */
#ifndef SOFTSENSE_HIGHEST_CODE
#define SOFTSENSE_HIGHEST_CODE 4095
#endif

struct health_channel {
    int16_t lowest; /* of the codes in this window */
    int16_t highest;
    uint8_t railed; /* conversions in a row at a rail, saturating */
    bool rail_seen; /* in this window */
    bool faulty;
};

/* All zero to begin with. */
struct health {
    uint8_t position; /* conversions in this window */
    struct health_channel channel[HEALTH_CHANNELS];
};

/* Takes one conversion of `count` channels; bit i of the result: channel i has failed. */
uint32_t health_update(struct health *health, uint8_t count, const int16_t codes[]);

/* The network to use: the first whose channels have not failed; the primary one, 0, and *trusted
 * false, when there is none. */
uint8_t health_choose(uint32_t failed, bool *trusted);

#endif
