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
#define RUN_SLOPE_Q6 124u /* change of the interval within a run */

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
    ramp->run_pulses = 1;
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
 * where fewer are left, so many whole runs as before. From the last group's size on, because that is nearly always it. */
static NOINLINE uint16_t choose_group(ramp_t *ramp, uint32_t change, uint32_t most_change, uint16_t left)
{
    uint8_t log2 = ramp->group_log2;
    uint16_t ticks = ramp->ticks;
    ramp->rest = false;
    if (ticks < BLOCK_SPLIT_TICKS) {
        /* Where a few pulses could not be reloaded in time, the last run is of many. */
        if (left < 2 * REST_PULSES)
            ramp->rest = true;
        else
            left = (uint16_t)(left - REST_PULSES);
    }
    if (ticks > GROUP_MAX_TICKS / 2)
        return 1; /* often, near a standstill */
    if (!ramp->faster) {
        ticks = (uint16_t)(ticks + (ticks >> part_log2(ramp))); /* they grow, and the variable shrinks */
        most_change -= most_change >> 2;
    }
    uint16_t pulses = (uint16_t)(1u << log2);
    uint16_t most_ticks = ramp->steep > 1 ? GROUP_MAX_STEEP_TICKS : GROUP_MAX_TICKS;
    most_ticks = (uint16_t)(most_ticks >> log2);
    change <<= log2;
    while (log2 && (log2 > ramp->most_log2 || ticks > most_ticks || change > most_change)) {
        change >>= 1;
        most_ticks = (uint16_t)(most_ticks << 1);
        pulses >>= 1;
        log2--;
    }
    while (log2 < ramp->most_log2 && ticks <= most_ticks >> 1 && pulses <= left >> 1) {
        change += change;
        if (change > most_change)
            break;
        most_ticks >>= 1;
        pulses = (uint16_t)(pulses << 1);
        log2++;
    }
    ramp->group_log2 = log2;
    if (ramp->rest && left <= pulses)
        return left;
    if (left >= pulses)
        return pulses;
    if (ramp->steep > 1 && left < ODD_GROUP_LEAST) {
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
 * value in the group's middle. Returns mean * part^2. */
static uint32_t shape(ramp_t *ramp, block_t *group, uint32_t mean_q16, uint32_t part)
{
    uint32_t slope = wide_fraction(mean_q16, part);
    uint32_t curve = wide_fraction(slope, part);
    group->slope_q16 = (int32_t)slope;
    ramp->third_q16 = wide_fraction(curve, part);
    group->runs = 1; /* to be divided */
    return curve;
}

/* Intervals that are all alike, *sum each: how many of those left, and their sum. */
static NOINLINE uint16_t flat(ramp_t *ramp, uint16_t left, ramp_time_t *sum)
{
    set_ticks(ramp, sum->ticks);
    uint16_t pulses = choose_group(ramp, 0, 0, left);
    ramp->rest = false;
    uint32_t frac = (uint32_t)sum->frac_q16 * pulses;
    sum->ticks = sum->ticks * pulses + (frac >> 16);
    sum->frac_q16 = (uint16_t)frac;
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
    ramp->steep = step > k_by_128 >> 10 ? 2 : step > k_by_128 / 3072; /* K / 2^17, 2^18.6 */
    ramp->u.harmonic.step_q40 = step < k_by_128 >> 1 ? ratio_q32(2 * step, 0, k_by_128) : UINT32_MAX;
    set_ticks(ramp, interval_at_twice(constants, 2 * (v_first < v_cap ? v_first : v_cap)).ticks);
}

/* The mean of 1 / (1 + x) over n pulses, x from -p / 2 to p / 2 (not quite: at the pulses), is 1 + second * (p^2 +
 * fourth * p^4 + sixth * p^6), in 1 / 2^32. For n = 2 to 8, and roughly for those from 8, 16, 32 and 64 on. */
typedef struct {
    uint32_t second, fourth, sixth;
} series_t;
#define SERIES(n) \
    {(uint32_t)(4294967296.0 / 12 * (1 - 1.0 / (n) / (n))), \
     (uint32_t)(4294967296.0 * 3 / 20 * (1 - 7.0 / 3 / (n) / (n))), \
     (uint32_t)(4294967296.0 * 3 / 112 * (1 - 6.0 / (n) / (n) + 31.0 / 3 / (n) / (n) / (n) / (n)))}
static const series_t series_of[] FLASH = {SERIES(2.0), SERIES(3.0), SERIES(4.0),  SERIES(5.0),  SERIES(6.0),
                                           SERIES(7.0), SERIES(8.0), SERIES(16.0), SERIES(32.0), SERIES(1e9)};

static const series_t *series(uint16_t pulses)
{
    uint8_t place = 6;
    if (pulses < 8)
        place = (uint8_t)(pulses - 2);
    for (; place < 9 && pulses >= 16; place++)
        pulses >>= 1;
    return &series_of[place];
}

static uint16_t harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint16_t left, ramp_time_t *sum, block_t *group)
{
    uint32_t first2 = ramp->u.harmonic.next2;
    uint32_t cap2 = ramp->u.harmonic.cap2;
    uint32_t step2 = ramp->u.harmonic.step2;
    uint16_t pulses;
    if (first2 > cap2) {
        *sum = interval_at_twice(constants, cap2);
        if (!ramp->faster) {
            uint32_t above = (first2 - cap2) / step2 + 1; /* so many pulses */
            if (above < left)
                left = (uint16_t)above;
        }
        pulses = flat(ramp, left, sum);
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
    *sum = interval_at_twice(constants, first2 + to_centre2);
    if (pulses > 1) {
        uint32_t mean = sum->ticks << 16 | sum->frac_q16;
        uint32_t part = wide_fraction(mean * pulses, ramp->u.harmonic.step_q40) << 8;
        uint32_t curve = shape(ramp, group, mean, part);
        group->curve_q16 = (int32_t)(2 * curve);
        uint32_t fourth = wide_fraction(wide_fraction(curve, part), part);
        const series_t *factor = series(pulses);
        curve += wide_fraction(fourth, flash_u32(&factor->fourth));
        if (ramp->steep > 1)
            curve += wide_fraction(wide_fraction(wide_fraction(fourth, part), part), flash_u32(&factor->sixth));
        mean += wide_fraction(curve, flash_u32(&factor->second));
        group->top_q16 = mean;
        set_q16(sum, mean * pulses);
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
    uint8_t bits_of_c = wide_bits(c);
    uint8_t bits = (uint8_t)(bits_of_c + wide_bits(&n));
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
    ramp->steep = bits_of_c <= STEEP_BITS ? 2 : bits_of_c <= STEEP_BITS + 6;
    /* The first interval, to choose the first group's size. */
    wide_copy(&t, x);
    add_if(x, c, faster);
    ramp_root_t next;
    root_at(ramp, &next);
    wide_copy(x, &t);
    set_ticks(ramp, between(ramp, &ramp->u.linear.t, &next) >> 4);
}

static bool is_longer(const ramp_time_t *a, const ramp_time_t *b)
{
    return a->ticks > b->ticks || (a->ticks == b->ticks && a->frac_q16 > b->frac_q16);
}

static uint16_t linear_next(ramp_t *ramp, uint16_t left, ramp_time_t *sum, block_t *group)
{
    if (ramp->u.linear.bounded) {
        *sum = ramp->u.linear.bound;
        return flat(ramp, left, sum);
    }
    bool faster = ramp->faster;
    uint8_t halved = ramp->u.linear.halved;
    const ramp_time_t *bound = &ramp->u.linear.bound;
    ramp_root_t *t = &ramp->u.linear.t;
    ramp_root_t begin = *t;
    uint32_t limit = begin.whole >> (31 - halved) ? GROUP_MAX_TICKS : begin.whole << halved >> 4 >> part_log2(ramp);
    for (;;) {
        uint16_t pulses = choose_group(ramp, ramp->ticks, limit, left);
        wide_t n = pulses;
        wide_t change;
        wide_multiply(&change, &n, &ramp->u.linear.c);
        add_if(&ramp->u.linear.x, &change, faster);
        root_at(ramp, t);
        uint32_t ticks_q4 = between(ramp, &begin, t);
        sum->ticks = ticks_q4 >> 4;
        sum->frac_q16 = (uint16_t)(ticks_q4 << 12);
        ramp_time_t last = *sum;
        if (pulses > 1) {
            uint32_t mean = ticks_q4 << 12; /* below 2^32 */
            mean = pulses & (pulses - 1u) ? mean / pulses : mean >> floor_log2(pulses);
            group->curve_q16 = (int32_t)(3 * shape(ramp, group, mean, ratio_q32(ticks_q4, halved, (begin.whole >> 1) + (t->whole >> 1))));
            group->top_q16 = mean;
            uint32_t half = (uint32_t)group->slope_q16 >> 1;
            set_q16(&last, faster ? mean - half : mean + half);
        }
        if (faster ? !is_longer(bound, &last) : !is_longer(&last, bound))
            return pulses;
        /* The bound is reached in it: less. */
        if (pulses == 1)
            break;
        ramp->most_log2 = (uint8_t)(floor_log2((uint16_t)(pulses - 1)));
        add_if(&ramp->u.linear.x, &change, !faster);
    }
    ramp->u.linear.bounded = true;
    ramp->most_log2 = GROUP_MAX_LOG2;
    *sum = *bound;
    return 1;
}

/* -- both -------------------------------------------------------------------------------------------------------- */

/* Divides a group, given by its mean and the law's derivatives in its middle, into runs. */
static void divide(ramp_t *ramp, uint16_t pulses, block_t *group)
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
        uint16_t slope_q6 = slope < 1UL << 26 ? (uint16_t)(slope >> 10) : UINT16_MAX;
        uint16_t span = (uint16_t)((ticks - RUN_PULSE_TICKS) * run);
        uint16_t least = (uint16_t)(2 * RUN_TICKS + 2 * RUN_TICKS * ramp->steep);
        uint16_t most = ticks < BLOCK_SPLIT_TICKS ? RUN_SLOPE_Q6 / 4 : RUN_SLOPE_Q6;
        if (odd > 1)
            slope_q6 = (uint16_t)(slope_q6 / odd);
        while (run > 1 && slope_q6 > most && span >= least) {
            halvings++;
            run >>= 1;
            slope_q6 >>= 1;
            span >>= 1;
        }
        runs = (uint16_t)(runs << halvings);
    }
    ramp->run_pulses = run;
    group->pulses = run;
    group->runs = (uint8_t)runs;
    /* The cubic part: so that two and four runs are right, and of more all nearly. */
    slope += wide_fraction(ramp->third_q16, runs == 2 ? 1UL << 28 : runs == 4 ? 9UL << 26 : 3UL << 28);
    if (odd > 1) {
        uint32_t part = ratio_q32(1, 0, odd);
        slope = wide_fraction(slope, part);
        curve = wide_fraction(wide_fraction(curve, part), part);
    }
    slope >>= halvings;
    curve >>= 2 * halvings;
    /* From the law's to the differences of the runs. */
    uint32_t sum = curve * (uint16_t)(runs - 1);
    slope = ramp->faster ? 0u - slope : slope;
    slope -= (uint32_t)((int32_t)(sum - curve) >> 1);
    group->slope_q16 = (int32_t)slope;
    group->curve_q16 = (int32_t)curve;
    group->top_q16 -= 65536u;
    group->top_q16 -= wide_fraction(sum * (uint16_t)(runs - 2), 715827883u); /* 2^32 / 6 */
    group->top_q16 -= (uint32_t)((int32_t)(slope * (uint16_t)(runs - 1)) >> 1);
}

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum, block_t *group)
{
    group->runs = 0;
    uint16_t few = left > 4u << GROUP_MAX_LOG2 ? 4u << GROUP_MAX_LOG2 : (uint16_t)left;
    uint16_t pulses = ramp->linear ? linear_next(ramp, few, sum, group) : harmonic_next(ramp, constants, few, sum, group);
    bool shaped = group->runs != 0;
    group->runs = 0;
    if (pulses == 1) {
        set_ticks(ramp, sum->ticks);
    } else if (shaped) {
        ramp->ticks = (uint16_t)(group->top_q16 >> 16);
        if (!ramp->rest && (ramp->ticks >= BLOCK_SPLIT_TICKS || pulses >= 8))
            divide(ramp, pulses, group);
    }
    return pulses;
}
