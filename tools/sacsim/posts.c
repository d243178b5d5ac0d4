#include "posts.h"

#include <ctype.h>
#include <strings.h>

#include "firmware/board.h"

/* The firmware's map and the board library's header both define the CPU clock; this file needs only the first, so the
 * pin number is formed here as BOARD_PIN() of test/board/board.h does it: ports B, C, D, eight bits each. */
#define ROW(post, port, bit, nano, direction, use) \
    {#post, (uint8_t)((#port[0] - 'B') * 8 + (bit)), nano, #direction[0] == 'O', use},

static post_t table[] = {BOARD_POSTS(ROW)};

const post_t *posts(size_t *count)
{
    static bool lowered;

    *count = sizeof table / sizeof table[0];
    if (!lowered) {
        for (size_t i = 0; i < *count; i++) {
            for (char *c = table[i].name; *c != '\0'; c++) {
                *c = (char)tolower((unsigned char)*c);
            }
        }
        lowered = true;
    }
    return table;
}

const post_t *post_find(const char *name)
{
    size_t count;
    const post_t *all = posts(&count);

    for (size_t i = 0; i < count; i++) {
        if (strcasecmp(all[i].name, name) == 0) {
            return &all[i];
        }
    }
    return NULL;
}
