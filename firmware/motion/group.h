/* Groups: from the interval in the middle of a group of pulses to the runs that follow the law.
 *
 * Purpose: the part of a ramp's planning that is the same for each group of several pulses, products nearly throughout.
 * Context: main loop; pure. In assembler on the AVR (group.S, cycles there), elsewhere in group.c; the same to the bit.
 * Errors:  none.
 * Source:  docs/design.md, "The two laws" and "Blocks".
 * Tests:   test/host/test_group.c, the same cases on the AVR; test_ramp.c. */
#ifndef MOTION_GROUP_H
#define MOTION_GROUP_H

#include <stdint.h>
#include "base/wide.h"
#include "motion/block.h"
#include "motion/ramp.h"

typedef struct {
    wide_t sum_q16; /* of all intervals */
    wide_t end_q16; /* the interval at the end */
} group_t;

/* Plans a group of `pulses`, 2 to 512. group->sum_q16 is still the interval at the mean of the velocities at its ends, and
 * of both numbers the upper half is zero (of end_q16 if it is of use). Divides the group into runs, unless they are the
 * ramp's last or the pulses too few and short: sets block->runs, pulses, top, slope and curve; carry and width are lost. */
void group_plan(const ramp_t *ramp, group_t *group, block_t *block, uint16_t pulses);

#endif
