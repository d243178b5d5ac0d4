/* See ramp.h and docs/design.md. The steady state has neither division nor square root: the last interval is carried
 * on by its slope, the exact remainder of the law tells how far off it is, and a few additions put it right. Floating
 * point is used only to come near at the start of a ramp or when the group size changes; the remainder is exact there
 * too, so no error of it survives. */
#include "motion/ramp.h"
#include "base/wide.h"
#include <math.h>

/* Shortest group worth planning: the planner's cost per group plus the interrupt's, in cycles = ticks. */
#define GROUP_MIN_TICKS 690u
#define GROUP_MORE_TICKS 400u /* of several pulses: two reloads ... */
#define GROUP_PULSE_TICKS 24u /* ... and the count of each */
#define GROUP_MIN_TICKS_FULL 3600u /* harmonic, while every interval has to be computed from scratch */
#define GROUP_MIN_TICKS_LINEAR 4500u
#define GROUP_MIN_TICKS_LINEAR_FULL 7000u
#define GROUP_MAX 128u
#define STEADY_GROUPS 12u /* until the next review of a group's size */
#define STEADY_MAX_Q8 (50000ul << 8) /* their intervals stay below 65536 ticks */
#define GROUP_MAX_TICKS 65536u /* so that a group's periods fit the timer and a command can be cut soon */

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev)
{
    uint64_t k512 = (96000000000ull * 512u + steps_per_rev / 2u) / steps_per_rev;
    constants->k512_low = (uint32_t)k512;
    constants->v2_least = (uint32_t)(k512 >> 31) + 1;
    constants->k512 = (float)(uint32_t)(k512 >> 16) * 65536.0f;
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

/* round(k512 / mid2), with its exact remainder: |rest| <= mid2 / 2 or so. */
static uint32_t divide_k(const ramp_constants_t *constants, uint32_t mid2, int32_t *rest)
{
    uint32_t q8 = (uint32_t)(constants->k512 / (float)mid2);
    /* Modulo 2^32: the true remainder is small. */
    int32_t r = (int32_t)(constants->k512_low - q8 * mid2);
    int32_t divisor = (int32_t)mid2;
    int32_t correction = r / divisor;
    q8 += (uint32_t)correction;
    r -= correction * divisor;
    if (r > divisor / 2) {
        q8++;
        r -= divisor;
    } else if (r < -(divisor / 2)) {
        q8--;
        r += divisor;
    }
    *rest = r;
    return q8;
}

ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v)
{
    ramp_time_t t;
    uint32_t mid2 = 2 * v;
    if (mid2 >= constants->v2_least) {
        int32_t rest;
        uint32_t q8 = divide_k(constants, mid2, &rest);
        t.ticks = q8 >> 8;
        t.frac = (uint8_t)q8;
    } else {
        t.ticks = (uint32_t)(constants->k512 / 256.0f / (float)mid2);
        t.frac = 0;
    }
    return t;
}

uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    return (uint32_t)(constants->k512 / 512.0f / (float)ticks + 0.5f);
}

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    ramp->linear = false;
    ramp->steady = 0;
    ramp->faster = faster;
    ramp->group = 0;
    ramp->group_limit = 1;
    ramp->u.harmonic.next2 = 2 * v_first;
    ramp->u.harmonic.cap2 = 2 * v_cap;
    ramp->u.harmonic.step = step;
    ramp->u.harmonic.slope = 0;
    ramp->u.harmonic.curve = 0;
    ramp_time_t first = ramp_interval(constants, v_first);
    ramp->u.harmonic.q8 = first.ticks << 8 | first.frac; /* only to choose the first group's size */
}

/* How many pulses to put together, given the interval and the change between the last two groups. */
static uint16_t choose_group(uint16_t group, uint32_t interval_ticks, uint32_t slope_q8, uint16_t min_ticks)
{
    uint16_t at_least = 1;
    bool may_grow = interval_ticks < GROUP_MAX_TICKS / 2 / GROUP_MAX || interval_ticks * group < GROUP_MAX_TICKS / 2;
    if (interval_ticks < min_ticks) {
        min_ticks = (uint16_t)(min_ticks + GROUP_MORE_TICKS);
        do {
            at_least = (uint16_t)(at_least * 2);
            interval_ticks *= 2;
            min_ticks = (uint16_t)(min_ticks + at_least / 2 * GROUP_PULSE_TICKS);
        } while (interval_ticks < min_ticks && at_least < GROUP_MAX);
    }
    if (group < at_least)
        return at_least;
    if (slope_q8 <= 64 && group < GROUP_MAX && may_grow) /* the intervals of twice the group differ by half a tick */
        return (uint16_t)(group * 2);
    if (slope_q8 > 192 && group > at_least)
        return (uint16_t)(group / 2);
    return group;
}

static uint32_t magnitude(int32_t x)
{
    return x < 0 ? (uint32_t)-x : (uint32_t)x;
}

/* A power of two while there is enough left; the last group takes what remains. */
static uint16_t limit_group(uint16_t group, uint32_t left)
{
    return left < 2u * group ? (uint16_t)left : group;
}

#ifdef __AVR__
#include "motion/ramp_offsets.h"
#include <stddef.h>
#define CHECK(name, member) _Static_assert(RAMP_##name == offsetof(ramp_t, member), "ramp_offsets.h: " #member)
CHECK(GROUP_LOG2, group_log2);
CHECK(NEXT2, u.harmonic.next2);
CHECK(SPACING2, u.harmonic.spacing2);
CHECK(MID2, u.harmonic.mid2);
CHECK(Q8, u.harmonic.q8);
CHECK(REST, u.harmonic.rest);
CHECK(SLOPE, u.harmonic.slope);
CHECK(CURVE, u.harmonic.curve);
#else
/* In assembler on the target: ramp_step.S. */
uint32_t ramp_step(ramp_t *ramp)
{
    uint32_t spacing2 = ramp->u.harmonic.spacing2;
    uint32_t q8 = ramp->u.harmonic.q8;
    int32_t rest = ramp->u.harmonic.rest - (int32_t)(spacing2 * q8);
    uint32_t mid2 = ramp->u.harmonic.mid2 + spacing2;
    int32_t slope = ramp->u.harmonic.slope + ramp->u.harmonic.curve;
    ramp->u.harmonic.mid2 = mid2;
    rest -= (int32_t)((uint32_t)slope * mid2);
    int32_t divisor = (int32_t)mid2;
    int32_t half = divisor >> 1;
    int32_t correction = 0;
    while (rest > half) {
        rest -= divisor;
        correction++;
    }
    while (rest < -half) {
        rest += divisor;
        correction--;
    }
    ramp->u.harmonic.rest = rest;
    ramp->u.harmonic.curve += correction;
    slope += correction;
    ramp->u.harmonic.slope = slope;
    ramp->u.harmonic.q8 = q8 + (uint32_t)slope;
    ramp->u.harmonic.next2 += spacing2;
    return ramp->u.harmonic.q8 << ramp->group_log2;
}
#endif

static uint16_t harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    uint32_t step = ramp->u.harmonic.step;
    uint32_t next2 = ramp->u.harmonic.next2;
    uint32_t spacing2 = 2u * step * ramp->group_limit;
    /* The slope carries on well only where the velocity changes by less than a 43rd from group to group. */
    bool from_scratch = spacing2 > (next2 >> 6) + (next2 >> 7) || ramp->group == 0;

    uint16_t wish = choose_group(ramp->group_limit, ramp->u.harmonic.q8 >> 8,
                                 ramp->group == 0 ? UINT16_MAX : magnitude(ramp->u.harmonic.slope),
                                 from_scratch ? GROUP_MIN_TICKS_FULL : GROUP_MIN_TICKS);
    if (from_scratch) {
        /* Near a standstill accuracy goes before the planner's load: a group may change by a quarter of its velocity. */
        while (wish > 1 && step * wish > next2 >> 3)
            wish /= 2;
    }
    ramp->group_limit = wish;
    uint16_t group = limit_group(wish, left);

    uint32_t total;
    if (from_scratch || group != ramp->group) {
        uint32_t half = step * (uint16_t)(group - 1);
        uint32_t mid2 = ramp->faster ? next2 + half : next2 - half;
        spacing2 = 2u * step * group;
        if (!ramp->faster)
            spacing2 = -spacing2;
        ramp->u.harmonic.spacing2 = spacing2;
        ramp->group = group;
        if (mid2 > ramp->u.harmonic.cap2) {
            mid2 = ramp->u.harmonic.cap2;
            ramp->group = 0; /* not to be carried on from */
        }
        ramp->u.harmonic.mid2 = mid2;
        ramp->group_log2 = 0;
        for (uint16_t g = group; g > 1; g >>= 1)
            ramp->group_log2++;
        if (mid2 < constants->v2_least) {
            /* Half a second and more: only at the start or end of a crawl. */
            *sum = ramp_interval(constants, mid2 / 2);
            ramp->u.harmonic.next2 = next2 + spacing2;
            ramp->u.harmonic.q8 = UINT32_MAX;
            ramp->group = 0;
            return 1;
        }
        uint32_t q8 = divide_k(constants, mid2, &ramp->u.harmonic.rest);
        ramp->u.harmonic.q8 = q8;
        /* The slope between groups of this size, up to this one, and its change: derivatives of K / v. */
        float ratio = (float)(int32_t)spacing2 / (float)mid2;
        float s = (float)q8 * ratio;
        ramp->u.harmonic.curve = (int32_t)(2.0f * s * ratio);
        ramp->u.harmonic.slope = (int32_t)(-s - s * ratio);
        total = q8 * group;
        if (group > 1) {
            /* sum of K / v over the group = group * K / mid * (1 + s2 + s4 + ...), a power series in the relative
             * change y per pulse: s2 = (k^2 - 1) / 12 y^2, s4 = (k^2 - 1)(3 k^2 - 7) / 240 y^4. */
            float k2 = (float)((uint32_t)group * group);
            float y2 = ratio * ratio / k2;
            float s2 = (k2 - 1.0f) * y2 * (1.0f / 12.0f);
            total += (uint32_t)((float)total * s2 * (1.0f + (3.0f * k2 - 7.0f) * y2 * (1.0f / 20.0f)) + 0.5f);
        }
        ramp->u.harmonic.next2 = next2 + spacing2;
        sum->ticks = total >> 8;
        sum->frac = (uint8_t)total;
        return group;
    }
    total = ramp_step(ramp);
    if ((group & (group - 1)) != 0)
        total = ramp->u.harmonic.q8 * group;
    ramp->excess_q8 = 0;
    uint32_t s = magnitude(ramp->u.harmonic.slope + ramp->u.harmonic.curve / 2);
    if (group > 1 && s > 96) {
        /* s2 from above, with s = change over the group: (k - 1/k) / 12 * s^2 / interval */
        float excess = (float)s * (float)s / (float)ramp->u.harmonic.q8;
        ramp->excess_q8 = (uint16_t)(excess * ((float)group - 1.0f / (float)group) * (1.0f / 12.0f) + 0.5f);
        total += ramp->excess_q8;
    }
    /* The same again for a while, without looking at everything. */
    if (ramp->u.harmonic.q8 < STEADY_MAX_Q8)
        ramp->steady = STEADY_GROUPS;
    sum->ticks = total >> 8;
    sum->frac = (uint8_t)total;
    return group;
}

/* -- linear ------------------------------------------------------------------------------------------------------ */

void ramp_linear_c(wide_t *c_q8, uint16_t steps_per_rev, uint8_t factor_log2, uint32_t accel_centi)
{
    /* 2 * alpha / accel in ticks^2 * 256 = 2 * (2 pi / (sprf * F)) / (centi / 100) * (16e6)^2 * 256
     *                                    = 8.23549667...e19 / (sprf * F * centi); an eighth of it fits 64 bits. */
    wide_t divisor = (wide_t)steps_per_rev * accel_centi;
    *c_q8 = (10294370808072384000ull / divisor << 3) >> factor_log2;
}

static float to_float(const wide_t *x)
{
    int32_t half[2];
    __builtin_memcpy(half, x, sizeof half);
    return (float)half[1] * 4294967296.0f + (float)(uint32_t)half[0];
}

void ramp_from_float(wide_t *x, float f)
{
    uint32_t half[2] = {0, 0};
    if (f >= 4294967296.0f) {
        half[1] = (uint32_t)(f * (1.0f / 4294967296.0f));
        f -= (float)half[1] * 4294967296.0f;
    }
    half[0] = (uint32_t)f;
    __builtin_memcpy(x, half, sizeof half);
}

void ramp_linear_time(wide_t *t_q4, const wide_t *c_q8, uint32_t n, wide_t *rest)
{
    float root = sqrtf((float)n) * sqrtf(to_float(c_q8));
    wide_t wide_n = n;
    wide_t square;
    ramp_from_float(t_q4, root);
    for (uint8_t i = 0; i < 3; i++) {
        wide_multiply(rest, c_q8, &wide_n);
        wide_multiply(&square, t_q4, t_q4);
        wide_subtract(rest, &square); /* modulo 2^64: it is small */
        int32_t correction = (int32_t)(to_float(rest) / (2.0f * root));
        if (correction == 0)
            break;
        wide_t wide_correction = (wide_t)(int64_t)correction;
        wide_add(t_q4, &wide_correction);
    }
}

void ramp_begin_linear(ramp_t *ramp, const wide_t *c_q8, const wide_t *t_q4, const wide_t *rest, bool faster,
                       uint32_t max_ticks)
{
    ramp->linear = true;
    ramp->faster = faster;
    ramp->group = 0;
    ramp->group_limit = 1;
    ramp->max_ticks = max_ticks;
    ramp->u.linear.t_q4 = *t_q4;
    ramp->u.linear.c_q8 = *c_q8;
    ramp->u.linear.rest = 0;
    if (faster)
        wide_add(&ramp->u.linear.rest, rest);
    else
        wide_subtract(&ramp->u.linear.rest, rest);
    ramp->u.linear.sum_q4 = 0;
    ramp->u.linear.slope_q4 = 0;
    ramp->u.linear.curve_q4 = 0;
}

/* Duration of a group whose C is `c`, from the law in floating point. */
static uint32_t linear_estimate(float t, float c, bool faster)
{
    float square = t * t;
    float after = faster ? square + c : square - c;
    if (after < square * 1e-5f)
        return (uint32_t)t; /* the last group: to standstill exactly */
    return (uint32_t)(c / (t + sqrtf(after)));
}

/* Makes s exact: group_c = s * (2t + s), or s * (2t - s) when slowing, up to half a unit; what is left is the rest. */
static uint32_t linear_exact(ramp_t *ramp, uint32_t s)
{
    bool faster = ramp->faster;
    wide_t *rest = &ramp->u.linear.rest;
    wide_t wide_s = s;
    wide_t divisor = ramp->u.linear.t_q4; /* 2t +- s, then 2t +- 2s: what one unit of s changes */
    wide_t product;
    wide_add(&divisor, &divisor);
    if (faster)
        wide_add(&divisor, &wide_s);
    else
        wide_subtract(&divisor, &wide_s);
    wide_multiply(&product, &wide_s, &divisor);
    wide_add(rest, &ramp->u.linear.group_c);
    wide_subtract(rest, &product);
    if (faster)
        wide_add(&divisor, &wide_s);
    else
        wide_subtract(&divisor, &wide_s);
    for (uint8_t tries = 0; tries < 4; tries++) {
        /* Enough of both to divide: rest is a few thousand units of s at most. */
        uint8_t byte = wide_from_byte(&divisor, 2) < 0x1000 ? 1 : 2;
        int32_t unit = wide_from_byte(&divisor, byte);
        int32_t off = wide_from_byte(rest, byte);
        int32_t half = unit >> 1;
        if (unit < 64 || (off <= half && off >= -half))
            break;
        int32_t correction = off > 0 ? 1 : -1;
        if (off > 2 * unit || off < -2 * unit)
            correction = off / unit;
        /* (s + c)(2t + s + c) = s(2t + s) + c(2t + 2s) + c^2 */
        wide_t wide_correction = (wide_t)(int64_t)correction;
        s += (uint32_t)correction;
        if (faster)
            wide_add(&divisor, &wide_correction);
        else
            wide_subtract(&divisor, &wide_correction);
        wide_multiply(&product, &wide_correction, &divisor);
        wide_subtract(rest, &product);
        if (faster)
            wide_add(&divisor, &wide_correction);
        else
            wide_subtract(&divisor, &wide_correction);
    }
    return s;
}

static uint16_t linear_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    bool faster = ramp->faster;
    uint32_t s = ramp->u.linear.sum_q4;
    int32_t slope = ramp->u.linear.slope_q4;
    int32_t curve = ramp->u.linear.curve_q4;
    /* Near standstill (less than 16 groups away) the intervals change too fast to be carried on; where one lasts long
     * there is time enough to compute it. */
    bool from_scratch = ramp->group == 0 || s >> 20 || (int32_t)(s >> 11) >= wide_from_byte(&ramp->u.linear.t_q4, 2);
    float t = 0.0f;
    uint32_t interval_ticks;
    uint32_t slope_q8 = UINT32_MAX;
    if (ramp->group == 0) {
        interval_ticks = linear_estimate(to_float(&ramp->u.linear.t_q4), to_float(&ramp->u.linear.c_q8), faster) >> 4;
    } else {
        interval_ticks = s >> 4;
        slope_q8 = magnitude(slope); /* of the mean interval, between groups */
        slope_q8 = slope_q8 < 0x10000u ? slope_q8 << 4 : UINT32_MAX;
        for (uint16_t g = ramp->group; g > 1; g >>= 1) {
            interval_ticks >>= 1;
            slope_q8 >>= 1;
        }
    }
    uint16_t wish = choose_group(ramp->group_limit, interval_ticks, slope_q8,
                                 from_scratch ? GROUP_MIN_TICKS_LINEAR_FULL : GROUP_MIN_TICKS_LINEAR);
    if (ramp->group != 0) {
        /* Near a standstill accuracy goes before the planner's load. */
        while (wish > 1 && (int32_t)(interval_ticks * wish >> 8) > wide_from_byte(&ramp->u.linear.t_q4, 2))
            wish /= 2;
    }
    ramp->group_limit = wish;
    uint16_t group = limit_group(wish, left);

    if (group != ramp->group) {
        wide_t wide_group = group;
        wide_multiply(&ramp->u.linear.group_c, &wide_group, &ramp->u.linear.c_q8);
        ramp->group = group;
        from_scratch = true;
    }
    if (from_scratch) {
        t = to_float(&ramp->u.linear.t_q4);
        s = linear_estimate(t, to_float(&ramp->u.linear.group_c), faster);
    } else {
        s += (uint32_t)(slope + curve);
    }
    s = linear_exact(ramp, s);
    if (from_scratch) {
        /* Derivatives of sqrt(x * C): change of the duration from group to group = duration^2 / t, and so on. */
        float f = (float)s;
        float ratio = f / (t + f);
        f *= ratio;
        slope = (int32_t)(faster ? -f : f);
        curve = (int32_t)(3.0f * f * ratio);
    } else {
        int32_t slope_before = slope;
        slope = (int32_t)(s - ramp->u.linear.sum_q4);
        curve = slope - slope_before;
    }
    ramp->u.linear.curve_q4 = curve;
    ramp->u.linear.slope_q4 = slope;
    ramp->u.linear.sum_q4 = s;
    wide_t wide_s = s;
    if (faster)
        wide_add(&ramp->u.linear.t_q4, &wide_s);
    else
        wide_subtract(&ramp->u.linear.t_q4, &wide_s);

    sum->ticks = s >> 4;
    sum->frac = (uint8_t)(s << 4);
    uint32_t most = ramp->max_ticks * group;
    if (!faster && sum->ticks >= most) {
        sum->ticks = most;
        sum->frac = 0;
    }
    return group;
}

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    if (ramp->linear)
        return linear_next(ramp, left, sum);
    ramp->steady = 0;
    return harmonic_next(ramp, constants, left, sum);
}
