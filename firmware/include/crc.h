/* The two checks of a frame: different polynomials, so that what one misses the other sees.
 * Bitwise, most significant bit first: 8 steps per byte, no table. Begin with the START value and
 * feed the bytes in any number of pieces. */
#ifndef CRC_H
#define CRC_H

#include <stddef.h>
#include <stdint.h>

#define CRC_CCITT_START 0xFFFFU /* CRC-16/CCITT (IBM-3740), polynomial 0x1021; "123456789": 0x29B1 */
#define CRC_CHECK_START 0x0000U /* CRC-16/EN-13757, polynomial 0x3D65; "123456789": 0xC2B7 */

uint16_t crc_ccitt(uint16_t crc, size_t length, const uint8_t data[]);

/* Without the final complement of EN-13757: crc_check_end() does that. */
uint16_t crc_check(uint16_t crc, size_t length, const uint8_t data[]);
uint16_t crc_check_end(uint16_t crc);

#endif
