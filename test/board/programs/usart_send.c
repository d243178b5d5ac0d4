/* Sends the bytes that the test left in RAM, polling UDRE0, then waits for TXC0 and looks at the flags.
 * The p_ variables are the test's: .noinit, written before the program starts. The r_ variables are the result. */
#include <avr/io.h>
#include <stdint.h>

#define NOINIT __attribute__((section(".noinit")))

volatile uint16_t p_ubrr NOINIT;
volatile uint8_t p_ucsra NOINIT;
volatile uint8_t p_ucsrb NOINIT; /* UCSZ02 and TXB8; TXEN0 is added */
volatile uint8_t p_ucsrc NOINIT;
volatile uint8_t p_order NOINIT; /* UCSR0A is written before UBRR0 (0), after it (1), after UCSR0B (2) */
volatile uint8_t p_count NOINIT;
volatile uint8_t p_bytes[32] NOINIT;

volatile uint8_t r_at_reset[5];  /* UCSR0A, UCSR0B, UCSR0C, UBRR0H, UBRR0L */
volatile uint8_t r_complete;     /* UCSR0A when TXC0 was seen */
volatile uint8_t r_zero_written; /* after a write of TXC0 = 0 */
volatile uint8_t r_one_written;  /* after a write of TXC0 = 1 */
volatile uint8_t r_done;

int main(void)
{
    r_at_reset[0] = UCSR0A;
    r_at_reset[1] = UCSR0B;
    r_at_reset[2] = UCSR0C;
    r_at_reset[3] = UBRR0H;
    r_at_reset[4] = UBRR0L;
    UCSR0C = p_ucsrc;
    if (p_order == 0) {
        UCSR0A = p_ucsra;
    }
    UBRR0H = (uint8_t)(p_ubrr >> 8);
    UBRR0L = (uint8_t)p_ubrr;
    if (p_order == 1) {
        UCSR0A = p_ucsra;
    }
    UCSR0B = (uint8_t)(p_ucsrb | (1 << TXEN0));
    if (p_order == 2) {
        UCSR0A = p_ucsra;
    }

    for (uint8_t i = 0; i < p_count; i++) {
        while (!(UCSR0A & (1 << UDRE0))) {
        }
        UDR0 = p_bytes[i];
    }
    while (!(UCSR0A & (1 << TXC0))) {
    }
    r_complete = UCSR0A;
    UCSR0A = p_ucsra;
    r_zero_written = UCSR0A;
    UCSR0A = (uint8_t)(p_ucsra | (1 << TXC0));
    r_one_written = UCSR0A;
    r_done = 1;
    for (;;) {
    }
}
