/* Where ramp_step.S finds the members of ramp_t; ramp.c checks each at compile time. */
#ifndef MOTION_RAMP_OFFSETS_H
#define MOTION_RAMP_OFFSETS_H

#define RAMP_LINEAR 0
#define RAMP_FASTER 1
#define RAMP_GROUP_LOG2 3
/* Both laws: the last value, its change, the change of that. */
#define RAMP_Q8 17
#define RAMP_SLOPE 21
#define RAMP_CURVE 25
#define RAMP_NEXT2 29
#define RAMP_SPACING2 41
#define RAMP_MID2 45
#define RAMP_K512 49
#define RAMP_T2 29
#define RAMP_REST 37
#define RAMP_GROUP_C 45

#endif
