#include "keys.h"

#include <ctype.h>
#include <stddef.h>
#include <stdio.h>

int keys_feed(keys_t *k, uint8_t key)
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
    for (const keys_own_t *own = k->own; own->key != 0; own++) {
        if (tolower(key) == own->key) {
            return own->action;
        }
    }
    return KEYS_UNKNOWN;
}

const char *keys_help(const keys_t *k, unsigned line)
{
    static char text[80];
    unsigned own = 0;

    if (line == 0) {
        return "Ctrl-] and then";
    }
    while (k->own[own].key != 0 && own < line) {
        own++;
    }
    if (line <= own) {
        snprintf(text, sizeof text, "  %c  %s", k->own[line - 1].key, k->own[line - 1].help);
        return text;
    }
    return line == own + 1 ? "  Ctrl-]  sends one Ctrl-] to the Nano" : NULL;
}
