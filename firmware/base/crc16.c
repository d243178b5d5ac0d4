#include "base/crc16.h"

/* Eight shifts at once: the byte that is shifted out, folded by its upper half, stands for all of them. */
uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    union { /* both machines have the low byte first; shifts by 8 the compiler would execute */
        uint16_t sum;
        struct {
            uint8_t low, high;
        };
    } it = {.sum = crc};
    uint8_t out = it.high ^ byte;
    out = (uint8_t)(out ^ (out >> 4));
    it.high = (uint8_t)(it.low ^ (uint8_t)(out << 4) ^ (out >> 3));
    it.low = (uint8_t)(out ^ (uint8_t)(out << 5));
    return it.sum;
}
