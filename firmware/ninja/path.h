/* The path of one move of both axes: how many steps, when, and what they do to the position.
 *
 * Purpose: target and velocity to a row of waits and steps (stepper_port.h), and steps made to position and slack.
 * A move:  the axis with more steps is the major one. The start interval, its M steps, and interval k after step k
 *          (SAC's linear law, motion/profile.h); after the M-th of them the end. The other axis makes its m steps on the
 *          way, at those k at which floor(k * m / M) grows: both make their last one together, and no point is farther
 *          from the straight line than a step.
 * Backlash: an axis has a slack of 0 to its backlash B. A motor step in the positive direction first takes up the
 *          slack, to B, then moves the platform; one in the negative direction likewise, to 0. The position is the
 *          platform's. A move makes the steps that this takes besides, evenly along its path (seed lines N115-122); an
 *          axis that is at its target makes none.
 * Units:   steps; microseconds a step of the major axis; ticks of the stepper.
 * Context: main loop; pure. Errors: none.
 * Source:  seed lines N41-55, N87-128; decisions 0.2.4 (ramps), A-NIN-13 to -15. Tests: test/host/test_ninja_path.c */
#ifndef NINJA_PATH_H
#define NINJA_PATH_H

#include <stdbool.h>
#include <stdint.h>
#include "ninja/constants.h"
#include "ninja/stepper_port.h"

#define PATH_CYCLE_US(steps_per_s) ((uint32_t)((1000000 + (steps_per_s) / 2) / (steps_per_s)))

typedef struct {
    int16_t min, max; /* position */
    uint8_t backlash;
} path_limits_t;
extern const path_limits_t path_limits[AXES];

void path_init(void); /* both axes as after path_centre() */

int16_t path_position(uint8_t axis);

/* The axis stands at position 0, its slack taken up in the positive direction. No move is under way. */
void path_centre(uint8_t axis);

/* Begins a move to a position, or by so many steps of one motor, whatever the slack: the mask of the axes that take
 * part, 0 if no step is to be made. step_us: of the major axis at full speed, 1,000..125,000. */
uint8_t path_to(const int16_t target[AXES], uint32_t step_us);
uint8_t path_by(uint8_t axis, int16_t steps, uint32_t step_us);

/* The next wait of the move that was begun last; false after its end. */
bool path_next(stepper_wait_t *wait);

/* A move is over, or was ended on the way, after an axis has made so many steps: below 0 in the negative direction. */
void path_made(uint8_t axis, int16_t steps);

#endif
