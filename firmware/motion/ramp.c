/* See ramp.h and docs/design.md. All arithmetic is in integers. In the steady state there is neither a division nor a
 * root: the last value is carried on by its slope and curve, the exact remainder of the law tells how far off it is, and
 * a few additions put it right (ramp_step). Where a ramp begins, and near a standstill, the value is computed from
 * scratch; the remainder is exact there too. When the group size doubles or halves, value, slope and curve do too. */
#include "motion/ramp.h"
#include "base/inline.h"
#include "base/wide.h"
#include <string.h>

/* Shortest group worth planning: the planner's cost per group plus the interrupt's, in cycles = ticks. */
#define GROUP_MIN_TICKS 700u
#define GROUP_MORE_TICKS 400u /* of several pulses: two reloads ... */
#define GROUP_PULSE_TICKS 24u /* ... and the count of each */
#define GROUP_MIN_TICKS_FULL 3000u /* while every interval has to be computed from scratch */
#define GROUP_MIN_TICKS_LINEAR 1200u
#define GROUP_MIN_TICKS_LINEAR_FULL 4000u
#define GROUP_MAX 128u
#define STEADY_GROUPS 12u /* until the next review of a group's size */
#define STEADY_MAX_TICKS 50000u /* their intervals stay below 65536 ticks */
#define STEADY_MIN_TICKS 128u /* of groups too small for an early reload */
#define GROUP_MAX_TICKS 65536u /* so that a group's periods fit the timer and a command can be cut soon */
#define SLOPE_KEEPS_Q8 192u /* change from group to group above which they are made smaller */
#define SEEN_ENOUGH 3u
#define LONGEST_Q8 0x7FFFFFFFu

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev)
{
    constants->k512 = 96000000000u * 512u;
    wide_divide(&constants->k512, steps_per_rev);
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

/* k512 / divisor, rounded. */
static void divide_k(wide_t *quotient, const ramp_constants_t *constants, uint32_t divisor)
{
    wide_t half = divisor >> 1;
    wide_copy(quotient, &constants->k512);
    wide_add(quotient, &half);
    wide_divide(quotient, divisor);
}

static NOINLINE uint32_t low_limited(const wide_t *x)
{
    return wide_bits(x) > 31 ? LONGEST_Q8 : wide_half(x, 0);
}

ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v)
{
    wide_t q8;
    divide_k(&q8, constants, 2 * v);
    ramp_time_t t;
    t.ticks = (uint32_t)wide_from_byte(&q8, 1);
    t.frac = (uint8_t)q8;
    return t;
}

uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    wide_t v512;
    divide_k(&v512, constants, ticks);
    return ((uint32_t)wide_from_byte(&v512, 1) + 1) >> 1;
}

static NOINLINE uint32_t magnitude(int32_t x)
{
    return x < 0 ? 0u - (uint32_t)x : (uint32_t)x;
}

/* -- the steady state -------------------------------------------------------------------------------------------- */

#ifdef __AVR__
#include "motion/ramp_offsets.h"
#include <stddef.h>
#define CHECK(name, member) _Static_assert(RAMP_##name == offsetof(ramp_t, member), "ramp_offsets.h: " #member)
CHECK(LINEAR, linear);
CHECK(FASTER, faster);
CHECK(GROUP_LOG2, group_log2);
CHECK(Q8, u.harmonic.q8);
CHECK(SLOPE, u.harmonic.slope);
CHECK(CURVE, u.harmonic.curve);
CHECK(NEXT2, u.harmonic.next2);
CHECK(SPACING2, u.harmonic.spacing2);
CHECK(MID2, u.harmonic.mid2);
CHECK(K512, u.harmonic.k512);
CHECK(CARRY, u.harmonic.carry);
CHECK(Q8, u.linear.sum_q4);
CHECK(SLOPE, u.linear.slope);
CHECK(CURVE, u.linear.curve);
CHECK(T2, u.linear.t2_q4);
CHECK(REST, u.linear.rest);
CHECK(GROUP_C, u.linear.group_c);
#else
/* In assembler on the target: ramp_step.S. The number of corrections is limited there, too. */
uint32_t ramp_step(ramp_t *ramp)
{
    uint32_t curve = (uint32_t)ramp->u.harmonic.curve;
    uint32_t slope = (uint32_t)ramp->u.harmonic.slope + curve;
    uint32_t q = ramp->u.harmonic.q8 + slope;
    uint32_t correction = 0;
    uint32_t sum;
    if (ramp->linear) {
        uint64_t divisor = ramp->u.linear.t2_q4; /* 2t +- s, then 2t +- 2s: what one unit of s changes */
        uint64_t rest = ramp->u.linear.rest + ramp->u.linear.group_c;
        uint64_t one = ramp->faster ? 1u : UINT64_MAX;
        divisor += one * q;
        rest -= divisor * q;
        divisor += one * q;
        for (uint8_t tries = 0; --tries;) {
            if ((int64_t)rest < 0) {
                divisor -= one;
                rest += divisor;
                divisor -= one;
                correction--;
            } else if (rest >= divisor) {
                divisor += one;
                rest -= divisor;
                divisor += one;
                correction++;
            } else {
                break;
            }
        }
        ramp->u.linear.t2_q4 = divisor;
        ramp->u.linear.rest = rest;
        q += correction;
        sum = q << 4;
    } else {
        uint32_t mid2 = ramp->u.harmonic.mid2 + ramp->u.harmonic.spacing2;
        ramp->u.harmonic.mid2 = mid2;
        ramp->u.harmonic.next2 += ramp->u.harmonic.spacing2;
        uint32_t rest = ramp->u.harmonic.k512 - q * mid2;
        while ((int32_t)rest < 0) {
            rest += mid2;
            correction--;
        }
        while (rest >= mid2) {
            rest -= mid2;
            correction++;
        }
        q += correction;
        sum = q;
        for (uint8_t bits = ramp->group_log2; bits; bits--) {
            sum <<= 1;
            rest <<= 1;
            if (rest >= mid2) {
                rest -= mid2;
                sum++;
            }
        }
        rest += ramp->u.harmonic.carry;
        if (rest >= mid2) {
            rest -= mid2;
            sum++;
        }
        ramp->u.harmonic.carry = rest;
    }
    ramp->u.harmonic.q8 = q;
    ramp->u.harmonic.slope = (int32_t)(slope + correction);
    ramp->u.harmonic.curve = (int32_t)(curve + correction);
    return sum;
}
#endif

/* -- the size of groups ------------------------------------------------------------------------------------------ */

/* How many pulses to put together, given the interval and the change between the last two groups. */
static uint8_t choose_group(uint8_t group, uint16_t interval, uint16_t slope_q8, uint16_t min_ticks)
{
    if (interval > GROUP_MAX_TICKS / 2)
        return 1;
    bool may_grow = (uint32_t)interval * group < GROUP_MAX_TICKS / 2;
    uint8_t at_least = 1;
    if (interval < min_ticks) {
        min_ticks = (uint16_t)(min_ticks + GROUP_MORE_TICKS);
        do {
            min_ticks = (uint16_t)(min_ticks + at_least * GROUP_PULSE_TICKS);
            at_least = (uint8_t)(at_least * 2);
            interval = (uint16_t)(interval * 2);
        } while (interval < min_ticks && at_least < GROUP_MAX);
    }
    if (group < at_least)
        return at_least;
    /* The intervals of twice the group differ by half a tick. */
    if (slope_q8 < SLOPE_KEEPS_Q8 / 3 && group < GROUP_MAX && may_grow)
        return (uint8_t)(group * 2);
    if (slope_q8 > SLOPE_KEEPS_Q8 && group > at_least)
        return group / 2;
    return group;
}

/* Carries value, slope and curve over to groups of twice or half the pulses: the parabola through them stays. */
static void resize(ramp_t *ramp, bool twice)
{
    bool linear = ramp->linear; /* the value is of a group, not of one interval */
    int32_t q = (int32_t)ramp->u.harmonic.q8;
    int32_t slope = ramp->u.harmonic.slope;
    int32_t curve = ramp->u.harmonic.curve;
    if (twice) {
        if (linear) {
            q *= 2;
            slope *= 2;
            curve *= 2;
        }
        q -= slope >> 1;
        slope = (slope - curve) * 2;
        curve *= 4;
    } else {
        curve >>= 2;
        slope = (slope >> 1) + curve;
        q += slope >> 1;
        if (linear) {
            q >>= 1;
            slope >>= 1;
            curve >>= 1;
        }
    }
    ramp->u.harmonic.q8 = (uint32_t)q;
    ramp->u.harmonic.slope = slope;
    ramp->u.harmonic.curve = curve;
}

/* A new ramp: all 0 but this. */
static void begin(ramp_t *ramp, bool linear, bool faster)
{
    memset(ramp, 0, sizeof *ramp);
    ramp->linear = linear;
    ramp->faster = faster;
    ramp->group = 1;
    ramp->group_limit = 1;
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    begin(ramp, false, faster);
    ramp->u.harmonic.next2 = 2 * v_first;
    ramp->u.harmonic.cap2 = 2 * v_cap;
    ramp->u.harmonic.step = step;
    ramp->u.harmonic.k512 = wide_half(&constants->k512, 0);
    wide_t q8;
    divide_k(&q8, constants, v_first < v_cap ? 2 * v_first : 2 * v_cap);
    ramp->u.harmonic.q8 = low_limited(&q8); /* to choose the first group's size */
}

/* What the sum over a group of k pulses exceeds k times the interval q in its middle by, where s is the law's change
 * over k pulses there: k q (s2 + s4), a power series in r = s / q:
 * s2 = (1 - 1 / k^2) / 12 r^2, s4 = (1 - 1 / k^2) (3 - 7 / k^2) / 240 r^4, which is s2 r^2 / 8 or so. */
static uint32_t excess(uint32_t q, uint32_t s, uint8_t k)
{
    uint32_t square = ramp_scale(s << 4, s, q); /* sixteenths */
    if (square > q >> 6)
        square += ramp_scale(square, square, q) >> 7;
    return ramp_scale(square, (uint16_t)(k * k) - 1u, 192u * k);
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

void ramp_linear_time(wide_t *t_q4, const wide_t *c_q8, uint32_t n, wide_t *rest)
{
    wide_t wide_n = n;
    wide_t x;
    wide_t y;
    wide_copy(&x, c_q8);
    /* The root of n * C / 4^halved, which fits 64 bits. */
    uint8_t bits = (uint8_t)(wide_bits(&x) + wide_bits(&wide_n));
    uint8_t halved = bits > 64 ? (uint8_t)(bits - 63) / 2 : 0;
    wide_shift(&x, (uint8_t)(2 * halved));
    wide_multiply(&y, &x, &wide_n);
    *t_q4 = wide_root(&y);
    for (uint8_t i = halved; i; i--)
        wide_add(t_q4, t_q4);
    for (uint8_t tries = 0; tries < 5; tries++) {
        wide_multiply(rest, c_q8, &wide_n);
        wide_multiply(&y, t_q4, t_q4);
        wide_subtract(rest, &y); /* modulo 2^64: it is small */
        if (halved == 0)
            return;
        /* What was lost by halving: t += rest / 2t. */
        bool more = !wide_is_negative(rest);
        x = 0;
        add_if(&x, rest, more);
        wide_copy(&y, t_q4);
        wide_add(&y, &y);
        bits = wide_bits(&x) > wide_bits(&y) ? wide_bits(&x) : wide_bits(&y);
        bits = bits > 32 ? (uint8_t)(bits - 32) : 0;
        wide_shift(&x, bits);
        wide_shift(&y, bits);
        wide_divide(&x, (uint32_t)y);
        add_if(t_q4, &x, more);
        if (wide_bits(&x) == 0)
            return;
    }
}

/* Duration of a group: |sqrt(t^2 +- group_c) - t|, to a few units. */
static uint32_t estimate(const ramp_t *ramp)
{
    wide_t t;
    wide_t c;
    wide_copy(&t, &ramp->u.linear.t2_q4);
    wide_copy(&c, &ramp->u.linear.c_q8);
    uint8_t bits = wide_bits(&t);
    if (bits >= 40) {
        /* Far from standstill: C / 2t; here the group's C may not fit. */
        bits = (uint8_t)(bits - 32);
        wide_shift(&t, bits);
        wide_shift(&c, bits);
        wide_divide(&c, (uint32_t)t);
        return (uint32_t)c * ramp->group;
    }
    wide_copy(&c, &ramp->u.linear.group_c);
    wide_add(&c, &ramp->u.linear.rest);
    uint8_t halved = bits > 32 ? (uint8_t)(bits - 32) : 0;
    if (wide_bits(&c) > 62)
        halved++;
    wide_shift(&t, (uint8_t)(halved + 1));
    wide_shift(&c, (uint8_t)(2 * halved));
    wide_t square;
    wide_multiply(&square, &t, &t);
    add_if(&square, &c, ramp->faster);
    if (wide_is_negative(&square))
        square = 0; /* the last group: to standstill exactly */
    return magnitude((int32_t)(wide_root(&square) - (uint32_t)t)) << halved;
}

void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, const wide_t *rest, bool faster,
                       uint32_t max_ticks)
{
    begin(ramp, true, faster);
    wide_add(&ramp->u.linear.t2_q4, t_q4);
    wide_add(&ramp->u.linear.t2_q4, t_q4);
    wide_add(&ramp->u.linear.c_q8, c_q8);
    wide_add(&ramp->u.linear.group_c, c_q8);
    if (!faster)
        ramp->bound_q8 = max_ticks << 8;
    add_if(&ramp->u.linear.rest, rest, faster);
    ramp->u.linear.sum_q4 = estimate(ramp); /* to choose the first group's size */
}

void ramp_bound(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v)
{
    wide_t bytes = 256;
    wide_t q16;
    wide_multiply(&q16, &bytes, &constants->k512);
    wide_divide(&q16, 2 * v);
    ramp->bound_q8 = (uint32_t)wide_from_byte(&q16, 1);
    ramp->bound_q16 = (uint8_t)q16;
}

/* -- both -------------------------------------------------------------------------------------------------------- */

/* Of the last group: mean interval and its change, both 65535 at most. */
static NOINLINE uint16_t last_ticks(const ramp_t *ramp)
{
    uint32_t ticks = ramp->u.harmonic.q8 >> 8;
    if (ramp->linear)
        ticks = ramp->u.linear.sum_q4 >> 4 >> ramp->group_log2;
    return ticks > UINT16_MAX ? UINT16_MAX : (uint16_t)ticks;
}

static NOINLINE uint16_t last_slope_q8(const ramp_t *ramp)
{
    uint32_t slope_q8 = magnitude(ramp->u.harmonic.slope);
    if (slope_q8 > 0xFFF)
        return UINT16_MAX;
    return (uint16_t)(ramp->linear ? slope_q8 << 4 >> ramp->group_log2 : slope_q8);
}

/* Sets the group that comes next; false if it can be carried on from the last. */
static bool begin_group(ramp_t *ramp, uint32_t left)
{
    uint8_t wish = ramp->group_limit;
    uint16_t ticks = last_ticks(ramp);
    uint16_t slope_q8 = last_slope_q8(ramp);
    bool linear = ramp->linear;
    uint32_t speed; /* what a group's `change` is to be small against */
    uint32_t change;
    bool from_scratch;
    uint16_t min_ticks;
    if (linear) {
        speed = (uint32_t)wide_from_byte(&ramp->u.linear.t2_q4, 2);
        change = ticks >> 7;
        uint32_t q = ramp->u.linear.sum_q4;
        from_scratch = q >> 18 || q >> 10 >= speed; /* long, or less than 16 groups from standstill */
        min_ticks = GROUP_MIN_TICKS_LINEAR;
    } else {
        speed = ramp->u.harmonic.next2 >> 3;
        change = ramp->u.harmonic.step;
        /* The velocity changes from group to group by more than a 43rd, or a 128th where that is many corrections. */
        from_scratch = change * wish > (speed >> 5) + (ticks < 4096 ? speed >> 4 : 0);
        min_ticks = GROUP_MIN_TICKS;
    }
    if (from_scratch)
        min_ticks = linear ? GROUP_MIN_TICKS_LINEAR_FULL : GROUP_MIN_TICKS_FULL;
    if (ramp->seen < SEEN_ENOUGH) {
        /* Only the first few: what they take longer the ring has in store. */
        from_scratch = true;
        if (ramp->seen < 2)
            slope_q8 = SLOPE_KEEPS_Q8; /* not known */
    }
    if (ramp->hurry)
        min_ticks = (uint16_t)(min_ticks * 2);
    wish = choose_group(wish, ticks, slope_q8, min_ticks);
    /* A power of two while there is enough left; the last group takes what remains. */
    uint8_t group = left >> 1 < wish ? (uint8_t)left : wish;
    /* Near a standstill accuracy goes before the planner's load: a group may change by a quarter of its velocity. */
    while (from_scratch && wish > 1 && change * wish > speed) {
        wish /= 2;
        group = left < wish ? (uint8_t)left : wish;
    }
    ramp->group_limit = wish;
    ramp->capped = false;
    if (!linear && ramp->u.harmonic.next2 > ramp->u.harmonic.cap2) {
        uint32_t over = (ramp->u.harmonic.next2 - ramp->u.harmonic.cap2 - 1) / change / 2;
        if (group > over)
            group = (uint8_t)(over + 1);
        ramp->capped = true;
        from_scratch = true;
    }
    uint8_t before = ramp->group;
    if (group != before) {
        if (ramp->seen == SEEN_ENOUGH && (group == before << 1 || group << 1 == before)) {
            resize(ramp, group > before);
        } else {
            ramp->seen = 0;
            from_scratch = true;
        }
        ramp->group = group;
        ramp->group_log2 = 0;
        for (uint8_t g = group; g > 1; g >>= 1)
            ramp->group_log2++;
        if (linear) {
            wide_t wide_group = group;
            wide_multiply(&ramp->u.linear.group_c, &wide_group, &ramp->u.linear.c_q8);
        }
    }
    return from_scratch;
}

/* After a value from scratch: slope and curve from the ones before. */
static NOINLINE void follow(ramp_t *ramp, uint32_t q_before, int32_t slope_before)
{
    uint32_t slope = ramp->u.harmonic.q8 - q_before;
    ramp->u.harmonic.slope = (int32_t)slope;
    ramp->u.harmonic.curve = (int32_t)(slope - (uint32_t)slope_before);
    if (ramp->seen < SEEN_ENOUGH)
        ramp->seen++;
}

static void harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, bool from_scratch, ramp_time_t *sum)
{
    uint8_t group = ramp->group;
    uint32_t step = ramp->u.harmonic.step;
    uint32_t next2 = ramp->u.harmonic.next2;
    if (!ramp->faster)
        step = 0u - step;
    uint32_t spacing2 = 2 * step * group;
    ramp->u.harmonic.spacing2 = spacing2;
    /* Where the group before this one would have had its middle. */
    uint32_t mid2 = next2 - step * (uint16_t)(group + 1);
    ramp->u.harmonic.mid2 = mid2;
    uint32_t s;
    uint32_t total;
    if (from_scratch) {
        uint32_t q_before = ramp->u.harmonic.q8;
        mid2 += spacing2;
        ramp->u.harmonic.next2 = next2 + spacing2;
        if (ramp->capped)
            mid2 = ramp->u.harmonic.cap2;
        wide_t q8;
        wide_copy(&q8, &constants->k512);
        uint32_t rest = wide_divide(&q8, mid2);
        ramp->u.harmonic.q8 = low_limited(&q8);
        if (ramp->u.harmonic.q8 == LONGEST_Q8) {
            /* Half a second and more, only at the start or end of a crawl: one by one. */
            sum->ticks = (uint32_t)wide_from_byte(&q8, 1);
            sum->frac = (uint8_t)q8;
            ramp->seen = 0;
            return;
        }
        ramp->u.harmonic.mid2 = mid2;
        follow(ramp, q_before, ramp->u.harmonic.slope);
        total = ramp->u.harmonic.q8 * group;
        if (group > 1) {
            uint32_t whole = ramp_scale(rest, group, mid2);
            total += whole;
            rest = rest * group - whole * mid2;
        }
        rest += ramp->u.harmonic.carry;
        if (rest >= mid2) {
            rest -= mid2;
            total++;
        }
        ramp->u.harmonic.carry = rest;
        s = 0;
        if (ramp->capped)
            ramp->seen = 0;
        else if (group > 1)
            s = ramp_scale(ramp->u.harmonic.q8, magnitude((int32_t)spacing2), mid2);
    } else {
        total = ramp_step(ramp);
        s = magnitude(ramp->u.harmonic.slope + (ramp->u.harmonic.curve >> 1));
    }
    uint32_t q = ramp->u.harmonic.q8;
    s = group > 1 && s > 96 ? excess(q, s, group) : 0;
    ramp->excess_q8 = (uint16_t)s;
    total += s;
    sum->ticks = total >> 8;
    sum->frac = (uint8_t)total;
}

/* True if neither standstill nor the bound is near. */
static bool linear_next(ramp_t *ramp, bool from_scratch, ramp_time_t *sum)
{
    if (from_scratch) {
        uint32_t q_before = ramp->u.linear.sum_q4;
        int32_t slope_before = ramp->u.linear.slope;
        ramp->u.linear.slope = (int32_t)(estimate(ramp) - q_before);
        ramp->u.linear.curve = 0;
        ramp_step(ramp);
        follow(ramp, q_before, slope_before);
    } else {
        ramp_step(ramp);
    }
    uint32_t q = ramp->u.linear.sum_q4;
    uint32_t bound_q8 = ramp->bound_q8;
    uint8_t group = ramp->group;
    if (group > 1)
        bound_q8 = bound_q8 >> 24 ? UINT32_MAX : bound_q8 * group;
    uint32_t bound_q4 = bound_q8 >> 4;
    uint32_t slope = magnitude(ramp->u.linear.slope) << 4;
    sum->ticks = q >> 4;
    sum->frac = (uint8_t)(q << 4);
    if (ramp->faster ? q < bound_q4 : q > bound_q4) {
        uint16_t carry = (uint16_t)(ramp->bound_carry + group * ramp->bound_q16);
        ramp->bound_carry = (uint8_t)carry;
        bound_q8 += carry >> 8;
        sum->ticks = bound_q8 >> 8;
        sum->frac = (uint8_t)bound_q8;
    }
    if (q >> 9 >= (uint32_t)wide_from_byte(&ramp->u.linear.t2_q4, 2))
        return false;
    return ramp->faster ? q >= bound_q4 + slope : q + 2 * slope <= bound_q4;
}

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    bool steady = !begin_group(ramp, left);
    if (ramp->linear)
        steady = linear_next(ramp, !steady, sum) && steady;
    else
        harmonic_next(ramp, constants, !steady, sum);
    uint16_t group = ramp->group;
    uint16_t ticks = last_ticks(ramp);
    /* The same again for a while, without looking at everything. */
    ramp->steady = steady && (group & (group - 1)) == 0 && ticks < STEADY_MAX_TICKS &&
                           (group >= 4 || ticks >= STEADY_MIN_TICKS)
                       ? STEADY_GROUPS
                       : 0;
    return group;
}
