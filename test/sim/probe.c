/* A small image for the tests of sacsim itself, so that they do not depend on the firmware. 38,400 Bd, polled. It says
 * hello with the reset flags (MCUSR, one hex digit), echoes every byte, and does with some of them what is said below. */
#define F_CPU 16000000UL
#include <avr/eeprom.h>
#include <avr/io.h>
#include <util/delay.h>

volatile uint8_t motion_state; /* as the firmware's: 0 STANDBY, 1 ACCEL, 2 CRUISE, 3 DECEL, 4 STOP */

static void put(char c)
{
    while (!(UCSR0A & (1 << UDRE0))) {
    }
    UDR0 = (uint8_t)c;
}

static void put_text(const char *text)
{
    while (*text != '\0') {
        put(*text++);
    }
}

/* About 1 kHz on clk (PB2), 5 us wide. */
static void pulses(uint8_t count, uint8_t ccw)
{
    PORTB = (uint8_t)((PORTB & ~(1 << PB5)) | (ccw ? 1 << PB5 : 0));
    motion_state = 2;
    while (count-- > 0) {
        PORTB |= 1 << PB2;
        _delay_us(5);
        PORTB &= (uint8_t) ~(1 << PB2);
        _delay_us(995);
    }
    motion_state = 0;
}

/* Whether T1 sees the 1 MHz that Timer2 makes on OC2A. */
static char wired(void)
{
    TCCR2A = (1 << COM2A0) | (1 << WGM21);
    OCR2A = 7;
    TCCR2B = 1 << CS20;
    DDRB |= 1 << PB3;
    TCNT1 = 0;
    TCCR1B = (1 << CS12) | (1 << CS11) | (1 << CS10);
    _delay_us(100);
    TCCR1B = 0;
    return TCNT1 > 90 && TCNT1 < 110 ? 'y' : 'n';
}

int main(void)
{
    uint8_t cause = MCUSR;

    MCUSR = 0;
    UBRR0 = 25;
    UCSR0B = (1 << RXEN0) | (1 << TXEN0);
    PORTD = (1 << PD2) | (1 << PD3); /* pull-ups of Estop and sync */
    EICRA = 1 << ISC11;              /* INTF1 at falling edges of sync */
    DDRB = (1 << PB2) | (1 << PB5);
    put_text("hello ");
    put("0123456789abcdef"[cause & 15]);
    put_text("\r\nSAC>");
    for (;;) {
        uint8_t c;

        while (!(UCSR0A & (1 << RXC0))) {
        }
        c = UDR0;
        put((char)c);
        switch (c) {
        case 'p': /* 20 pulses clockwise */ pulses(20, 0); break;
        case 'n': /* 5 pulses counter-clockwise */ pulses(5, 1); break;
        case 'c': /* seems to cruise for ever */ motion_state = 2; break;
        case 'w': /* changes the EEPROM */
            eeprom_write_byte((uint8_t *)7, 0x5a);
            eeprom_busy_wait();
            put('.');
            break;
        case 'l': /* the level of Estop */ put(PIND & (1 << PD2) ? '1' : '0'); break;
        case 'y': /* whether sync has fallen */
            put(EIFR & (1 << INTF1) ? '1' : '0');
            EIFR = 1 << INTF1;
            break;
        case 't': put(wired()); break;
        case 'X': /* a stack in the registers */
            SP = 0x40;
            put_text("not reached");
            break;
        }
    }
}
