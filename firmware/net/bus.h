/* The bus: packets in and out, one at a time, half duplex.
 *
 * One buffer serves both ways. A packet that has been received stays in it until bus_poll() is called again, and what
 * arrives meanwhile waits in the port's ring; a packet is put together in it when the bus is free for it. An echo of what
 * was sent is known by its origin.
 * Units:   128 us, characters of the port's rate.
 * Context: main loop. Errors: PACKET_WRONG and PACKET_BROKEN are counted here.
 * Tests:   test/host/test_network.c with test/host/fakes/bus_port_fake.c
 * Source:  manual lines 183, 191-205, 215-217; decisions 0.4, A-NET-13, A-NET-14. */
#ifndef NET_BUS_H
#define NET_BUS_H

#include <stdint.h>
#include "net/packet.h"

/* Since the start or bus_clear(), those of the port apart; they go round after 65,535. */
typedef struct {
    uint16_t good;      /* packets for this node */
    uint16_t wrong;     /* with a wrong CRC */
    uint16_t discarded; /* broken, or not acceptable */
    uint16_t resent;    /* answers to a command that came again (strict packets) */
} bus_counters_t;

extern bus_counters_t bus_counters;
extern packet_t bus_packet;

/* After so much silence an answer is sent, another packet, and a packet under way is given up. */
enum { BUS_ANSWER_CHARACTERS = 1, BUS_PACKET_CHARACTERS = 3, BUS_SILENCE_CHARACTERS = 20 };

void bus_init(void);

packet_event_t bus_poll(void);

/* Each is 0 or not. */
uint8_t bus_free(uint8_t characters); /* nothing is on its way in or out, and nothing has been for so many characters */
uint8_t bus_expects(void);            /* a packet is under way, or a soft op is to go out */
uint8_t bus_sending(void);

/* Not 0: something is to be done though nothing has come in; network_poll() says when it is over. */
extern uint8_t bus_awake;

/* With body and length in bus_packet, while bus_free(). crc: as the session says; strict packets have one always. */
void bus_send(uint8_t destination, uint8_t crc);

uint8_t bus_strict(void);
void bus_clear(void); /* the counters */

/* -- soft ops: broadcasts that wait until the bus is free ---------------------------------------------------------- */

void bus_ops(uint8_t byte); /* DC1, DC2; the newest are dropped when 8 are waiting */
uint8_t bus_ops_wait(void);
uint8_t bus_ops_next(void); /* the one that has waited longest, taken out; only while there is one */

#endif
