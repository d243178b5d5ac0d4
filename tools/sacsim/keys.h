/* The keys of a simulator's own: everything after Ctrl-], the rest belongs to the board.
 *
 * Context: pure; no terminal, no board.
 * Errors:  an unknown key after Ctrl-] is reported as such and does nothing.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_KEYS_H
#define SACSIM_KEYS_H

#include <stdbool.h>
#include <stdint.h>

enum { KEYS_ESCAPE = 0x1d, KEYS_CTRL_C = 0x03 }; /* Ctrl-]: as telnet has it, and no line of SAC's needs it */

/* What a key is for; from KEYS_OWN on: what the simulator's own list says. */
enum {
    KEYS_NOTHING, /* Ctrl-] itself: the next key decides */
    KEYS_BYTE,    /* for the board */
    KEYS_UNKNOWN, /* after Ctrl-] */
    KEYS_OWN,
};

typedef struct {
    char key; /* in lower case; 0: the end of the list */
    int action;
    const char *help;
} keys_own_t;

typedef struct {
    const keys_own_t *own;
    bool escaped; /* Ctrl-] was the last key */
} keys_t;

int keys_feed(keys_t *k, uint8_t key);

/* The list of keys, line by line; NULL behind the last. A line is valid until the next call. */
const char *keys_help(const keys_t *k, unsigned line);

#endif
