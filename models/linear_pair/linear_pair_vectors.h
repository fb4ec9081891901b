/* linear_pair_vectors.h: what linear_pair_estimate() must answer, bit for bit (generated, digest d451cb20ea0a182cd0c688ffb7ab661730af67d2d647ec7a8ac1b50cc631b544).
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
    {16315},
    {132208202},
    {132208202},
    {132208202},
    {132208202},
    {-50727513},
    {-50727513},
    {-50727513},
    {132208202},
    {16315},
    {16315},
    {132208202},
    {16315},
    {132208202},
    {174456968},
    {132208202},
    {174456968},
    {132208202},
    {132208202},
    {-50727513},
    {-50727513},
    {132208202},
    {-19767055},
    {16315},
    {55817603},
    {124114261},
    {159379628},
    {27358416},
    {57396886},
    {35563186},
    {58905952},
    {25506270},
    {18238831},
    {143405581},
    {20200098},
    {65180408},
    {1293677},
    {65376435},
    {12830898},
    {100430387},
    {48663473},
    {74626224},
    {94281288},
    {70153546},
    {78934747},
    {63618314},
    {25705825},
    {89384776},
};

#endif
