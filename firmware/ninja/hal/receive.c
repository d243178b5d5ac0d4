/* The serial line: the receiving half of USART0's driver (hal/usart_receive.S), alone.
 * Source: ATmega328P datasheet DS40002061, 20.10 (registers). */
#include <avr/io.h>
#include "base/inline.h"
#include "hal/baud.h"
#include "hal/ports.h"
#include "ninja/receive_port.h"
#include "ninja/stepper_port.h"

#define BAUD 4800

/* UCSR0B while the receive interrupt is at work, and otherwise: never with the transmitter. */
__asm__(".global usart_busy\n\tusart_busy = 1 << 4"); /* RXEN0 */
_Static_assert(RXEN0 == 4, "as above");
volatile uint8_t usart_control __attribute__((used)) = _BV(RXEN0) | _BV(RXCIE0);

void receive_port_init(void)
{
    const baud_divisor_t divisor = baud_divisor(BAUD);
    UBRR0 = divisor.ubrr;
    UCSR0A = (uint8_t)(divisor.u2x << U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00); /* 8 data bits, no parity, 1 stop bit */
    UCSR0B = usart_control;
}

/* The ring is nearly always empty: the main loop has a round every millisecond, a byte takes two. */
bool receive_port_halts(void)
{
    const uint8_t head = usart_port.rx_head;
    for (uint8_t i = usart_port.rx_tail; i != head; i = i == USART_RX_BYTES - 1 ? 0 : (uint8_t)(i + 1)) {
        const uint8_t byte = usart_port.rx[i];
        if (byte == RECEIVE_BACKSPACE || byte == RECEIVE_CTRL_R) {
            return true;
        }
    }
    return false;
}

int16_t receive_port_get(void)
{
    /* Before it is taken: the step interrupt sees it here or there. */
    if (receive_port_halts()) {
        stepper_port_halt();
    }
    return port_take(&usart_port, USART_RX_BYTES);
}
