/* The command line of ninjasim.
 *
 * Units:   in the names.
 * Errors:  a wrong command line is reported on stderr and ends the program with exit code EXIT_USAGE.
 * Tests:   test/sim/test_ninjasim.py. */
#ifndef NINJASIM_OPTIONS_H
#define NINJASIM_OPTIONS_H

#include <stdbool.h>

#include "test/board/head.h"

typedef struct {
    const char *image;
    head_options_t head;
    double speed;       /* simulated over real time; PACE_FAST */
    double for_seconds; /* simulated; 0: no limit */
    double linger_ms;   /* simulated */
    double baud;
    const char *script; /* NULL: what is typed, or piped in */
    bool wait;
} options_t;

/* Fills *o from the command line. Does not return when it is wrong, nor for --help and --version. */
void options_parse(options_t *o, int argc, char **argv);

#endif
