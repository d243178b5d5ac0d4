/* See profile.h. */
#include "motion/profile.h"
#include <math.h>

#define LONGEST_RAMP_STEPS 16777216.0f /* two of them times 128 microsteps fit 32 bits */

void profile_basis(profile_basis_t *basis, uint16_t steps_per_rev, uint8_t factor_log2, uint8_t slow_rpm)
{
    ramp_constants(&basis->ramp, steps_per_rev);
    basis->us_rpm = (uint32_t)60000000 / steps_per_rev;
    basis->steps_per_rev = steps_per_rev;
    basis->factor_log2 = factor_log2;
    basis->v_slow = (uint32_t)slow_rpm * 100u << factor_log2;
    ramp_time_t slow = ramp_interval(&basis->ramp, basis->v_slow);
    basis->slow_ticks = slow.ticks + (slow.frac != 0);
    basis->linear_steps = (float)steps_per_rev * 0.0872664626f; /* pi / 36 */
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

/* floor(V^2 / (2 alpha a)) = RPM^2 * steps_per_rev * pi / (36 * centi): steps from standstill. */
static uint32_t linear_steps(const profile_basis_t *basis, uint32_t v, uint32_t centi)
{
    uint32_t centi_rpm = v >> basis->factor_log2;
    float rpm = (float)centi_rpm * 0.01f;
    float exact = rpm * rpm * basis->linear_steps / (float)centi;
    return exact < LONGEST_RAMP_STEPS ? (uint32_t)exact : (uint32_t)LONGEST_RAMP_STEPS;
}

uint32_t profile_ramp_steps(const profile_basis_t *basis, uint32_t v_from, uint32_t v_to, uint32_t centi, bool linear)
{
    if (!linear) {
        uint32_t change = (v_from > v_to ? v_from - v_to : v_to - v_from) >> basis->factor_log2;
        if (centi == 100 && change % 100u == 0 && change < 65536u)
            return (uint16_t)change / 100u; /* the factory value: a short division */
        return change / centi;
    }
    uint32_t from = linear_steps(basis, v_from, centi);
    uint32_t to = linear_steps(basis, v_to, centi);
    return from > to ? from - to : to - from;
}

/* a * b / divisor, truncated; of large ones to the precision of a float, which is enough for a ratio. */
static uint32_t scale(uint32_t a, uint32_t b, uint32_t divisor)
{
    if (a < 65536u && b < 65536u)
        return a * b / divisor;
    return (uint32_t)((float)a * (float)b / (float)divisor);
}

/* Change of v^2 per pulse of a linear ramp, in units^2: 2 * alpha * accel. */
static float square_per_pulse(const profile_basis_t *basis, uint32_t centi)
{
    return 114591.559f * (float)centi * (float)(1u << basis->factor_log2) / (float)basis->steps_per_rev;
}

static uint32_t root(float square)
{
    return square > 0.0f ? (uint32_t)(sqrtf(square) + 0.5f) : 0;
}

/* The velocity that the acceleration reaches (v_peak), and that of its last interval. */
static uint32_t reached(profile_t *profile, const profile_basis_t *basis, uint32_t v_target)
{
    uint32_t v_peak;
    uint32_t v_last;
    uint32_t pulses = profile->accel_pulses;
    bool faster = profile->faster;
    if (profile->linear) {
        float per_pulse = square_per_pulse(basis, profile->accel_centi);
        float square = 0.0f;
        if (profile->v_start != basis->v_slow || !faster)
            square = (float)profile->v_start * (float)profile->v_start;
        if (!faster)
            per_pulse = -per_pulse;
        square += (float)pulses * per_pulse;
        v_peak = root(square);
        v_last = root(square - 0.5f * per_pulse);
    } else {
        uint32_t step = faster ? profile->accel_centi : -profile->accel_centi;
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
    uint32_t accel = 0;
    uint32_t decel = 0;
    if (ramps && command->accel != ACCEL_NONE && v_start != v_target) {
        uint32_t from = v_start;
        if (profile->linear && v_start == v_slow)
            from = 0; /* a linear ramp starts from zero (decisions 0.2.4) */
        accel = profile_ramp_steps(basis, from, v_target, profile->accel_centi, profile->linear);
    }
    if (ramps && command->decel != ACCEL_NONE)
        decel = profile_ramp_steps(basis, profile->linear ? 0 : v_slow, v_target, profile->decel_centi,
                                   profile->linear);

    /* Full steps are truncated as full steps, so that a ramp covers the same steps whatever the factor. */
    uint8_t after_log2 = factor_log2;
    if (command->flags & MOTION_PULSES) {
        accel <<= factor_log2;
        decel <<= factor_log2;
        after_log2 = 0;
    }
    uint32_t total = command->count;
    uint32_t cruise;
    bool truncated = accel > total || decel > total - accel;
    if (truncated) {
        uint32_t whole = accel + decel;
        uint32_t scaled = scale(decel, total, whole);
        if (scaled > 1)
            scaled = total - scale(accel, total, whole);
        decel = scaled;
        accel = total - decel;
        cruise = 0;
    } else {
        cruise = total - accel - decel;
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
            /* v^2 that the deceleration can take off, against what it has to */
            float able = (float)profile->decel_pulses * square_per_pulse(basis, profile->decel_centi);
            float needed = (float)profile->v_peak * (float)profile->v_peak;
            profile->steep_decel = needed > able * 1.02f + 4.0f * square_per_pulse(basis, profile->decel_centi) *
                                                                (float)(1u << factor_log2);
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
        /* From zero to v_start: v / accel = RPM * pi / 30 / (centi / 100) s = units / (100 F) * 2.680826e9 / centi */
        ramp_from_float(&t, (float)profile->v_start * 26808257.0f /
                                ((float)profile->accel_centi * (float)(1u << basis->factor_log2)));
    }
    ramp_begin_linear(ramp, &c, &t, &rest, profile->faster, UINT32_MAX >> 8);
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
    ramp_linear_c(&c, basis->steps_per_rev, basis->factor_log2, profile->decel_centi);
    if (profile->steep_decel) {
        /* From v_peak to zero in n pulses: t = 2 n interval(v_peak), C = t^2 / n. */
        float interval_q4 = basis->ramp.k512 / 32.0f / (float)profile->v_peak;
        ramp_from_float(&c, 4.0f * (float)n * interval_q4 * interval_q4);
    }
    ramp_linear_time(&t, &c, n, &rest);
    ramp_begin_linear(ramp, &c, &t, &rest, false, basis->slow_ticks);
}
