/* The command line of sacsim.
 *
 * Units:   in the names.
 * Errors:  a wrong command line is reported on stderr and ends the program with exit code EXIT_USAGE.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_OPTIONS_H
#define SACSIM_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "exit_codes.h"
#include "posts.h"

enum { OPTIONS_POSTS_MAX = 24, OPTIONS_WIRES_MAX = 8, OPTIONS_NODES_MAX = 16 };

typedef struct {
    const char *image;
    bool fast;
    double for_seconds; /* simulated; 0: no limit */
    double baud;
    double linger_ms; /* simulated */
    bool pty;
    const char *link;
    unsigned nodes;  /* on one RS485 line; 0: a single Nano without one */
    double bus_baud; /* of the line's pseudo terminal */
    bool reset_on_open;
    const char *edges;
    const char *vcd;
    const post_t *pins[OPTIONS_POSTS_MAX];
    size_t pin_count;
    struct {
        const post_t *output;
        const post_t *input;
    } wires[OPTIONS_WIRES_MAX];
    size_t wire_count;
    const char *eeprom;
    bool status;
    unsigned steps_per_rev;
    unsigned microsteps;
    uint8_t cw_level; /* level of dir that turns clockwise */
} options_t;

/* Fills *o from the command line. Does not return when it is wrong, nor for --help, --version and --pins list. */
void options_parse(options_t *o, int argc, char **argv);

#endif
