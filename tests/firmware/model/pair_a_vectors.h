#ifndef pair_a_VECTORS_H
#define pair_a_VECTORS_H

#include <stdint.h>

#define pair_a_VECTORS 3
static const int16_t pair_a_vector_x[pair_a_VECTORS][2] = {{0, 0}, {16, -32}, {4095, 4095}};
static const int32_t pair_a_vector_y[pair_a_VECTORS][1] = {{0}, {224}, {1027589}};

#endif
