/* linear_pair_vectors.h: what linear_pair_estimate() must answer, bit for bit (generated, digest 44e710b6c9714523655a334f04f5bc897bd458fe778a0cab1fde9a856f158412).
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
    {-52193},
    {72031503},
    {72031503},
    {72031503},
    {72031503},
    {-26965736},
    {-26965736},
    {-26965736},
    {72031503},
    {-52193},
    {-52193},
    {72031503},
    {-52193},
    {72031503},
    {102739974},
    {72031503},
    {102739974},
    {72031503},
    {72031503},
    {-26965736},
    {-26965736},
    {72031503},
    {-8858889},
    {-52193},
    {30343422},
    {67683378},
    {92736686},
    {15164606},
    {31320602},
    {19322394},
    {32166410},
    {14132372},
    {10783990},
    {80386319},
    {10982542},
    {35521425},
    {671745},
    {35591744},
    {7001995},
    {54712613},
    {26504002},
    {40611720},
    {51311033},
    {38198434},
    {42965295},
    {34640813},
    {14026162},
    {48761034},
};

#endif
