/* The commands of the terminal: from a line to what it does, by the table commands.def.
 *
 * A space ends a command; what follows is ignored. Every line that begins with $ ends all activity first, as S, even if
 * it is then refused (manual line 839).
 * Context: main loop.
 * Errors:  a status of base/status.def; then nothing has changed.
 * Tests:   test/host/test_commands.c */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"

void commands_init(void);

/* Reads ahead in the line that is being typed, so that little is left to do at its end. Optional; what was read stays
 * read, so call it after every character that was taken back. */
void commands_read_ahead(const char *line, uint8_t length);

/* Executes a line; a blank one, or one that begins with a space, does nothing. */
status_t commands_execute(const char *line, uint8_t length);

/* + and -: whether this character, first on a line, is a command of its own. Executes it if so. */
bool commands_at_once(char character);

/* What `?` prints, in flash: form, tab, words of each command. */
extern const char commands_help[];

const char *commands_prompt(void); /* in flash: that of the mode */

bool commands_debugging(void);

/* -- from the network ---------------------------------------------------------------------------------------------- */

/* Executes a line that came in a packet: it has a program mode of its own, displays nothing, and cannot be sent on. $R is
 * accepted and left to be done: commands_restart() when the answer is out. */
status_t commands_execute_remote(const char *line);
bool commands_remote(void); /* such a line is being executed */
bool commands_restart_due(void);
void commands_restart(void);

#endif
