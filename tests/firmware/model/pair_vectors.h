#ifndef pair_VECTORS_H
#define pair_VECTORS_H

#include <stdint.h>

#define pair_VECTORS 3
static const int16_t pair_vector_x[pair_VECTORS][2] = {{0, 0}, {16, -32}, {4095, 4095}};
static const int32_t pair_vector_y[pair_VECTORS][1] = {{0}, {176}, {1039874}};

#endif
