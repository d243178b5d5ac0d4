/* The keys of sacsim's own: everything after Ctrl-], the rest belongs to the board.
 *
 * Context: pure; no terminal, no board.
 * Errors:  an unknown key after Ctrl-] is reported as such and does nothing.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_KEYS_H
#define SACSIM_KEYS_H

#include <stdbool.h>
#include <stdint.h>

enum { KEYS_ESCAPE = 0x1d, KEYS_CTRL_C = 0x03 }; /* Ctrl-]: as telnet has it, and no line of SAC's needs it */

typedef enum {
    KEYS_NOTHING, /* Ctrl-] itself: the next key decides */
    KEYS_BYTE,    /* for the board */
    KEYS_QUIT,
    KEYS_RESET,
    KEYS_POWER,
    KEYS_ESTOP,
    KEYS_SYNC,
    KEYS_FACTORY,
    KEYS_STATUS,
    KEYS_HELP,
    KEYS_UNKNOWN,
} keys_action_t;

typedef struct {
    bool escaped; /* Ctrl-] was the last key */
} keys_t;

keys_action_t keys_feed(keys_t *k, uint8_t key);

/* The list for Ctrl-] ?: lines, NULL at the end. */
extern const char *const keys_help[];

#endif
