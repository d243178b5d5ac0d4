/* The syntax of motion commands, read a character at a time.
 *
 *     M/m[-][nnn] then, in any order and either case:
 *     v[nnn] vc<nnn> a[nn.nn] d[nn.nn] l[0|1] u[nnn] t[nnn] s[0|1] f p
 *
 * A line can be read while it arrives, so that little is left to do at its end. The single commands v, vc, a and d are
 * read by the same rules.
 * Rules:   a space ends the command. The last of two equal parameters wins. Missing numbers: v, a, d the system
 *          default; l and s 1; u and t 0. a0 and d0 mean the system default too. A fraction of v is dropped; a and d
 *          keep two decimals below 100 and none from 100. l without a or d takes the defaults of that ramp for what is
 *          not given (decided at the end of the line, because parameters come in any order).
 * Context: main loop. Cost: about 60 cycles a character.
 * Errors:  STATUS_SYNTAX, NUMBER_MISSING, NUMBER_TOO_LARGE, RANGE, VELOCITY_ZERO, PERIOD_TOO_SHORT; the first
 *          one stands. Nothing but the parser changes.
 * Tests:   test/host/test_motion_syntax.c
 * Source:  manual lines 239, 464-489, 499-549, 588, 634-638, 882-902. */
#ifndef CLI_MOTION_SYNTAX_H
#define CLI_MOTION_SYNTAX_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "motion/command.h"
#include "queue/session.h"

typedef struct {
    motion_command_t command; /* what is read so far, on top of the session defaults */
    uint32_t value;           /* of the number being read; hundredths of it if places is 2, tenths if 1 */
    const char *range;        /* in flash: the range that STATUS_RANGE refers to */
    status_t status;          /* the first error */
    uint8_t parameter;        /* row of motion_parameters.def whose number is being read */
    uint8_t number;           /* bits: what the number being read consists of */
    uint8_t places;           /* decimals taken into value */
    uint8_t given;            /* bits: parameters that need a decision at the end */
    uint8_t single;           /* not 0: v, a or d alone, no second parameter may follow */
} motion_syntax_t;

#define MOTION_SYNTAX_VELOCITY 1 /* single: v or vc */

/* The range of what is either 0 or 1, in flash. */
extern const char motion_syntax_range_flag[];

/* Starts on the first letter: m, or v, a, d for the single commands. */
void motion_syntax_begin(motion_syntax_t *syntax, char first_letter, const session_t *defaults);

/* An entry of the queue is edited: parameters in any order, m[-]nnn among them, and what is not named stays. A count
 * without p is in full steps; f or p alone change that without it. a and d without a number: the system default of the
 * entry's ramp. STATUS_NUMBER_MISSING: no count, or 0. */
void motion_syntax_begin_edit(motion_syntax_t *syntax, const motion_command_t *entry);

/* The next character of the line. */
void motion_syntax_take(motion_syntax_t *syntax, char character);

/* The end of the line. STATUS_OK: syntax->command is complete and executable; with count 0 it is continuous motion. */
status_t motion_syntax_end(motion_syntax_t *syntax);

/* What a complete command leaves as session defaults: all but count, direction, sync, start wait and extra pulses. */
void motion_syntax_keep(const motion_syntax_t *syntax, session_t *defaults);

#endif
