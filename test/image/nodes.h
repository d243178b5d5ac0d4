/* For the tests of several boards on one RS485 line: images that are ready for commands, a master in strict mode.
 *
 * Units: cycles of the bus (62.5 ns), if nothing else is said. Errors: fail the running test (image_fail()). */
#ifndef TEST_NODES_H
#define TEST_NODES_H

#include "board/bus.h"
#include "image.h"

enum { MOST_NODES = 12 };

typedef struct {
    board_t *board;
    size_t pulses;
    uint64_t first_pulse; /* of these; cycle of the bus */
    bool moving;          /* a pulse has come since the last look of nodes_run_until_still() */
} node_t;

extern bus_t *bus;
extern node_t node[MOST_NODES];
extern unsigned node_count;

/* A board that has started, with this address and k CRC; its clock so many parts in a million too fast. */
void nodes_begin(void);
void nodes_add(uint8_t address, uint8_t crc_mode, double ppm);
void nodes_end(void);

void nodes_run(uint64_t cycles);
void nodes_run_until_still(uint64_t most_cycles); /* no pulse for 50 ms */
void nodes_clear_pulses(void);

/* At a terminal: what is printed until `ends` is its end. */
const char *node_says(unsigned which, const char *line, const char *ends);
void node_text_is(unsigned which, const char *expected); /* all that was printed meanwhile; it is forgotten then */

/* -- a master, whose address is 1: what it sends is strict ----------------------------------------------------------- */

void master_begin(void);
size_t master_packet(uint8_t *bytes, uint8_t destination, uint8_t sequence, const char *text);
/* Sends it once. What the answer is: ACK, NAK; 0: none, or none that can be read. */
uint8_t master_sends(uint8_t destination, uint8_t sequence, const char *text);
/* The line is held low from that cycle on, as long as the packet or answer may last: it is lost. */
void master_jams(uint64_t after_cycles, uint64_t cycles);

#endif
