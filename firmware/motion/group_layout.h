/* What ramp.S and group.S share with ramp.c and group.c: where the members of ramp_t, block_t and group_t are (group.c
 * checks each at compile time), and what limits a group and a run. */
#ifndef MOTION_GROUP_LAYOUT_H
#define MOTION_GROUP_LAYOUT_H

#include "motion/block_offsets.h"

#define BLOCK_THIRD BLOCK_CARRY /* in the place of carry and width, which a block gets when it begins */

#define GROUP_SUM 0
#define GROUP_END 8
#define GROUP_SIZE 16

#define RAMP_LINEAR 0
#define RAMP_FASTER 1
#define RAMP_V 2
#define RAMP_STEP 6
#define RAMP_LIMIT 10
#define RAMP_RATE 18
#define RAMP_K2 22
#define RAMP_K_LACKS 30
#define RAMP_CYCLES_LOG2 31
#define RAMP_SPLIT_TICKS 32
#define RAMP_LEAST_RUN 33
#define RAMP_X 34
#define RAMP_C 42
#define RAMP_STEEP 50
#define RAMP_BOUNDED 51
#define RAMP_REST 52
#define RAMP_GROUP_LOG2 53
#define RAMP_MOST_LOG2 54
#define RAMP_RUN_PULSES 55
#define RAMP_TICKS 56

#define CONSTANTS_STEPS_PER_REV 12
#define CONSTANTS_CYCLES_LOG2 14
#define CONSTANTS_SPLIT_TICKS 15

/* ramp_t.rate has 40 bits behind the point in a harmonic ramp. In a linear one it has so many; half of its product with
 * an interval is shifted to 40. */
#define LINEAR_RATE_LOG2 48
#define LINEAR_RATE_SHIFT (40 + 16 - LINEAR_RATE_LOG2 - 1)

/* Of velocity units squared, a pulse, for a hundredth of rad/s^2, times steps_per_rev: 360,000 / pi * 2^15. */
#define LINEAR_SQUARE_Q15 3754936206
#define LINEAR_STEEP_LOG2 (LINEAR_RATE_LOG2 + 2 - 28) /* first intervals below 2^14 ticks: 4 K^2 / c below 2^28 */

#define GROUP_MAX_LOG2 9
#define ODD_GROUP_LEAST 16 /* pulses of a group that are not a power of two */
#define REST_PULSES 64 /* the least that is left for a fast ramp's last run */
#define GROUP_MAX_TICKS 64000 /* below 65,536: intervals that grow are taken for longer than they are ... */
#define GROUP_MAX_STEEP_TICKS 49152 /* ... by up to a third, in a steep ramp */

#define RUN_MAX_PULSES 128
/* Runs: the interrupt's cycles for two segments, the planner's, and as much for others; and those of each pulse. */
#define RUN_CYCLES 500
#define RUN_PULSE_CYCLES 24
#define RUN_SLOPE_Q16 127200 /* change of the interval within a run */
#define SIXTH_Q32 715827883 /* 2^32 / 6 */
#define UNSPLIT_LEAST 8 /* pulses of a group whose runs are not split */

#endif
