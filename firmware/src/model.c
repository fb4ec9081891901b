#include "model.h"

#include <string.h>

/* The board, as its board.mk names it. */
#ifndef PORT_NAME
#define PORT_NAME "unnamed"
#endif

#define MODEL(NAME, SCALES)                                                                        \
    {                                                                                              \
        NAME##_estimate,     NAME##_uncalibrated, NAME##_INPUTS,       NAME##_OUTPUTS,             \
        #NAME,               NAME##_DIGEST,       NAME##_INPUT_NAMES,  NAME##_OUTPUT_NAMES,        \
        NAME##_OUTPUT_UNITS, SCALES,                                                               \
    },
static const struct model models[] = {SOFTSENSE_MODELS};
#undef MODEL

enum { COUNT = sizeof models / sizeof models[0] };

static const char firmware_version[] = "1.0";

/* channel_of[network][input], and where each channel's name stands. */
static uint8_t channel_of[COUNT][MODEL_MAX_INPUTS];
static uint8_t channels;

struct name {
    const char *text;
    size_t length;
};

/* Item number `index` of a list joined by commas; empty beyond its end. */
static struct name item(const char *list, uint8_t index)
{
    for (; index > 0U && *list != '\0'; index--) {
        list += strcspn(list, ",");
        list += (*list == ',') ? 1 : 0;
    }
    const struct name name = {list, strcspn(list, ",")};
    return name;
}

/* Name of a channel: that of the first input that uses it. */
static struct name channel_name(uint8_t channel)
{
    for (uint8_t network = 0; network < (uint8_t)COUNT; network++) {
        for (uint8_t input = 0; input < models[network].inputs; input++) {
            if (channel_of[network][input] == channel) {
                return item(models[network].input_names, input);
            }
        }
    }
    const struct name none = {"", 0};
    return none;
}

static uint8_t find_channel(struct name wanted)
{
    for (uint8_t channel = 0; channel < channels; channel++) {
        const struct name name = channel_name(channel);
        if (name.length == wanted.length && memcmp(name.text, wanted.text, name.length) == 0) {
            return channel;
        }
    }
    return channels;
}

uint8_t model_count(void)
{
    return (uint8_t)COUNT;
}

const struct model *model_at(uint8_t index)
{
    return &models[index];
}

bool model_init(void)
{
    /* No input has a channel yet: channel_name() must not find channel 0 everywhere. */
    memset(channel_of, 0xFF, sizeof channel_of);
    channels = 0;
    for (uint8_t network = 0; network < (uint8_t)COUNT; network++) {
        const struct model *const model = &models[network];
        if (model->inputs > (uint8_t)MODEL_MAX_INPUTS ||
            model->outputs > (uint8_t)MODEL_MAX_OUTPUTS) {
            return false;
        }
        for (uint8_t input = 0; input < model->inputs; input++) {
            /* The primary network's inputs are channels 0, 1, ... in order. */
            const uint8_t channel =
                (network == 0U) ? input : find_channel(item(model->input_names, input));
            if (channel >= (uint8_t)MODEL_MAX_CHANNELS) {
                return false;
            }
            channel_of[network][input] = channel;
            if (channel >= channels) {
                channels = (uint8_t)(channel + 1U);
            }
        }
    }
    return true;
}

uint8_t model_channels(void)
{
    return channels;
}

uint8_t model_channel(uint8_t index, uint8_t input)
{
    return channel_of[index][input];
}

/* A text of which only the part from `offset` on, and only `room` characters, is kept. */
struct window {
    size_t offset;
    size_t room;
    uint8_t *text;
    size_t position; /* characters seen */
    size_t copied;
};

static void add(struct window *window, size_t length, const char text[])
{
    for (size_t i = 0; i < length; i++) {
        if (window->position >= window->offset && window->copied < window->room) {
            window->text[window->copied] = (uint8_t)text[i];
            window->copied++;
        }
        window->position++;
    }
}

static void add_line(struct window *window, const char key[], const char value[])
{
    add(window, strlen(key), key);
    add(window, 1, "=");
    add(window, strlen(value), value);
    add(window, 1, "\n");
}

size_t model_describe(uint8_t index, size_t offset, size_t room, uint8_t text[], size_t *total)
{
    const struct model *const model = &models[index];
    struct window window = {offset, room, text, 0, 0};
    add_line(&window, "digest", model->digest);
    add_line(&window, "name", model->name);
    add_line(&window, "inputs", model->input_names);
    add_line(&window, "outputs", model->output_names);
    add_line(&window, "units", model->output_units);
    add_line(&window, "scales", model->output_scales);
    add_line(&window, "firmware", firmware_version);
    add_line(&window, "board", PORT_NAME);
    add(&window, 9, "channels=");
    for (uint8_t channel = 0; channel < channels; channel++) {
        const struct name name = channel_name(channel);
        add(&window, (channel > 0U) ? 1U : 0U, ",");
        add(&window, name.length, name.text);
    }
    add(&window, 1, "\n");
    *total = window.position;
    return window.copied;
}

#ifdef SOFTSENSE_SELF_TEST

/* Vectors of a hand-written model lie where constants lie. */
#ifndef SOFTSENSE_ROM
#define SOFTSENSE_ROM
#endif

struct vectors {
    const SOFTSENSE_ROM int16_t *x;
    const SOFTSENSE_ROM int32_t *y;
    uint32_t count;
};

#define MODEL(NAME, SCALES) {&NAME##_vector_x[0][0], &NAME##_vector_y[0][0], NAME##_VECTORS},
static const struct vectors all_vectors[] = {SOFTSENSE_MODELS};
#undef MODEL

void model_self_test(uint8_t index, uint16_t count, struct model_test *test)
{
    const struct model *const model = &models[index];
    const struct vectors *const vectors = &all_vectors[index];
    test->total = vectors->count;
    test->compared = 0;
    test->mismatches = 0;
    for (uint32_t i = test->first; i < vectors->count && test->compared < count; i++) {
        int16_t x[MODEL_MAX_INPUTS];
        int32_t y[MODEL_MAX_OUTPUTS];
        bool same = true;
        for (uint8_t k = 0; k < model->inputs; k++) {
            x[k] = vectors->x[i * model->inputs + k];
        }
        model->estimate(x, y);
        for (uint8_t k = 0; k < model->outputs; k++) {
            same = same && y[k] == vectors->y[i * model->outputs + k];
        }
        if (!same) {
            test->mismatches++;
        }
        test->compared++;
    }
}

#else

void model_self_test(uint8_t index, uint16_t count, struct model_test *test)
{
    (void)index;
    (void)count;
    test->total = 0;
    test->compared = 0;
    test->mismatches = 0;
}

#endif
