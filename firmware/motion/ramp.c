/* See ramp.h and docs/design.md. The steady state has neither division nor square root: the last interval is carried
 * on by its slope, the exact remainder of the law tells how far off it is, and a few additions put it right. Floating
 * point is used only to come near at the start of a ramp or when the group size changes; the remainder is exact there
 * too, so no error of it survives. */
#include "motion/ramp.h"
#include <math.h>

/* Shortest group worth planning: the planner's cost per group plus the interrupt's, in cycles = ticks. */
#define GROUP_MIN_TICKS 800u
#define GROUP_MIN_TICKS_FULL 1600u /* harmonic, while every interval has to be computed from scratch */
#define GROUP_MIN_TICKS_LINEAR 1000u
#define GROUP_MIN_TICKS_LINEAR_FULL 3500u
#define GROUP_MAX 128u

void ramp_constants(ramp_constants_t *constants, uint16_t steps_per_rev)
{
    constants->k512 = (96000000000ull * 512u + steps_per_rev / 2u) / steps_per_rev;
    constants->k512_float = (float)constants->k512;
}

/* -- harmonic ---------------------------------------------------------------------------------------------------- */

/* round(k512 / mid2), with its exact remainder: |rest| <= mid2 / 2 or so. */
static uint32_t divide_k(const ramp_constants_t *constants, uint32_t mid2, int32_t *rest)
{
    uint32_t q8 = (uint32_t)(constants->k512_float / (float)mid2);
    /* Modulo 2^32: the true remainder is small. */
    int32_t r = (int32_t)((uint32_t)constants->k512 - q8 * mid2);
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

/* True where divide_k() is valid: the quotient fits 31 bits. */
static bool fits_q8(const ramp_constants_t *constants, uint32_t mid2)
{
    return (uint32_t)(constants->k512 >> 31) < mid2;
}

ramp_time_t ramp_interval(const ramp_constants_t *constants, uint32_t v)
{
    ramp_time_t t;
    uint32_t mid2 = 2 * v;
    if (fits_q8(constants, mid2)) {
        int32_t rest;
        uint32_t q8 = divide_k(constants, mid2, &rest);
        t.ticks = q8 >> 8;
        t.frac = (uint8_t)q8;
    } else {
        uint64_t q8 = constants->k512 / mid2;
        t.ticks = (uint32_t)(q8 >> 8);
        t.frac = (uint8_t)q8;
    }
    return t;
}

uint32_t ramp_velocity(const ramp_constants_t *constants, uint32_t ticks)
{
    return (uint32_t)(constants->k512_float / 512.0f / (float)ticks + 0.5f);
}

void ramp_begin_harmonic(ramp_t *ramp, const ramp_constants_t *constants, uint32_t v_first, uint32_t step, bool faster,
                         uint32_t v_cap)
{
    ramp->linear = false;
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
    while (interval_ticks < min_ticks && at_least < GROUP_MAX) {
        at_least = (uint16_t)(at_least * 2);
        interval_ticks *= 2;
    }
    if (group < at_least)
        return at_least;
    if (slope_q8 <= 40 && group < GROUP_MAX) /* twice the group spreads over less than 2 * 2 * 40 / 256 tick */
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

static void harmonic_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    uint32_t step = ramp->u.harmonic.step;
    uint32_t next2 = ramp->u.harmonic.next2;
    uint32_t interval_ticks = ramp->u.harmonic.q8 >> 8;
    uint32_t spacing2 = 2u * step * ramp->group_limit;
    /* The slope carries on well only where the velocity changes by less than a sixteenth from group to group. */
    bool from_scratch = spacing2 > next2 >> 4;

    uint16_t wish = choose_group(ramp->group_limit, interval_ticks,
                                 ramp->group == 0 ? UINT16_MAX : magnitude(ramp->u.harmonic.slope),
                                 from_scratch ? GROUP_MIN_TICKS_FULL : GROUP_MIN_TICKS);
    if (from_scratch) {
        /* Near a standstill accuracy goes before the planner's load: a group may change by a quarter of its velocity. */
        while (wish > 1 && step * wish > next2 >> 3)
            wish /= 2;
    }
    from_scratch = from_scratch || ramp->group == 0;
    ramp->group_limit = wish;
    uint16_t group = limit_group(wish, left);

    uint32_t half = step * (uint16_t)(group - 1);
    uint32_t mid2 = ramp->faster ? next2 + half : next2 - half;
    ramp->u.harmonic.next2 = ramp->faster ? mid2 + half + 2 * step : mid2 - half - 2 * step;
    if (mid2 > ramp->u.harmonic.cap2) {
        mid2 = ramp->u.harmonic.cap2;
        from_scratch = true;
    }

    uint32_t q8;
    uint32_t total;
    int32_t slope;
    if (from_scratch || group != ramp->group) {
        if (!fits_q8(constants, mid2)) {
            /* More than a second: only at the very start of a crawl. */
            uint64_t wide = constants->k512 / mid2;
            sum->ticks = (uint32_t)(wide >> 8);
            sum->frac = (uint8_t)wide;
            ramp->u.harmonic.q8 = 0xFFFFFFFFu;
            ramp->u.harmonic.mid2 = mid2;
            ramp->group = 0;
            return;
        }
        q8 = divide_k(constants, mid2, &ramp->u.harmonic.rest);
        /* The slope between groups of this size, up to this one, and its change: derivatives of K / v. */
        float ratio = (float)(2u * step * group) / (float)mid2;
        float s = (float)q8 * ratio;
        ramp->u.harmonic.curve = (int32_t)(2.0f * s * ratio);
        slope = (int32_t)(ramp->faster ? -s - s * ratio : s - s * ratio);
        total = q8 * group;
        if (group > 1) {
            /* sum of K / v over the group = group * K / mid * (1 + s2 + s4 + ...), a power series in the relative
             * change y per pulse: s2 = (k^2 - 1) / 12 y^2, s4 = (k^2 - 1)(3 k^2 - 7) / 240 y^4. */
            float k2 = (float)((uint16_t)group * (uint32_t)group);
            float y2 = ratio * ratio / k2;
            float s2 = (k2 - 1.0f) * y2 * (1.0f / 12.0f);
            total += (uint32_t)((float)total * s2 * (1.0f + (3.0f * k2 - 7.0f) * y2 * (1.0f / 20.0f)) + 0.5f);
        }
    } else {
        int32_t r = ramp->u.harmonic.rest;
        uint32_t change2 = mid2 - ramp->u.harmonic.mid2; /* modulo 2^32 */
        q8 = ramp->u.harmonic.q8;
        r -= (int32_t)(change2 * q8);
        int32_t slope_before = ramp->u.harmonic.slope;
        slope = slope_before + ramp->u.harmonic.curve;
        q8 += (uint32_t)slope;
        r -= (int32_t)((uint32_t)slope * mid2);
        int32_t divisor = (int32_t)mid2;
        int32_t half_divisor = divisor >> 1;
        if (r > half_divisor || r < -half_divisor) {
            uint8_t tries = 6;
            int32_t before = slope;
            do {
                if (r > half_divisor) {
                    r -= divisor;
                    slope++;
                } else if (r < -half_divisor) {
                    r += divisor;
                    slope--;
                } else {
                    break;
                }
            } while (--tries);
            if (!tries) {
                int32_t correction = r / divisor;
                slope += correction;
                r -= correction * divisor;
            }
            q8 += (uint32_t)(slope - before);
        }
        ramp->u.harmonic.rest = r;
        ramp->u.harmonic.curve = slope - slope_before;
        total = q8 * group;
        uint32_t s = magnitude(slope + ramp->u.harmonic.curve / 2);
        if (group > 1 && s > 96) {
            /* s2 from above, with s = change over the group: (k - 1/k) / 12 * s^2 / interval */
            uint32_t excess = s < 0x8000u ? s * s / q8 : (uint32_t)((uint64_t)s * s / q8);
            total += (excess * group - excess / group + 6u) / 12u;
        }
    }
    ramp->u.harmonic.slope = slope;
    ramp->u.harmonic.q8 = q8;
    ramp->u.harmonic.mid2 = mid2;
    ramp->group = group;

    sum->ticks = total >> 8;
    sum->frac = (uint8_t)total;
}

/* -- linear ------------------------------------------------------------------------------------------------------ */

uint64_t ramp_linear_c(uint16_t steps_per_rev, uint8_t factor_log2, uint32_t accel_centi)
{
    /* 2 * alpha / accel in ticks^2 * 256 = 2 * (2 pi / (sprf * F)) / (centi / 100) * (16e6)^2 * 256
     *                                    = 8.23549667...e19 / (sprf * F * centi); an eighth of it fits 64 bits. */
    uint64_t divisor = ((uint64_t)steps_per_rev * accel_centi) << factor_log2;
    const uint64_t eighth = 10294370808072384000ull;
    uint64_t whole = eighth / divisor;
    uint64_t rest = eighth - whole * divisor;
    return whole * 8u + rest * 8u / divisor;
}

static float to_float(int64_t x)
{
    return (float)(int32_t)(x >> 32) * 4294967296.0f + (float)(uint32_t)x;
}

uint64_t ramp_linear_time(uint64_t c_q8, uint32_t n, int64_t *rest)
{
    *rest = 0;
    if (n == 0)
        return 0;
    float root = sqrtf((float)n) * sqrtf(to_float((int64_t)(c_q8 >> 1)) * 2.0f);
    uint64_t t = (uint64_t)root;
    for (uint8_t i = 0; i < 2; i++) {
        int64_t missing = (int64_t)(c_q8 * n - t * t); /* modulo 2^64: it is small */
        t += (uint64_t)(int64_t)(to_float(missing) / (2.0f * root));
    }
    *rest = (int64_t)(c_q8 * n - t * t);
    return t;
}

void ramp_begin_linear(ramp_t *ramp, uint64_t c_q8, uint64_t t_q4, int64_t rest, bool faster, uint32_t max_ticks)
{
    ramp->linear = true;
    ramp->faster = faster;
    ramp->group = 0;
    ramp->group_limit = 1;
    ramp->max_ticks = max_ticks;
    ramp->u.linear.t_q4 = t_q4;
    ramp->u.linear.c_q8 = c_q8;
    ramp->u.linear.rest = faster ? rest : -rest;
    ramp->u.linear.sum_q4 = 0;
    ramp->u.linear.slope_q4 = 0;
    ramp->u.linear.curve_q4 = 0;
}

/* Duration of a group from the law, in floating point. */
static uint32_t linear_estimate(uint64_t t_q4, uint64_t group_c, bool faster)
{
    float t = to_float((int64_t)t_q4);
    float c = to_float((int64_t)(group_c >> 1)) * 2.0f;
    float square = faster ? t * t + c : t * t - c;
    if (square < t * t * 1e-5f)
        return (uint32_t)t_q4; /* the last group: to standstill exactly */
    return (uint32_t)(c / (t + sqrtf(square)));
}

static void linear_next(ramp_t *ramp, uint32_t left, ramp_time_t *sum)
{
    uint64_t t = ramp->u.linear.t_q4;
    bool faster = ramp->faster;
    /* Near standstill the intervals change too fast to be carried on. */
    bool from_scratch = ramp->group == 0 || (uint64_t)ramp->u.linear.sum_q4 << 5 > t;
    uint32_t s;
    int32_t slope = ramp->u.linear.slope_q4;
    int32_t curve = ramp->u.linear.curve_q4;
    uint16_t wish = ramp->group_limit;

    if (ramp->group == 0) {
        /* The size of the first group follows from its interval. */
        uint32_t first = linear_estimate(t, ramp->u.linear.c_q8, faster) >> 4;
        wish = choose_group(wish, first, UINT16_MAX, GROUP_MIN_TICKS_LINEAR_FULL);
    } else {
        uint32_t interval_ticks = ramp->u.linear.sum_q4 >> 4;
        uint32_t slope_q8 = magnitude(slope) << 4; /* of the mean interval, between groups */
        for (uint16_t g = ramp->group; g > 1; g >>= 1) {
            interval_ticks >>= 1;
            slope_q8 >>= 1;
        }
        wish = choose_group(wish, interval_ticks, slope_q8,
                            from_scratch ? GROUP_MIN_TICKS_LINEAR_FULL : GROUP_MIN_TICKS_LINEAR);
        /* Near a standstill accuracy goes before the planner's load. */
        while (wish > 1 && (uint64_t)(interval_ticks * wish) << 8 > t)
            wish /= 2;
    }
    ramp->group_limit = wish;
    uint16_t group = limit_group(wish, left);

    if (from_scratch || group != ramp->group) {
        ramp->u.linear.group_c = ramp->u.linear.c_q8 * group;
        s = linear_estimate(t, ramp->u.linear.group_c, faster);
        from_scratch = true;
    } else {
        s = ramp->u.linear.sum_q4 + (uint32_t)(slope + curve);
    }

    /* Exact: group_c = s * (2t + s), or s * (2t - s) when slowing; rest says by how much t^2 is off n * C. */
    int64_t rest = ramp->u.linear.rest;
    uint64_t twice = faster ? 2 * t + s : 2 * t - s;
    rest += (int64_t)(ramp->u.linear.group_c - (uint64_t)s * (uint32_t)twice - ((uint64_t)(s * (uint32_t)(twice >> 32)) << 32));
    int64_t divisor = (int64_t)(faster ? twice + s : twice - s);
    if (divisor > 0) {
        int64_t half = divisor >> 1;
        uint8_t tries = 4;
        while (tries && (rest > half || rest < -half)) {
            int32_t correction = rest > 0 ? 1 : -1;
            if (rest > 8 * half || rest < -8 * half)
                correction = (int32_t)(to_float(rest) / to_float(divisor));
            /* (s + c)(2t + s + c) = s(2t + s) + c(2t + 2s) + c^2 */
            int64_t square = (int64_t)correction * correction;
            rest -= correction * divisor + (faster ? square : -square);
            s += (uint32_t)correction;
            divisor += faster ? 2 * (int64_t)correction : -2 * (int64_t)correction;
            tries--;
        }
    }
    if (from_scratch) {
        /* Derivatives of sqrt(x * C): change of the duration from group to group = duration^2 / t, and so on. */
        float f = (float)s;
        float ratio = f / (to_float((int64_t)t) + f);
        f *= ratio;
        slope = (int32_t)(faster ? -f : f);
        curve = (int32_t)(3.0f * f * ratio);
    } else {
        int32_t slope_before = slope;
        slope = (int32_t)(s - ramp->u.linear.sum_q4);
        curve = slope - slope_before;
    }
    ramp->u.linear.curve_q4 = curve;
    ramp->u.linear.rest = rest;
    ramp->u.linear.slope_q4 = slope;
    ramp->u.linear.sum_q4 = s;
    if (faster)
        ramp->u.linear.t_q4 = t + s;
    else
        ramp->u.linear.t_q4 = t > s ? t - s : 0;
    ramp->group = group;

    sum->ticks = s >> 4;
    sum->frac = (uint8_t)(s << 4);
    uint32_t most = ramp->max_ticks * group;
    if (!faster && sum->ticks >= most) {
        sum->ticks = most;
        sum->frac = 0;
    }
}

uint16_t ramp_next(ramp_t *ramp, const ramp_constants_t *constants, uint32_t left, ramp_time_t *sum)
{
    if (ramp->linear)
        linear_next(ramp, left, sum);
    else
        harmonic_next(ramp, constants, left, sum);
    return ramp->group ? ramp->group : 1;
}
