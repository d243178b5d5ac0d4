/* Timer0 at clock / 64 (4 us), counted on by its overflow interrupt every 1.024 ms (timebase_isr.S).
 * It runs freely: who needs its compare units may rely on that.
 * Source: ATmega328P datasheet DS40002061, 15.7.1 (normal mode), 15.9. */
#include <avr/io.h>
#include "base/atomic.h"
#include "cli/timebase_port.h"
#include "hal/timebase.h"

volatile uint32_t timebase_overflows;

void timebase_start(void)
{
    TIMSK0 = _BV(TOIE0);
    TCCR0B = _BV(CS01) | _BV(CS00);
}

uint8_t timebase_wraps(void)
{
    return ((const volatile uint8_t *)&timebase_overflows)[1];
}

uint32_t timebase_us(void)
{
    /* The atomic sections stay short: the flag, the low half and the count are compared afterwards. */
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
