/* A network stand-in for the tests of the firmware: exact, small, and easy to restate. */
#ifndef pair_a_H
#define pair_a_H

#include <stdint.h>

#define pair_a_INPUTS       2
#define pair_a_OUTPUTS      1
#define pair_a_DIGEST       "77aa0102"
#define pair_a_INPUT_NAMES  "s1,s2"
#define pair_a_OUTPUT_NAMES "strain"
#define pair_a_OUTPUT_UNITS "1"

void pair_a_estimate(const int16_t x[pair_a_INPUTS], int32_t y[pair_a_OUTPUTS]);
uint32_t pair_a_uncalibrated(const int16_t x[pair_a_INPUTS]);

#endif
