/* SLEEP without SE is a NOP; with SE, IDLE lasts until the interrupt. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

volatile uint8_t r_passed; /* SLEEP executed without SE */
volatile uint8_t r_woken;
volatile uint16_t r_slept_ticks; /* Timer1 at 1 MHz / 8 while asleep */

ISR(TIMER1_COMPA_vect)
{
    r_woken++;
}

int main(void)
{
    __asm__ __volatile__("sleep");
    r_passed = 1;
    OCR1A = 9999;
    TCCR1B = (1 << WGM12) | (1 << CS11);
    TIMSK1 = 1 << OCIE1A;
    sei();
    SMCR = 1 << SE;
    __asm__ __volatile__("sleep");
    r_slept_ticks = TCNT1;
    SMCR = 0;
    for (;;) {
    }
}
