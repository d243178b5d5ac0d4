/* The ideal intervals of a motion from standstill, in long double, and how far a run is from them.
 *
 * Source: manual lines 77-115 (both laws), 249-265 (lengths, truncation); decisions: a linear ramp starts from zero and
 * has the intervals c0 (sqrt(k + 1) - sqrt(k)), its deceleration is their mirror, never above the slow interval. */
#include "bench.h"

#include <math.h>
#include <stdio.h>

#define STEPS_PER_REV 200
#define SLOW_RPM 10

static const long double pi = 3.14159265358979323846264338327950288L;

/* Full steps between slow speed (linear: zero) and the velocity, whole ones. */
static uint64_t ramp_steps(long double rpm, double ramp, bool linear)
{
    if (ramp >= 999.0 || rpm <= SLOW_RPM)
        return 0;
    if (!linear)
        return (uint64_t)((rpm - SLOW_RPM) / (long double)ramp + 1e-9L);
    long double speed = rpm * 2.0L * pi / 60.0L; /* rad/s */
    long double step = 2.0L * pi / STEPS_PER_REV;
    return (uint64_t)(speed * speed / (2.0L * step * (long double)ramp));
}

void ideal_plan(ideal_t *ideal, const motion_t *motion)
{
    uint64_t factor = 1u << motion->ustep;
    long double rpm = 60000000u / STEPS_PER_REV / motion->cycle_us; /* a whole number: the manual's arithmetic */
    uint64_t accel = ramp_steps(rpm, motion->accel, motion->linear);
    uint64_t decel = ramp_steps(rpm, motion->decel, motion->linear);
    uint64_t cruise = 0;
    if (accel + decel > motion->steps) {
        uint64_t whole = accel + decel;
        uint64_t scaled = decel * motion->steps / whole;
        if (scaled > 1)
            scaled = motion->steps - accel * motion->steps / whole;
        decel = scaled;
        accel = motion->steps - decel;
    } else {
        cruise = motion->steps - accel - decel;
    }
    ideal->motion = *motion;
    ideal->accel_pulses = accel * factor;
    ideal->cruise_pulses = cruise * factor;
    ideal->decel_pulses = decel * factor;
    ideal->tick_rpm = 60.0L * TICKS_PER_S / (long double)(STEPS_PER_REV * factor);
    ideal->slow_ticks = ideal->tick_rpm / SLOW_RPM;
    ideal->cruise_ticks = (long double)motion->cycle_us * TICKS_PER_US / (long double)factor;
    long double pulse_angle = 2.0L * pi / (long double)(STEPS_PER_REV * factor);
    ideal->c0_accel = sqrtl(2.0L * pulse_angle / (long double)motion->accel) * TICKS_PER_S;
    ideal->c0_decel = sqrtl(2.0L * pulse_angle / (long double)motion->decel) * TICKS_PER_S;
}

uint64_t ideal_pulses(const ideal_t *ideal)
{
    return ideal->accel_pulses + ideal->cruise_pulses + ideal->decel_pulses;
}

bool ideal_is_ramp(const ideal_t *ideal, uint64_t k)
{
    return k < ideal->accel_pulses || k >= ideal->accel_pulses + ideal->cruise_pulses;
}

/* sqrt(k + 1) - sqrt(k) without cancellation. */
static long double root_difference(uint64_t k)
{
    return 1.0L / (sqrtl((long double)k + 1.0L) + sqrtl((long double)k));
}

long double ideal_interval(const ideal_t *ideal, uint64_t k)
{
    long double factor = (long double)(1u << ideal->motion.ustep);
    if (!ideal_is_ramp(ideal, k))
        return ideal->cruise_ticks;
    if (k < ideal->accel_pulses) {
        if (ideal->motion.linear)
            return ideal->c0_accel * root_difference(k);
        return ideal->tick_rpm / (SLOW_RPM + (long double)k * (long double)ideal->motion.accel / factor);
    }
    uint64_t left = ideal_pulses(ideal) - 1 - k; /* the mirror: 0 for the last interval */
    if (ideal->motion.linear) {
        long double ticks = ideal->c0_decel * root_difference(left);
        return ticks < ideal->slow_ticks ? ticks : ideal->slow_ticks;
    }
    return ideal->tick_rpm / (SLOW_RPM + (long double)left * (long double)ideal->motion.decel / factor);
}

void ideal_command(const motion_t *motion, char *text, size_t size)
{
    snprintf(text, size, "m%lluvc%ua%gd%gl%d\n", (unsigned long long)motion->steps, motion->cycle_us, motion->accel,
             motion->decel, motion->linear);
}

void ramp_error_where(const ramp_error_t *error, const ideal_t *ideal, char *text, size_t size)
{
    if (error->first_bad == UINT64_MAX)
        snprintf(text, size, "none");
    else
        snprintf(text, size, "%llu, %.2f kHz", (unsigned long long)error->first_bad,
                 (double)(TICKS_PER_S / ideal_interval(ideal, error->first_bad) / 1000.0L));
}

void ideal_compare(const ideal_t *ideal, const run_t *run, size_t first, ramp_error_t *error)
{
    long double squares = 0.0L;
    long double beyond = 0.0L;
    long double sum = 0.0L;
    *error = (ramp_error_t){.first_bad = UINT64_MAX};
    uint64_t seen = run->pulses - first;
    if (seen > ideal_pulses(ideal))
        seen = ideal_pulses(ideal);
    for (uint64_t k = 0; k + 1 < seen; k++) {
        long double ideal_ticks = ideal_interval(ideal, k);
        long double off = (long double)run_interval(run, first + k) - ideal_ticks;
        sum += off;
        if (!ideal_is_ramp(ideal, k))
            continue;
        error->intervals++;
        long double percent = 100.0L * fabsl(off) / ideal_ticks;
        squares += percent * percent;
        if (percent > (long double)error->max_percent) {
            error->max_percent = (double)percent;
            error->worst_at = k;
        }
        if (fabsl(off) > (long double)error->max_ticks)
            error->max_ticks = (double)fabsl(off);
        if (fabsl(off) > 1.0L) {
            if (percent > 0.1L && error->first_bad == UINT64_MAX)
                error->first_bad = k;
            if (percent > (long double)error->worst_ticks_percent)
                error->worst_ticks_percent = (double)percent;
            long double excess = 100.0L * (fabsl(off) - 1.0L) / ideal_ticks;
            beyond += excess * excess;
        }
    }
    if (error->intervals) {
        error->rms_percent = (double)sqrtl(squares / (long double)error->intervals);
        error->beyond_rms_percent = (double)sqrtl(beyond / (long double)error->intervals);
    }
    error->sum_ticks = (double)sum;
}

bool ramp_error_met(const ramp_error_t *error)
{
    if (error->max_ticks <= 1.0)
        return true;
    bool rms = error->rms_percent <= 0.03 || error->beyond_rms_percent <= 0.03;
    return rms && error->worst_ticks_percent <= 0.1;
}
