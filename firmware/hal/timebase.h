/* What timebase.c, its interrupt and the sleep share. */
#ifndef HAL_TIMEBASE_H
#define HAL_TIMEBASE_H

#include <stdint.h>

extern volatile uint32_t timebase_overflows; /* every 1.024 ms; written by the interrupt alone */

static inline uint8_t timebase_low(void)
{
    return *(const volatile uint8_t *)&timebase_overflows;
}

#endif
