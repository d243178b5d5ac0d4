/* The session defaults: what a motion command takes for each parameter it does not name.
 *
 * They start as the system defaults (settings), change with v, a, d, $L, $F, $P, $U and with the parameters of motion
 * commands (count, u, s and t excepted), and are lost at a reset.
 * Units:   as in motion/command.h.
 * Context: main loop. Errors: none; who writes checks first.
 * Tests:   test/host/test_session.c
 * Source:  manual lines 355-357, 464-468, 549, 634-638, 987-989. */
#ifndef QUEUE_SESSION_H
#define QUEUE_SESSION_H

#include <stdbool.h>
#include <stdint.h>
#include "motion/command.h"

typedef struct {
    uint32_t velocity;
    accel_code_t accel;
    accel_code_t decel;
    uint8_t flags;   /* MOTION_CYCLE, MOTION_LINEAR, MOTION_PULSES; the other bits stay clear */
    uint8_t options; /* SESSION_... */
} session_t;

enum {
    SESSION_SOFT_OPS = 1 << 0, /* $O */
    SESSION_CRC = 1 << 1,      /* $H */
    SESSION_ACK = 1 << 2,      /* $K */
};

#define SESSION_FLAGS (MOTION_CYCLE | MOTION_LINEAR | MOTION_PULSES)

extern session_t session;

void session_init(void); /* from the settings */

/* Selects the ramp, 0 harmonic, 1 linear; accel and decel become the system defaults of that ramp (LIN-013). */
void session_set_linear(uint8_t linear);

void session_set_option(uint8_t option, uint8_t on); /* 0: off */

/* Counts are pulses (true) or full steps. */
void session_set_pulses(bool pulses);

/* A motion command with these defaults and nothing else: count, start wait, extra pulses 0, clockwise. */
void session_template(const session_t *from, motion_command_t *command);

#endif
