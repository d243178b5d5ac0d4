#include "keys.h"

#include <ctype.h>
#include <stddef.h>

const char *const keys_help[] = {
    "Ctrl-] and then",
    "  q  quit",
    "  r  press the Nano's reset button",
    "  p  power off and on",
    "  e  ground Estop; again: release it",
    "  y  ground sync for 1 ms",
    "  f  ground RST (factory reset at a power-on); again: release it",
    "  s  status line off; again: on",
    "  ?  this list",
    "  Ctrl-]  sends one Ctrl-] to the Nano",
    NULL,
};

keys_action_t keys_feed(keys_t *k, uint8_t key)
{
    if (!k->escaped) {
        k->escaped = key == KEYS_ESCAPE;
        return k->escaped ? KEYS_NOTHING : KEYS_BYTE;
    }
    k->escaped = false;
    if (key == KEYS_ESCAPE) {
        return KEYS_BYTE;
    }
    if (key < 0x20) {
        key |= 0x60; /* a letter with the Ctrl key still down */
    }
    switch (tolower(key)) {
    case 'q': return KEYS_QUIT;
    case 'r': return KEYS_RESET;
    case 'p': return KEYS_POWER;
    case 'e': return KEYS_ESTOP;
    case 'y': return KEYS_SYNC;
    case 'f': return KEYS_FACTORY;
    case 's': return KEYS_STATUS;
    case '?': return KEYS_HELP;
    default: return KEYS_UNKNOWN;
    }
}
