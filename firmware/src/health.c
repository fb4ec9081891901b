#include "health.h"

static int32_t range_of(const struct health_channel *channel)
{
    return (int32_t)channel->highest - channel->lowest;
}

static void see(struct health_channel *channel, int16_t code, bool first)
{
    if (first || code < channel->lowest) {
        channel->lowest = code;
    }
    if (first || code > channel->highest) {
        channel->highest = code;
    }
    if (first) {
        channel->rail_seen = false;
    }
    if (code > HEALTH_LOWEST_CODE && code < SOFTSENSE_HIGHEST_CODE) {
        channel->railed = 0;
        return;
    }
    channel->rail_seen = true;
    if (channel->railed < (uint8_t)HEALTH_RAIL_SAMPLES) {
        channel->railed++;
    }
    if (channel->railed == (uint8_t)HEALTH_RAIL_SAMPLES) {
        channel->faulty = true;
    }
}

/* At the end of a window: who stood while another moved, and who is well again. */
static void judge(struct health *health, uint8_t watched)
{
    bool motion = false;
    for (uint8_t i = 0; i < watched; i++) {
        motion = motion || range_of(&health->channel[i]) >= HEALTH_MOTION_CODES;
    }
    for (uint8_t i = 0; i < watched; i++) {
        struct health_channel *const channel = &health->channel[i];
        if (range_of(channel) == 0) {
            channel->faulty = channel->faulty || motion;
        } else if (!channel->rail_seen) {
            channel->faulty = false;
        }
    }
}

uint32_t health_update(struct health *health, uint8_t count, const int16_t codes[])
{
    const uint8_t watched = (count < (uint8_t)HEALTH_CHANNELS) ? count : (uint8_t)HEALTH_CHANNELS;
    for (uint8_t i = 0; i < watched; i++) {
        see(&health->channel[i], codes[i], health->position == 0U);
    }
    health->position++;
    if (health->position == (uint8_t)HEALTH_WINDOW) {
        health->position = 0;
        judge(health, watched);
    }
    uint32_t failed = 0;
    for (uint8_t i = 0; i < watched; i++) {
        failed |= health->channel[i].faulty ? (uint32_t)1 << i : 0U;
    }
    return failed;
}

uint8_t health_choose(uint32_t failed, bool *trusted)
{
    *trusted = true;
    for (uint8_t network = 0; network < model_count(); network++) {
        bool usable = true;
        for (uint8_t input = 0; input < model_at(network)->inputs; input++) {
            const uint8_t channel = model_channel(network, input);
            if (channel < (uint8_t)HEALTH_CHANNELS && ((failed >> channel) & 1U) != 0U) {
                usable = false;
            }
        }
        if (usable) {
            return network;
        }
    }
    *trusted = false;
    return 0;
}
