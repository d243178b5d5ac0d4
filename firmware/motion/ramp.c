/* See ramp.h and docs/design.md. All arithmetic is in integers.
 * Harmonic: the interval in a group's middle, by a division; the law's series around it gives the sum.
 * Linear: the time from standstill at a group's end, by a root. Differences of such times do not drift.
 * How much the law's variable changes in the group, as a part of its value, gives the shape of either. */
#include "motion/ramp.h"
#include "base/inline.h"
#include "base/wide.h"
#include "motion/block.h"
#include <string.h>

#define GROUP_MAX_LOG2 9u
#define RUN_MAX_LOG2 7u
#define ALIGN_TICKS 600u /* from here on there is time for small groups */
#define GROUP_MAX_TICKS 49152u /* so that 32 bits hold their sum, and a command can be cut soon */
#define STEEP_BITS 36u /* of C: first intervals below 16,384 ticks */
/* Runs: the interrupt's cycles for two segments, the planner's, and as much for others; and those of each pulse. */
#define RUN_TICKS 500u
#define RUN_STEEP_TICKS 1500u /* of steep ramps, where every segment counts */
#define RUN_PULSE_TICKS 24u
#define RUN_SLOPE_Q8 496u /* change of the interval within a run */

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev)
{
    constants->k2_q16 = 96000000000u * 131072u;
    wide_divide(&constants->k2_q16, steps_per_rev);
}

uint32_t ramp_scale(uint32_t a, uint32_t b, uint32_t divisor)
{
    wide_t wide_a = a;
    wide_t wide_b = b;
    wide_t product;
    wide_multiply(&product, &wide_a, &wide_b);
    wide_divide(&product, divisor);
    return (uint32_t)product;
}

static NOINLINE void divide_k(wide_t *quotient, const ramp_constants_t *constants, uint32_t divisor)
{
    wide_copy(quotient, &constants->k2_q16);
    wide_divide(quotient, divisor);
}

/* The interval at half of v2. */
static NOINLINE ramp_time_t interval_at_twice(const ramp_constants_t *constants, uint32_t v2)
{
    wide_t q16;
    divide_k(&q16, constants, v2);
    ramp_time_t t;
    t.ticks = (uint32_t)wide_from_byte(&q16, 2);
    t.frac_q16 = (uint16_t)q16;
    return t;
}

ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v)
{
    return interval_at_twice(constants, 2 * v);
}

uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    wide_t v2_q16;
    divide_k(&v2_q16, constants, ticks);
    return ((uint32_t)wide_from_byte(&v2_q16, 2) + 1) >> 1;
}

static NOINLINE uint32_t magnitude(int32_t x)
{
    return x < 0 ? 0u - (uint32_t)x : (uint32_t)x;
}

static void set_q16(ramp_time_t *time, uint32_t q16)
{
    time->ticks = q16 >> 16;
    time->frac_q16 = (uint16_t)q16;
}

static NOINLINE void set_ticks(ramp_t *ramp, uint32_t ticks)
{
    ramp->ticks = ticks > UINT16_MAX ? UINT16_MAX : (uint16_t)ticks;
}

/* A new ramp: all 0 but this. */
static void begin(ramp_t *ramp, bool linear, bool faster)
{
    memset(ramp, 0, sizeof *ramp);
    ramp->linear = linear;
    ramp->faster = faster;
    ramp->most_log2 = GROUP_MAX_LOG2;
}

/* -- groups ------------------------------------------------------------------------------------------------------ */

/* 2^24 * part / whole. part < whole. */
static NOINLINE uint32_t ratio_q24(uint32_t part, uint8_t part_shift, uint32_t whole)
{
    wide_t quotient = (wide_t)part << 24;
    wide_shift(&quotient, part_shift);
    wide_divide(&quotient, whole);
    return wide_half(&quotient, 0);
}

/* By what power of two the law's variable may change in a group, so that the parabola stays within a tenth of a tick of
 * the law. Steep ramps need groups that last as long as it takes to plan them. */
static uint8_t part_log2(const ramp_t *ramp)
{
    uint16_t ticks = ramp->ticks;
    return ramp->steep || ticks < 128 ? 2 : ticks < 1024 ? 3 : ticks < 4096 ? 4 : 5;
}

/* The next group's size: a power of two whose change, of so much a pulse, and duration are within the limits. From the
 * last group's on, because that is nearly always it. */
static NOINLINE void choose_group(ramp_t *ramp, uint32_t change, uint32_t most_change, uint32_t left)
{
    uint8_t log2 = ramp->group_log2;
    uint32_t ticks = ramp->ticks;
    if (!ramp->faster)
        ticks += ticks >> 2; /* they grow */
    change <<= log2;
    ticks <<= log2;
    while (log2 && (change > most_change || ticks > GROUP_MAX_TICKS || left >> log2 == 0)) {
        change >>= 1;
        ticks >>= 1;
        log2--;
    }
    /* Speeding up, groups are made larger where the pulses left can be divided by it: small groups then come while there
     * is time for them, not at the ramp's end. */
    uint16_t align = ramp->faster && ramp->ticks >= ALIGN_TICKS ? (uint16_t)left : 0;
    while (log2 < ramp->most_log2 && 2 * change <= most_change && 2 * ticks <= GROUP_MAX_TICKS && left >> log2 > 1 &&
           (align & ((2u << log2) - 1)) == 0) {
        change *= 2;
        ticks *= 2;
        log2++;
    }
    ramp->group_log2 = log2;
}

/* The intervals of a group whose mean is mean_q16: as those of the law, whose variable changes by part / 2^32 of its
 * value in the group's middle. Returns mean * part^2. */
static uint32_t shape(ramp_t *ramp, uint32_t mean_q16, uint32_t part)
{
    uint32_t slope = wide_fraction(mean_q16, part);
    uint32_t curve = wide_fraction(slope, part);
    slope += wide_fraction(curve, part) >> 2; /* from end to end */
    ramp->slope_q16 = (int32_t)(ramp->faster ? 0u - slope : slope);
    ramp->shaped = true;
    return curve;
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    begin(ramp, false, faster);
    ramp->u.harmonic.next2 = 2 * v_first;
    ramp->u.harmonic.cap2 = 2 * v_cap;
    ramp->u.harmonic.step2 = 2 * step;
    ramp->steep = step > (uint32_t)wide_from_byte(&constants->k2_q16, 3) >> 10; /* K / 2^17 */
    set_ticks(ramp, interval_at_twice(constants, 2 * (v_first < v_cap ? v_first : v_cap)).ticks);
}

static void harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    uint32_t first2 = ramp->u.harmonic.next2;
    uint32_t cap2 = ramp->u.harmonic.cap2;
    uint32_t step2 = ramp->u.harmonic.step2;
    bool capped = first2 > cap2;
    choose_group(ramp, step2, capped ? first2 - cap2 : first2 >> part_log2(ramp), left);
    uint8_t log2 = ramp->group_log2;
    uint32_t change2 = step2 << log2;
    uint32_t to_centre2 = (change2 - step2) >> 1;
    uint32_t centre2 = ramp->faster ? first2 + to_centre2 : first2 - to_centre2;
    ramp->u.harmonic.next2 = ramp->faster ? first2 + change2 : first2 - change2;
    if (capped) {
        centre2 = cap2;
        change2 = 0;
    }
    *sum = interval_at_twice(constants, centre2);
    if (log2) {
        uint32_t mean = sum->ticks << 16 | sum->frac_q16;
        uint32_t part = ratio_q24(change2, 0, centre2) << 8;
        uint32_t curve = shape(ramp, mean, part);
        /* The mean of 1 / (1 + x) over the pulses, x from -part / 2 to part / 2, n of them:
         * 1 + (1 - 1 / n^2) / 12 * (part^2 + 3 / 20 * part^4 * (1 - 7 / 3 n^2)) */
        uint32_t sum2 = (wide_fraction(wide_fraction(curve, part), part) * 19) >> 7;
        sum2 += curve - ((sum2 * 37 >> 4) >> log2 >> log2);
        mean += wide_fraction(sum2 - (sum2 >> log2 >> log2), 357913941u); /* 2^32 / 12 */
        ramp->curve_q16 = (int32_t)(2 * curve);
        set_q16(sum, mean << log2);
    }
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

/* The time from standstill at a pulse: the root of x, and 16 bits more where units are coarse. */
static void root_at(const ramp_t *ramp, ramp_root_t *t)
{
    t->whole = wide_root(&ramp->u.linear.x);
    t->frac_q16 = 0;
    if (ramp->u.linear.halved) {
        /* x - t^2 over 2 t */
        wide_t whole = t->whole;
        wide_t square;
        wide_multiply(&square, &whole, &whole);
        wide_t rest;
        wide_copy(&rest, &ramp->u.linear.x);
        wide_subtract(&rest, &square);
        rest <<= 15;
        if (t->whole) {
            wide_divide(&rest, t->whole);
            t->frac_q16 = (uint16_t)rest;
        }
    }
}

/* In 1/16 ticks, modulo 2^32. */
static NOINLINE uint32_t in_q4(const ramp_t *ramp, const ramp_root_t *t)
{
    uint8_t halved = ramp->u.linear.halved;
    uint32_t frac = t->frac_q16;
    return (t->whole << halved) + (halved > 16 ? frac << (halved - 16) : frac >> (16 - halved));
}

/* Ticks in 1/16 from one to the other. */
static uint32_t between(const ramp_t *ramp, const ramp_root_t *from, const ramp_root_t *to)
{
    uint32_t ticks_q4 = in_q4(ramp, to) - in_q4(ramp, from);
    return ramp->faster ? ticks_q4 : 0u - ticks_q4;
}

void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, uint32_t pulses, bool faster,
                       ramp_time_t bound)
{
    begin(ramp, true, faster);
    ramp->u.linear.bound = bound;
    wide_t *x = &ramp->u.linear.x;
    wide_t *c = &ramp->u.linear.c;
    wide_t n = pulses;
    wide_t t;
    wide_copy(&t, t_q4);
    wide_copy(c, c_q8);
    /* In units that let t^2 fit 64 bits to the end. */
    uint8_t bits = (uint8_t)(wide_bits(c) + wide_bits(&n));
    uint8_t start_bits = (uint8_t)(2 * wide_bits(&t));
    if (start_bits > bits)
        bits = start_bits;
    uint8_t halved = bits > 62 ? (uint8_t)(bits - 61) / 2 : 0;
    ramp->u.linear.halved = halved;
    wide_shift(c, (uint8_t)(2 * halved));
    wide_shift(&t, halved);
    if (start_bits) {
        wide_multiply(x, &t, &t);
        if (halved) {
            /* 2 t times what was shifted out */
            n = wide_half(t_q4, 0) & ((1UL << halved) - 1);
            wide_t part;
            wide_multiply(&part, &n, &t);
            wide_shift(&part, (uint8_t)(halved - 1));
            wide_add(x, &part);
        }
    } else if (!faster) {
        wide_multiply(x, &n, c); /* to standstill, exactly */
    }
    root_at(ramp, &ramp->u.linear.t);
    ramp->steep = wide_bits(c_q8) <= STEEP_BITS;
    /* The first interval, to choose the first group's size. */
    wide_copy(&t, x);
    add_if(x, c, faster);
    ramp_root_t next;
    root_at(ramp, &next);
    wide_copy(x, &t);
    set_ticks(ramp, between(ramp, &ramp->u.linear.t, &next) >> 4);
}

/* Beyond the bound all intervals are equal. */
static void bounded_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    const ramp_time_t *bound = &ramp->u.linear.bound;
    set_ticks(ramp, bound->ticks);
    choose_group(ramp, 0, 0, left);
    uint8_t log2 = ramp->group_log2;
    uint32_t frac = (uint32_t)bound->frac_q16 << log2;
    sum->ticks = (bound->ticks << log2) + (frac >> 16);
    sum->frac_q16 = (uint16_t)frac;
    ramp->slope_q16 = 0;
    ramp->curve_q16 = 0;
    ramp->shaped = log2 != 0;
}

static bool is_longer(const ramp_time_t *a, const ramp_time_t *b)
{
    return a->ticks > b->ticks || (a->ticks == b->ticks && a->frac_q16 > b->frac_q16);
}

static void linear_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    if (ramp->u.linear.bounded) {
        bounded_next(ramp, left, sum);
        return;
    }
    bool faster = ramp->faster;
    uint8_t halved = ramp->u.linear.halved;
    const ramp_time_t *bound = &ramp->u.linear.bound;
    ramp_root_t begin = ramp->u.linear.t;
    uint32_t limit = begin.whole;
    limit = limit >> (31 - halved) ? GROUP_MAX_TICKS : limit << halved >> 4 >> part_log2(ramp);
    choose_group(ramp, ramp->ticks, limit, left);
    wide_t x;
    wide_copy(&x, &ramp->u.linear.x);
    for (;;) {
        uint8_t log2 = ramp->group_log2;
        wide_t n = (uint16_t)(1u << log2);
        wide_t change;
        wide_multiply(&change, &n, &ramp->u.linear.c);
        add_if(&ramp->u.linear.x, &change, faster);
        ramp_root_t *end = &ramp->u.linear.t;
        root_at(ramp, end);
        uint32_t ticks_q4 = between(ramp, &begin, end);
        sum->ticks = ticks_q4 >> 4;
        sum->frac_q16 = (uint16_t)(ticks_q4 << 12);
        ramp_time_t last = *sum;
        if (log2) {
            uint32_t mean = ticks_q4 << (12 - log2);
            ramp->curve_q16 =
                (int32_t)(3 * shape(ramp, mean, ratio_q24(ticks_q4, halved, (begin.whole >> 1) + (end->whole >> 1)) << 8));
            set_q16(&last, mean + (uint32_t)(ramp->slope_q16 >> 1));
        }
        if (faster ? !is_longer(bound, &last) : !is_longer(&last, bound))
            return;
        /* The bound is reached in it: half of it. */
        if (log2 == 0)
            break;
        ramp->most_log2 = --ramp->group_log2;
        wide_copy(&ramp->u.linear.x, &x);
    }
    ramp->u.linear.bounded = true;
    ramp->most_log2 = GROUP_MAX_LOG2;
    *sum = *bound;
}

/* -- both -------------------------------------------------------------------------------------------------------- */

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    ramp->shaped = false;
    if (ramp->linear)
        linear_next(ramp, left, sum);
    else
        harmonic_next(ramp, constants, left, sum);
    uint8_t log2 = ramp->group_log2;
    set_ticks(ramp, sum->ticks >> log2);
    uint16_t ticks = ramp->ticks;
    ramp->run_log2 = log2;
    if (ticks < BLOCK_SPLIT_TICKS && log2 < 3)
        ramp->shaped = false;
    if (ramp->shaped && ticks > RUN_PULSE_TICKS) {
        /* How many pulses may share one or two timer values. */
        uint32_t slope_q8 = magnitude(ramp->slope_q16) >> 8;
        uint32_t span = (uint32_t)(ticks - RUN_PULSE_TICKS) << log2;
        uint16_t least = ramp->steep ? 2 * RUN_STEEP_TICKS : 2 * RUN_TICKS;
        uint16_t most = ticks < BLOCK_SPLIT_TICKS ? RUN_SLOPE_Q8 / 4 : RUN_SLOPE_Q8;
        while (ramp->run_log2 > RUN_MAX_LOG2 || (ramp->run_log2 && slope_q8 > most && span >= least)) {
            ramp->run_log2--;
            slope_q8 /= 2;
            span /= 2;
        }
    }
    return (uint16_t)(1u << log2);
}
