/* A simulated RS485 line: boards and peers of the host's on one pair of wires.
 *
 * A node is a board with a transceiver: D6 (S/W Tx) drives the line while D7 (Tx En) is high, D4 (S/W Rx) hears it at all
 * times, its own echo included. A peer is anything else: a master, a babbler, noise, a short circuit. A line that nobody
 * drives is high (biased). Drivers of different levels at once are a contention: counted, and the line is low.
 *
 * Units:   cycles of the bus: 1/16 us since bus_new(). A node's own cycles are these unless its clock is skewed.
 * Exact:   all boards run in quanta of BUS_QUANTUM cycles. What a node does to the line is in effect at its exact cycle,
 *          as peers see it and time it. What the line does reaches D4 of every node BUS_DELAY cycles later, always by as
 *          much, as over a slow transceiver: so intervals are exact too. With a skewed clock both are rounded to one cycle.
 * Errors:  a board that crashes ends the run; bus_crashed() tells which. Out of memory: abort().
 * Context: once a board has joined, only the bus runs it; what board.h offers besides may be used between runs. */
#ifndef BOARD_BUS_H
#define BOARD_BUS_H

#include "board.h"

#define BUS_QUANTUM 32
/* A board ends a run within the instruction that is due then, and that lasts no longer than the difference. */
#define BUS_DELAY (BUS_QUANTUM + 8)

typedef struct bus bus_t;
typedef struct bus_peer bus_peer_t;

bus_t *bus_new(void);
void bus_free(bus_t *bus); /* before its boards, which are left as they are */
void bus_join(bus_t *bus, board_t *b);

uint64_t bus_cycle(const bus_t *bus);
board_run_t bus_run_to(bus_t *bus, uint64_t cycle);
board_run_t bus_run_for(bus_t *bus, uint64_t cycles);
board_t *bus_crashed(const bus_t *bus); /* NULL: none */

/* From now on the node's clock runs so much faster than it should, at most +-20 %. */
void bus_skew(bus_t *bus, board_t *b, double percent);

/* The cycle of the board's own clock at that cycle of the bus, from the last bus_skew() on; and the other way round. */
uint64_t bus_board_cycle(const board_t *b, uint64_t bus_cycle);
uint64_t bus_cycle_of(const board_t *b, uint64_t board_cycle);

int bus_level(const bus_t *bus);            /* as it is heard */
unsigned bus_drivers(const bus_t *bus);     /* how many drive it, peers included */
uint32_t bus_contentions(const bus_t *bus); /* how many times drivers began to disagree */

/* From now on each bit time of a line that is driven is inverted with that probability, for all that hear it; the same
 * seed makes the same errors. A line that nobody drives is not damaged: what noise does
 * to it a peer can do. */
void bus_bit_errors(bus_t *bus, double probability, double baud, uint64_t seed);
uint32_t bus_bit_errors_made(const bus_t *bus);

/* -- peers: what they drive is planned, one thing behind the other -------------------------------------------------- */

bus_peer_t *bus_peer(bus_t *bus, double baud); /* freed with the bus */
/* Bytes back to back, 10 bits each; the peer drives from the first start bit to the last stop bit. */
void bus_peer_send(bus_peer_t *p, const void *bytes, size_t count);
/* Drives 0 or 1 for so long, or nothing (-1): a gap. */
void bus_peer_hold(bus_peer_t *p, int level, uint64_t cycles);
void bus_peer_stop(bus_peer_t *p);              /* releases the line and forgets what was planned */
uint64_t bus_peer_free_at(const bus_peer_t *p); /* the end of all that is planned; in the past: nothing is */

typedef struct {
    uint64_t start_cycle; /* falling edge of the start bit */
    uint64_t end_cycle;   /* middle of the stop bit: the byte is complete */
    uint8_t byte;
    bool framing_error; /* the stop bit was low */
    bool echo;          /* the peer itself drove the line when it began */
} bus_byte_t;
/* All that was on the line, read at the peer's rate, since bus_peer_clear(). */
const bus_byte_t *bus_peer_received(const bus_peer_t *p, size_t *count);
void bus_peer_clear(bus_peer_t *p);

#endif
