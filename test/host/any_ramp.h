/* A ramp for tests that run on the AVR, too: what all of them choose by chance, whether there can be such a one or not. */
#ifndef HOST_ANY_RAMP_H
#define HOST_ANY_RAMP_H

#include "host/any_value.h"
#include "motion/ramp.h"

/* Returns 9 bits that are left to choose by. */
static inline uint32_t choose_kind(ramp_t *ramp)
{
    uint32_t bits = next_bits();
    ramp->linear = bits & 1;
    ramp->faster = bits >> 1 & 1;
    ramp->steep = (uint8_t)((bits >> 2 & 0xFF) % 3);
    ramp->cycles_log2 = (uint8_t)((bits >> 10 & 0xFF) % 6);
    ramp->split_ticks = (uint8_t)(bits >> 20 & 1 ? 128 : 0);
    ramp->least_run = (uint8_t)(1u << (bits >> 21 & 3));
    return bits >> 23;
}

#endif
