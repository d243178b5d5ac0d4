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
    union {
        motion_command_t command; /* what is read so far, on top of the session defaults */
        uint32_t limit;           /* of a number that is read instead of a command (cli/range.c) */
    };
    uint32_t value;           /* of the number being read; hundredths of it if places is 2, tenths if 1 */
    const char *behind;       /* what follows the number that motion_syntax_number() has read */
    status_t status;          /* the first error */
    uint8_t parameter;        /* row of motion_parameters.def whose number is being read */
    uint8_t number;           /* bits: what the number being read consists of */
    uint8_t places;           /* decimals taken into value; 3: none, as there was no point that counts */
    uint8_t given;            /* bits: parameters that need a decision at the end */
    uint8_t single;           /* not 0: v, a or d alone, no second parameter may follow */
} motion_syntax_t;

#define MOTION_SYNTAX_NO_POINT 3   /* places */
#define MOTION_SYNTAX_VELOCITY 1 /* single: v or vc */

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

/* Instead of a command: the digits that text begins with, to value; with up to two decimals, a point alone is 0.
 * STATUS_SYNTAX, NUMBER_MISSING, NUMBER_TOO_LARGE. */
status_t motion_syntax_number(motion_syntax_t *syntax, const char *text, bool decimals);

/* 0 at the end of a command: of the line, or a space. */
static inline uint8_t motion_syntax_more(char c)
{
    return (uint8_t)(c & ~' ');
}

/* The code of the ramp value that has been read; 0 if it is none. */
accel_code_t motion_syntax_ramp(const motion_syntax_t *syntax);

/* What a complete command leaves as session defaults: all but count, direction, sync, start wait and extra pulses. */
void motion_syntax_keep(const motion_syntax_t *syntax, session_t *defaults);

#endif
