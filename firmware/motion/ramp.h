/* Ramps: the intervals of an acceleration or deceleration, one group of pulses after the other.
 *
 * Purpose: the ideal interval after pulse k (k = 0, 1, ...) of a ramp, summed over groups of pulses that will share one
 *          or two neighbouring timer values. A group is one pulse at low speed; where neighbouring intervals differ by
 *          less than a tick, or come faster than they can be computed, it is more. Sums are exact: what is rounded off
 *          one group is carried into the next, so a ramp has no drift.
 * Laws:    harmonic: interval = K / v, v changing by a constant amount per pulse (manual lines 77-89);
 *          linear: t(k) = sqrt(k * C), C = 2 * alpha / accel (constant acceleration; manual lines 101-115, 265).
 * Units:   ticks of 62.5 ns with a fraction in 1/256. Velocities in "units" = RPM * 100 * microstep factor, so that a
 *          ramp value in hundredths is the change per pulse whatever the factor, and interval = K / v.
 * Context: main loop only; no hardware. Tests: test/host/test_ramp.c, test/avr/.
 * Limits:  steps_per_rev * slow_rpm >= 58 and steps_per_rev >= 8 (first intervals below about one second).
 */
#ifndef MOTION_RAMP_H
#define MOTION_RAMP_H

#include <stdbool.h>
#include <stdint.h>
#include "base/wide.h"

typedef struct {
    uint32_t ticks;
    uint8_t frac; /* 1/256 tick */
} ramp_time_t;

/* Depends on steps per revolution: 2 * 256 * K, K = 96e9 / steps_per_rev (ticks times velocity units). */
typedef struct {
    wide_t k512;
} ramp_constants_t;

typedef struct {
    bool linear;
    bool faster;          /* velocity grows from pulse to pulse */
    uint8_t steady;       /* groups that may follow in the same way before their size is reviewed */
    uint8_t group_log2;   /* of the last group's pulses, rounded down */
    uint8_t seen;         /* groups of one size so far that followed each other; from 3 on slope and curve are right */
    uint8_t group;        /* pulses of the last group */
    uint8_t group_limit;  /* what the next group would like to be */
    uint16_t excess_q8;   /* what a steady group's sum exceeds its middle times its pulses by */
    uint32_t bound_q8;    /* linear: no interval above while slowing, none below while speeding up */
    uint8_t bound_q16;    /* its next eight bits: 1/65536 tick */
    uint8_t bound_carry;  /* of those */
    bool capped;          /* harmonic: the last group was at cap2 */
    union {
        struct {
            uint32_t q8;       /* interval in the middle of the last group */
            int32_t slope;     /* change of q8 from the group before */
            int32_t curve;     /* change of slope, likewise */
            uint32_t next2;    /* twice the velocity of the next pulse */
            uint32_t cap2;     /* never above */
            uint32_t step;     /* change of velocity per pulse */
            uint32_t spacing2; /* change of mid2 from group to group, modulo 2^32 */
            uint32_t mid2;     /* twice the velocity in the middle of the last group */
            uint32_t k512;     /* modulo 2^32: k512 - q8 * mid2, below mid2, is the exact remainder */
            uint32_t carry;    /* of such remainders, below mid2 */
        } harmonic;
        struct {
            uint32_t sum_q4; /* duration of the last group */
            int32_t slope;   /* its change from the group before */
            int32_t curve;   /* change of slope, likewise */
            wide_t t2_q4;    /* twice the time from standstill at the next pulse */
            wide_t rest;     /* faster: k * C - t^2; slower: t^2 - k * C; exact, from 0 to t2 */
            wide_t group_c;  /* C times the group's pulses */
            wide_t c_q8;     /* C */
        } linear;
    } u;
    bool hurry; /* set by the caller: groups shall last twice as long, there is other work to be done */
} ramp_t;

/* steps_per_rev >= 8 */
void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev);

/* Interval at a velocity. v >= 1. */
ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v);

/* Velocity of an interval in ticks: the inverse. ticks >= 1. */
uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks);

/* Harmonic ramp: v_first at the first pulse, changing by `step` units per pulse, never above v_cap. */
void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap);

/* Linear ramp with C = c_q8 / 256 ticks^2 per pulse, beginning at the time t_q4 / 16 ticks from standstill, which is
 * off by `rest` (ramp_linear_time). A slowing one never has an interval above max_ticks; what bound_q8 is set to
 * afterwards takes its place. */
void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, const wide_t *rest, bool faster,
                       uint32_t max_ticks);

/* The bound of a linear ramp that slows down: the interval at velocity v. */
void ramp_bound(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v);

/* C for a ramp value in hundredths of rad/s^2. factor_log2: microsteps per full step. */
void ramp_linear_c(wide_t *c_q8, uint16_t steps_per_rev, uint8_t factor_log2, uint32_t accel_centi);

/* t from standstill to n pulses: sqrt(n * C), to one unit of 1/16 tick; *rest = n * C - t^2, what was rounded off. */
void ramp_linear_time(wide_t *t_q4, const wide_t *c_q8, uint32_t n, wide_t *rest);

/* a * b / divisor, truncated, where that fits 32 bits. divisor >= 1. */
uint32_t ramp_scale(uint32_t a, uint32_t b, uint32_t divisor);

/* While ramp->steady and at least two groups are left: the next group in a short way, of either law. steady is counted
 * down by the caller. Returns the sum of its intervals in 1/256 ticks, less excess_q8; it has ramp->group pulses, a
 * power of two, at least 4 where the intervals are shorter than 128 ticks. */
uint32_t ramp_step(ramp_t *ramp);

/* The next group of at most `left` pulses: returns how many (>= 1) and the sum of their intervals. */
uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum);

#endif
