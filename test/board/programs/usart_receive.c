/* Polls RXC0 and keeps UCSR0A and UDR0 of every byte, unless the test holds it; also turns the receiver off and on. */
#include <avr/io.h>
#include <stdint.h>

#define NOINIT __attribute__((section(".noinit")))

volatile uint16_t p_ubrr NOINIT;
volatile uint8_t p_ucsra NOINIT;
volatile uint8_t p_ucsrb NOINIT; /* UCSZ02; RXEN0 is added */
volatile uint8_t p_ucsrc NOINIT;
volatile uint8_t p_hold NOINIT; /* 1: leave the bytes where they are */
volatile uint8_t p_flush;       /* 1: RXEN0 off and on, then 0 again */

volatile uint8_t r_count;
volatile uint8_t r_status[256];
volatile uint8_t r_data[256];
volatile uint8_t r_ninth[256]; /* UCSR0B */
volatile uint8_t r_ready;

int main(void)
{
    UCSR0C = p_ucsrc;
    UBRR0H = (uint8_t)(p_ubrr >> 8);
    UBRR0L = (uint8_t)p_ubrr;
    UCSR0A = p_ucsra;
    UCSR0B = (uint8_t)(p_ucsrb | (1 << RXEN0));
    r_ready = 1;
    for (;;) {
        if (p_flush) {
            UCSR0B = p_ucsrb;
            UCSR0B = (uint8_t)(p_ucsrb | (1 << RXEN0));
            p_flush = 0;
        }
        uint8_t status = UCSR0A;
        if (!p_hold && (status & (1 << RXC0))) {
            r_ninth[r_count] = UCSR0B;
            r_status[r_count] = status;
            r_data[r_count] = UDR0;
            r_count++;
        }
    }
}
