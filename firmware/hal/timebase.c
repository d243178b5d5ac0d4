/* Timer0 at clock / 8 (0.5 us, as fine as the software port needs it), counted on by its overflow interrupt every 128 us
 * (timebase_isr.S). Each 8th overflow wakes the main loop (sleep.c).
 * Source: ATmega328P datasheet DS40002061, 15.7.1 (normal mode), 15.9. */
#include "hal/timebase.h"
#include <avr/io.h>
#include "base/atomic.h"
#include "base/inline.h"
#include "base/timebase_port.h"

volatile uint32_t timebase_overflows;

void timebase_start(void)
{
    TIMSK0 |= _BV(TOIE0); /* the software port may be about to send */
    TCCR0B = _BV(CS01);
}

NOINLINE uint16_t timebase_128us(void)
{
    const uint8_t state = atomic_begin();
    const uint16_t overflows = (uint16_t)timebase_overflows;
    atomic_end(state);
    return overflows;
}

uint8_t timebase_32ms(void)
{
    return (&TIMEBASE_OVERFLOWS_LOW)[1];
}

uint8_t timebase_262ms(void)
{
    uint8_t state = atomic_begin();
    const uint8_t low = (&TIMEBASE_OVERFLOWS_LOW)[1];
    const uint8_t high = (&TIMEBASE_OVERFLOWS_LOW)[2];
    atomic_end(state);
    return (uint8_t)(high << 5 | low >> 3);
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
    return (high << 8 | ticks) >> 1 | (high >> 24 & 1) << 31;
}
