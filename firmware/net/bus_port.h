/* The serial port that the network uses, and the RS485 driver's enable pin (Tx En); implemented by hal/ports.c.
 *
 * Which port it is follows from the setting E network: 0 the software port (D4, D6), 1 the hardware port.
 * Units:   bytes. Context: main loop.
 * Errors:  a byte with a framing error, or bytes lost before one, are read as a byte 0xFF and counted; a packet's CRC
 *          tells them from a genuine one.
 * Tests:   test/host/fakes/bus_port_fake.c stands in for it
 * Source:  manual lines 181, 215-217, 664-666. */
#ifndef NET_BUS_PORT_H
#define NET_BUS_PORT_H

#include <stdbool.h>
#include <stdint.h>

uint8_t bus_port_waiting(void); /* not 0: a byte has arrived */
int16_t bus_port_get(void); /* the next byte that has arrived; -1: none */

/* Tx En rises. The first byte that is put follows at least one bit time later. */
void bus_port_begin(void);
uint8_t bus_port_free(void);     /* how many bytes bus_port_put() would take now, 0..31 */
void bus_port_put(uint8_t byte); /* only while bus_port_free() is not 0, between bus_port_begin() and bus_port_end() */

/* All of the packet has been put: Tx En falls as soon as its last stop bit has left, by interrupt. Until then it stays
 * high, also where the bytes come too slowly. */
void bus_port_end(void);

/* Tx En is high. What arrives meanwhile may be the port's own echo. */
bool bus_port_sending(void);

/* How long so many characters of 10 bits last, in units of 128 us, rounded up: 3 for one at 38,400 Bd. */
uint16_t bus_port_characters_128us(uint8_t characters);

/* Of the network's port since bus_port_clear(); they stay at 255. */
uint8_t bus_port_framing_errors(void);
uint8_t bus_port_overruns(void);
void bus_port_clear(void);

#endif
