/* Ramps: the intervals of an acceleration or deceleration, one group of pulses after the other.
 *
 * Purpose: the ideal intervals after pulses 0, 1, ... of a ramp, in groups of pulses: their sum, and the parabola that they
 *          follow. A group is one pulse near a standstill, and as many as the parabola is good for elsewhere. Sums are
 *          those of the law, so a ramp has no drift.
 * Laws:    harmonic: interval = K / v, v changing by a constant amount per pulse (manual lines 77-89);
 *          linear: t(k) = sqrt(k * C), C = 2 * alpha / accel (constant acceleration; manual lines 101-115, 265).
 * Units:   ticks of 62.5 ns with a fraction in 1/65536. Velocities in "units" = RPM * 100 * microstep factor, so that a
 *          ramp value in hundredths is the change per pulse whatever the factor, and interval = K / v.
 * Context: main loop only; no hardware. Tests: test/host/test_ramp.c, test/avr/.
 * Errors:  none; what is asked for has been checked (profile_check).
 * Limits:  steps_per_rev * slow_rpm >= 58 and steps_per_rev >= 8 (first intervals below about one second).
 */
#ifndef MOTION_RAMP_H
#define MOTION_RAMP_H

#include <stdbool.h>
#include <stdint.h>
#include "base/wide.h"
#include "motion/block.h"

typedef struct {
    uint32_t ticks;
    uint16_t frac_q16; /* 1/65536 tick */
} ramp_time_t;

/* Depends on steps per revolution: 2 * 65536 * K, K = 96e9 / steps_per_rev (ticks times velocity units). */
typedef struct {
    wide_t k2_q16;
} ramp_constants_t;

typedef struct {
    bool linear;
    bool faster;        /* velocity grows from pulse to pulse */
    uint8_t steep;      /* 0; 1: its runs may be longer; 2: planning it takes as long as playing it, or nearly */
    bool rest;          /* the last group was of the last pulses, too few for more than one run */
    uint8_t group_log2; /* pulses of a group: this power of two, unless fewer are left */
    uint8_t most_log2;  /* the same, at most: less where the bound is near */
    uint16_t ticks;     /* interval in the last group, at most 65535 */
    uint8_t run_pulses; /* of the last group in several runs; 0: none yet */
    union {
        struct {
            uint32_t next2; /* twice the velocity of the next pulse */
            uint32_t cap2;  /* never above */
            uint32_t step2; /* change per pulse */
            uint32_t step_q40; /* half of that by K */
        } harmonic;
        struct {
            wide_t x;          /* square of the time from standstill at the next pulse, in units of 2^halved / 16 ticks */
            wide_t c;          /* C in the same */
            uint32_t t;        /* that time, rounded down */
            wide_t bound_q16;  /* no interval above while slowing, none below while speeding up */
            bool bounded;      /* it has been reached: all that is left is equal */
            uint8_t halved;    /* how often units were doubled so that x fits */
            uint32_t rest;     /* of the last division, for the next one */
        } linear;
    } u;
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

/* Linear ramp of so many pulses with C = c_q8 / 256 ticks^2 per pulse. It begins at the time t_q4 / 16 ticks from
 * standstill, or, with that 0, at a standstill if faster and ends at one if not. No interval is above `bound` while
 * slowing, none below while speeding up. */
void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, uint32_t pulses, bool faster,
                       ramp_time_t bound);

/* C for a ramp value in hundredths of rad/s^2. factor_log2: microsteps per full step. */
void ramp_linear_c(wide_t *c_q8, uint16_t steps_per_rev, uint8_t factor_log2, uint32_t accel_centi);

/* x *= factor */
void ramp_multiply(wide_t *x, uint32_t factor);

/* a * b / divisor, truncated, where that fits 32 bits. divisor >= 1. */
uint32_t ramp_scale(uint32_t a, uint32_t b, uint32_t divisor);

/* The next group of at most `left` pulses (>= 1): returns how many, up to 512, and the sum of their intervals; that of
 * several is below 65,536 ticks. How these follow each other: `block`, of which runs, pulses, top, slope and curve are set;
 * no runs: alike. */
uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum, block_t *block);

#endif
