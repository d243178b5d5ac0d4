/* Writes 10 bytes from the EEPROM-ready interrupt, asleep in between; the interrupt is level-triggered. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

volatile uint8_t r_written;
volatile uint8_t r_calls; /* interrupts, the last one (nothing left to write) included */
volatile uint8_t r_done;

ISR(EE_READY_vect)
{
    r_calls++;
    if (r_written == 10) {
        EECR = 0;
        r_done = 1;
        return;
    }
    EEAR = 0x100 + r_written;
    EEDR = (uint8_t)(0x80 + r_written);
    EECR = (1 << EERIE) | (1 << EEMPE);
    EECR = (1 << EERIE) | (1 << EEMPE) | (1 << EEPE);
    r_written++;
}

int main(void)
{
    EECR = 1 << EERIE;
    sei();
    set_sleep_mode(SLEEP_MODE_IDLE);
    for (;;) {
        sleep_mode();
    }
}
