/* What timebase.c, timebase_isr.S and sleep.c share. */
#ifndef HAL_TIMEBASE_H
#define HAL_TIMEBASE_H

#include <stdint.h>

extern volatile uint32_t timebase_overflows; /* of Timer0, 128 us each; written by the interrupt */

/* The low byte alone. */
#define TIMEBASE_OVERFLOWS_LOW (*(const volatile uint8_t *)&timebase_overflows)

#endif
