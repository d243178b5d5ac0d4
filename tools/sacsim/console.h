/* The host's terminal: raw keys, the firmware's output, and a status line in the bottom row that stays out of its way.
 *
 * How the status line stays out of the way: the firmware's output scrolls in a region that ends one row above the
 * bottom. The cursor is always where the firmware left it, so all that lies below it is ours to clear after a resize.
 * Whatever ends the program (a signal, a crash, exit() in a library) puts the terminal back first.
 *
 * Units:   none.
 * Errors:  a terminal that cannot be set up is used as it is, without raw keys or without a status line.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_CONSOLE_H
#define SACSIM_CONSOLE_H

#include <stdbool.h>
#include <stddef.h>

/* Raw keys where stdin is a terminal, status line where stdout is one and status is true. */
void console_open(bool status);

/* Puts all back as it was. May be called at any time and more than once, also from a signal handler. */
void console_restore(void);

/* After a stop and a continue by job control. */
void console_reopen(void);

/* From a signal handler: the program is to end, so a write that waits for a reader gives up. */
void console_abandon(void);

bool console_keys(void);    /* stdin is a terminal */
bool console_screen(void);  /* stdout is a terminal */
bool console_hung_up(void); /* stdout cannot be written any more */

/* The firmware's output, unchanged. */
void console_write(const void *bytes, size_t count);

/* A line of sacsim's own, "sacsim: " in front, on stderr. */
void console_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A line of sacsim's own on stdout, among the firmware's output. */
void console_print(const char *line);

bool console_has_status(void);
void console_set_status(bool on);
unsigned console_columns(void);
/* Shows this text in the status line, cut to the width of the screen. */
void console_status(const char *text);
/* The size of the screen may have changed. */
void console_resized(void);

#endif
