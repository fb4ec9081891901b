#include "pair.h"

void pair_estimate(const int16_t x[pair_INPUTS], int32_t y[pair_OUTPUTS])
{
    y[0] = (int32_t)3 * x[0] - (int32_t)5 * x[1] + (int32_t)x[0] * x[1] / 16;
}

uint32_t pair_uncalibrated(const int16_t x[pair_INPUTS])
{
    uint32_t bits = 0;
    for (uint32_t i = 0; i < pair_INPUTS; i++) {
        bits |= (x[i] < 100 || x[i] > 4000) ? (uint32_t)1 << i : 0U;
    }
    return bits;
}
