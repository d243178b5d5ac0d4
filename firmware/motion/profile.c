/* See profile.h. */
#include "motion/profile.h"
#include "base/inline.h"
#include "base/wide.h"

#define NO_RAMP_CENTI 99900u /* of ACCEL_NONE */

void profile_basis(profile_basis_t *basis, uint16_t steps_per_rev, uint8_t factor_log2, uint8_t slow_rpm,
                   uint32_t clock_hz)
{
    NEAR(basis);
    ramp_constants(&basis->ramp, steps_per_rev, clock_hz);
    basis->us_rpm = (uint32_t)60000000 / steps_per_rev;
    basis->factor_log2 = factor_log2;
    basis->v_slow = (uint32_t)slow_rpm * 100u << factor_log2;
    ramp_time_t slow;
    ramp_interval_q16(&slow.q16, &basis->ramp, basis->v_slow);
    basis->slow_ticks = slow.ticks + (slow.frac_q16 != 0);
}

/* Velocity and cycle are each other's inverse. */
static NOINLINE uint32_t inverse(const profile_basis_t *basis, const motion_command_t *command)
{
    NEAR(command);
    return basis->us_rpm / command->velocity;
}

uint32_t profile_rpm(const profile_basis_t *basis, const motion_command_t *command)
{
    return command->flags & MOTION_CYCLE ? inverse(basis, command) : command->velocity;
}

uint32_t profile_cycle_us(const profile_basis_t *basis, const motion_command_t *command)
{
    return command->flags & MOTION_CYCLE ? command->velocity : inverse(basis, command);
}

NOINLINE void profile_interval(const profile_basis_t *basis, uint32_t us, uint8_t halvings, profile_interval_t *interval)
{
    NEAR(interval);
    wide_t ticks_q9;
    wide_set(&ticks_q9, us);
    if (basis->ramp.cycles_log2 == 0) { /* 16 ticks a microsecond */
        halvings = (uint8_t)(halvings - 12);
    } else {
        wide_multiply(&ticks_q9, basis->ramp.clock_hz);
        wide_shift(&ticks_q9, -8);
        wide_divide(&ticks_q9, 1000000);
    }
    wide_shift(&ticks_q9, (int8_t)(halvings - 1));
    interval->chunks = (uint32_t)wide_from_byte(&ticks_q9, 3);
    interval->ticks_q8 = (wide_half(&ticks_q9, 0) & 0xFFFFFFu) >> 1;
}

status_t profile_check(const profile_basis_t *basis, const motion_command_t *command, uint16_t pulse_us)
{
    if (command->velocity == 0)
        return STATUS_VELOCITY_ZERO;
    uint32_t shortest_us = pulse_us > 1 ? pulse_us + 1u : 2u;
    if (basis->ramp.cycles_log2)
        shortest_us = pulse_us > 2 ? pulse_us + 6u : 8u; /* two ticks, and time for the interrupt */
    shortest_us <<= basis->factor_log2;
    if (command->flags & MOTION_CYCLE) {
        if (command->velocity < shortest_us)
            return STATUS_PERIOD_TOO_SHORT;
    } else if (command->velocity > UINT16_MAX) { /* no division where the product below has room */
        if (inverse(basis, command) < shortest_us)
            return STATUS_PERIOD_TOO_SHORT;
    } else if (basis->us_rpm < shortest_us * command->velocity) {
        return STATUS_PERIOD_TOO_SHORT;
    }
    uint32_t most = UINT32_MAX - command->extra_pulses;
    if (!(command->flags & MOTION_PULSES))
        most >>= basis->factor_log2;
    return command->count > most ? STATUS_NUMBER_TOO_LARGE : STATUS_OK;
}

/* floor(V^2 / (2 alpha a)) steps from standstill = (100 RPM)^2 * steps_per_rev * pi / 360000 / centi. Up to 500,000
 * pulses a second the product fits 64 bits. 9 / 1031324 is pi / 360000 to 3 parts in 10^8. */
static void linear_steps(wide_t *steps, const profile_basis_t *basis, uint32_t v, uint32_t centi)
{
    ramp_square(steps, v >> basis->factor_log2);
    wide_multiply(steps, basis->ramp.steps_per_rev * (uint32_t)9);
    wide_divide(steps, 1031324);
    wide_divide(steps, centi);
}

/* Full steps of the profile's ramp from a velocity to v_peak. */
static void ramp_steps(wide_t *steps, const profile_basis_t *basis, const profile_t *profile, uint32_t v_from,
                       uint32_t centi)
{
    NEAR(profile);
    uint32_t v_to = profile->v_peak;
    wide_set(steps, 0);
    /* Within the slow range there are no ramps (manual lines 159, 169). */
    if (v_to <= basis->v_slow || centi == NO_RAMP_CENTI)
        return;
    bool from_slow = v_from == basis->v_slow;
    if (v_from > v_to) {
        v_to = v_from;
        v_from = profile->v_peak;
    }
    if (!profile->linear) {
        wide_set(steps, ((v_to - v_from) >> basis->factor_log2) / centi);
        return;
    }
    linear_steps(steps, basis, v_to, centi);
    if (!from_slow) { /* otherwise it starts from zero (decisions 0.2.4) */
        wide_t less;
        linear_steps(&less, basis, v_from, centi);
        wide_subtract(steps, &less);
    }
}

uint32_t profile_ramp_steps(const profile_basis_t *basis, uint32_t v_from, uint32_t v_to, uint32_t centi, bool linear)
{
    profile_t profile = {.v_peak = v_to, .linear = linear};
    wide_t steps;
    ramp_steps(&steps, basis, &profile, v_from, centi);
    return wide_half(&steps, 1) ? UINT32_MAX : wide_half(&steps, 0);
}

/* v2 +-= the change of v^2 over so many pulses of a linear ramp, in units^2: 2 * alpha * accel = 114591.559 centi F /
 * sprf each. */
static void add_change(wide_t *v2, const profile_basis_t *basis, uint32_t pulses, uint32_t centi, bool add)
{
    wide_t change;
    wide_set(&change, pulses);
    wide_multiply(&change, centi << basis->factor_log2);
    wide_multiply(&change, 916732); /* 8 * 114591.559 to 5 parts in 10^7 */
    wide_divide(&change, basis->ramp.steps_per_rev);
    wide_shift(&change, 3);
    wide_change(v2, &change, add);
}

static NOINLINE uint32_t limited(uint32_t v, const profile_t *profile)
{
    NEAR(profile);
    uint32_t most = profile->v_peak;
    bool beyond = v > most;
    return beyond == profile->faster ? most : v;
}

/* The velocity that the acceleration reaches instead of v_peak, and that of its last interval: v_exit. */
static void limit_peak(profile_t *profile, const profile_basis_t *basis)
{
    NEAR(profile);
    uint32_t v_peak = profile->v_start;
    uint32_t v_last;
    uint32_t pulses = profile->accel_pulses;
    bool faster = profile->faster;
    if (pulses == 0) {
        v_last = v_peak;
    } else if (profile->linear) {
        wide_t v2;
        if (v_peak == basis->v_slow && faster)
            v_peak = 0;
        ramp_square(&v2, v_peak);
        add_change(&v2, basis, pulses, profile->accel_centi, faster);
        v_peak = wide_root(&v2);
        add_change(&v2, basis, 1, profile->accel_centi, !faster);
        v_last = (v_peak + wide_root(&v2)) / 2; /* the mean of its two ends */
    } else {
        uint32_t step = faster ? profile->accel_centi : 0u - profile->accel_centi;
        v_peak += step * pulses;
        v_last = v_peak - step;
    }
    profile->v_exit = limited(v_last, profile);
    profile->v_peak = limited(v_peak, profile);
}

/* Would the deceleration's pulses leave the velocity above slow speed? */
static bool is_steep(const profile_t *profile, const profile_basis_t *basis)
{
    uint32_t pulses = profile->decel_pulses;
    uint8_t step = (uint8_t)(1u << basis->factor_log2);
    if (!profile->linear)
        return profile->v_peak - basis->v_slow > profile->decel_centi * (pulses + step);
    /* The v^2 that is left, after 2 % and four full steps more. */
    wide_t v2;
    ramp_square(&v2, profile->v_peak);
    add_change(&v2, basis, pulses + pulses / 50 + 4u * step, profile->decel_centi, false);
    return !wide_is_negative(&v2);
}

static NOINLINE void begin_plan(profile_t *profile, accel_code_t decel, bool linear, uint32_t v)
{
    NEAR(profile);
    profile->accel_pulses = 0;
    profile->cruise_pulses = 0;
    profile->linear = linear;
    profile->faster = false;
    profile->steep_decel = false;
    profile->decel_centi = accel_centi(decel);
    profile->v_start = v;
    profile->v_peak = v;
    profile->v_exit = v;
    profile->exit_cycle_us = 0;
}

/* Splits the count, in full steps or pulses, into phases. True if the ramps had to be truncated. */
static bool split(profile_t *profile, wide_t *accel, wide_t *decel, uint32_t total)
{
    bool truncated = false;
    wide_t ramps;
    for (;;) {
        wide_copy(&ramps, accel);
        wide_add(&ramps, decel);
        if (wide_half(&ramps, 1) == 0)
            break;
        /* Ramps beyond any command keep their ratio. */
        wide_shift(accel, 1);
        wide_shift(decel, 1);
        truncated = true;
    }
    uint32_t whole = wide_half(&ramps, 0);
    if (whole > total)
        truncated = true;
    uint32_t decel_pulses = wide_half(decel, 0);
    if (truncated) {
        wide_multiply(decel, total);
        wide_divide(decel, whole);
        decel_pulses = wide_half(decel, 0);
        if (decel_pulses > 1) {
            wide_multiply(accel, total);
            wide_divide(accel, whole);
            decel_pulses = total - wide_half(accel, 0);
        }
        whole = total;
    }
    profile->accel_pulses = whole - decel_pulses;
    profile->decel_pulses = decel_pulses;
    profile->cruise_pulses = total - whole;
    return truncated;
}

NOINLINE void profile_plan(profile_t *profile, const profile_basis_t *basis, const motion_command_t *command, uint32_t v_in)
{
    uint8_t factor_log2 = basis->factor_log2;
    uint32_t cycle_us = profile_cycle_us(basis, command);
    profile->cycle_us = cycle_us;
    profile_interval(basis, cycle_us, factor_log2, &profile->cruise); /* of a full step, divided by the microsteps */

    /* Velocities above the range of units are refused by profile_check: a period of 2 us is far below it. */
    uint32_t v_target = profile_rpm(basis, command) * 100u << factor_log2;
    begin_plan(profile, command->decel, (command->flags & MOTION_LINEAR) != 0, v_target);
    profile->accel_centi = accel_centi(command->accel);
    if (v_in < basis->v_slow)
        v_in = basis->v_slow;
    profile->v_start = v_in;
    profile->faster = v_target > v_in;

    wide_t accel;
    wide_t decel;
    ramp_steps(&accel, basis, profile, v_in, profile->accel_centi);
    if (v_in == basis->v_slow && command->decel == command->accel)
        wide_copy(&decel, &accel); /* saves half of the planning */
    else
        ramp_steps(&decel, basis, profile, basis->v_slow, profile->decel_centi);
    /* Full steps are truncated as full steps, so that a ramp covers the same steps whatever the factor. */
    uint8_t doublings = factor_log2;
    if (command->flags & MOTION_PULSES) {
        wide_shift(&accel, (int8_t)-doublings);
        wide_shift(&decel, (int8_t)-doublings);
        doublings = 0;
    }
    bool truncated = split(profile, &accel, &decel, command->count);
    for (; doublings; doublings--) {
        profile->accel_pulses *= 2;
        profile->cruise_pulses *= 2;
        profile->decel_pulses *= 2;
    }
    if (!truncated)
        profile->cruise_pulses += command->extra_pulses;
    if (profile->cruise_pulses == 0 && (truncated || profile->accel_pulses != 0))
        limit_peak(profile, basis);
    if (profile->accel_pulses == 0)
        profile->v_start = v_target; /* bounds that of a linear deceleration */

    /* The velocity that stays. */
    if (profile->decel_pulses != 0) {
        profile->v_exit = basis->v_slow;
        if (profile->cruise_pulses == 0)
            profile->steep_decel = is_steep(profile, basis);
    } else if (profile->cruise_pulses != 0) {
        profile->exit_cycle_us = profile->cycle_us;
    }
}

void profile_plan_decel(profile_t *profile, const profile_basis_t *basis, uint32_t v, accel_code_t decel, bool linear)
{
    begin_plan(profile, decel, linear, v);
    wide_t steps;
    ramp_steps(&steps, basis, profile, basis->v_slow, profile->decel_centi);
    profile->decel_pulses = wide_half(&steps, 0) << basis->factor_log2;
    if (profile->decel_pulses != 0)
        profile->v_exit = basis->v_slow;
}

void profile_begin_ramp(const profile_t *profile, const profile_basis_t *basis, bool accel, ramp_t *ramp)
{
    NEAR(basis);
    NEAR(ramp);
    uint32_t n = profile->decel_pulses;
    uint32_t v_most = profile->v_start;
    ramp->linear = profile->linear;
    ramp->faster = false;
    ramp->v = 0;
    if (accel) {
        ramp->faster = profile->faster;
        ramp->v = v_most;
    }
    ramp->step = accel ? profile->accel_centi : profile->decel_centi;
    if (!profile->linear) {
        ramp->limit.cap = UINT32_MAX >> 1; /* (an acceleration ends before) */
        if (!accel) {
            ramp->limit.cap = profile->v_peak;
            if (profile->steep_decel)
                ramp->step = (profile->v_peak - basis->v_slow) / n;
            ramp->v = basis->v_slow + (n - 1) * ramp->step;
        }
    } else {
        wide_t *bound_q16 = &ramp->limit.bound_q16;
        if (accel) {
            /* Whole full steps may pass the target a little: not beyond the interval of the cruise. */
            wide_set(bound_q16, (profile->cruise.chunks << (PROFILE_CHUNK_LOG2 + 8)) + profile->cruise.ticks_q8);
            wide_shift(bound_q16, -8);
            if (profile->faster && v_most == basis->v_slow)
                ramp->v = 0; /* (decisions 0.2.4) */
        } else {
            ramp_interval_q16(bound_q16, &basis->ramp, basis->v_slow);
        }
        if (v_most < profile->v_peak)
            v_most = profile->v_peak;
        if (!accel && profile->steep_decel) {
            v_most = profile->v_peak;
            ramp->step = 0;
        }
        ramp->step <<= basis->factor_log2;
    }
    ramp_begin(ramp, &basis->ramp, v_most, n);
}
