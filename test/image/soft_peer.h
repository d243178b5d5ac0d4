/* A serial peer on S/W Rx (D4) and S/W Tx (D6): drives the one bit by bit, decodes the edges of the other.
 *
 * Units:   cycles of 62.5 ns; a bit may be any number of them. It takes the board's edges, those of S/W Tx and Tx En:
 *          all others go on to the oscilloscope.
 * Errors:  bytes that do not fit 8N1 are counted in soft_peer_bad. */
#ifndef TEST_SOFT_PEER_H
#define TEST_SOFT_PEER_H

#include <stddef.h>
#include <stdint.h>
#include "board/board.h"

void soft_peer_begin(board_t *b, double baud); /* both lines idle, nothing seen */
/* Drives so many bytes back to back from a cycle on, in bits of bit_cycles; returns the end of the last stop bit. */
uint64_t soft_peer_send(const void *bytes, size_t count, uint64_t from, double bit_cycles);
extern size_t soft_peer_flip; /* this bit of the next call's bytes, start and stop bits included, goes out inverted */
void soft_peer_level(int level, uint64_t cycle); /* the line at a cycle in the future: glitches, breaks */
const char *soft_peer_text(void);                /* what the board has sent, as far as its stop bits are over */
const board_uart_byte_t *soft_peer_bytes(size_t *count); /* the same, with their cycles */
const board_edge_t *soft_peer_tx_en(size_t *count);      /* its edges */
void soft_peer_clear_tx(void);
void soft_peer_clear_tx_en(void);
void soft_peer_clear(void); /* both */

extern double soft_peer_off;       /* the farthest an edge was from an ideal byte laid among its edges */
extern unsigned soft_peer_bad;     /* bytes without a stop bit */

#endif
