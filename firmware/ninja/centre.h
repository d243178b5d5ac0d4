/* Centring: each axis finds the edge of its sensor, from the negative side, slowly.
 *
 * X first, then Y, never both. An axis leaves the positive side if it stands there, or goes there and leaves it, goes
 * on until it has room to take up the backlash, and approaches the edge at low speed: where the sensor changes is
 * position 0. An axis whose sensor does not change on its whole travel and a margin, or on the way back to where it
 * was seen to change, is given up, and taken to stand at 0 all the same.
 * Context: main loop. Errors: none reported: there is nobody to report to.
 * Source:  seed lines N57-61, N96-99; decisions 0.5, A-NIN-12. Tests: test/host/test_ninja_centre.c */
#ifndef NINJA_CENTRE_H
#define NINJA_CENTRE_H

#include <stdbool.h>

/* Begins as soon as no move is under way; from the beginning, if it is under way already. */
void centre_begin(void);

/* Abandons it. The move under way is not halted by this (drive_halt()). */
void centre_stop(void);

bool centre_runs(void);

/* Goes on with it; true if there was something to do. */
bool centre_poll(void);

#endif
