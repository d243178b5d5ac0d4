/* USART0 as the terminal's port: rings between the main loop and the interrupts of usart_isr.S.
 * Source: ATmega328P datasheet DS40002061, section 20. */
#include <avr/io.h>
#include "base/inline.h"
#include "cli/terminal_port.h"
#include "hal/baud.h"
#include "hal/usart.h"
#include "queue/ops_port.h"

_Static_assert(TERMINAL_PORT_DAMAGED == USART_DAMAGED, "the terminal knows a damaged byte by this value");

volatile uint8_t usart_rx_bytes[USART_RX_BYTES];
volatile uint8_t usart_tx_bytes[USART_TX_BYTES];
volatile uint8_t usart_rx_head, usart_rx_tail, usart_tx_head, usart_tx_tail;

/* The port's registers as they lie in the memory (datasheet, register summary). */
typedef struct {
    uint8_t status_a, control_b, control_c, reserved;
    uint16_t divisor;
} usart_t;

void terminal_port_init(uint32_t baud)
{
    const baud_divisor_t divisor = baud_divisor(baud);
    const uint8_t u2x = (uint8_t)(divisor.u2x << U2X0);
    volatile usart_t *usart = (volatile usart_t *)&UCSR0A;
    NEAR(usart);
    if (usart->divisor == divisor.ubrr && ((usart->status_a ^ u2x) & _BV(U2X0)) == 0 && usart->control_b != 0) {
        return; /* as it is: a write would spoil what is being received */
    }
    usart->status_a = u2x;
    usart->divisor = divisor.ubrr;
    usart->control_c = _BV(UCSZ01) | _BV(UCSZ00); /* 8 data bits, no parity, 1 stop bit */
    usart->control_b = USART_CONTROL | _BV(RXCIE0) | _BV(UDRIE0); /* output may be under way; if not, it is masked again */
}

int16_t terminal_port_get(void)
{
    const uint8_t tail = usart_rx_tail;
    if (tail == usart_rx_head) {
        return -1;
    }
    const uint8_t byte = usart_rx_bytes[tail];
    usart_rx_tail = tail == USART_RX_BYTES - 1 ? 0 : (uint8_t)(tail + 1);
    return byte;
}

uint8_t terminal_port_waiting(void)
{
    const uint8_t head = usart_rx_head;
    const uint8_t tail = usart_rx_tail;
    return (uint8_t)(head >= tail ? head - tail : head + USART_RX_BYTES - tail);
}

uint8_t terminal_port_free(void)
{
    return (uint8_t)((usart_tx_tail - usart_tx_head - 1) & (USART_TX_BYTES - 1));
}

uint8_t terminal_port_peek(uint8_t others)
{
    return usart_rx_bytes[others];
}

bool terminal_port_idle(void)
{
    return usart_tx_tail == usart_tx_head && (UCSR0A & _BV(TXC0)) != 0;
}

void terminal_port_put(uint8_t byte)
{
    UCSR0A = (uint8_t)((UCSR0A & _BV(U2X0)) | _BV(TXC0)); /* cleared, until this one is out (20.11.2) */
    const uint8_t head = usart_tx_head;
    usart_tx_bytes[head] = byte;
    usart_tx_head = (uint8_t)((head + 1) & (USART_TX_BYTES - 1));
    UCSR0B = USART_CONTROL | _BV(RXCIE0) | _BV(UDRIE0);
}

void ops_port_send(uint8_t byte)
{
    if (terminal_port_free() != 0) {
        terminal_port_put(byte);
    }
}
