/* The configure screen, $C<letter><value> and $E: the parameters of settings.def as they are stored.
 *
 * A value is checked against its range and stored at once; it becomes effective at the next reset.
 * Context: main loop.
 * Errors:  STATUS_UNKNOWN_COMMAND: no such parameter; SYNTAX, NUMBER_MISSING, NUMBER_TOO_LARGE, RANGE: nothing is
 *          changed; STATUS_WAIT: the change before is still being written, nothing is changed yet.
 * Tests:   test/host/test_configure.c
 * Source:  manual lines 682-835, 846-852; requirements, annexes A and E. */
#ifndef CLI_CONFIGURE_H
#define CLI_CONFIGURE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "cli/motion_syntax.h"

/* <letter><value> is stored; number: to read it with. */
status_t configure_set(motion_syntax_t *number, const char *text);

/* The same as a line of the configure mode: the screen is shown anew. */
status_t configure_line(motion_syntax_t *number, const char *line);

/* The cells of the screen, or of the list of $E, one after the other: at most TEXT_PIECE_BYTES each. */
void configure_first_cell(bool screen);
bool configure_has_cell(void);
void configure_put_cell(void);

#endif
