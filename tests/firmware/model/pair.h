/* A network stand-in for the tests of the firmware: exact, small, and easy to restate. */
#ifndef pair_H
#define pair_H

#include <stdint.h>

#define pair_INPUTS       2
#define pair_OUTPUTS      1
#define pair_DIGEST       "5f3a9c01"
#define pair_INPUT_NAMES  "s1,s4"
#define pair_OUTPUT_NAMES "strain"
#define pair_OUTPUT_UNITS "1"

void pair_estimate(const int16_t x[pair_INPUTS], int32_t y[pair_OUTPUTS]);
uint32_t pair_uncalibrated(const int16_t x[pair_INPUTS]);

#endif
