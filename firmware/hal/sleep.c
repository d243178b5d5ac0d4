/* Sleeps in IDLE: the timers and the serial ports keep running. An overflow of Timer0 alone is no reason to wake, but each
 * 8th is, 1.024 ms: for the watchdog, and for what is polled.
 * Source: ATmega328P datasheet DS40002061, 10.3 Idle Mode; 7.7: the instruction after SEI is executed before any
 * pending interrupt, so nothing fits between SEI and SLEEP. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include "base/wake.h"
#include "hal/timebase.h"

volatile uint8_t wake_flag;

void wake_sleep(void)
{
    SMCR = _BV(SE); /* mode 0 is IDLE */
    for (;;) {
        const uint8_t before = TIMEBASE_OVERFLOWS_LOW;
        cli();
        if (wake_flag != 0) {
            break;
        }
        __asm__ volatile("sei\n\tsleep" : : : "memory");
        const uint8_t now = TIMEBASE_OVERFLOWS_LOW;
        if (now == before || (now & 7) == 0) {
            break;
        }
    }
    sei();
    SMCR = 0;
}
