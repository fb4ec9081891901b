/* The emulated converter: the host's file adc.bin, read through the debugger's semihosting calls
 * (Arm IHI 0100; the RISC-V ones are the same). Conversion n is row n modulo the number of rows;
 * a row is one little-endian int16 per channel. For emulated boards only: on a real board without
 * a debugger the call would trap.
 */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdbool.h>
#include <stdint.h>

/* Returns false where the file is not there or holds no row. */
bool semihosting_convert(uint32_t conversion, uint8_t count, int16_t codes[]);

#endif
