#include "messages.h"

#include "bytes.h"

/* Beyond an enumerator's range where int has 16 bits. */
#define LONGEST_STREAM_PERIOD_US 60000000U

enum {
    SHORTEST_STREAM_PERIOD_US = 200,
    ESTIMATE_FIXED = 12, /* bytes of an answer before its estimates */
    SAMPLE_FIXED = 18,   /* bytes of a sample before its codes */
};

/* One estimate and what is to be said about it. */
struct verdict {
    uint8_t network;
    uint8_t flags;
    uint32_t uncalibrated; /* bit i: input i of `network` */
    uint32_t failed;       /* bit i: channel i */
};


bool messages_fit(void)
{
    const uint32_t sample = SAMPLE_FIXED + 2U * (uint32_t)model_channels() +
                            4U * (uint32_t)model_at(0)->outputs;
    return sample <= (uint32_t)FRAME_PAYLOAD;
}

static void read_codes(uint8_t count, const uint8_t bytes[], int16_t codes[])
{
    for (uint8_t i = 0; i < count; i++) {
        codes[i] = signed16(get16(bytes + (size_t)2U * i));
    }
}

/* Runs network `verdict->network` on x and adds the estimates; returns the place after them. */
static uint8_t *estimate(struct messages *messages, struct verdict *verdict, const int16_t x[],
                         uint8_t *next)
{
    const struct model *const model = model_at(verdict->network);
    int32_t y[MODEL_MAX_OUTPUTS];
    model->estimate(x, y);
    messages->statistics.estimates++;
    verdict->uncalibrated |= model->uncalibrated(x);
    if (verdict->uncalibrated != 0U) {
        verdict->flags |= MESSAGE_FLAG_UNCALIBRATED;
    }
    for (uint8_t i = 0; i < model->outputs; i++) {
        next = put32(next, (uint32_t)y[i]);
    }
    return next;
}

/* Lets the health of the sensors choose the network for the codes of all channels. */
static uint8_t *estimate_healthy(struct messages *messages, struct verdict *verdict,
                                 const int16_t codes[], uint8_t *next)
{
    int16_t x[MODEL_MAX_INPUTS];
    bool trusted = true;
    verdict->failed = health_update(&messages->health, model_channels(), codes);
    verdict->network = health_choose(verdict->failed, &trusted);
    if (verdict->failed != 0U) {
        verdict->flags |= MESSAGE_FLAG_FAILED;
    }
    if (verdict->network != 0U) {
        verdict->flags |= MESSAGE_FLAG_FALLBACK;
    }
    if (!trusted) {
        verdict->flags |= MESSAGE_FLAG_UNTRUSTED;
    }
    for (uint8_t i = 0; i < model_at(verdict->network)->inputs; i++) {
        x[i] = codes[model_channel(verdict->network, i)];
    }
    return estimate(messages, verdict, x, next);
}

static uint8_t *put_verdict(uint8_t *next, const struct verdict *verdict)
{
    *next++ = verdict->network;
    *next++ = verdict->flags;
    next = put32(next, verdict->uncalibrated);
    return put32(next, verdict->failed);
}

/* Short answers come through a line that loses one byte in a hundred. */
enum { DESCRIPTION_PART = 64 };

static enum message_error identify(struct messages *messages, const struct frame *request,
                                   uint8_t **next)
{
    if (request->length != 5U) {
        return MESSAGE_BAD_LENGTH;
    }
    const uint8_t network = request->payload[2];
    if (network >= model_count()) {
        return MESSAGE_BAD_NETWORK;
    }
    messages->session = get16(request->payload);
    const struct model *const model = model_at(network);
    uint8_t *at = *next;
    *at++ = model_count();
    *at++ = model->inputs;
    *at++ = model->outputs;
    *at++ = model_channels();
    at = put16(at, PORT_FRAME_BYTES);
    at = put16(at, PORT_RECEIVE_BYTES);
    at = put32(at, PORT_BAUD);
    uint8_t *const total_at = at;
    at += 2;
    size_t total = 0;
    const size_t left = FRAME_PAYLOAD - (size_t)(at - *next);
    const size_t room = left < DESCRIPTION_PART ? left : DESCRIPTION_PART;
    at += model_describe(network, get16(request->payload + 3), room, at, &total);
    (void)put16(total_at, (uint16_t)total);
    *next = at;
    return MESSAGE_DONE;
}

/* Estimate and batch: a network, a count, and that many rows of codes. */
static enum message_error estimates(struct messages *messages, const struct frame *request,
                                    uint8_t **next)
{
    if (request->length < 3U) {
        return MESSAGE_BAD_LENGTH;
    }
    const uint8_t network = request->payload[0];
    const bool choose = network == (uint8_t)MESSAGE_CHOOSE;
    if (!choose && network >= model_count()) {
        return MESSAGE_BAD_NETWORK;
    }
    const struct model *const model = model_at(choose ? 0U : network);
    const uint8_t columns = choose ? model_channels() : model->inputs;
    const uint32_t rows = get16(request->payload + 1);
    if (request->length != 3U + rows * columns * 2U ||
        ESTIMATE_FIXED + rows * model->outputs * 4U > (uint32_t)FRAME_PAYLOAD ||
        (request->kind == (uint8_t)MESSAGE_ESTIMATE && rows != 1U)) {
        return MESSAGE_BAD_LENGTH;
    }
    struct verdict verdict = {choose ? 0U : network, 0, 0, 0};
    uint8_t *at = *next + ESTIMATE_FIXED;
    const uint8_t *from = request->payload + 3;
    for (uint32_t row = 0; row < rows; row++) {
        int16_t codes[MODEL_MAX_CHANNELS];
        read_codes(columns, from, codes);
        from += (size_t)2U * columns;
        at = choose ? estimate_healthy(messages, &verdict, codes, at)
                    : estimate(messages, &verdict, codes, at);
        port_poll();
    }
    (void)put16(put_verdict(*next, &verdict), (uint16_t)rows);
    *next = at;
    return MESSAGE_DONE;
}

static enum message_error self_test(const struct frame *request, uint8_t **next)
{
    if (request->length != 7U) {
        return MESSAGE_BAD_LENGTH;
    }
    const uint8_t network = request->payload[0];
    if (network >= model_count()) {
        return MESSAGE_BAD_NETWORK;
    }
    struct model_test test = {get32(request->payload + 1), 0, 0, 0};
    model_self_test(network, get16(request->payload + 5), &test);
    *next = put16(put16(put32(*next, test.total), test.compared), test.mismatches);
    return MESSAGE_DONE;
}

static enum message_error stream(struct messages *messages, const struct frame *request,
                                 uint8_t **next)
{
    if (request->length != 4U) {
        return MESSAGE_BAD_LENGTH;
    }
    const uint32_t period_us = get32(request->payload);
    if (period_us != 0U) {
        int16_t codes[MODEL_MAX_CHANNELS];
        if (period_us < (uint32_t)SHORTEST_STREAM_PERIOD_US ||
            period_us > LONGEST_STREAM_PERIOD_US) {
            return MESSAGE_BAD_RATE;
        }
        if (!port_convert(messages->conversion, model_channels(), codes)) {
            return MESSAGE_NO_CONVERTER;
        }
    }
    messages->period_us = period_us;
    messages->next_us = port_time_us();
    *next = put32(*next, period_us);
    return MESSAGE_DONE;
}

static enum message_error statistics(const struct messages *messages, const struct frame *request,
                                     uint8_t **next)
{
    if (request->length != 0U) {
        return MESSAGE_BAD_LENGTH;
    }
    const struct statistics *const counts = &messages->statistics;
    uint8_t *at = put32(*next, port_time_us());
    at = put32(at, counts->frames);
    at = put32(at, counts->damaged);
    at = put32(at, counts->overrun);
    at = put32(at, counts->answers);
    at = put32(at, counts->refused);
    at = put32(at, counts->estimates);
    *next = put32(at, messages->conversion);
    return MESSAGE_DONE;
}

static enum message_error handle(struct messages *messages, const struct frame *request,
                                 uint8_t **next)
{
    if (request->version != (uint8_t)FRAME_VERSION) {
        return MESSAGE_BAD_VERSION;
    }
    if (request->kind == (uint8_t)MESSAGE_IDENTIFY) {
        return identify(messages, request, next);
    }
    if (messages->session == 0U || request->session != messages->session) {
        return MESSAGE_BAD_SESSION;
    }
    switch (request->kind) {
    case MESSAGE_ESTIMATE:
    case MESSAGE_BATCH:
        return estimates(messages, request, next);
    case MESSAGE_SELF_TEST:
        return self_test(request, next);
    case MESSAGE_STREAM:
        return stream(messages, request, next);
    case MESSAGE_STATISTICS:
        return statistics(messages, request, next);
    default:
        return MESSAGE_BAD_KIND;
    }
}

size_t messages_answer(struct messages *messages, const struct frame *request, uint8_t bytes[])
{
    uint8_t *const payload = bytes + FRAME_HEADER;
    uint8_t *next = payload;
    uint8_t kind = request->kind;
    const enum message_error error = handle(messages, request, &next);
    if (error != MESSAGE_DONE) {
        kind = MESSAGE_ERROR;
        next = payload;
        *next++ = (uint8_t)error;
        messages->statistics.refused++;
    } else {
        messages->statistics.answers++;
    }
    const struct frame answer = {
        .version = FRAME_VERSION,
        .kind = (uint8_t)(kind | MESSAGE_ANSWER),
        .sequence = request->sequence,
        .session = messages->session,
        .length = (size_t)(next - payload),
    };
    return frame_seal(&answer, request->check, bytes);
}

size_t messages_sample(struct messages *messages, uint32_t scheduled_us, uint8_t bytes[])
{
    int16_t codes[MODEL_MAX_CHANNELS];
    const uint8_t channels = model_channels();
    if (!port_convert(messages->conversion, channels, codes)) {
        return 0;
    }
    uint8_t *const payload = bytes + FRAME_HEADER;
    uint8_t *next = put32(put32(payload, messages->conversion), scheduled_us);
    messages->conversion++;
    struct verdict verdict = {0, 0, 0, 0};
    uint8_t *const verdict_at = next;
    uint8_t *at = next + 10;
    for (uint8_t i = 0; i < channels; i++) {
        at = put16(at, (uint16_t)codes[i]);
    }
    next = estimate_healthy(messages, &verdict, codes, at);
    (void)put_verdict(verdict_at, &verdict);
    const struct frame sample = {
        .version = FRAME_VERSION,
        .kind = MESSAGE_SAMPLE | MESSAGE_ANSWER,
        .sequence = messages->sample++,
        .session = messages->session,
        .length = (size_t)(next - payload),
    };
    return frame_seal(&sample, 0, bytes);
}
