/* See group.h. On the AVR group.S does this. */
#include "motion/group.h"
#include "base/flash.h"
#include "base/wide.h"
#include "motion/group_layout.h"

/* The mean of 1 / (1 + x) over n pulses, x from -p / 2 to p / 2 (not quite: at the pulses), is nearly 1 + second * p^2 /
 * (1 - fourth * p^2), in 1 / 2^16: all of it for n = 2 and 3, up to p^4 for others. For n = 2 to 8, and roughly for those
 * from 8, 16, 32 and 64 on. */
typedef struct {
    uint16_t fourth, second;
} series_t;
#define SERIES(n) \
    {(uint16_t)(65536.0 * 3 / 20 * (1 - 7.0 / 3 / (n) / (n)) + 0.5),                                                   \
     (uint16_t)(65536.0 / 12 * (1 - 1.0 / (n) / (n)) + 0.5)}
extern const series_t group_series[];
const series_t group_series[] FLASH = {SERIES(2.0), SERIES(3.0), SERIES(4.0),  SERIES(5.0),  SERIES(6.0),
                                       SERIES(7.0), SERIES(8.0), SERIES(16.0), SERIES(32.0), SERIES(1e9)};

#ifdef __AVR__
#include <stddef.h>
#define CHECK(name, type, member) _Static_assert(name == offsetof(type, member), "group_layout.h: " #member)
CHECK(RAMP_LINEAR, ramp_t, linear);
CHECK(RAMP_FASTER, ramp_t, faster);
CHECK(RAMP_V, ramp_t, v);
CHECK(RAMP_STEP, ramp_t, step);
CHECK(RAMP_LIMIT, ramp_t, limit);
CHECK(RAMP_RATE, ramp_t, rate);
CHECK(RAMP_K2, ramp_t, k2_q16);
CHECK(RAMP_K_LACKS, ramp_t, k_lacks);
CHECK(RAMP_CYCLES_LOG2, ramp_t, cycles_log2);
CHECK(RAMP_SPLIT_TICKS, ramp_t, split_ticks);
CHECK(RAMP_LEAST_RUN, ramp_t, least_run);
CHECK(RAMP_X, ramp_t, x);
CHECK(RAMP_C, ramp_t, c);
CHECK(RAMP_STEEP, ramp_t, steep);
CHECK(RAMP_BOUNDED, ramp_t, bounded);
CHECK(RAMP_REST, ramp_t, rest);
CHECK(RAMP_GROUP_LOG2, ramp_t, group_log2);
CHECK(RAMP_MOST_LOG2, ramp_t, most_log2);
CHECK(RAMP_RUN_PULSES, ramp_t, run_pulses);
CHECK(RAMP_TICKS, ramp_t, ticks);
CHECK(CONSTANTS_STEPS_PER_REV, ramp_constants_t, steps_per_rev);
CHECK(CONSTANTS_CYCLES_LOG2, ramp_constants_t, cycles_log2);
CHECK(CONSTANTS_SPLIT_TICKS, ramp_constants_t, split_ticks);
_Static_assert(offsetof(ramp_constants_t, k2_q16) == 0, "ramp.S");
CHECK(GROUP_SUM, group_t, sum_q16);
CHECK(GROUP_END, group_t, end_q16);
_Static_assert(GROUP_SIZE == sizeof(group_t), "group_layout.h: size of group_t");
_Static_assert(BLOCK_TOP == 0 && BLOCK_SLOPE == 4 && BLOCK_CURVE == 8 && BLOCK_THIRD == 12 && BLOCK_WIDTH == 14,
               "group.S goes from one to the next");
_Static_assert(GROUP_MAX_TICKS % 256 == 0 && GROUP_MAX_STEEP_TICKS % 256 == 0, "ramp.S sets their upper bytes alone");
_Static_assert(LINEAR_RATE_SHIFT == 7 && RUN_MAX_PULSES == 128, "group.S has them in its code");
#endif

#if !defined __AVR__ || defined GROUP_IN_C

static const series_t *series(uint16_t pulses)
{
    uint8_t place = 6;
    if (pulses < 8)
        place = (uint8_t)(pulses - 2);
    for (; place < 9 && pulses >= 16; place++)
        pulses >>= 1;
    return &group_series[place];
}

/* Of the intervals from the one at the mean of the velocities at the ends, which becomes their mean: that, times the part by
 * which the velocity changes in the group, times it again ... */
typedef struct {
    uint32_t mean, slope, curve, third;
} shape_t;

static void shape(const ramp_t *ramp, shape_t *q16, uint16_t pulses)
{
    uint32_t mean = q16->mean;
    uint32_t rate_q40 = ramp->rate;
    if (ramp->linear)
        rate_q40 = wide_fraction(mean, rate_q40) << LINEAR_RATE_SHIFT;
    uint32_t part = wide_fraction(mean * pulses, rate_q40) << 8;
    uint32_t slope = wide_fraction(mean, part);
    uint32_t curve = wide_fraction(slope, part);
    uint32_t third = wide_fraction(curve, part);
    q16->slope = slope;
    q16->curve = ramp->linear ? 3 * curve : 2 * curve;
    q16->third = third;
    if (ramp->linear)
        return;
    const series_t *factors = series(pulses);
    uint32_t fourth = (uint32_t)flash_u16(&factors->fourth) << 16;
    uint32_t term = wide_fraction(wide_fraction(third, part), fourth);
    curve += term;
    if (ramp->steep > 1)
        curve += wide_fraction(wide_fraction(wide_fraction(term, part), part), fourth);
    q16->mean = mean + wide_fraction(curve, (uint32_t)flash_u16(&factors->second) << 16);
}

/* Divides a group of that shape into runs. */
static void divide(const ramp_t *ramp, const shape_t *q16, block_t *block, uint16_t pulses)
{
    uint8_t run = 1;
    uint16_t runs = pulses;
    while ((runs & 1) == 0 && run < RUN_MAX_PULSES) {
        runs >>= 1;
        run = (uint8_t)(run << 1);
    }
    uint32_t slope = q16->slope;
    uint32_t curve = q16->curve;
    uint32_t third = q16->third;
    if (runs > 1) {
        uint32_t part = UINT32_MAX / runs; /* as good as 2^32 / runs */
        slope = wide_fraction(slope, part);
        curve = wide_fraction(wide_fraction(curve, part), part);
        third = wide_fraction(third, part);
    }
    uint8_t odd = (uint8_t)runs;
    /* How many pulses may share one or two timer values. */
    uint16_t ticks = ramp->ticks;
    uint8_t run_pulse_ticks = (uint8_t)(RUN_PULSE_CYCLES >> ramp->cycles_log2);
    if (ticks > run_pulse_ticks) {
        uint16_t span = (uint16_t)((ticks - run_pulse_ticks) * run);
        uint16_t least = (uint16_t)((uint16_t)(2 * RUN_CYCLES * (ramp->steep + 1)) >> ramp->cycles_log2);
        uint32_t most = ticks < ramp->split_ticks ? RUN_SLOPE_Q16 / 4 : RUN_SLOPE_Q16;
        while (run > ramp->least_run && slope > most && span >= least) {
            run >>= 1;
            odd = (uint8_t)(odd << 1);
            span >>= 1;
            slope >>= 1;
            third >>= 1;
            curve >>= 2;
        }
    }
    block->pulses = run;
    block->runs = odd;
    /* The cubic part: so that two and four runs are right, and of more all nearly. */
    uint8_t cubic_q8 = odd == 2 ? 16 : odd == 4 ? 36 : 48;
    slope += wide_fraction(third, (uint32_t)cubic_q8 << 24);
    /* From the law's to the differences of the runs. */
    uint8_t steps = (uint8_t)(odd - 1);
    uint32_t bend = curve * (uint8_t)(odd - 2); /* (of no use where there is one run only) */
    slope = ramp->faster ? 0u - slope : slope;
    slope -= (uint32_t)((int32_t)bend >> 1);
    block->slope_q16 = (int32_t)slope;
    block->curve_q16 = (int32_t)curve;
    uint32_t sixth = wide_fraction(bend * steps, SIXTH_Q32);
    block->top_q16 = q16->mean - 65536u - sixth - (uint32_t)((int32_t)(slope * steps) >> 1);
}

void group_plan(const ramp_t *ramp, group_t *group, block_t *block, uint16_t pulses)
{
    shape_t q16 = {.mean = wide_half(&group->sum_q16, 0)};
    shape(ramp, &q16, pulses);
    uint32_t half = q16.slope >> 1;
    wide_set(&group->end_q16, ramp->faster ? q16.mean - half : q16.mean + half);
    wide_set(&group->sum_q16, q16.mean * pulses);
    if (!ramp->rest && (ramp->ticks >= ramp->split_ticks || pulses >= UNSPLIT_LEAST))
        divide(ramp, &q16, block, pulses);
}
#endif
