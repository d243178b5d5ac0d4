/* Where ramp_step.S finds the members of ramp_t; ramp.c checks each at compile time. */
#ifndef MOTION_RAMP_OFFSETS_H
#define MOTION_RAMP_OFFSETS_H

#define RAMP_GROUP_LOG2 3
#define RAMP_NEXT2 14
#define RAMP_SPACING2 26
#define RAMP_MID2 30
#define RAMP_Q8 34
#define RAMP_REST 38
#define RAMP_SLOPE 42
#define RAMP_CURVE 46

#endif
