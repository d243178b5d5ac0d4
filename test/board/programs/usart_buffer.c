/* One transmit buffer and one shift register: looks at UDRE0 and TXC0 after each write to UDR0, then disables the
 * transmitter while two bytes are on their way. DS40002061 sections 20.6.2, 20.6.5 and 20.11.2. */
#include <avr/io.h>
#include <stdint.h>

volatile uint8_t r_after_first, r_after_second, r_after_third; /* UCSR0A */
volatile uint8_t r_between;                                    /* UCSR0A when UDRE0 came back: TXC0 must be 0 */
volatile uint8_t r_done;

int main(void)
{
    DDRD |= 1 << PD1; /* PORTD1 stays 0: whoever reads a 1 on TXD reads the transmitter */
    UBRR0L = 25;
    UCSR0B = 1 << TXEN0;

    UDR0 = 'A';
    __asm__ __volatile__("nop");
    r_after_first = UCSR0A;
    UDR0 = 'B';
    __asm__ __volatile__("nop");
    r_after_second = UCSR0A;
    UDR0 = 'C'; /* the buffer is full: lost */
    __asm__ __volatile__("nop");
    r_after_third = UCSR0A;
    while (!(UCSR0A & (1 << UDRE0))) {
    }
    r_between = UCSR0A;
    while (!(UCSR0A & (1 << TXC0))) {
    }
    UCSR0A = 1 << TXC0;

    UDR0 = 'D';
    UDR0 = 'E';
    UCSR0B = 0; /* effective when both have left */
    while (!(UCSR0A & (1 << TXC0))) {
    }
    r_done = 1;
    for (;;) {
    }
}
