/* Short sections that no interrupt may divide.
 *
 *     uint8_t state = atomic_begin();
 *     ...at most 20 cycles: the step interrupt at 500 kHz waits meanwhile...
 *     atomic_end(state);
 *
 * Context: main loop. Nesting is allowed: the state before is restored. On the host nothing interrupts. */
#ifndef BASE_ATOMIC_H
#define BASE_ATOMIC_H

#include <stdint.h>

static inline uint8_t atomic_begin(void)
{
#ifdef __AVR__
    uint8_t state;
    __asm__ volatile("in %0, 0x3f\n\tcli" : "=r"(state) : : "memory"); /* SREG */
    return state;
#else
    return 0;
#endif
}

static inline void atomic_end(uint8_t state)
{
#ifdef __AVR__
    __asm__ volatile("out 0x3f, %0" : : "r"(state) : "memory");
#else
    (void)state;
#endif
}

/* At the end of boot: from now on interrupts are served. */
static inline void atomic_enable(void)
{
#ifdef __AVR__
    __asm__ volatile("sei" : : : "memory");
#endif
}

#endif
