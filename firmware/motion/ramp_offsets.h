/* Where ramp_step.S finds the members of ramp_t; ramp.c checks each at compile time. */
#ifndef MOTION_RAMP_OFFSETS_H
#define MOTION_RAMP_OFFSETS_H

#define RAMP_LINEAR 0
#define RAMP_FASTER 1
#define RAMP_GROUP_LOG2 3
/* Both laws: the last value, its change, the change of that. */
#define RAMP_Q8 16
#define RAMP_SLOPE 20
#define RAMP_CURVE 24
#define RAMP_NEXT2 28
#define RAMP_SPACING2 40
#define RAMP_MID2 44
#define RAMP_K512 48
#define RAMP_CARRY 52
#define RAMP_T2 28
#define RAMP_REST 36
#define RAMP_GROUP_C 44

#endif
