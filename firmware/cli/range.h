/* The ranges of numbers that are typed, each with its text, which an error tells and from which the limits are read.
 *
 * Context: main loop. Errors: STATUS_RANGE.
 * Tests:   test/host/test_commands.c, test/host/test_configure.c, test/host/test_motion_syntax.c */
#ifndef CLI_RANGE_H
#define CLI_RANGE_H

#include <stdint.h>
#include "base/status.h"
#include "cli/motion_syntax.h"

/* Those of the parameters (settings.def), and of commands alone. */
typedef enum {
#define SETTING_KIND(kind, range) RANGE_##kind,
#include "settings.def"
#undef SETTING_KIND
    RANGE_POSITION, /* of the queue */
    RANGE_COUNT,
    RANGE_ENTRY = RANGE_AUTORUN, /* of the xRef array, and what stands in it */
} range_t;

/* Whether the number that has been read is in the range; one above it becomes its end. */
status_t range_check(motion_syntax_t *number, uint8_t range);

/* STATUS_RANGE, with this range. */
status_t range_refuse(uint8_t range);

uint8_t range_refused(void);            /* the one that the last STATUS_RANGE referred to */
const char *range_text(uint8_t range); /* in flash */

#endif
