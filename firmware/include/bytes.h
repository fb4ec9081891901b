/* Little-endian integers in byte strings, on any core. */
#ifndef BYTES_H
#define BYTES_H

#include <stdint.h>

static inline uint16_t get16(const uint8_t bytes[2])
{
    return (uint16_t)(bytes[0] | (uint16_t)((uint16_t)bytes[1] << 8));
}

static inline uint32_t get32(const uint8_t bytes[4])
{
    return get16(bytes) | ((uint32_t)get16(bytes + 2) << 16);
}

/* Both return the place after what they wrote. */
static inline uint8_t *put16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)(value & 0xFFU);
    bytes[1] = (uint8_t)(value >> 8);
    return bytes + 2;
}

static inline uint8_t *put32(uint8_t *bytes, uint32_t value)
{
    return put16(put16(bytes, (uint16_t)(value & 0xFFFFU)), (uint16_t)(value >> 16));
}

/* Two's complement without an implementation-defined conversion. */
static inline int16_t signed16(uint16_t value)
{
    return (int16_t)(value < 0x8000U ? (int32_t)value : (int32_t)value - 0x10000);
}

#endif
