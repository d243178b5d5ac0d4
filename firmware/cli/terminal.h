/* The terminal: what is typed becomes lines and commands; echo, answers and the prompt go back.
 *
 * Input comes first. Every line is executed as soon as it is complete, whatever the output is doing. While a display is
 * printed, or when lines come faster than the port sends or the processor can answer, echo and answers are held back:
 * afterwards one prompt follows, with the first error since, and what is already typed of the next line. So a flood of
 * lines at the port's own rate is executed completely, and its echo is thinned out by whole lines.
 * + and - as the first character of a line act at once; they are not echoed.
 * Context: main loop.
 * Errors:  answered as `?<number> <words>`.
 * Tests:   test/host/test_terminal.c
 * Source:  manual lines 121, 177, 239; decisions on echo and refused lines. */
#ifndef CLI_TERMINAL_H
#define CLI_TERMINAL_H

#include <stdint.h>
#include "base/status.h"

/* The port is ready: prints the version line. The first polls print what is reported, if not STATUS_OK, and the prompt. */
void terminal_init(status_t reported);

void terminal_report(status_t status); /* is printed, as the answer to a line, and another prompt */

void terminal_announce(void); /* something is to be shown (network_show()), and another prompt */

/* `?12 range 1..255`, where text goes (text.h): at most TEXT_ERROR_BYTES, less two for a new line. */
void terminal_put_error(status_t status, uint8_t range);

uint8_t terminal_poll(void); /* takes a few bytes in, sends what is owed; not 0 if it did anything */

#endif
