/* Timer0 at clock / 64 (4 us), counted on by its overflow interrupt every 1.024 ms (timebase_isr.S): seldom enough to cost
 * nothing that matters, often enough for the main loop to be woken for the watchdog.
 * Source: ATmega328P datasheet DS40002061, 15.7.1 (normal mode), 15.9. */
#include <avr/io.h>
#include "base/atomic.h"
#include "cli/timebase_port.h"

/* Written by the interrupt. */
volatile uint32_t timebase_overflows;

void timebase_start(void)
{
    TIMSK0 = _BV(TOIE0);
    TCCR0B = _BV(CS01) | _BV(CS00);
}

__attribute__((noinline)) uint16_t timebase_128us(void)
{
    uint8_t state = atomic_begin(); const uint16_t r = (uint16_t)timebase_overflows; atomic_end(state); return r;
}

uint8_t timebase_32ms(void)
{
    uint8_t state = atomic_begin();
    const volatile uint8_t *overflows = (const volatile uint8_t *)&timebase_overflows;
    uint8_t low = overflows[0];
    uint8_t high = overflows[1];
    atomic_end(state);
    return (uint8_t)(high << 3 | low >> 5);
}

uint8_t timebase_262ms(void)
{
    return ((const volatile uint8_t *)&timebase_overflows)[1];
}

uint32_t timebase_us(void)
{
    /* The atomic section stays short: the flag, the low byte and the count are compared afterwards. */
    uint8_t state = atomic_begin();
    uint8_t ticks = TCNT0;
    const uint8_t flags = TIFR0;
    uint32_t high = timebase_overflows;
    atomic_end(state);
    if ((flags & _BV(TOV0)) != 0 && ticks < 128) {
        high++; /* overflowed, not yet counted */
    }
    return (high << 8 | ticks) << 2;
}
