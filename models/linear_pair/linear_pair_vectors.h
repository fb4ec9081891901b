/* linear_pair_vectors.h: what linear_pair_estimate() must answer, bit for bit (generated, digest 158be3bacd5b6ce6559a98e60308b361d259184d0b273d8131ba2ec78cefecd0).
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
    {-49309},
    {71626928},
    {71626928},
    {71626928},
    {71626928},
    {-26799846},
    {-26799846},
    {-26799846},
    {71626928},
    {-49309},
    {-49309},
    {71626928},
    {-49309},
    {71626928},
    {102244462},
    {71626928},
    {102244462},
    {71626928},
    {71626928},
    {-26799846},
    {-26799846},
    {71626928},
    {-8786713},
    {-49309},
    {30173645},
    {67304784},
    {92266645},
    {15079301},
    {31148157},
    {19213581},
    {31987885},
    {14052611},
    {10730442},
    {79958138},
    {10919999},
    {35324387},
    {670259},
    {35393090},
    {6962282},
    {54405321},
    {26355841},
    {40383735},
    {51022906},
    {37984256},
    {42722399},
    {34446132},
    {13945071},
    {48485593},
};

#endif
