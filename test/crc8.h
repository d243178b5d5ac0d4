/* The network's CRC (Dallas/Maxim: reflected polynomial 0x8C, initial 0), a bit at a time: what the tests hold against
 * firmware/net/packet.c, whose code is another.
 *
 * Source: manual line 201; docs/wire-format.md. Errors: none. */
#ifndef TEST_CRC8_H
#define TEST_CRC8_H

#include <stddef.h>
#include <stdint.h>

static inline uint8_t crc8(const uint8_t *bytes, size_t count)
{
    unsigned crc = 0;
    for (size_t bit = 0; bit < 8 * count; bit++) {
        const unsigned feedback = (crc ^ (unsigned)bytes[bit / 8] >> bit % 8) & 1u;
        crc = crc >> 1 ^ (feedback ? 0x8Cu : 0u);
    }
    return (uint8_t)crc;
}

#endif
