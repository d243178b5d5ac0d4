/* Text to the terminal's port. Whoever calls these has asked terminal_port_free() first.
 *
 * Context: main loop. Errors: none. Tests: through test_display.c and test_terminal.c */
#ifndef CLI_TEXT_H
#define CLI_TEXT_H

#include <stdint.h>

/* What is put at a time is no longer than this: whoever has room for so many may go on. */
#define TEXT_PIECE_BYTES 24

void text_put_flash(const char *text); /* in flash */
void text_put_u32(uint32_t value);
void text_put_decimal(uint32_t value, uint8_t decimals); /* as number_format() */
void text_new_line(void);                                /* CR LF */

#endif
