/* See ramp.h and docs/design.md. All arithmetic is in integers.
 * Harmonic: the interval in a group's middle, by a division; the law's series around it gives the sum.
 * Linear: the time from standstill at a group's end, by a root. Differences of such times do not drift.
 * How much the law's variable changes in the group, as a part of its value, gives the shape of either. */
#include "motion/ramp.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/wide.h"
#include "motion/block.h"
#include <string.h>

#define GROUP_MAX_LOG2 9u
#define RUN_MAX_PULSES 128u
#define ODD_GROUP_LEAST 16u /* pulses of a group that are not a power of two */
#define REST_PULSES 64u /* the least that is left for a fast ramp's last run */
#define GROUP_MAX_TICKS 60000u /* below 65,536 also where it grows more than expected ... */
#define GROUP_MAX_STEEP_TICKS 49152u /* ... by up to a third, in a steep ramp */
#define STEEP_BITS 36u /* of C: first intervals below 16,384 ticks */
/* Runs: the interrupt's cycles for two segments, the planner's, and as much for others; and those of each pulse. */
#define RUN_TICKS 500u
#define RUN_PULSE_TICKS 24u
#define RUN_SLOPE_Q8 496u /* change of the interval within a run */

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev)
{
    constants->k2_q16 = 96000000000u * 131072u;
    wide_divide(&constants->k2_q16, steps_per_rev);
}

void ramp_multiply(wide_t *x, uint32_t factor)
{
    wide_t wide_factor = factor;
    wide_t product;
    wide_multiply(&product, &wide_factor, x); /* the shorter one first: faster */
    wide_copy(x, &product);
}

uint32_t ramp_scale(uint32_t a, uint32_t b, uint32_t divisor)
{
    wide_t product = a;
    ramp_multiply(&product, b);
    wide_divide(&product, divisor);
    return (uint32_t)product;
}

static NOINLINE void divide_k(wide_t *quotient, const ramp_constants_t *constants, uint32_t divisor)
{
    wide_copy(quotient, &constants->k2_q16);
    wide_divide(quotient, divisor);
}

/* Of ticks in 1/65536. */
static void set_time(ramp_time_t *time, const wide_t *q16)
{
    time->ticks = (uint32_t)wide_from_byte(q16, 2);
    time->frac_q16 = (uint16_t)*q16;
}

ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v)
{
    wide_t q16;
    divide_k(&q16, constants, 2 * v);
    ramp_time_t time;
    set_time(&time, &q16);
    return time;
}

uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    wide_t v2_q16;
    divide_k(&v2_q16, constants, ticks);
    return ((uint32_t)wide_from_byte(&v2_q16, 2) + 1) >> 1;
}

/* The interval, in 1/65536, to choose the next group by. */
static NOINLINE void set_ticks(ramp_t *ramp, const wide_t *q16)
{
    uint32_t ticks = (uint32_t)wide_from_byte(q16, 2);
    ramp->ticks = ticks > UINT16_MAX ? UINT16_MAX : (uint16_t)ticks;
}

/* A new ramp: all 0 but this. */
static NOINLINE void begin(ramp_t *ramp, bool linear, bool faster)
{
    memset(ramp, 0, sizeof *ramp);
    ramp->linear = linear;
    ramp->faster = faster;
    ramp->group_log2 = ramp->most_log2 = GROUP_MAX_LOG2;
}

/* -- groups ------------------------------------------------------------------------------------------------------ */

/* 2^32 * part / whole / 2^halved. The result is below 2^32. */
static NOINLINE uint32_t ratio_q32(uint32_t part, uint8_t halved, uint32_t whole)
{
    wide_t quotient = (wide_t)part << 32;
    wide_shift(&quotient, halved);
    wide_divide(&quotient, whole);
    return wide_half(&quotient, 0);
}

/* By what part of its value, a power of two, the law's variable may change in a group. The parabola is off by no more than
 * 1/32 of the cube of that, of the interval: a 16,000th, or at less than 128 ticks a 2,000th. Steep ramps need groups that
 * last as long as it takes to plan them. */
static NOINLINE uint8_t part_log2(const ramp_t *ramp)
{
    return ramp->steep > 1 ? 1 : ramp->ticks < 128 ? 2 : 3;
}

static uint8_t floor_log2(uint16_t n)
{
    uint8_t log2 = 0;
    while (n >>= 1)
        log2++;
    return log2;
}

/* How many pulses the next group has: a power of two whose change, of so much a pulse, and duration are within the limits;
 * where fewer are left, so many whole runs as before. Down from twice the last group's size, which is nearly always enough. */
static NOINLINE uint16_t choose_group(ramp_t *ramp, uint32_t change, uint32_t most_change, uint16_t left)
{
    uint16_t ticks = ramp->ticks;
    ramp->rest = false;
    if (ticks < BLOCK_SPLIT_TICKS) {
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
    if (!ramp->faster) {
        ticks = (uint16_t)(ticks + (ticks >> part_log2(ramp))); /* they grow, and the variable shrinks */
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

/* The shape of a group of intervals with this mean: as those of the law, whose variable changes by part / 2^32 of its
 * value in the group's middle. Returns mean * part^2; *third_q16: the change of that. */
static uint32_t shape(block_t *group, uint32_t *third_q16, uint32_t mean_q16, uint32_t part)
{
    uint32_t slope = wide_fraction(mean_q16, part);
    uint32_t curve = wide_fraction(slope, part);
    group->slope_q16 = (int32_t)slope;
    *third_q16 = wide_fraction(curve, part);
    group->runs = 1; /* to be divided */
    return curve;
}

/* Intervals that are all alike: how many of those left, and their sum. */
static NOINLINE uint16_t flat(ramp_t *ramp, uint16_t left, const wide_t *interval_q16, wide_t *sum_q16)
{
    set_ticks(ramp, interval_q16);
    uint16_t pulses = choose_group(ramp, 0, 0, left);
    ramp->rest = false;
    wide_copy(sum_q16, interval_q16);
    ramp_multiply(sum_q16, pulses);
    return pulses;
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    begin(ramp, false, faster);
    ramp->u.harmonic.next2 = 2 * v_first;
    ramp->u.harmonic.cap2 = 2 * v_cap;
    ramp->u.harmonic.step2 = 2 * step;
    uint32_t k_by_128 = (uint32_t)wide_from_byte(&constants->k2_q16, 3);
    uint32_t steep = k_by_128 >> 10; /* K / 2^17; a third: 2^18.6 */
    ramp->steep = (uint8_t)((step > steep) + (3 * step > steep));
    ramp->u.harmonic.step_q40 = step < k_by_128 >> 1 ? ratio_q32(2 * step, 0, k_by_128) : UINT32_MAX;
    wide_t interval_q16;
    divide_k(&interval_q16, constants, 2 * (v_first < v_cap ? v_first : v_cap));
    set_ticks(ramp, &interval_q16);
}

/* The mean of 1 / (1 + x) over n pulses, x from -p / 2 to p / 2 (not quite: at the pulses), is nearly 1 + second * p^2 /
 * (1 - fourth * p^2), in 1 / 2^16: all of it for n = 2 and 3, up to p^4 for others. For n = 2 to 8, and roughly for those
 * from 8, 16, 32 and 64 on. */
typedef struct {
    uint16_t second, fourth;
} series_t;
#define SERIES(n) \
    {(uint16_t)(65536.0 / 12 * (1 - 1.0 / (n) / (n)) + 0.5), (uint16_t)(65536.0 * 3 / 20 * (1 - 7.0 / 3 / (n) / (n)) + 0.5)}
static const series_t series_of[] FLASH = {SERIES(2.0), SERIES(3.0), SERIES(4.0),  SERIES(5.0),  SERIES(6.0),
                                           SERIES(7.0), SERIES(8.0), SERIES(16.0), SERIES(32.0), SERIES(1e9)};

static uint32_t series(uint16_t pulses)
{
    uint8_t place = 6;
    if (pulses < 8)
        place = (uint8_t)(pulses - 2);
    for (; place < 9 && pulses >= 16; place++)
        pulses >>= 1;
    return flash_u32(&series_of[place]);
}

static uint16_t harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint16_t left, wide_t *sum_q16, block_t *group,
                             uint32_t *third_q16)
{
    uint32_t first2 = ramp->u.harmonic.next2;
    uint32_t cap2 = ramp->u.harmonic.cap2;
    uint32_t step2 = ramp->u.harmonic.step2;
    uint16_t pulses;
    if (first2 > cap2) {
        wide_t interval_q16;
        divide_k(&interval_q16, constants, cap2);
        if (!ramp->faster) {
            uint32_t above = (first2 - cap2) / step2 + 1; /* so many pulses */
            if (above < left)
                left = (uint16_t)above;
        }
        pulses = flat(ramp, left, &interval_q16, sum_q16);
        if (!ramp->faster)
            ramp->u.harmonic.next2 -= step2 * pulses;
        return pulses;
    }
    pulses = choose_group(ramp, step2, first2 >> part_log2(ramp), left);
    uint32_t change2 = step2 * pulses;
    uint32_t to_centre2 = (change2 - step2) >> 1;
    if (!ramp->faster) {
        change2 = 0u - change2;
        to_centre2 = 0u - to_centre2;
    }
    ramp->u.harmonic.next2 = first2 + change2;
    divide_k(sum_q16, constants, first2 + to_centre2);
    if (pulses > 1) {
        uint32_t mean = wide_half(sum_q16, 0);
        uint32_t part = wide_fraction(mean * pulses, ramp->u.harmonic.step_q40) << 8;
        uint32_t curve = shape(group, third_q16, mean, part);
        group->curve_q16 = (int32_t)(2 * curve);
        uint32_t factors = series(pulses);
        uint32_t term = curve;
        for (uint8_t terms = ramp->steep > 1 ? 2 : 1; terms; terms--) {
            term = wide_fraction(wide_fraction(wide_fraction(term, part), part), factors & 0xFFFF0000u);
            curve += term;
        }
        mean += wide_fraction(curve, factors << 16);
        group->top_q16 = mean;
        *sum_q16 = mean * pulses;
    }
    return pulses;
}

/* -- linear ------------------------------------------------------------------------------------------------------ */

void ramp_linear_c(wide_t *c_q8, uint16_t steps_per_rev, uint8_t factor_log2, uint32_t accel_centi)
{
    /* 2 * alpha / accel in ticks^2 * 256 = 2 * (2 pi / (sprf * F)) / (centi / 100) * (16e6)^2 * 256
     *                                    = 8.23549664645790755e19 / (sprf * F * centi); an eighth of it fits 64 bits. */
    *c_q8 = 10294370808072384000u;
    wide_divide(c_q8, steps_per_rev);
    wide_divide(c_q8, accel_centi);
    for (uint8_t i = 0; i < 3; i++)
        wide_add(c_q8, c_q8);
    wide_shift(c_q8, factor_log2);
}

/* sum +- x */
static void add_if(wide_t *sum, const wide_t *x, bool add)
{
    if (add)
        wide_add(sum, x);
    else
        wide_subtract(sum, x);
}

/* Units as fine as they can be: t below 2^30, and still below 2^31 after the next group. */
static NOINLINE void choose_units(ramp_t *ramp)
{
    NEAR(ramp);
    wide_t *x = &ramp->u.linear.x;
    wide_t *c = &ramp->u.linear.c;
    for (;;) {
        uint8_t bits = wide_bits(x);
        if (bits > 60) {
            wide_shift(x, 2);
            wide_shift(c, 2);
            ramp->u.linear.halved++;
        } else if (bits < 58 && ramp->u.linear.halved) {
            for (uint8_t i = 0; i < 2; i++) {
                wide_add(x, x);
                wide_add(c, c);
            }
            ramp->u.linear.halved--;
        } else {
            return;
        }
        ramp->u.linear.t = wide_root(x);
    }
}

/* Takes the ramp so many squares of time further, or back: by 1/16 ticks, modulo 2^32. */
static NOINLINE uint32_t advance(ramp_t *ramp, const wide_t *squares, bool forward)
{
    NEAR(ramp);
    uint8_t halved = ramp->u.linear.halved;
    uint32_t before = ramp->u.linear.t;
    bool faster = ramp->faster == forward;
    add_if(&ramp->u.linear.x, squares, faster);
    uint32_t after = wide_root(&ramp->u.linear.x);
    ramp->u.linear.t = after;
    if (halved == 0)
        return faster ? after - before : before - after;
    /* Units are coarser than that: what x changes by, over the sum of both times. */
    wide_t change;
    wide_copy(&change, squares);
    do
        wide_add(&change, &change);
    while (--halved);
    wide_t rest = ramp->u.linear.rest;
    wide_add(&change, &rest);
    ramp->u.linear.rest = wide_divide(&change, before + after + 1); /* roots are rounded down */
    return (uint32_t)change;
}

/* From 1/16. */
static NOINLINE void set_q4(wide_t *ticks_q16, uint32_t ticks_q4)
{
    *ticks_q16 = (wide_t)ticks_q4 << 16;
    wide_shift(ticks_q16, 4);
}

void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, uint32_t pulses, bool faster,
                       ramp_time_t bound)
{
    begin(ramp, true, faster);
    ramp->u.linear.bound_q16 = (wide_t)bound.ticks << 16 | bound.frac_q16;
    wide_t *x = &ramp->u.linear.x;
    wide_t *c = &ramp->u.linear.c;
    wide_t n = pulses;
    wide_t t;
    wide_copy(&t, t_q4);
    wide_copy(c, c_q8);
    uint8_t bits_of_c = wide_bits(c);
    uint8_t bits = (uint8_t)(2 * wide_bits(&t));
    bool standstill = bits == 0;
    if (standstill && !faster)
        bits = (uint8_t)(bits_of_c + wide_bits(&n));
    uint8_t halved = bits > 62 ? (uint8_t)(bits - 61) / 2 : 0; /* x needs 64 bits at most */
    ramp->u.linear.halved = halved;
    wide_shift(c, (uint8_t)(2 * halved));
    wide_shift(&t, halved);
    if (!standstill)
        wide_multiply(x, &t, &t);
    else if (!faster)
        wide_multiply(x, &n, c); /* exactly to it */
    ramp->u.linear.t = wide_root(x);
    choose_units(ramp);
    ramp->steep = bits_of_c <= STEEP_BITS ? 2 : bits_of_c <= STEEP_BITS + 6;
    /* The first interval, to choose the first group's size. */
    wide_t interval_q16;
    set_q4(&interval_q16, advance(ramp, c, true));
    set_ticks(ramp, &interval_q16);
    advance(ramp, c, false);
}

static uint16_t linear_next(ramp_t *ramp, uint16_t left, wide_t *sum_q16, block_t *group,
                             uint32_t *third_q16)
{
    const wide_t *bound_q16 = &ramp->u.linear.bound_q16;
    if (ramp->u.linear.bounded)
        return flat(ramp, left, bound_q16, sum_q16);
    bool faster = ramp->faster;
    for (;;) {
        choose_units(ramp);
        uint32_t begin = ramp->u.linear.t;
        uint8_t halved = ramp->u.linear.halved;
        uint16_t pulses = choose_group(ramp, (uint32_t)ramp->ticks >> halved, begin >> 4 >> part_log2(ramp), left);
        wide_t change;
        wide_copy(&change, &ramp->u.linear.c);
        ramp_multiply(&change, pulses);
        uint32_t ticks_q4 = advance(ramp, &change, true);
        set_q4(sum_q16, ticks_q4);
        wide_t last_q16;
        wide_copy(&last_q16, sum_q16);
        if (pulses > 1) {
            uint32_t mean = wide_half(sum_q16, 0);
            mean = pulses & (pulses - 1u) ? mean / pulses : mean >> floor_log2(pulses);
            group->curve_q16 = (int32_t)(3 * shape(group, third_q16, mean, ratio_q32(ticks_q4, halved, (begin + ramp->u.linear.t) >> 1)));
            group->top_q16 = mean;
            uint32_t half = (uint32_t)group->slope_q16 >> 1;
            last_q16 = faster ? mean - half : mean + half;
        }
        wide_subtract(&last_q16, bound_q16);
        if (wide_is_negative(&last_q16) != faster)
            return pulses;
        /* The bound is reached in it: less. */
        if (pulses == 1)
            break;
        ramp->most_log2 = (uint8_t)(ramp->group_log2 - 1);
        advance(ramp, &change, false);
    }
    ramp->u.linear.bounded = true;
    ramp->most_log2 = GROUP_MAX_LOG2;
    wide_copy(sum_q16, bound_q16);
    return 1;
}

/* -- both -------------------------------------------------------------------------------------------------------- */

/* Divides a group, given by its mean and the law's derivatives in its middle, into runs. */
static void divide(ramp_t *ramp, uint16_t pulses, block_t *group, uint32_t third_q16)
{
    uint8_t run = 1;
    uint16_t runs = pulses;
    while ((runs & 1) == 0 && run < RUN_MAX_PULSES) {
        runs >>= 1;
        run = (uint8_t)(run << 1);
    }
    uint8_t odd = (uint8_t)runs;
    uint32_t slope = (uint32_t)group->slope_q16;
    uint32_t curve = (uint32_t)group->curve_q16;
    /* How many pulses may share one or two timer values. */
    uint16_t ticks = ramp->ticks;
    uint8_t halvings = 0;
    if (ticks > RUN_PULSE_TICKS) {
        uint16_t slope_q8 = slope < 1UL << 24 ? (uint16_t)(slope >> 8) : UINT16_MAX;
        uint16_t span = (uint16_t)((ticks - RUN_PULSE_TICKS) * run);
        uint16_t least = (uint16_t)(2 * RUN_TICKS + 2 * RUN_TICKS * ramp->steep);
        uint16_t most = ticks < BLOCK_SPLIT_TICKS ? RUN_SLOPE_Q8 / 4 : RUN_SLOPE_Q8;
        if (odd > 1)
            slope_q8 = (uint16_t)(slope_q8 / odd);
        while (run > 1 && slope_q8 > most && span >= least) {
            halvings++;
            run >>= 1;
            slope_q8 >>= 1;
            span >>= 1;
        }
    }
    ramp->run_pulses = run;
    group->pulses = run;
    odd = (uint8_t)(odd << halvings);
    group->runs = odd;
    /* The cubic part: so that two and four runs are right, and of more all nearly. */
    uint8_t cubic_q8 = odd == 2 ? 16 : odd == 4 ? 36 : 48;
    slope += wide_fraction(third_q16, (uint32_t)cubic_q8 << 24);
    if (runs > 1) {
        uint32_t part = ratio_q32(1, 0, runs);
        slope = wide_fraction(slope, part);
        curve = wide_fraction(wide_fraction(curve, part), part);
    }
    slope >>= halvings;
    curve >>= 2 * halvings;
    /* From the law's to the differences of the runs. */
    uint8_t steps = (uint8_t)(odd - 1);
    uint32_t sum = curve * steps;
    uint32_t bend = sum - curve;
    slope = ramp->faster ? 0u - slope : slope;
    slope -= (uint32_t)((int32_t)bend >> 1);
    group->slope_q16 = (int32_t)slope;
    group->curve_q16 = (int32_t)curve;
    group->top_q16 -= 65536u + wide_fraction(bend * steps, 715827883u) + (uint32_t)((int32_t)(slope * steps) >> 1); /* 2^32 / 6 */
}

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum, block_t *group)
{
    wide_t sum_q16;
    uint32_t third_q16;
    group->runs = 0;
    uint16_t few = left > 4u << GROUP_MAX_LOG2 ? 4u << GROUP_MAX_LOG2 : (uint16_t)left;
    uint16_t pulses = ramp->linear ? linear_next(ramp, few, &sum_q16, group, &third_q16) : harmonic_next(ramp, constants, few, &sum_q16, group, &third_q16);
    set_time(sum, &sum_q16);
    bool shaped = group->runs != 0;
    group->runs = 0;
    if (pulses == 1) {
        set_ticks(ramp, &sum_q16);
    } else if (shaped) {
        ramp->ticks = (uint16_t)(group->top_q16 >> 16);
        if (!ramp->rest && (ramp->ticks >= BLOCK_SPLIT_TICKS || pulses >= 8))
            divide(ramp, pulses, group, third_q16);
    }
    return pulses;
}
