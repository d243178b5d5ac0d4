/* Text to the terminal's port, or into a packet. Whoever calls these has asked for room first.
 *
 * Context: main loop. Errors: none. Tests: through test_display.c and test_terminal.c */
#ifndef CLI_TEXT_H
#define CLI_TEXT_H

#include <stdint.h>

/* Where text goes, in RAM; 0: to the terminal's port. */
extern uint8_t *text_to;

/* What is put at a time is no longer than this: whoever has room for so many may go on. */
#define TEXT_PIECE_BYTES 24
#define TEXT_ERROR_BYTES 28 /* but an error with its range */

void text_put_byte(uint8_t c); /* as it is */

/* A character of a text in flash: it may stand for up to TEXT_LONGEST (tools/pack_texts.py). Returns how many were put. */
#define TEXT_LONGEST 4
uint8_t text_put(uint8_t c);
uint8_t text_put_flash(const char *text); /* in flash, packed or not; how many characters were put */

void text_put_u32(uint32_t value);
void text_put_hex(uint8_t byte); /* two digits */
void text_put_decimal(uint32_t value, uint8_t decimals); /* as number_format() */
void text_new_line(void);                                /* CR LF */

#endif
