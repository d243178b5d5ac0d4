/* What ports.c, usart_receive.S, usart_transmit.S and soft_uart_isr.S share: both serial ports in one shape. */
#ifndef HAL_PORTS_H
#define HAL_PORTS_H

/* The receivers': what arrives at 250,000 Bd while the planner is at its longest piece of work (4 ms), and at 38,400. */
#define USART_RX_BYTES 106
#define SOFT_RX_BYTES 64 /* a power of two */
#define PORT_TX_BYTES 32 /* a power of two: its index wraps by masking */

/* Stands in the receive ring for what was lost: a byte with a framing error, or bytes before an overrun. It is not a
 * character of any command; in binary data a checksum tells it from a genuine 0xFF. */
#define PORT_DAMAGED 0xFF

#define PORT_SW_RX 4 /* bits of port D (board.h) */
#define PORT_TX_EN 7

/* UCSR0B while an interrupt of the port is at work. */
#define USART_CONTROL ((1 << RXEN0) | (1 << TXEN0))

/* Offsets in port_t. */
#define PORT_RX_HEAD 0
#define PORT_RX_TAIL 1
#define PORT_TX_HEAD 2
#define PORT_TX_TAIL 3
#define PORT_FRAMING 4
#define PORT_OVERRUNS 5
#define PORT_TX 6
#define PORT_RX (PORT_TX + PORT_TX_BYTES)

/* Offsets in soft_uart. */
#define SOFT_INTERVAL 0
#define SOFT_INTERVALS 2
#define SOFT_ENDED 3
#define SOFT_RX_FRACTION 4
#define SOFT_RX_INTERVALS 5
#define SOFT_RX_BITS 6
#define SOFT_RX_SHIFT 7
#define SOFT_TX_FRACTION 8
#define SOFT_TX_INTERVALS 9
#define SOFT_TX_BITS 10
#define SOFT_TX_SHIFT 11
#define SOFT_PORT 12

/* SOFT_TX_BITS, where nothing but a stop bit or an idle line is left. */
#define SOFT_TX_LAST 0xFF

#ifndef __ASSEMBLER__
#include <stdint.h>

/* Rings: the interrupts write rx_head and tx_tail, the main loop rx_tail and tx_head. Head is where the next byte goes,
 * tail where the next one is taken; equal means empty, one place stays free. */
typedef struct {
    volatile uint8_t rx_head, rx_tail, tx_head, tx_tail;
    volatile uint8_t framing, overruns; /* errors, up to 255 */
    volatile uint8_t tx[PORT_TX_BYTES];
    volatile uint8_t rx[];
} port_t;

/* The oldest byte received, or -1. places: of the ring. Main loop; inlined, because at 250,000 Bd all that is done for a
 * character counts. */
__attribute__((always_inline)) static inline int16_t port_take(port_t *port, uint8_t places)
{
    const uint8_t tail = port->rx_tail;
    if (tail == port->rx_head) {
        return -1;
    }
    const uint8_t byte = port->rx[tail];
    port->rx_tail = tail == places - 1 ? 0 : (uint8_t)(tail + 1);
    return byte;
}

extern port_t usart_port;

/* UCSR0B without RXCIE0, which comes to it unless an interrupt of either port is at work, and UDRIE0, while the transmit
 * ring is not empty. Written by the main loop alone. */
extern volatile uint8_t usart_control;

/* A bit is a number of equal intervals, a power of two: one above 11,765 Bd. They are in ticks of Timer0, 0.5 us, with a
 * fraction that is carried on. What stands below `ended` belongs to the interrupts while they are enabled. */
extern struct {
    volatile uint16_t interval; /* in 1/256 ticks, 52..170 ticks */
    volatile uint8_t intervals;
    volatile uint8_t ended; /* Tx En falls where the ring runs empty */
    volatile uint8_t rx_fraction, rx_intervals, rx_bits, rx_shift;
    volatile uint8_t tx_fraction, tx_intervals, tx_bits, tx_shift;
    port_t port;
} soft_uart;
#endif

#endif
