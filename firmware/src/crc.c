#include "crc.h"

static uint16_t step(uint16_t crc, uint16_t polynomial, size_t length, const uint8_t data[])
{
    for (size_t i = 0; i < length; i++) {
        crc = (uint16_t)(crc ^ (uint16_t)((uint16_t)data[i] << 8));
        for (uint8_t bit = 0; bit < 8U; bit++) {
            const uint16_t carry = (uint16_t)(crc & 0x8000U);
            crc = (uint16_t)((uint32_t)crc << 1);
            if (carry != 0U) {
                crc = (uint16_t)(crc ^ polynomial);
            }
        }
    }
    return crc;
}

uint16_t crc_ccitt(uint16_t crc, size_t length, const uint8_t data[])
{
    return step(crc, 0x1021U, length, data);
}

uint16_t crc_check(uint16_t crc, size_t length, const uint8_t data[])
{
    return step(crc, 0x3D65U, length, data);
}

uint16_t crc_check_end(uint16_t crc)
{
    return (uint16_t)(crc ^ 0xFFFFU);
}
