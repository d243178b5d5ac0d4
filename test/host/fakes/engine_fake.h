/* A motion engine that only records what it is asked, for the tests of queue and terminal.
 *
 * Its arithmetic (command_rpm, command_cycle_us, engine_check) is the manual's, written out plainly. */
#ifndef ENGINE_FAKE_H
#define ENGINE_FAKE_H

#include <stdbool.h>
#include <stdint.h>
#include "motion/engine.h"

#define ENGINE_FAKE_COMMANDS 1200

typedef struct {
    /* what the test sets */
    bool accepts;    /* it begins what it is offered at once, as at standstill; otherwise engine_fake_begin() does */
    bool cannot_end; /* engine_next() comes at a moment when nothing can be cut */
    bool estop;      /* estop_port_active() */
    motion_state_t state;
    int32_t position;
    uint32_t rpm, cycle_us; /* engine_velocity() */
    uint8_t faults;
    uint8_t ended, played;
    /* what was asked */
    const motion_command_t *offered; /* and not begun */
    uint8_t begun;
    unsigned releases;
    unsigned restarts; /* boot_restart(): in main.c, which the tests of the host do without */
    motion_command_t submitted[ENGINE_FAKE_COMMANDS];
    unsigned submitted_count;
    unsigned stops, nexts, nexts_graceful, stops_graceful;
    accel_code_t graceful_decel;
    bool graceful_linear;
    unsigned pulses_cw, pulses_ccw;
    char ops[100]; /* ops_port_set(): 1 and 0, one after the other */
    bool gap;
    /* bytes that the port had been given when the last command was submitted (terminal_port_fake) */
    unsigned sent_at_submit;
} engine_fake_t;

extern engine_fake_t engine_fake;

void engine_fake_begin(void); /* what it is offered: what ran has ended, or is about to */
void engine_fake_reset(void); /* accepts, in STANDBY, GAP on, nothing recorded */

#endif
