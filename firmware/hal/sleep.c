/* Sleeps in IDLE: the timers and the serial port keep running.
 * Source: ATmega328P datasheet DS40002061, 10.3 Idle Mode; 7.7: the instruction after SEI is executed before any
 * pending interrupt, so nothing fits between SEI and SLEEP. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include "base/wake.h"
#include "hal/timebase.h"
#include "motion/segment.h"

volatile uint8_t wake_flag;

void wake_sleep(void)
{
    uint8_t overflows, counted, tail;
    SMCR = _BV(SE); /* mode 0 is IDLE */
    do {
        overflows = timebase_low();
        counted = GPIOR0;
        tail = step_tail;
        cli();
        if (wake_flag == 0) {
            __asm__ volatile("sei\n\tsleep" : : : "memory");
        }
        sei();
        /* Again, if it was the time base and no step; not every 33 ms. */
    } while (wake_flag == 0 && timebase_low() != overflows && (timebase_low() & 31) != 0 && GPIOR0 == counted &&
             step_tail == tail);
    SMCR = 0;
}
