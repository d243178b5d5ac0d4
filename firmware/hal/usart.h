/* What usart.c and usart_isr.S share. */
#ifndef HAL_USART_H
#define HAL_USART_H

/* The receiver's: what arrives at 250,000 Bd while the planner is at its longest piece of work (4 ms). */
#define USART_RX_BYTES 112
#define USART_TX_BYTES 32 /* a power of two: its index wraps by masking */

/* Stands in the receive ring for what was lost: a byte with a framing error, or bytes before an overrun. It is not a
 * character of any command; in binary data a checksum tells it from a genuine 0xFF. */
#define USART_DAMAGED 0xFF

/* UCSR0B while an interrupt of the port is at work. */
#define USART_CONTROL ((1 << RXEN0) | (1 << TXEN0))

#ifndef __ASSEMBLER__
#include <stdint.h>

/* Rings: the interrupt writes rx_head and tx_tail, the main loop rx_tail and tx_head. Head is where the next byte goes,
 * tail where the next one is taken; equal means empty, one place stays free. */
extern volatile uint8_t usart_rx_bytes[USART_RX_BYTES];
extern volatile uint8_t usart_tx_bytes[USART_TX_BYTES];
extern volatile uint8_t usart_rx_head, usart_rx_tail, usart_tx_head, usart_tx_tail;
#endif

#endif
