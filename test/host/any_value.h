/* Numbers of all lengths for tests that run on the AVR, too: a linear congruential generator (Knuth's MMIX). */
#ifndef HOST_ANY_VALUE_H
#define HOST_ANY_VALUE_H

#include <stdint.h>

static inline uint32_t next_bits(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 32);
}

/* Of all lengths. */
static inline uint32_t next_value(void)
{
    uint32_t bits = next_bits();
    return bits >> (next_bits() >> 27);
}

#endif
