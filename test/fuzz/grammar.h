/* Lines as a user, a chattering host or a broken cable would send them: made from the grammar of all commands, those of
 * later versions too, then damaged. In a mode most lines are what that mode reads.
 *
 * The same seed makes the same lines on every machine. What a line ends with is left to the caller; one that was damaged
 * may hold line ends of its own. TERMINAL_PORT_DAMAGED stands for a byte that was lost.
 * Source:  decisions, section 11 (letters); manual lines 464-489, 880-1000. */
#ifndef FUZZ_GRAMMAR_H
#define FUZZ_GRAMMAR_H

#include <stdbool.h>
#include <stdint.h>

enum { FUZZ_LINE_BYTES = 320 };

typedef struct {
    uint8_t bytes[FUZZ_LINE_BYTES];
    unsigned length;
} fuzz_line_t;

enum { FUZZ_KEPT = 4 };

typedef struct {
    uint64_t state;
    uint32_t motions;            /* so many in a hundred lines are motion commands */
    uint8_t mode;                /* fuzz_mode_t */
    bool brisk;                  /* for the simulated board: most of these are short and fast, and whole */
    fuzz_line_t kept[FUZZ_KEPT]; /* lines that others are spliced with */
} fuzz_t;

void fuzz_begin(fuzz_t *fuzz, uint64_t seed);
uint32_t fuzz_u32(fuzz_t *fuzz);
uint32_t fuzz_below(fuzz_t *fuzz, uint32_t limit); /* 0..limit - 1 */
bool fuzz_chance(fuzz_t *fuzz, uint32_t percent);

void fuzz_line(fuzz_t *fuzz, fuzz_line_t *line);

/* A line as it can be printed; in a buffer that lives until the next call. */
const char *fuzz_printable(const uint8_t *bytes, unsigned length);

#endif
