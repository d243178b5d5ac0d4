/* See profile.h. */
#include "motion/profile.h"
#include "base/wide.h"

void profile_basis(profile_basis_t *basis, uint16_t steps_per_rev, uint8_t factor_log2, uint8_t slow_rpm)
{
    ramp_constants(&basis->ramp, steps_per_rev);
    basis->us_rpm = (uint32_t)60000000 / steps_per_rev;
    basis->steps_per_rev = steps_per_rev;
    basis->factor_log2 = factor_log2;
    basis->v_slow = (uint32_t)slow_rpm * 100u << factor_log2;
    ramp_time_t slow = ramp_interval(&basis->ramp, basis->v_slow);
    basis->slow_ticks = slow.ticks + (slow.frac != 0);
}

uint32_t profile_rpm(const profile_basis_t *basis, const motion_command_t *command)
{
    return command->flags & MOTION_CYCLE ? basis->us_rpm / command->velocity : command->velocity;
}

uint32_t profile_cycle_us(const profile_basis_t *basis, const motion_command_t *command)
{
    return command->flags & MOTION_CYCLE ? command->velocity : basis->us_rpm / command->velocity;
}

/* Cycle of a full step, divided by the microsteps. */
static profile_interval_t pulse_interval(uint32_t cycle_us, uint8_t factor_log2)
{
    uint8_t chunk_us_log2 = (uint8_t)(PROFILE_CHUNK_LOG2 - 4 + factor_log2); /* 16 ticks a microsecond */
    profile_interval_t interval;
    interval.chunks = cycle_us >> chunk_us_log2;
    interval.ticks_q8 = ((cycle_us & (((uint32_t)1 << chunk_us_log2) - 1)) << 12) >> factor_log2;
    return interval;
}

status_t profile_check(const profile_basis_t *basis, const motion_command_t *command, uint8_t pulse_us)
{
    if (command->velocity == 0)
        return STATUS_VELOCITY_ZERO;
    uint32_t shortest_us = (uint32_t)(pulse_us > 1 ? pulse_us + 1u : 2u) << basis->factor_log2;
    if (command->flags & MOTION_CYCLE) {
        if (command->velocity < shortest_us)
            return STATUS_PERIOD_TOO_SHORT;
    } else if (command->velocity > 1000) { /* slower ones are never too fast: no division in the common case */
        if (basis->us_rpm / command->velocity < shortest_us)
            return STATUS_PERIOD_TOO_SHORT;
    } else if (basis->us_rpm < shortest_us * command->velocity) {
        return STATUS_PERIOD_TOO_SHORT;
    }
    uint32_t most = UINT32_MAX - command->extra_pulses;
    if (!(command->flags & MOTION_PULSES))
        most >>= basis->factor_log2;
    return command->count > most ? STATUS_NUMBER_TOO_LARGE : STATUS_OK;
}

static void multiply(wide_t *x, uint32_t factor)
{
    wide_t wide_factor = factor;
    wide_t product;
    wide_multiply(&product, x, &wide_factor);
    *x = product;
}

static void square(wide_t *x, uint32_t v)
{
    wide_t wide_v = v;
    wide_multiply(x, &wide_v, &wide_v);
}

static bool is_negative(const wide_t *x)
{
    return wide_half(x, 1) > INT32_MAX;
}

/* floor(V^2 / (2 alpha a)) steps from standstill = (100 RPM)^2 * steps_per_rev * pi / 360000 / centi. Up to 500,000
 * pulses a second the product fits 64 bits. 9 / 1031324 is pi / 360000 to 3 parts in 10^8. */
static void linear_steps(wide_t *steps, const profile_basis_t *basis, uint32_t v, uint32_t centi)
{
    square(steps, v >> basis->factor_log2);
    multiply(steps, basis->steps_per_rev * (uint32_t)9);
    wide_divide(steps, 1031324);
    wide_divide(steps, centi);
}

/* Full steps of a ramp between two velocities. */
static void ramp_steps(wide_t *steps, const profile_basis_t *basis, uint32_t v_from, uint32_t v_to, uint32_t centi,
                       bool linear)
{
    if (v_from > v_to) {
        uint32_t v = v_from;
        v_from = v_to;
        v_to = v;
    }
    if (!linear) {
        *steps = ((v_to - v_from) >> basis->factor_log2) / centi;
        return;
    }
    linear_steps(steps, basis, v_to, centi);
    if (v_from) {
        wide_t from;
        linear_steps(&from, basis, v_from, centi);
        wide_subtract(steps, &from);
    }
}

uint32_t profile_ramp_steps(const profile_basis_t *basis, uint32_t v_from, uint32_t v_to, uint32_t centi, bool linear)
{
    wide_t steps;
    ramp_steps(&steps, basis, v_from, v_to, centi, linear);
    return wide_half(&steps, 1) ? UINT32_MAX : wide_half(&steps, 0);
}

/* Change of v^2 over so many pulses of a linear ramp, in units^2: 2 * alpha * accel = 114591.559 centi F / sprf each. */
static void square_change(wide_t *change, const profile_basis_t *basis, uint32_t pulses, uint32_t centi)
{
    *change = pulses;
    multiply(change, centi << basis->factor_log2);
    multiply(change, 916732); /* 8 * 114591.559 to 5 parts in 10^7 */
    wide_divide(change, basis->steps_per_rev);
    wide_shift(change, 3);
}

static uint32_t root(const wide_t *x)
{
    return is_negative(x) ? 0 : wide_root(x);
}

/* The velocity that the acceleration reaches (v_peak), and that of its last interval. */
static uint32_t reached(profile_t *profile, const profile_basis_t *basis, uint32_t v_target)
{
    uint32_t v_peak;
    uint32_t v_last;
    uint32_t pulses = profile->accel_pulses;
    bool faster = profile->faster;
    if (profile->linear) {
        wide_t v2 = 0;
        wide_t change;
        if (profile->v_start != basis->v_slow || !faster)
            square(&v2, profile->v_start);
        square_change(&change, basis, pulses, profile->accel_centi);
        if (faster)
            wide_add(&v2, &change);
        else
            wide_subtract(&v2, &change);
        v_peak = root(&v2);
        square_change(&change, basis, 1, profile->accel_centi);
        if (faster)
            wide_subtract(&v2, &change);
        else
            wide_add(&v2, &change);
        v_last = (v_peak + root(&v2)) / 2; /* the mean of its two ends */
    } else {
        uint32_t step = faster ? profile->accel_centi : 0u - profile->accel_centi;
        v_peak = profile->v_start + step * pulses;
        v_last = v_peak - step;
    }
    if (faster ? v_peak > v_target : v_peak < v_target)
        v_peak = v_target;
    if (faster ? v_last > v_target : v_last < v_target)
        v_last = v_target;
    profile->v_peak = v_peak;
    return v_last;
}

void profile_plan(profile_t *profile, const profile_basis_t *basis, const motion_command_t *command, uint32_t v_in)
{
    uint8_t factor_log2 = basis->factor_log2;
    uint32_t cycle_us = profile_cycle_us(basis, command);
    uint32_t rpm = profile_rpm(basis, command);
    /* Velocities above the range of units are refused by profile_check: a period of 2 us is far below it. */
    uint32_t v_target = rpm * 100u << factor_log2;
    uint32_t v_slow = basis->v_slow;

    profile->cycle_us = cycle_us;
    profile->cruise = pulse_interval(cycle_us, factor_log2);
    profile->linear = (command->flags & MOTION_LINEAR) != 0;
    profile->accel_centi = accel_centi(command->accel);
    profile->decel_centi = accel_centi(command->decel);
    profile->steep_decel = false;

    uint32_t v_start = v_in < v_slow ? v_slow : v_in;
    profile->v_start = v_start;
    profile->faster = v_target > v_start;

    /* Within the slow range there are no ramps (manual lines 159, 169). */
    bool ramps = v_target > v_slow;
    wide_t wide_accel = 0;
    wide_t wide_decel = 0;
    if (ramps && command->accel != ACCEL_NONE && v_start != v_target) {
        uint32_t from = v_start;
        if (profile->linear && v_start == v_slow)
            from = 0; /* a linear ramp starts from zero (decisions 0.2.4) */
        ramp_steps(&wide_accel, basis, from, v_target, profile->accel_centi, profile->linear);
    }
    if (ramps && command->decel != ACCEL_NONE)
        ramp_steps(&wide_decel, basis, profile->linear ? 0 : v_slow, v_target, profile->decel_centi, profile->linear);

    /* Full steps are truncated as full steps, so that a ramp covers the same steps whatever the factor. */
    uint8_t after_log2 = factor_log2;
    if (command->flags & MOTION_PULSES) {
        while (after_log2) {
            wide_add(&wide_accel, &wide_accel);
            wide_add(&wide_decel, &wide_decel);
            after_log2--;
        }
    }
    /* Ramps beyond any command keep their ratio. */
    bool truncated = false;
    while (wide_half(&wide_accel, 1) || wide_half(&wide_decel, 1) ||
           (uint32_t)wide_accel > UINT32_MAX - (uint32_t)wide_decel) {
        wide_shift(&wide_accel, 1);
        wide_shift(&wide_decel, 1);
        truncated = true;
    }
    uint32_t accel = (uint32_t)wide_accel;
    uint32_t decel = (uint32_t)wide_decel;
    uint32_t total = command->count;
    uint32_t whole = accel + decel;
    uint32_t cruise = 0;
    if (whole > total)
        truncated = true;
    if (truncated) {
        uint32_t scaled = ramp_scale(decel, total, whole);
        if (scaled > 1)
            scaled = total - ramp_scale(accel, total, whole);
        decel = scaled;
        accel = total - decel;
    } else {
        cruise = total - whole;
    }
    profile->accel_pulses = accel << after_log2;
    profile->decel_pulses = decel << after_log2;
    profile->cruise_pulses = (cruise << after_log2) + (truncated ? 0 : command->extra_pulses);

    /* The velocity reached, and the one that stays. */
    uint32_t v_last = v_target; /* of the last interval, if it is one of the acceleration */
    profile->v_peak = v_target;
    if (truncated || cruise == 0)
        v_last = profile->accel_pulses ? reached(profile, basis, v_target) : (profile->v_peak = v_start);
    profile->exit_cycle_us = 0;
    if (profile->decel_pulses != 0) {
        profile->v_exit = v_slow;
        if (profile->linear) {
            /* Can the deceleration, and 2 % and four full steps more of it, take off v^2? */
            wide_t able;
            wide_t needed;
            square_change(&able, basis,
                          profile->decel_pulses + profile->decel_pulses / 50 + ((uint32_t)4 << factor_log2),
                          profile->decel_centi);
            square(&needed, profile->v_peak);
            wide_subtract(&able, &needed);
            profile->steep_decel = is_negative(&able);
        } else {
            profile->steep_decel =
                profile->v_peak - v_slow > profile->decel_centi * (profile->decel_pulses + ((uint32_t)1 << factor_log2));
        }
    } else if (profile->cruise_pulses != 0) {
        profile->v_exit = v_target;
        profile->exit_cycle_us = cycle_us;
    } else {
        profile->v_exit = v_last;
    }
}

void profile_plan_decel(profile_t *profile, const profile_basis_t *basis, uint32_t v, accel_code_t decel, bool linear)
{
    profile->accel_pulses = 0;
    profile->cruise_pulses = 0;
    profile->decel_pulses = 0;
    profile->linear = linear;
    profile->faster = false;
    profile->steep_decel = false;
    profile->decel_centi = accel_centi(decel);
    profile->v_start = v;
    profile->v_peak = v;
    profile->v_exit = v;
    profile->exit_cycle_us = 0;
    if (decel == ACCEL_NONE || v <= basis->v_slow)
        return;
    uint32_t steps = profile_ramp_steps(basis, linear ? 0 : basis->v_slow, v, profile->decel_centi, linear);
    profile->decel_pulses = steps << basis->factor_log2;
    if (profile->decel_pulses != 0)
        profile->v_exit = basis->v_slow;
}

void profile_begin_accel(const profile_t *profile, const profile_basis_t *basis, ramp_t *ramp)
{
    if (!profile->linear) {
        ramp_begin_harmonic(ramp, &basis->ramp, profile->v_start, profile->accel_centi, profile->faster, UINT32_MAX >> 1);
        return;
    }
    wide_t c;
    wide_t t = 0;
    wide_t rest = 0;
    ramp_linear_c(&c, basis->steps_per_rev, basis->factor_log2, profile->accel_centi);
    if (profile->v_start != basis->v_slow || !profile->faster) {
        /* From zero to v_start: v / accel = RPM * pi / 30 / (centi / 100) s = units / (100 F) * 2.680825731e9 / centi
         * sixteenths of a tick */
        t = profile->v_start;
        multiply(&t, 2680825731u);
        wide_divide(&t, profile->accel_centi * 100u << basis->factor_log2);
    }
    ramp_begin_linear(ramp, &c, &t, &rest, profile->faster, 0);
    /* Whole full steps may pass the target a little: not beyond the interval of the cruise. */
    ramp->bound_q8 = profile->cruise.chunks >> (32 - PROFILE_CHUNK_LOG2 - 8)
                         ? UINT32_MAX
                         : (profile->cruise.chunks << (PROFILE_CHUNK_LOG2 + 8)) + profile->cruise.ticks_q8;
}

void profile_begin_decel(const profile_t *profile, const profile_basis_t *basis, ramp_t *ramp)
{
    uint32_t n = profile->decel_pulses;
    if (!profile->linear) {
        uint32_t step = profile->decel_centi;
        if (profile->steep_decel)
            step = (profile->v_peak - basis->v_slow) / n;
        ramp_begin_harmonic(ramp, &basis->ramp, basis->v_slow + (n - 1) * step, step, false, profile->v_peak);
        return;
    }
    wide_t c;
    wide_t t;
    wide_t rest;
    if (profile->steep_decel) {
        /* From v_peak to zero in n pulses: t = 2 n interval(v_peak), C = t^2 / n. */
        ramp_time_t interval = ramp_interval(&basis->ramp, profile->v_peak);
        square(&c, interval.ticks << 4 | interval.frac >> 4);
        multiply(&c, n << 2);
    } else {
        ramp_linear_c(&c, basis->steps_per_rev, basis->factor_log2, profile->decel_centi);
    }
    ramp_linear_time(&t, &c, n, &rest);
    ramp_begin_linear(ramp, &c, &t, &rest, false, 0);
    ramp_bound(ramp, &basis->ramp, basis->v_slow);
}
