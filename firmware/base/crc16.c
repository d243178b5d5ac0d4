#include "base/crc16.h"

/* Eight shifts at once: the byte that is shifted out, folded by its upper half, stands for all of them. */
uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    uint8_t out = (uint8_t)((crc >> 8) ^ byte);
    out = (uint8_t)(out ^ (out >> 4));
    const uint8_t high = (uint8_t)((uint8_t)crc ^ (uint8_t)(out << 4) ^ (out >> 3));
    const uint8_t low = (uint8_t)(out ^ (uint8_t)(out << 5));
    return (uint16_t)(high << 8 | low);
}
