/* The posts of the Nano by name, from the firmware's own pin map: what --pins, --wire and the recordings speak of.
 *
 * Units:   none.
 * Errors:  an unknown name is NULL.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_POSTS_H
#define SACSIM_POSTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    char name[16]; /* lower case, e.g. "clk" */
    uint8_t pin;   /* a board_pin_t of the board library */
    const char *nano;
    bool output;
    const char *use;
} post_t;

/* All posts, in the order of the pin map. */
const post_t *posts(size_t *count);

/* The post of this name, upper or lower case alike. */
const post_t *post_find(const char *name);

#endif
