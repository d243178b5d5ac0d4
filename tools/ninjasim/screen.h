/* The head on the terminal, drawn by ncurses: the azimuth from above, the altitude from the side, scales and numbers.
 *
 * Units:   steps, degrees and seconds, as shown.
 * Errors:  a terminal that ncurses does not know: screen_open() says so and returns false. Where there is no room for the
 *          drawings, lines remain.
 * Context: one screen. Whatever ends the program by exit() puts the terminal back first.
 * Tests:   test/sim/test_ninjasim.py. */
#ifndef NINJASIM_SCREEN_H
#define NINJASIM_SCREEN_H

#include <stdbool.h>

#include "test/board/head.h"

bool screen_open(void);
void screen_close(void);

/* The next byte that was typed, -1: none. The Backspace key is 0x08 wherever the terminal has it; keys that send more than
 * a byte send nothing. */
int screen_key(void);

typedef struct {
    const head_state_t *axis[HEAD_AXES];
    double rate[HEAD_AXES];         /* steps/s */
    double seconds;                 /* simulated */
    double speed;                   /* over real time; 0: not known yet */
    const char *typed;              /* its end is shown */
    const char *notice;             /* a line; "": none */
    const char *(*help)(unsigned line); /* instead of the drawings, up to NULL; NULL: the drawings */
} screen_view_t;

void screen_show(const screen_view_t *v);

#endif
