/* The networks in this firmware: the primary one first, then its fallbacks, best first.
 *
 * The build names them: -include NAME.h for each, and
 * -DSOFTSENSE_MODELS='MODEL(NAME, "LSB:ZERO[,LSB:ZERO...]") MODEL(...)' with one LSB and ZERO per
 * output. A channel of the converter is a sensor's name: the primary network's inputs come first,
 * then what the fallbacks add.
 */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MODEL_MAX_INPUTS = 64, MODEL_MAX_OUTPUTS = 16, MODEL_MAX_CHANNELS = 64 };

struct model {
    void (*estimate)(const int16_t x[], int32_t y[]);
    uint32_t (*uncalibrated)(const int16_t x[]);
    uint8_t inputs;
    uint8_t outputs;
    const char *name;
    const char *digest;
    const char *input_names; /* joined by commas, as all lists here */
    const char *output_names;
    const char *output_units;
    const char *output_scales; /* LSB:ZERO of each output */
};

/* Number of networks, at least 1. */
uint8_t model_count(void);

/* `index` < model_count(). */
const struct model *model_at(uint8_t index);

/* Finds the channel of every input; call once. Returns false, and the firmware must not estimate,
 * when the networks need more than MODEL_MAX_CHANNELS channels. */
bool model_init(void);

/* Number of channels that the converter must deliver. */
uint8_t model_channels(void);

/* Channel of input `input` of network `index`. */
uint8_t model_channel(uint8_t index, uint8_t input);

/* Characters of network `index`'s description: lines "key=value". Copies at most `room` of them
 * from `offset` on into text and returns how many; stores the total length. */
size_t model_describe(uint8_t index, size_t offset, size_t room, uint8_t text[], size_t *total);

struct model_test {
    uint32_t first;      /* in: the vector to begin with */
    uint32_t total;      /* vectors in flash */
    uint16_t compared;
    uint16_t mismatches;
};

/* Runs up to `count` of the vectors in flash through network `index`. */
void model_self_test(uint8_t index, uint16_t count, struct model_test *test);

#endif
