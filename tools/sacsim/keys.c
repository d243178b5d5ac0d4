#include "keys.h"

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

keys_action_t keys_feed(keys_t *k, uint8_t key) {
    if (!k->escaped) {
        k->escaped = key == KEYS_ESCAPE;
        return k->escaped ? KEYS_NOTHING : KEYS_BYTE;
    }
    k->escaped = false;
    switch (key) {
    case 'q':
    case 'Q':
    case 0x11: /* Ctrl-Q and the others: with the Ctrl key still down */
        return KEYS_QUIT;
    case 'r':
    case 'R':
    case 0x12:
        return KEYS_RESET;
    case 'p':
    case 'P':
    case 0x10:
        return KEYS_POWER;
    case 'e':
    case 'E':
    case 0x05:
        return KEYS_ESTOP;
    case 'y':
    case 'Y':
    case 0x19:
        return KEYS_SYNC;
    case 'f':
    case 'F':
    case 0x06:
        return KEYS_FACTORY;
    case 's':
    case 'S':
    case 0x13:
        return KEYS_STATUS;
    case '?':
    case 'h':
        return KEYS_HELP;
    case KEYS_ESCAPE:
        return KEYS_BYTE;
    default:
        return KEYS_UNKNOWN;
    }
}
