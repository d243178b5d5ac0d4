/* Tells how it was reset, what a reset left of RAM and what the I/O registers hold before anything is set up, then
 * sets many of them and waits. */
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdint.h>

#define NOINIT __attribute__((section(".noinit")))

volatile uint8_t p_keep_flags NOINIT; /* 1: do not clear MCUSR */
volatile uint8_t r_kept NOINIT;       /* a RAM cell that nobody initialises */
volatile uint8_t r_boots NOINIT;
volatile uint8_t r_mcusr NOINIT;
volatile uint8_t r_wdtcsr NOINIT;
volatile uint8_t r_io[8] NOINIT;
volatile uint8_t r_ready;

__attribute__((naked, used, section(".init3"))) void look_first(void)
{
    r_mcusr = MCUSR;
    r_wdtcsr = WDTCSR;
    if (p_keep_flags != 1) {
        MCUSR = 0;
    }
    wdt_disable();
}

int main(void)
{
    r_io[0] = DDRB;
    r_io[1] = PORTB;
    r_io[2] = UCSR0A;
    r_io[3] = UCSR0B;
    r_io[4] = UCSR0C;
    r_io[5] = UBRR0L;
    r_io[6] = TCCR1B;
    r_io[7] = EECR;
    r_boots++;

    DDRB = 0x04;
    PORTB = 0x04;
    UBRR0L = 25;
    UCSR0B = (1 << TXEN0) | (1 << RXEN0);
    TCCR1B = 1 << CS10;
    UDR0 = 'x';
    r_ready = 1;
    for (;;) {
    }
}
