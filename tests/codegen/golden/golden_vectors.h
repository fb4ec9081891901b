/* golden_vectors.h: what golden_estimate() must answer, bit for bit (generated, digest 673a9daa0e9f131f1ccb392bf69352a571aa467362f687f4f5c40ff281fc3ce8).
 *
 * for (i = 0; i < golden_VECTORS; i++) {
 *     golden_estimate(golden_vector_x[i], y);   y must equal golden_vector_y[i]
 * }
 */
#ifndef GOLDEN_SOFTSENSE_VECTORS_H
#define GOLDEN_SOFTSENSE_VECTORS_H

#include "golden.h"

/* On AVR they stay in flash where the compiler can read them there (gnu99 or later). */
#ifndef SOFTSENSE_ROM
#if defined(__AVR__) && defined(__FLASH) && !defined(__STRICT_ANSI__)
#define SOFTSENSE_ROM __flash
#else
#define SOFTSENSE_ROM
#endif
#endif

#define golden_VECTORS 48

static const SOFTSENSE_ROM int16_t golden_vector_x[48][golden_INPUTS] = {
    {1006, 1207},
    {1258, 3265},
    {1258, 3265},
    {1258, 3265},
    {1258, 3265},
    {1258, 1207},
    {1258, 1207},
    {1258, 1207},
    {1258, 3265},
    {1006, 1207},
    {1006, 1207},
    {1258, 3265},
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
    {1113, 2207},
    {1187, 3038},
    {1024, 3130},
    {1140, 1943},
    {1176, 2383},
    {1070, 1869},
    {1188, 2430},
    {1133, 1902},
    {1198, 2013},
    {1089, 3040},
    {1072, 1674},
    {1186, 2490},
    {1113, 2207},
    {1187, 3038},
    {1024, 3130},
    {1140, 1943},
    {1176, 2383},
    {1070, 1869},
    {1188, 2430},
    {1133, 1902},
    {1198, 2013},
    {1089, 3040},
    {1072, 1674},
    {1186, 2490},
};

static const SOFTSENSE_ROM int32_t golden_vector_y[48][golden_OUTPUTS] = {
    {5008391},
    {3152155},
    {3152155},
    {3152155},
    {3152155},
    {5011846},
    {5011846},
    {5011846},
    {3152155},
    {5008391},
    {5008391},
    {3152155},
    {5008391},
    {3152155},
    {3173606},
    {3152155},
    {3173606},
    {3152155},
    {3152155},
    {5011846},
    {5011846},
    {3152155},
    {4767072},
    {5008391},
    {4067811},
    {3247508},
    {3206322},
    {4439712},
    {3878429},
    {4481470},
    {3824622},
    {4482865},
    {4394107},
    {3239246},
    {4690791},
    {3745169},
    {4067811},
    {3247508},
    {3206322},
    {4439712},
    {3878429},
    {4481470},
    {3824622},
    {4482865},
    {4394107},
    {3239246},
    {4690791},
    {3745169},
};

#endif
