/* A small image for the tests of ninjasim itself, so that they do not depend on the firmware. 4,800 Bd, polled; what
 * comes while a motor turns is lost but for the two bytes that the USART keeps. At power-up: 5 steps of Y down. */
#define F_CPU 16000000UL
#include <avr/io.h>
#include <util/delay.h>

static const uint8_t pair[4] = {0x3, 0x6, 0xC, 0x9};
static uint8_t phase_x, phase_y;

static void off(void)
{
    PORTD = 0;
    PORTC = 0;
}

/* So many steps, of the sign's direction; 100 a second if ms is 10. */
static void turn_x(int steps, uint8_t ms)
{
    for (;;) {
        PORTD = (uint8_t)(pair[phase_x & 3] << 4);
        for (uint8_t i = 0; i < ms; i++) {
            _delay_ms(1);
        }
        if (steps == 0) {
            break;
        }
        phase_x += steps > 0 ? 1 : -1;
        steps -= steps > 0 ? 1 : -1;
    }
    off();
}

static void turn_y(int steps)
{
    for (;;) {
        PORTC = pair[phase_y & 3];
        _delay_ms(10);
        if (steps == 0) {
            break;
        }
        phase_y += steps > 0 ? 1 : -1;
        steps -= steps > 0 ? 1 : -1;
    }
    off();
}

int main(void)
{
    UBRR0 = 207;
    UCSR0B = 1 << RXEN0;
    DDRD = 0xF0;
    DDRC = 0x0F;
    PORTB = (1 << PB0) | (1 << PB1); /* pull-ups of the sensors */
    turn_y(-5);
    for (;;) {
        while (!(UCSR0A & (1 << RXC0))) {
        }
        switch (UDR0) {
        case 'x': turn_x(-50, 10); break;
        case 'X': turn_x(50, 10); break;
        case 'y': turn_y(-50); break;
        case 'Y': turn_y(50); break;
        case '\b': turn_y(-20); break;
        case 0x12: turn_y(-30); break;
        case 'f': /* too fast from standstill */ turn_x(-40, 2); break;
        case 'w': /* wrong: A+C */
            PORTD = 0x50;
            _delay_ms(10);
            off();
            break;
        case 'h': /* the coils stay on */ PORTD = 0x30; break;
        case 's': /* moves X down while the sensor is low, 200 steps at most */
            for (uint8_t i = 0; i < 200 && !(PINB & 1); i++) {
                turn_x(-1, 10);
            }
            break;
        case 't': /* speaks */
            UCSR0B |= 1 << TXEN0;
            UDR0 = '!';
            break;
        case '!': /* a stack in the registers */ SP = 0x40; break;
        }
    }
}
