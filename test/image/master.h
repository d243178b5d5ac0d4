/* A master on the RS485 line of the one board, and what the board does to that line.
 *
 * The line is the software port's (D4, D6) or, with the roles exchanged, the hardware port's; Tx En is D7 in both cases.
 * The terminal is at the other one: master_type() and master_shown(), or at the hardware port image.h's functions.
 * Half duplex. Units: cycles.
 * Errors: whatever is sent in front of or behind Tx En, without a stop bit, or while the master sends, fails the test. */
#ifndef TEST_MASTER_H
#define TEST_MASTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "board/board.h"

enum { MASTER = 1, UNIT = 85 /* d_id of a unit as it comes from the factory */ };
enum { TERMINAL_USART, TERMINAL_SOFT };

#define LINE_BYTE 4167ull /* at the factory's 38,400 Bd */

typedef struct {
    uint8_t byte[120];
    size_t count;
} frame_t;

/* Between image_power_on() and the first prompt: who is where. crc_mode: the setting k. */
void master_begin(unsigned terminal, unsigned crc_mode);
/* The same, with another rate of the line. */
void master_begin_at(unsigned terminal, unsigned crc_mode, uint32_t baud);
void master_boot(unsigned terminal, unsigned crc_mode); /* power on, this, and on to the prompt */

/* A packet with the CRC that crc_mode wants, by a sum of the tests' own; bytes as they are written in the documents. */
frame_t master_frame(uint8_t destination, uint8_t origin, const char *body);
frame_t master_hex(const char *bytes);

/* From now on or from behind what is still being sent; time does not pass. */
void master_send(const frame_t *frame);
/* Time passes until the frame is sent, and any answer to it has come; one that has not begun after master_patience is not
 * awaited: 5 ms unless a test says otherwise, and 20 characters. */
extern uint64_t master_patience;
void master_exchange(const frame_t *frame);
void master_ask(const char *body); /* the same, to UNIT */
uint64_t master_sent_at(void); /* end of the last stop bit of what the master has sent */

/* What the board has sent on the line since the last frame or master_clear(), with its cycles; Tx En is checked. */
const board_uart_byte_t *master_heard(size_t *count);
void master_clear(void);
void master_assert_heard(const char *hex); /* exactly these bytes; "": none */
void master_assert_ack(void);              /* from UNIT to MASTER; crc_mode 0 or 1 */

/* The largest and smallest distances seen so far, all in cycles. */
typedef struct {
    uint64_t rise_min, rise_max; /* from Tx En's rise to the start bit */
    uint64_t fall_max;           /* from the last stop bit's end to its fall */
    uint64_t answer_min, answer_max; /* from the end of the master's frame to the start bit */
    uint64_t enabled_max;        /* longest time that Tx En was high */
} master_measures_t;
extern master_measures_t master_measures;

void master_type(const char *text); /* at the terminal; time passes until it is sent */
void master_begin_line(const char *line); /* and CR; time does not pass */
const char *master_text(void);      /* shown at the terminal since the last master_shown() */
const char *master_shown(void);     /* the same, and it is forgotten */

#endif
