/* The line editor: bytes to lines.
 *
 * CR, LF and CRLF each end exactly one line. BS and DEL take the last character back, ESC the whole line; other
 * control characters are ignored. A line that grew beyond 64 characters, or in which a byte was lost or damaged, is
 * refused whole at its end: none of it is ever executed.
 * Context: main loop; pure. Errors: STATUS_LINE_TOO_LONG, STATUS_LINE_DAMAGED in line_t.status.
 * Tests:   test/host/test_line.c
 * Source:  manual line 177; decisions for lines too long. */
#ifndef CLI_LINE_H
#define CLI_LINE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"

#define LINE_CHARACTERS 64

typedef struct {
    uint8_t length;
    status_t status;                /* not STATUS_OK: the line will be refused */
    uint8_t last;                   /* the byte before: a LF behind a CR belongs to it */
    char text[LINE_CHARACTERS + 1]; /* NUL-terminated whenever line_take() has returned */
} line_t;

typedef enum {
    LINE_UNCHANGED,
    LINE_APPENDED, /* one character more */
    LINE_ERASED,   /* one character less */
    LINE_CLEARED,  /* by ESC */
    LINE_ENDED,    /* text and status stand until line_reset() */
} line_event_t;

void line_reset(line_t *line); /* empty, for the next line */

line_event_t line_take(line_t *line, uint8_t byte);
line_event_t line_damage(line_t *line); /* instead of a byte that was lost or damaged */

/* 0: nothing has been typed on this line, not even something that was lost. */
static inline uint8_t line_begun(const line_t *line)
{
    return (uint8_t)(line->length | line->status);
}

#endif
