/* Both serial ports, USART0 and the software port: rings between the main loop and the interrupts of usart_receive.S,
 * usart_transmit.S and soft_uart_isr.S. One is the terminal's, the other one the network's.
 * Source: ATmega328P datasheet DS40002061, sections 15 (Timer0) and 20 (USART). */
#include "hal/ports.h"
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stddef.h>
#include "base/atomic.h"
#include "base/inline.h"
#include "base/timebase_port.h"
#include "cli/terminal_port.h"
#include "hal/baud.h"
#include "net/bus_port.h"
#include "ports_port.h"
#include "queue/ops_port.h"
#include "settings.h"

_Static_assert(TERMINAL_PORT_DAMAGED == PORT_DAMAGED, "the terminal knows a damaged byte by this value");
_Static_assert(offsetof(port_t, rx) == PORT_RX && offsetof(port_t, overruns) == PORT_OVERRUNS, "as in ports.h");
_Static_assert(sizeof soft_uart == SOFT_PORT + PORT_RX, "as in ports.h");

#define LONGEST_INTERVAL (170u << 8)

volatile uint8_t usart_control;
static uint8_t network;    /* as the setting was when the ports were set up */
static uint16_t begun_128us; /* when Tx En has risen */

/* The port's registers as they lie in the memory (datasheet, register summary). */
typedef struct {
    uint8_t status_a, control_b, control_c, reserved;
    uint16_t divisor;
} usart_t;

/* At 250,000 Bd a character lasts 640 cycles, and all that is done for one counts: so what a port's functions have in
 * common is compiled twice, with the addresses of each, and the role chosen once. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))

/* -- rates and roles ----------------------------------------------------------------------------------------------- */

static void usart_init(void)
{
    const baud_divisor_t divisor = baud_divisor(settings.hw_baud);
    const uint8_t u2x = (uint8_t)(divisor.u2x << U2X0);
    volatile usart_t *usart = (volatile usart_t *)&UCSR0A;
    NEAR(usart);
    if (usart->divisor == divisor.ubrr && ((usart->status_a ^ u2x) & _BV(U2X0)) == 0 && usart->control_b != 0) {
        return; /* as it is: a write would spoil what is being received */
    }
    usart->status_a = u2x;
    usart->divisor = divisor.ubrr;
    usart->control_c = _BV(UCSZ01) | _BV(UCSZ00); /* 8 data bits, no parity, 1 stop bit */
}

static void soft_init(void)
{
    uint32_t interval = 16 * BOARD_CPU_HZ * 2 / settings.sw_baud;
    uint8_t intervals = 1;
    while (interval > LONGEST_INTERVAL) {
        interval = (interval + 1) >> 1;
        intervals = (uint8_t)(intervals << 1);
    }
    const uint8_t state = atomic_begin();
    soft_uart.interval = (uint16_t)interval;
    soft_uart.intervals = intervals;
    atomic_end(state);
}

static void usart_enable(uint8_t ended)
{
    usart_control = USART_CONTROL | ended;
    UCSR0B = usart_control | _BV(RXCIE0) | _BV(UDRIE0); /* output may be under way; if not, it is masked again */
}

void ports_init(void)
{
    usart_init();
    soft_init();
    if (network != settings.network) {
        network = settings.network;
        usart_port.rx_tail = usart_port.rx_head; /* it was meant for another */
        soft_uart.port.rx_tail = soft_uart.port.rx_head;
        soft_uart.ended = 0;
        usart_control = 0;
        PORTD &= (uint8_t)~_BV(PORT_TX_EN);
    }
    usart_enable(usart_control & _BV(TXCIE0));
}

bool ports_deaf(void)
{
    return PCMSK2 == 0;
}

void ports_listen(void)
{
    cli();
    if ((TIMSK0 & _BV(OCIE0B)) == 0) { /* otherwise a byte is being received */
        PCMSK2 = _BV(PORT_SW_RX);
    }
    sei();
}

/* -- rings --------------------------------------------------------------------------------------------------------- */

static int16_t get(uint8_t software)
{
    return software ? port_take(&soft_uart.port, SOFT_RX_BYTES) : port_take(&usart_port, USART_RX_BYTES);
}

ALWAYS_INLINE uint8_t free_places_of(const port_t *port)
{
    return (uint8_t)((port->tx_tail - port->tx_head - 1) & (PORT_TX_BYTES - 1));
}

static uint8_t free_places(uint8_t software)
{
    return software ? free_places_of(&soft_uart.port) : free_places_of(&usart_port);
}

ALWAYS_INLINE uint8_t waiting(const port_t *port, uint8_t places)
{
    const uint8_t head = port->rx_head;
    const uint8_t tail = port->rx_tail;
    return (uint8_t)(head >= tail ? head - tail : head + places - tail);
}

ALWAYS_INLINE void append(port_t *port, uint8_t byte)
{
    const uint8_t head = port->tx_head;
    port->tx[head] = byte;
    port->tx_head = (uint8_t)((head + 1) & (PORT_TX_BYTES - 1));
}

static bool soft_sends(void)
{
    return (TIMSK0 & _BV(OCIE0A)) != 0;
}

static void put(uint8_t software, uint8_t byte)
{
    if (!software) {
        UCSR0A = (uint8_t)((UCSR0A & _BV(U2X0)) | _BV(TXC0)); /* cleared, until this one is out (20.11.2) */
        append(&usart_port, byte);
        UCSR0B = usart_control | _BV(RXCIE0) | _BV(UDRIE0);
        return;
    }
    append(&soft_uart.port, byte);
    if (!soft_sends()) {
        /* The first match, at once, leaves the line high; the start bit comes a bit later. */
        soft_uart.tx_intervals = soft_uart.intervals;
        soft_uart.tx_bits = SOFT_TX_LAST;
        const uint8_t state = atomic_begin();
        OCR0A = (uint8_t)(TCNT0 + 3);
        TIFR0 = _BV(OCF0A);
        TIMSK0 |= _BV(OCIE0A);
        atomic_end(state);
    }
}

/* -- the terminal's ------------------------------------------------------------------------------------------------ */

int16_t terminal_port_get(void)
{
    return get(network);
}

uint8_t terminal_port_waiting(void)
{
    return network ? waiting(&soft_uart.port, SOFT_RX_BYTES) : waiting(&usart_port, USART_RX_BYTES);
}

uint8_t terminal_port_free(void)
{
    return free_places(network);
}

uint8_t terminal_port_peek(uint8_t others)
{
    return (network ? &soft_uart.port : &usart_port)->rx[others];
}

bool terminal_port_idle(void)
{
    if (network) {
        return !soft_sends();
    }
    return usart_port.tx_tail == usart_port.tx_head && (UCSR0A & _BV(TXC0)) != 0;
}

void terminal_port_put(uint8_t byte)
{
    put(network, byte);
}

void ops_port_send(uint8_t byte)
{
    if (terminal_port_free() != 0) {
        terminal_port_put(byte);
    }
}

/* -- the network's ------------------------------------------------------------------------------------------------- */

uint8_t bus_port_waiting(void)
{
    return network ? usart_port.rx_head ^ usart_port.rx_tail : soft_uart.port.rx_head ^ soft_uart.port.rx_tail;
}

int16_t bus_port_get(void)
{
    return get(network ^ 1);
}

void bus_port_begin(void)
{
    if (network) {
        usart_enable(0);
    }
    soft_uart.ended = 0;
    PORTD |= _BV(PORT_TX_EN);
    begun_128us = timebase_128us();
}

/* The software port begins with an idle bit of its own, USART0 does not. */
uint8_t bus_port_free(void)
{
    if (network && (uint16_t)(timebase_128us() - begun_128us) <= bus_port_characters_128us(1) / 8 + 1) {
        return 0;
    }
    return free_places(network ^ 1);
}

void bus_port_put(uint8_t byte)
{
    put(network ^ 1, byte);
}

void bus_port_end(void)
{
    if (network) {
        usart_enable(_BV(TXCIE0));
        return;
    }
    const uint8_t state = atomic_begin();
    soft_uart.ended = 1;
    if (!soft_sends()) {
        PORTD &= (uint8_t)~_BV(PORT_TX_EN);
    }
    atomic_end(state);
}

bool bus_port_sending(void)
{
    return (PORTD & _BV(PORT_TX_EN)) != 0;
}

uint16_t bus_port_characters_128us(uint8_t characters)
{
    uint32_t bit = (uint32_t)soft_uart.interval * soft_uart.intervals; /* in 1/32 cycles */
    if (network) {
        bit = (uint32_t)(UBRR0 + 1) << ((UCSR0A & _BV(U2X0)) != 0 ? 8 : 9);
    }
    return (uint16_t)((bit * 10 * characters >> 16) + 1);
}

static port_t *bus(void)
{
    return network ? &usart_port : &soft_uart.port;
}

uint8_t bus_port_framing_errors(void)
{
    return bus()->framing;
}

uint8_t bus_port_overruns(void)
{
    return bus()->overruns;
}

void bus_port_clear(void)
{
    port_t *port = bus();
    port->framing = 0;
    port->overruns = 0;
}
