/* Ramps: the intervals of an acceleration or deceleration, one group of pulses after the other.
 *
 * Purpose: the ideal intervals after pulses 0, 1, ... of a ramp, in groups of pulses: their sum, and the parabola that they
 *          follow. A group is one pulse near a standstill, and as many as the parabola is good for elsewhere. Sums are
 *          those of the law, so a ramp has no drift.
 * Laws:    harmonic: interval = K / v, v changing by a constant amount per pulse (manual lines 77-89);
 *          linear: v^2 changing by a constant amount per pulse (constant acceleration; manual lines 101-115, 265).
 * Units:   ticks of the timer's clock (62.5 ns, or the external one's) with a fraction in 1/65536. Velocities in "units" =
 *          RPM * 100 * microstep factor, so that a ramp value in hundredths is the change per pulse whatever the factor, and
 *          interval = K / v.
 * Context: main loop only; no hardware. ramp_begin() and ramp_next() are in assembler on the AVR (ramp.S, cycles there),
 *          elsewhere in ramp.c; the same to the bit.
 * Tests:   test/host/test_ramp.c, test_ramp_next.c, the same cases on the AVR.
 * Errors:  none; what is asked for has been checked (profile_check).
 * Limits:  steps_per_rev * slow_rpm >= 58 and steps_per_rev >= 8 (first intervals below about one second).
 */
#ifndef MOTION_RAMP_H
#define MOTION_RAMP_H

#include <stdbool.h>
#include <stdint.h>
#include "base/wide.h"
#include "motion/block.h"

/* An interval, or the sum of several. */
typedef union {
    wide_t q16; /* 1/65536 tick; below 2^48 */
    struct __attribute__((packed)) {
        uint16_t frac_q16;
        uint32_t ticks;
    };
} ramp_time_t;

/* What ramps depend on: motor and clock. */
typedef struct {
    wide_t k2_q16;          /* 2 * 65536 * K, K = 6000 * clock_hz / steps_per_rev (ticks times velocity units) */
    uint32_t clock_hz;      /* ticks a second; below that of the CPU: the timer's external clock */
    uint16_t steps_per_rev;
    uint8_t cycles_log2;    /* CPU cycles of a tick, rounded down to a power of two; 0: they are the same */
    uint8_t split_ticks;    /* runs of shorter intervals than these are not split (block.h) */
} ramp_constants_t;

typedef struct {
    /* Set by who begins a ramp: */
    bool linear;
    bool faster;        /* velocity grows from pulse to pulse */
    uint32_t v;         /* at the next pulse; linear: 0 if it begins, or, not faster, ends at a standstill */
    uint32_t step;      /* harmonic: change of v per pulse; linear: hundredths of rad/s^2 times microstep factor, or 0: so
                         * that `pulses` from v_most end at a standstill */
    union {
        uint32_t cap;     /* harmonic: never faster */
        wide_t bound_q16; /* linear: no interval beyond this one */
    } limit;
    /* By ramp_begin(), which makes the units of linear velocities smaller: */
    uint32_t rate;      /* harmonic: step / K * 2^40; linear: c / K^2 * 2^48 */
    wide_t k2_q16;      /* as in the constants, for these units, but so many doublings, for which it has no room ... */
    uint8_t k_lacks;
    uint8_t cycles_log2; /* as in the constants */
    uint8_t split_ticks;
    uint8_t least_run;   /* runs have so many pulses, a power of two, at least, where the group is of whole such ones; may be changed
                          * between groups */
    wide_t x;           /* linear: v^2 ... */
    wide_t c;           /* ... and its change per pulse */
    uint8_t steep;      /* 0; 1: its runs may be longer; 2: planning it takes as long as playing it, or nearly */
    bool bounded;       /* the limit has been reached: intervals are equal */
    bool rest;          /* the last group was of the last pulses, too few for more than one run */
    uint8_t group_log2; /* pulses of a group: this power of two, unless fewer are left */
    uint8_t most_log2;  /* the same, at most: less where the limit is near */
    uint8_t run_pulses; /* of the last group in several runs; 0: none yet */
    uint16_t ticks;     /* interval in the last group, at most 65535 */
} ramp_t;

/* steps_per_rev >= 8; clock_hz 400,000..16,000,000 */
void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev, uint32_t clock_hz);

/* Interval at a velocity, in 1/65536 tick. v >= 1. */
void ramp_interval_q16(wide_t *q16, const ramp_constants_t *constants, uint32_t v);

/* Velocity of an interval in ticks: the inverse. ticks >= 1. */
uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks);

/* Begins the ramp whose law stands in `ramp` (see there). v_most: its highest velocity; pulses: how many it takes to a
 * standstill, if linear and it ends there. A harmonic ramp that is not faster may begin above its cap. */
void ramp_begin(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_most, uint32_t pulses);

/* x = v^2 */
void ramp_square(wide_t *x, uint32_t v);

/* The next group of at most `left` pulses (>= 1): returns how many, up to 512, and the sum of their intervals; that of
 * several is below 65,536 ticks. How these follow each other: `block`, of which runs, pulses, top, slope and curve are set,
 * carry and width lost; no runs: alike. */
uint16_t ramp_next(ramp_t *ramp, uint16_t left, ramp_time_t *sum, block_t *block);

#endif
