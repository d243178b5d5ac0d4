/* See ramp.h and docs/design.md. All arithmetic is in integers.
 * Both laws are about velocity. Harmonic: it changes by so much a pulse; the interval in a group's middle is a division's
 * quotient, and the law's series around it gives the mean. Linear: its square does; a group's pulses over the mean of the
 * velocities at both ends is its duration, exactly.
 * By what part of its value the velocity changes in the group gives the shape of either. */
#include "motion/ramp.h"
#include "base/inline.h"
#include "base/wide.h"
#include "motion/block.h"
#include "motion/group.h"
#include "motion/group_layout.h"
#include <string.h>

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev, uint32_t clock_hz)
{
    constants->steps_per_rev = steps_per_rev;
    constants->clock_hz = clock_hz;
    wide_set(&constants->k2_q16, clock_hz);
    wide_multiply(&constants->k2_q16, 6000u * 131072u);
    wide_divide(&constants->k2_q16, steps_per_rev);
    uint8_t log2 = 0;
    for (uint8_t mhz_q4 = (uint8_t)(clock_hz >> 16); mhz_q4 < 128; mhz_q4 = (uint8_t)(mhz_q4 << 1))
        log2++;
    constants->cycles_log2 = log2;
    constants->split_ticks = log2 ? 0 : BLOCK_SPLIT_TICKS;
}

/* quotient = k2_q16 / divisor */
void ramp_divide_k(wide_t *quotient, const wide_t *k2_q16, uint32_t divisor);

#if !defined __AVR__ || defined RAMP_IN_C

void ramp_divide_k(wide_t *quotient, const wide_t *k2_q16, uint32_t divisor)
{
    wide_copy(quotient, k2_q16);
    wide_divide(quotient, divisor);
}

void ramp_interval_q16(wide_t *q16, const ramp_constants_t *constants, uint32_t v)
{
    ramp_divide_k(q16, &constants->k2_q16, 2 * v);
}

void ramp_square(wide_t *x, uint32_t v)
{
    wide_set(x, v);
    wide_multiply(x, v);
}

/* The interval, in 1/65536, to choose the next group by. */
static NOINLINE void set_ticks(ramp_t *ramp, const wide_t *q16)
{
    uint32_t ticks = (uint32_t)wide_from_byte(q16, 2);
    ramp->ticks = ticks > UINT16_MAX ? UINT16_MAX : (uint16_t)ticks;
}

/* -- the laws ----------------------------------------------------------------------------------------------------- */

/* x * 2^up / divisor, of as many bits as there is room for. */
static NOINLINE void divide_scaled(wide_t *x, uint32_t divisor, int8_t up)
{
    int8_t room = (int8_t)(64 - wide_bits(x));
    int8_t before = up < room ? up : room;
    wide_shift(x, (int8_t)-before);
    wide_divide(x, divisor);
    wide_shift(x, (int8_t)(before - up));
}

/* Linear: velocity units so many times twice as large, or half as large (below 0). K gets what it has room for. */
static NOINLINE void scale_k(ramp_t *ramp, int8_t by)
{
    NEAR(ramp);
    int8_t up = (int8_t)(ramp->k_lacks - by);
    int8_t room = (int8_t)(64 - wide_bits(&ramp->k2_q16));
    ramp->k_lacks = 0;
    if (up > room) {
        ramp->k_lacks = (uint8_t)(up - room);
        up = room;
    }
    wide_shift(&ramp->k2_q16, (int8_t)-up);
}

/* As fine as they can be. */
static NOINLINE void choose_units(ramp_t *ramp)
{
    NEAR(ramp);
    uint8_t bits = wide_bits(&ramp->x);
    uint8_t bits_of_c = wide_bits(&ramp->c);
    if (bits < bits_of_c)
        bits = bits_of_c;
    int8_t by = (int8_t)((int8_t)(bits - 59) / 2);
    if (by == 0)
        return;
    scale_k(ramp, by);
    by = (int8_t)(2 * by);
    wide_shift(&ramp->x, by);
    wide_shift(&ramp->c, by);
    ramp->v = wide_root(&ramp->x);
}

static void begin_linear(ramp_t *ramp, const ramp_constants_t *constants, uint32_t k_by_128, uint32_t v_most,
                         uint32_t pulses)
{
    NEAR(ramp);
    wide_t *c = &ramp->c;
    wide_t *x = &ramp->x;
    wide_set(x, v_most);
    uint8_t scale = (uint8_t)(30 - wide_bits(x));
    scale_k(ramp, (int8_t)-scale);
    ramp->v <<= scale;
    uint8_t scale2 = (uint8_t)(2 * scale);
    uint32_t divisor = pulses;
    int8_t up = (int8_t)scale2;
    if (ramp->step) {
        wide_set(c, ramp->step);
        wide_multiply(c, LINEAR_SQUARE_Q15);
        divisor = constants->steps_per_rev;
        up = (int8_t)(scale2 - 15);
    } else {
        ramp_square(c, v_most);
    }
    divide_scaled(c, divisor, up);
    wide_copy(x, c);
    divide_scaled(x, k_by_128, (int8_t)(LINEAR_RATE_LOG2 - 14u - scale2));
    wide_divide(x, k_by_128);
    ramp->rate = wide_half(x, 0);
    uint8_t bits = wide_bits(x);
    uint8_t most_bits = (uint8_t)(LINEAR_STEEP_LOG2 - 6u + 2u * ramp->cycles_log2);
    ramp->steep = (uint8_t)((bits > most_bits) + (bits > (uint8_t)(most_bits + 6)));
    ramp_square(x, ramp->v);
    if (ramp->v == 0 && !ramp->faster) {
        wide_copy(x, c);
        wide_multiply(x, pulses); /* exactly to a standstill */
        ramp->v = wide_root(x);
    }
    choose_units(ramp);
}

/* 2 K / v2 */
static NOINLINE void set_interval(ramp_t *ramp, wide_t *interval_q16, uint32_t v2)
{
    NEAR(ramp);
    ramp_divide_k(interval_q16, &ramp->k2_q16, v2);
    wide_shift(interval_q16, (int8_t)-ramp->k_lacks);
    set_ticks(ramp, interval_q16);
}

NOINLINE void ramp_begin(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_most, uint32_t pulses)
{
    ramp->rest = false;
    ramp->bounded = false;
    ramp->run_pulses = 0;
    ramp->k_lacks = 0;
    ramp->least_run = 1;
    ramp->cycles_log2 = constants->cycles_log2;
    ramp->split_ticks = constants->split_ticks;
    ramp->group_log2 = ramp->most_log2 = GROUP_MAX_LOG2;
    wide_copy(&ramp->k2_q16, &constants->k2_q16);
    uint32_t k_by_128 = (uint32_t)wide_from_byte(&constants->k2_q16, 3);
    uint32_t first2;
    if (ramp->linear) {
        begin_linear(ramp, constants, k_by_128, v_most, pulses);
        first2 = 2 * ramp->v;
        if (first2 == 0)
            first2 = wide_root(&ramp->c);
    } else {
        uint32_t step = ramp->step;
        uint32_t steep = k_by_128 >> (10u - ramp->cycles_log2); /* K / 2^17; a third: 2^18.6 */
        ramp->steep = (uint8_t)((step > steep) + (3 * step > steep));
        wide_t *rate = &ramp->x;
        wide_set(rate, 0);
        wide_set_upper(rate, 2 * step);
        wide_divide(rate, k_by_128);
        ramp->rate = wide_half(rate, 1) ? UINT32_MAX : wide_half(rate, 0);
        first2 = 2 * (ramp->v < ramp->limit.cap ? ramp->v : ramp->limit.cap);
    }
    wide_t interval_q16;
    set_interval(ramp, &interval_q16, first2);
}

/* -- groups ------------------------------------------------------------------------------------------------------ */

/* By what part of its value, a power of two, the law's variable may change in a group. The parabola is off by no more than
 * 1/32 of the cube of that, of the interval: a 16,000th, or at less than 128 ticks a 2,000th. Steep ramps need groups that
 * last as long as it takes to plan them. */
static uint8_t part_log2(const ramp_t *ramp)
{
    return ramp->steep > 1 ? 1 : ramp->ticks < 128 ? 2 : 3;
}

/* How many pulses the next group has: a power of two whose change of the law's variable, of so much a pulse, and duration
 * are within the limits; where fewer are left, so many whole runs as before. Down from twice the last group's size, which is
 * nearly always enough. */
static NOINLINE uint16_t choose_group(ramp_t *ramp, uint16_t left)
{
    NEAR(ramp);
    uint16_t ticks = ramp->ticks;
    ramp->rest = false;
    if (ticks < ramp->split_ticks) {
        /* Where a few pulses could not be reloaded in time, the last run is of many. */
        if (left < 2 * REST_PULSES)
            ramp->rest = true;
        else
            left = (uint16_t)(left - REST_PULSES);
    }
    uint8_t log2 = ramp->group_log2;
    ramp->group_log2 = 0;
    if (ticks > GROUP_MAX_TICKS / 2)
        return 1; /* often, near a standstill */
    uint32_t change = ramp->step;
    uint32_t most_change = ramp->v;
    if (ramp->linear) {
        change = wide_half(&ramp->c, 1);
        most_change = 2 * wide_half(&ramp->x, 1);
    }
    if (ramp->bounded)
        change = 0;
    uint8_t part = part_log2(ramp);
    most_change >>= part;
    if (!ramp->faster) {
        ticks = (uint16_t)(ticks + (ticks >> part)); /* they grow, and the variable shrinks */
        most_change -= most_change >> 2;
    }
    if (++log2 > ramp->most_log2)
        log2 = ramp->most_log2;
    uint16_t most_ticks = ramp->steep > 1 ? GROUP_MAX_STEEP_TICKS : GROUP_MAX_TICKS;
    while (log2 && (ticks > most_ticks >> log2 || change > most_change >> log2))
        log2--;
    uint16_t pulses = (uint16_t)(1u << log2);
    ramp->group_log2 = log2;
    if (ramp->rest && left <= pulses)
        return left;
    if (left >= pulses)
        return pulses;
    if (ramp->run_pulses == 0 || (ramp->steep > 1 && left < ODD_GROUP_LEAST)) {
        while (pulses > left)
            pulses >>= 1;
        return pulses;
    }
    uint16_t odd = (uint16_t)(left & (ramp->run_pulses - 1u));
    if (odd == left)
        ramp->rest = true;
    else
        left = (uint16_t)(left - odd);
    return left;
}

/* The next group of a law: its pulses, and the interval at the mean of the velocities at both ends. */

static uint16_t harmonic_next(ramp_t *ramp, uint16_t left, wide_t *interval_q16)
{
    uint32_t v = ramp->v;
    uint32_t step = ramp->step;
    uint32_t cap = ramp->limit.cap;
    ramp->bounded = v > cap;
    if (ramp->bounded) {
        uint32_t above = (v - cap) / step + 1; /* so many pulses */
        if (above < left)
            left = (uint16_t)above;
    }
    uint16_t pulses = choose_group(ramp, left);
    if (!ramp->faster)
        step = 0u - step;
    uint32_t change = step * pulses;
    uint32_t v_end = v + change;
    ramp->v = v_end;
    set_interval(ramp, interval_q16, ramp->bounded ? 2 * cap : v + v_end - step);
    return pulses;
}

/* *change: of v^2. */
static uint16_t linear_next(ramp_t *ramp, uint16_t left, wide_t *interval_q16, wide_t *change)
{
    choose_units(ramp);
    uint16_t pulses = choose_group(ramp, left);
    wide_copy(change, &ramp->c);
    wide_multiply(change, pulses);
    wide_change(&ramp->x, change, ramp->faster);
    uint32_t v = ramp->v;
    ramp->v = wide_root(&ramp->x);
    set_interval(ramp, interval_q16, v + ramp->v + 1); /* roots are rounded down */
    return pulses;
}

/* -- both -------------------------------------------------------------------------------------------------------- */

uint16_t ramp_next(ramp_t *ramp, uint16_t left, ramp_time_t *sum, block_t *block)
{
    uint16_t pulses;
    group_t group;
    for (;;) {
        wide_t change;
        bool goes_on = false;
        if (!ramp->linear) {
            pulses = harmonic_next(ramp, left, &group.sum_q16);
        } else if (!ramp->bounded) {
            goes_on = true;
            pulses = linear_next(ramp, left, &group.sum_q16, &change);
            wide_copy(&group.end_q16, &group.sum_q16);
        } else {
            wide_copy(&group.sum_q16, &ramp->limit.bound_q16);
            set_ticks(ramp, &group.sum_q16);
            pulses = choose_group(ramp, left);
        }
        block->runs = 0;
        if (ramp->bounded)
            wide_multiply(&group.sum_q16, pulses);
        else if (pulses > 1)
            group_plan(ramp, &group, block, pulses);
        if (!goes_on)
            break;
        wide_subtract(&group.end_q16, &ramp->limit.bound_q16);
        if (wide_is_negative(&group.end_q16) != ramp->faster)
            break;
        /* Beyond the limit: fewer pulses. */
        wide_change(&ramp->x, &change, !ramp->faster);
        ramp->v = wide_root(&ramp->x);
        if (pulses > 1) {
            ramp->most_log2 = (uint8_t)(ramp->group_log2 - 1);
        } else {
            /* All that is left: equal intervals, from this one on. */
            ramp->most_log2 = GROUP_MAX_LOG2;
            ramp->bounded = true;
            left = 1;
        }
    }
    if (ramp->bounded)
        ramp->rest = false;
    if (block->runs)
        ramp->run_pulses = block->pulses;
    wide_copy(&sum->q16, &group.sum_q16);
    return pulses;
}
#endif

NOINLINE uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    wide_t v2_q16;
    ramp_divide_k(&v2_q16, &constants->k2_q16, ticks);
    return ((uint32_t)wide_from_byte(&v2_q16, 2) + 1) >> 1;
}
