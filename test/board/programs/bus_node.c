/* A node of an RS485 line at 38,400 Bd, all by hand: reads what comes at D4, sends p_bytes from D6 when told to. */
#include <avr/io.h>
#include <stdint.h>

#define BIT 417

enum { NOTHING, SEND, DRIVE_LOW, DRIVE_HIGH, RELEASE }; /* p_command */

volatile uint8_t p_command, p_count;
volatile uint8_t p_bytes[16];
volatile uint8_t r_bytes[64], r_count;
volatile uint8_t r_echo[16]; /* what D4 said in the middle of each bit that was sent */

static void receive(void)
{
    uint8_t byte = 0;

    __builtin_avr_delay_cycles(BIT + BIT / 2 - 20);
    for (uint8_t i = 0; i < 8; i++) {
        byte = (uint8_t)(byte >> 1 | (PIND & (1 << PD4) ? 0x80 : 0));
        __builtin_avr_delay_cycles(BIT - 10);
    }
    r_bytes[r_count++ & 63] = byte;
    __builtin_avr_delay_cycles(BIT / 8); /* well into the stop bit */
}

static void send(uint8_t byte, volatile uint8_t *echo)
{
    uint16_t frame = (uint16_t)(0x200 | byte << 1);
    uint8_t heard = 0;

    for (uint8_t i = 0; i < 10; i++) {
        if (frame & 1) {
            PORTD |= 1 << PD6;
        } else {
            PORTD &= (uint8_t) ~(1 << PD6);
        }
        frame >>= 1;
        __builtin_avr_delay_cycles(BIT / 2);
        if (i >= 1 && i <= 8) {
            heard = (uint8_t)(heard >> 1 | (PIND & (1 << PD4) ? 0x80 : 0));
        }
        __builtin_avr_delay_cycles(BIT / 2 - 24);
    }
    *echo = heard;
}

int main(void)
{
    PORTD = 1 << PD6;
    DDRD = (1 << PD6) | (1 << PD7);
    for (;;) {
        uint8_t command = p_command;

        if (!(PIND & (1 << PD4))) {
            receive();
        }
        switch (command) {
        case SEND:
            PORTD |= 1 << PD7;
            __builtin_avr_delay_cycles(BIT);
            for (uint8_t i = 0; i < p_count; i++) {
                send(p_bytes[i], &r_echo[i]);
            }
            PORTD &= (uint8_t) ~(1 << PD7);
            break;
        case DRIVE_LOW: PORTD = 1 << PD7; break;
        case DRIVE_HIGH: PORTD = (1 << PD7) | (1 << PD6); break;
        case RELEASE: PORTD = 1 << PD6; break;
        default: continue;
        }
        p_command = NOTHING;
    }
}
