/* What the manual's arithmetic says about a motion command, in long double, for comparison with the firmware.
 *
 * Written from the requirements, not from the firmware:
 *   steps of a ramp    harmonic floor(|V2 - V1| / acc) (manual line 89); linear |floor(n(V2)) - floor(n(V1))| with
 *                      n(V) = V^2 / (2 alpha acc) (lines 265-269), from standstill n(V1) = 0
 *   truncation         dec' = floor(dec N / (acc + dec)); if dec' <= 1 then acc' = N - dec', else
 *                      acc' = floor(acc N / (acc + dec)), dec' = N - acc' (lines 253-263)
 *   harmonic interval  K / v, v = v0, v0 +- a, ...; a deceleration ends at slow speed (lines 85-89, 159)
 *   linear interval    c0 (sqrt(k + 1) - sqrt(k)), c0 = sqrt(2 alpha / acc); not above the slow interval while slowing
 *   cruise interval    the cycle, divided by the microsteps (lines 541-547)
 * Units: ticks of 62.5 ns; velocities in RPM of full steps; ramp values in RPM per full step or rad/s^2. */
#ifndef MOTION_EXACT_H
#define MOTION_EXACT_H

#include <stdbool.h>
#include <stdint.h>
#include "motion/command.h"

typedef struct {
    uint32_t steps_per_rev;
    uint32_t factor; /* microsteps per full step */
    uint32_t slow_rpm;
} exact_motor_t;

/* Ramp pulses: floor() of a real number. Where that is within 3e-7 of a whole one (a few units in the last place of a
 * float), both are right. */
typedef struct {
    uint64_t least, most;
} exact_count_t;

uint32_t exact_rpm(const exact_motor_t *motor, const motion_command_t *command);
uint32_t exact_cycle_us(const exact_motor_t *motor, const motion_command_t *command);
long double exact_cruise_ticks(const exact_motor_t *motor, const motion_command_t *command);
long double exact_interval_ticks(const exact_motor_t *motor, long double rpm); /* K / v */
long double exact_rpm_of(const exact_motor_t *motor, long double ticks);

/* Full steps of a ramp between two speeds. */
exact_count_t exact_ramp_steps(const exact_motor_t *motor, long double from_rpm, long double to_rpm, uint32_t centi,
                               bool linear);

/* A ramp as a law: time from its first pulse to pulse k, ticks. */
typedef struct {
    bool linear;
    bool faster;
    long double k;     /* harmonic: ticks * RPM */
    long double v;     /* harmonic: RPM of the first interval */
    long double dv;    /* change per pulse, signed */
    long double c0;    /* linear */
    long double x;     /* linear: pulses from standstill at the first pulse */
    long double limit; /* linear: no interval below (speeding up) or above (slowing); 0: none */
    long double peak;  /* harmonic deceleration: no speed above; 0: none */
} exact_ramp_t;

/* Acceleration from a speed (from standstill: rest) to a cruise of so many ticks, which it does not pass. */
void exact_accel(exact_ramp_t *ramp, const exact_motor_t *motor, long double from_rpm, bool rest, bool faster,
                 long double cruise_ticks, uint32_t centi, bool linear);
/* Deceleration of n pulses to slow speed, from a peak that a truncated profile may have left below its first speed. */
void exact_decel(exact_ramp_t *ramp, const exact_motor_t *motor, uint64_t n, long double peak_rpm, uint32_t centi,
                 bool linear);
long double exact_ramp_time(const exact_ramp_t *ramp, uint64_t k);
long double exact_ramp_interval(const exact_ramp_t *ramp, uint64_t k);

#endif
