/* linear_pair_vectors.h: what linear_pair_estimate() must answer, bit for bit (generated, digest d43229625b29663a0d8b0f88b664c8f35d30ccb459526e1c7848ea1ac0d828f1).
 *
 * for (i = 0; i < linear_pair_VECTORS; i++) {
 *     linear_pair_estimate(linear_pair_vector_x[i], y);   y must equal linear_pair_vector_y[i]
 * }
 */
#ifndef LINEAR_PAIR_SOFTSENSE_VECTORS_H
#define LINEAR_PAIR_SOFTSENSE_VECTORS_H

#include "linear_pair.h"

/* On AVR they stay in flash where the compiler can read them there (gnu99 or later). */
#ifndef SOFTSENSE_ROM
#if defined(__AVR__) && defined(__FLASH) && !defined(__STRICT_ANSI__)
#define SOFTSENSE_ROM __flash
#else
#define SOFTSENSE_ROM
#endif
#endif

#define linear_pair_VECTORS 48

static const SOFTSENSE_ROM int16_t linear_pair_vector_x[48][linear_pair_INPUTS] = {
    {1303, 1383},
    {2688, 2459},
    {2688, 2459},
    {2688, 2459},
    {2688, 2459},
    {2688, 1383},
    {2688, 1383},
    {2688, 1383},
    {2688, 2459},
    {1303, 1383},
    {1303, 1383},
    {2688, 2459},
    {-32768, -32768},
    {32767, 32767},
    {-2562, 32585},
    {19987, 31512},
    {-7896, 12159},
    {29497, 9860},
    {22302, 12350},
    {13369, -7280},
    {24586, -23915},
    {5171, 14515},
    {22641, 1661},
    {-8165, -12436},
    {1889, 1906},
    {2299, 2340},
    {1404, 2388},
    {2039, 1768},
    {2235, 1998},
    {1655, 1729},
    {2300, 2023},
    {2002, 1746},
    {2357, 1804},
    {1757, 2341},
    {1668, 1627},
    {2292, 2054},
    {1536, 1455},
    {2212, 2035},
    {1403, 1510},
    {2239, 2217},
    {1998, 1889},
    {2040, 2044},
    {2353, 2213},
    {1924, 1995},
    {2078, 2075},
    {1826, 1938},
    {1799, 1696},
    {2046, 2122},
};

static const SOFTSENSE_ROM int32_t linear_pair_vector_y[48][linear_pair_OUTPUTS] = {
    {-97349},
    {44476937},
    {44476937},
    {44476937},
    {44476937},
    {22803734},
    {22803734},
    {22803734},
    {44476937},
    {-97349},
    {-97349},
    {44476937},
    {-97349},
    {44476937},
    {32857598},
    {44476937},
    {32857598},
    {44476937},
    {44476937},
    {22803734},
    {22803734},
    {44476937},
    {17119509},
    {-97349},
    {18728663},
    {41593731},
    {38872995},
    {9125536},
    {19348156},
    {11941745},
    {19839753},
    {8487185},
    {6019608},
    {51815953},
    {7057408},
    {22088208},
    {636419},
    {22128677},
    {4317252},
    {33925377},
    {16495190},
    {25113307},
    {31808978},
    {23714244},
    {26527017},
    {21546106},
    {8834158},
    {30289564},
};

#endif
