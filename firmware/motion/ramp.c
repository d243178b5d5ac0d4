/* See ramp.h and docs/design.md. All arithmetic is in integers.
 * Harmonic: the interval at both ends of a group and in its middle, each by a division; the parabola through them gives
 * the sum and the shape.
 * Linear: the time from standstill at a group's beginning, middle and end, each by a root. Differences of such times do
 * not drift. */
#include "motion/ramp.h"
#include "base/inline.h"
#include "base/wide.h"
#include "motion/block.h"
#include <string.h>

#define GROUP_MAX_LOG2 9u
#define RUN_MAX_LOG2 7u
#define ALIGN_TICKS 600u /* from here on there is time for small groups */
#define LONG_TICKS 4096u /* groups are half as wide, so that the parabola is within a tenth of a tick */
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

/* The same in one number, where that is below 65,536 ticks. */
static NOINLINE uint32_t interval_q16(const ramp_constants_t *constants, uint32_t v2)
{
    wide_t q16;
    divide_k(&q16, constants, v2);
    return wide_half(&q16, 0);
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
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    begin(ramp, false, faster);
    ramp->u.harmonic.next2 = 2 * v_first;
    ramp->u.harmonic.cap2 = 2 * v_cap;
    ramp->u.harmonic.step = step;
    ramp->steep = step > (uint32_t)wide_from_byte(&constants->k2_q16, 3) >> 10; /* K / 2^17 */
}

static void harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    uint32_t next2 = ramp->u.harmonic.next2;
    uint32_t step = ramp->u.harmonic.step;
    uint32_t cap2 = ramp->u.harmonic.cap2;
    bool capped = next2 > cap2;
    uint32_t first = ramp->u.harmonic.next_q16;
    ramp->u.harmonic.next_q16 = 0;
    if (first && !capped)
        set_q16(sum, first);
    else
        *sum = interval_at_twice(constants, capped ? cap2 : next2);
    uint32_t ticks = sum->ticks;
    /* A group changes the velocity by a 16th at most, or a quarter: steep ones have to last as long as it takes to plan
     * them. */
    uint32_t limit = capped ? (next2 - cap2) >> 1 : next2 >> (ramp->steep ? 3 : 5);
    if (ticks >= LONG_TICKS)
        limit >>= 1;
    uint8_t log2 = 0;
    /* Speeding up, groups are made larger where the pulses left can be divided by it: small groups then come while there
     * is time for them, not at the ramp's end. */
    uint16_t align = ramp->faster && ramp->ticks >= ALIGN_TICKS ? (uint16_t)left : 0;
    while (log2 < GROUP_MAX_LOG2 && 2 * step <= limit && 2 * ticks <= GROUP_MAX_TICKS && left >= 2u << log2 &&
           (align & ((2u << log2) - 1)) == 0) {
        step *= 2;
        ticks *= 2;
        log2++;
    }
    if (!ramp->faster)
        step = 0u - step;
    ramp->u.harmonic.next2 = next2 + 2 * step;
    if (log2) {
        first = sum->ticks << 16 | sum->frac_q16;
        uint32_t middle = first;
        uint32_t end = first;
        if (!capped) {
            middle = interval_q16(constants, next2 + step);
            end = interval_q16(constants, next2 + 2 * step);
            ramp->u.harmonic.next_q16 = end;
        }
        uint32_t change = end - first;
        uint32_t curve = 2 * (first - middle + end - middle);
        if ((int32_t)curve < 0)
            curve = 0; /* hardly any: rounded */
        ramp->curve_q16 = (int32_t)(2 * curve);
        ramp->slope_q16 = (int32_t)(change - (curve >> log2));
        /* The mean over the pulses: m - (e - f) / 2n + c / 12 + c / 6n^2 */
        middle -= (uint32_t)((int32_t)change >> log2 >> 1);
        if (ramp->steep) {
            /* ... - c^2 / 120 m (1 - 1 / n^2) (1 - 4 / n^2), the fourth derivative's part */
            uint16_t curve_q4 = (uint16_t)(curve >> 12);
            uint32_t sixty = (middle >> 16) * 60u;
            uint32_t part = ((uint32_t)curve_q4 * curve_q4 + sixty) / (2 * sixty) << 8;
            part -= (5 * part - (4 * part >> 2 * log2)) >> 2 * log2;
            middle -= part;
        }
        curve += curve >> 2 * log2 << 1;
        middle += (curve >> 8) * 5461u >> 8; /* 65536 / 12 */
        set_q16(sum, middle << log2);
        ramp->shaped = true;
    }
    ramp->group_log2 = log2;
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
    ramp->u.linear.most_log2 = GROUP_MAX_LOG2;
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

/* The largest group of so many ticks a pulse that lasts no longer than `limit`. */
static uint8_t widest(uint32_t ticks, uint32_t limit, uint32_t left, uint8_t most_log2)
{
    uint8_t log2 = 0;
    for (; log2 < most_log2 && ticks <= limit >> 1 && left >= 2u << log2; log2++)
        ticks *= 2;
    return log2;
}

/* Beyond the bound all intervals are equal. */
static void bounded_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    uint32_t ticks = ramp->u.linear.bound.ticks;
    uint8_t log2 = widest(ticks, GROUP_MAX_TICKS, left, GROUP_MAX_LOG2);
    uint32_t frac = (uint32_t)ramp->u.linear.bound.frac_q16 << log2;
    sum->ticks = (ticks << log2) + (frac >> 16);
    sum->frac_q16 = (uint16_t)frac;
    ramp->group_log2 = log2;
    ramp->slope_q16 = 0;
    ramp->curve_q16 = 0;
    ramp->shaped = log2 != 0;
}

static void linear_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    if (ramp->u.linear.bounded) {
        bounded_next(ramp, left, sum);
        return;
    }
    bool faster = ramp->faster;
    uint8_t halved = ramp->u.linear.halved;
    uint32_t span = ramp->ticks;
    /* Part of the time from standstill. */
    uint32_t limit = ramp->u.linear.t.whole;
    limit = limit >> (31 - halved) ? GROUP_MAX_TICKS : limit << halved >> (ramp->steep ? 6 : 8);
    if (limit > GROUP_MAX_TICKS)
        limit = GROUP_MAX_TICKS;
    if (span >= LONG_TICKS)
        limit >>= 1;
    uint8_t log2 = widest(span, limit, left, ramp->u.linear.most_log2);
    ramp_root_t begin = ramp->u.linear.t;
    ramp_root_t end;
    wide_t step = (uint16_t)(1u << log2 >> (log2 != 0));
    wide_t half;
    wide_multiply(&half, &step, &ramp->u.linear.c);
    add_if(&ramp->u.linear.x, &half, faster);
    root_at(ramp, &end);
    uint32_t ticks_q4 = between(ramp, &begin, &end);
    while (log2) {
        ramp_root_t middle = end;
        add_if(&ramp->u.linear.x, &half, faster);
        root_at(ramp, &end);
        uint32_t second_q4 = between(ramp, &middle, &end);
        uint32_t mean1 = ticks_q4 << (13 - log2);
        uint32_t mean2 = second_q4 << (13 - log2);
        int32_t slope = (int32_t)(mean2 - mean1) * 2;
        uint32_t bound = ramp->u.linear.bound.ticks;
        bound = bound > UINT16_MAX ? UINT32_MAX : bound << 16 | ramp->u.linear.bound.frac_q16;
        uint32_t last = mean2 + (uint32_t)(slope >> 2);
        if (!(faster ? last < bound : last > bound)) {
            /* 3 r^2 times the interval, r the relative change */
            uint32_t slope_q8 = magnitude(slope) >> 8;
            ramp->curve_q16 = (int32_t)(slope_q8 * 3 * (slope_q8 / ((mean1 >> 16) + 1)));
            ramp->slope_q16 = slope;
            ramp->shaped = true;
            ticks_q4 += second_q4;
            break;
        }
        /* The bound is reached in it: half of it. */
        ramp->u.linear.most_log2 = --log2;
        add_if(&ramp->u.linear.x, &half, !faster);
        end = middle;
        if (log2) {
            wide_shift(&half, 1);
            add_if(&ramp->u.linear.x, &half, !faster);
            root_at(ramp, &end);
            ticks_q4 = between(ramp, &begin, &end);
        }
    }
    ramp->u.linear.t = end;
    ramp->group_log2 = log2;
    sum->ticks = ticks_q4 >> 4;
    sum->frac_q16 = (uint16_t)(ticks_q4 << 12);
    if (ramp->group_log2 == 0) {
        uint32_t bound = ramp->u.linear.bound.ticks;
        uint16_t bound_frac = ramp->u.linear.bound.frac_q16;
        bool longer = sum->ticks > bound || (sum->ticks == bound && sum->frac_q16 > bound_frac);
        if (faster ? !longer : longer) {
            ramp->u.linear.bounded = true;
            *sum = ramp->u.linear.bound;
        }
    }
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
