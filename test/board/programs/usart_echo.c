/* Echoes by interrupts alone, asleep in IDLE between them: RX into a ring, UDRE out of it. TX complete is counted. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

volatile uint8_t ring[256];
volatile uint8_t head, tail;
volatile uint16_t r_received, r_sent, r_completed;
volatile uint8_t r_errors; /* FE0, DOR0, UPE0 of any byte */

ISR(USART_RX_vect)
{
    r_errors |= UCSR0A & ((1 << FE0) | (1 << DOR0) | (1 << UPE0));
    ring[head++] = UDR0;
    r_received++;
    UCSR0B |= 1 << UDRIE0;
}

ISR(USART_UDRE_vect)
{
    UDR0 = ring[tail++];
    r_sent++;
    if (tail == head) {
        UCSR0B &= (uint8_t) ~(1 << UDRIE0);
    }
}

ISR(USART_TX_vect)
{
    r_completed++;
}

int main(void)
{
    UBRR0L = 25; /* 38,462 Bd */
    UCSR0B = (1 << RXCIE0) | (1 << TXCIE0) | (1 << RXEN0) | (1 << TXEN0);
    set_sleep_mode(SLEEP_MODE_IDLE);
    sei();
    for (;;) {
        sleep_mode();
    }
}
