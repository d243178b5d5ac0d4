/* Sleeps in IDLE: the timers and the serial port keep running.
 * Source: ATmega328P datasheet DS40002061, 10.3 Idle Mode; 7.7: the instruction after SEI is executed before any
 * pending interrupt, so nothing fits between SEI and SLEEP. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include "base/wake.h"

volatile uint8_t wake_flag;

void wake_sleep(void)
{
    SMCR = _BV(SE); /* mode 0 is IDLE */
    cli();
    if (wake_flag == 0) {
        __asm__ volatile("sei\n\tsleep" : : : "memory");
    }
    sei();
    SMCR = 0;
}
