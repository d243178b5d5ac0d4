/* motion/ramp: intervals and their sums. The table's sums come from motion_exact, which the host checks; the AVR runs
 * the same ramps against the same sums. */
#include "motion/profile.h"
#include "motion/ramp.h"
#include "unity.h"

#ifdef __AVR__
#include <avr/pgmspace.h>
#define TABLE PROGMEM
#define table_copy(to, from) memcpy_P((to), (from), sizeof *(to))
#else
#include <math.h>
#include <stdio.h>
#include "host/motion_exact.h"
#define TABLE
#define table_copy(to, from) (*(to) = *(from))
#endif

#define SLOW_RPM 10

static ramp_constants_t constants;
static ramp_t ramp;
static block_t block; /* the last group's runs */

void setUp(void)
{
    ramp_constants(&constants, 200, 16000000);
}

void tearDown(void)
{
}

typedef struct {
    uint8_t linear, faster; /* linear and slower: to a stop */
    uint8_t factor_log2;
    uint16_t rpm; /* at the first pulse; 0: from standstill, or to a stop */
    uint16_t centi;
    uint16_t pulses;
    uint32_t ticks; /* sum of the intervals */
} case_t;

static const case_t cases[] TABLE = {
    {0, 1, 0, 10, 100, 90, 11272364},
    {0, 1, 0, 10, 50, 180, 22322796},
    {0, 1, 0, 10, 1000, 500, 3260555},
    {0, 0, 0, 100, 100, 90, 10840364},
    {0, 1, 0, 10, 33, 2000, 61396903},
    {0, 1, 3, 10, 100, 720, 11079470},
    {0, 1, 4, 10, 1000, 4000, 2667314},
    {0, 0, 4, 640, 250, 3900, 5831471},
    {0, 1, 0, 10, 9999, 50, 687753},
    {0, 1, 0, 1000, 7, 5000, 20579223},
    {0, 0, 0, 3000, 500, 590, 3884170},
    {0, 1, 7, 10, 999, 12000, 2188165},
    {1, 1, 0, 0, 1047, 166, 15969474},
    {1, 0, 0, 0, 1047, 166, 15176597},
    {1, 1, 0, 0, 500, 893, 53598254},
    {1, 0, 0, 0, 500, 893, 51931060},
    {1, 1, 0, 0, 50000, 20000, 25365295},
    {1, 0, 0, 0, 50000, 20000, 25365295},
    {1, 1, 4, 0, 2500, 10000, 20053026},
    {1, 0, 4, 0, 2500, 10000, 19717943},
    {1, 1, 7, 0, 9999, 30000, 6140267},
    {1, 0, 7, 0, 9999, 30000, 6056488},
    {1, 1, 0, 0, 10, 40, 80212105},
    {1, 0, 0, 0, 10, 40, 19200000},
    {1, 1, 0, 0, 60000, 1, 163732},
};
#define CASES (sizeof cases / sizeof cases[0])

static void begin_harmonic(uint32_t v_first, uint32_t step, bool faster)
{
    ramp.linear = false;
    ramp.faster = faster;
    ramp.v = v_first;
    ramp.limit.cap = UINT32_MAX >> 1;
    ramp.step = step;
    ramp_begin(&ramp, &constants, v_first, 0);
}

static void begin(const case_t *c)
{
    uint16_t factor = (uint16_t)(1u << c->factor_log2);
    if (!c->linear) {
        begin_harmonic((uint32_t)c->rpm * 100u * factor, c->centi, c->faster);
        return;
    }
    /* The highest velocity, in RPM / 100 and pulses: v^2 = 2 * accel * way. */
    wide_t v2 = (wide_t)c->pulses * c->centi * factor * 114592u / 200u;
    ramp.linear = true;
    ramp.faster = c->faster;
    ramp.v = 0;
    ramp.limit.bound_q16 = c->faster ? 0 : ((wide_t)constants.clock_hz * 3u << 16) / (10u * SLOW_RPM * factor);
    ramp.step = (uint32_t)c->centi * factor;
    ramp_begin(&ramp, &constants, wide_root(&v2) + 1, c->pulses);
}

static ramp_time_t interval_at(uint32_t v)
{
    ramp_time_t t;
    ramp_interval_q16(&t.q16, &constants, v);
    return t;
}

/* As many as ramp_next() takes. */
static uint16_t few(uint32_t pulses)
{
    return pulses > UINT16_MAX ? UINT16_MAX : (uint16_t)pulses;
}

/* The sum of the ramp's intervals in 1/65536 ticks. */
static uint64_t run(uint32_t pulses)
{
    uint64_t sum_q16 = 0;
    while (pulses) {
        ramp_time_t sum;
        uint16_t group = ramp_next(&ramp, few(pulses), &sum, &block);
        TEST_ASSERT_TRUE(group >= 1 && group <= pulses);
        pulses -= group;
        sum_q16 += ((uint64_t)sum.ticks << 16) + sum.frac_q16;
    }
    return sum_q16;
}

/* HAR-002, HAR-003, HAR-019, LIN-001, LIN-002, LIN-020 */
static void test_ramps_take_the_time_that_their_law_says(void)
{
    for (uint8_t i = 0; i < CASES; i++) {
        case_t c;
        table_copy(&c, &cases[i]);
        begin(&c);
        uint32_t ticks = (uint32_t)((run(c.pulses) + 32768) >> 16);
        uint32_t allowed = 1u + c.pulses / 1000u;
        TEST_ASSERT_UINT32_WITHIN_MESSAGE(allowed, c.ticks, ticks, "ticks of a case");
    }
}

/* Frequencies, and the CPU cycles of a tick as a power of two, not more than there are. */
typedef struct {
    uint32_t hz;
    uint8_t cycles_log2;
} clock_case_t;

static const clock_case_t clocks[] TABLE = {{400000, 5},  {500000, 5},  {999999, 4},  {1000000, 4}, {1048576, 3},
                                            {1843200, 3}, {2000000, 3}, {3686400, 2}, {6400000, 1}, {16000000, 0}};
#define CLOCKS (sizeof clocks / sizeof clocks[0])

/* CLK-012 */
static void test_ramps_take_the_same_time_with_another_clock(void)
{
    for (uint8_t k = 0; k < CLOCKS; k++) {
        clock_case_t clock;
        table_copy(&clock, &clocks[k]);
        ramp_constants(&constants, 200, clock.hz);
        for (uint8_t i = 0; i < CASES; i++) {
            case_t c;
            table_copy(&c, &cases[i]);
            begin(&c);
            uint32_t ticks = (uint32_t)((run(c.pulses) + 32768) >> 16);
            uint32_t expected = (uint32_t)((uint64_t)c.ticks * clock.hz / 16000000u);
            TEST_ASSERT_UINT32_WITHIN_MESSAGE(2u + c.pulses / 1000u, expected, ticks, "ticks of a case");
        }
    }
}

/* CLK-012 */
static void test_constants_follow_the_clock(void)
{
    for (uint8_t k = 0; k < CLOCKS; k++) {
        clock_case_t clock;
        table_copy(&clock, &clocks[k]);
        ramp_constants(&constants, 200, clock.hz);
        TEST_ASSERT_EQUAL_UINT32(clock.hz, constants.clock_hz);
        TEST_ASSERT_EQUAL_UINT8(clock.cycles_log2, constants.cycles_log2);
        TEST_ASSERT_EQUAL_UINT8(clock.cycles_log2 ? 0 : BLOCK_SPLIT_TICKS, constants.split_ticks);
        ramp_time_t t = interval_at(7000); /* 70 RPM: 30 ms / 7 */
        uint64_t q16 = ((uint64_t)clock.hz * 3u << 16) / 700u;
        TEST_ASSERT_EQUAL_UINT32((uint32_t)(q16 >> 16), t.ticks);
        TEST_ASSERT_UINT32_WITHIN(1, (uint16_t)q16, t.frac_q16);
        TEST_ASSERT_UINT32_WITHIN(1 + 7000 / t.ticks, 7000, ramp_velocity(&constants, t.ticks + (t.frac_q16 >= 32768)));
    }
}

/* The order in which a ramp is asked for does not matter: the engine takes the last interval by itself. */
static void test_pieces_of_a_ramp_add_up_to_the_whole(void)
{
    for (uint8_t i = 0; i < CASES; i++) {
        case_t c;
        table_copy(&c, &cases[i]);
        if (c.pulses < 40)
            continue;
        begin(&c);
        uint64_t sum_q16 = run(17);
        sum_q16 += run(c.pulses - 18u);
        sum_q16 += run(1);
        uint32_t allowed = 1u + c.pulses / 1000u;
        TEST_ASSERT_UINT32_WITHIN(allowed, c.ticks, (uint32_t)((sum_q16 + 32768) >> 16));
    }
}

/* However many pulses are left: the runs of a group are as many pulses as the group, and last as long. */
static void test_the_runs_of_a_group_add_up_to_it(void)
{
    for (uint16_t left = 1; left < 700; left = (uint16_t)(left + (left < 300 ? 7 : 1))) {
        for (uint8_t step = 1; step <= 101; step += 50) {
            begin_harmonic(left < 500 ? 6000000 : 2000000, step, false);
            ramp_time_t sum;
            (void)ramp_next(&ramp, 5000, &sum, &block); /* a large one first */
            uint16_t group = ramp_next(&ramp, left, &sum, &block);
            TEST_ASSERT_TRUE(group >= 1 && group <= left);
            if (block.runs == 0)
                continue;
            TEST_ASSERT_EQUAL_UINT16(group, (uint16_t)(block.runs * block.pulses));
            uint32_t top = block.top_q16, sum_q16 = 0;
            int32_t slope = block.slope_q16;
            for (uint8_t i = 0; i < block.runs; i++) {
                sum_q16 += (top + 65536u) * block.pulses;
                top += (uint32_t)slope;
                slope += block.curve_q16;
            }
            TEST_ASSERT_UINT32_WITHIN(1311, sum.ticks << 16 | sum.frac_q16, sum_q16); /* a fiftieth of a tick */
        }
    }
}

/* HAR-010, HAR-011, SLO-001 */
static void test_the_interval_at_a_speed_is_300000_us_by_rpm(void)
{
    ramp_time_t t = interval_at(1000);
    TEST_ASSERT_EQUAL_UINT32(480000, t.ticks);
    TEST_ASSERT_EQUAL_UINT16(0, t.frac_q16);
    t = interval_at(15000); /* 150 RPM: 2000 us */
    TEST_ASSERT_EQUAL_UINT32(32000, t.ticks);
    t = interval_at(7000); /* 70 RPM: 4285.714 us = 68571.43 ticks */
    TEST_ASSERT_EQUAL_UINT32(68571, t.ticks);
    TEST_ASSERT_UINT32_WITHIN(1, 110, t.frac_q16 >> 8);
}

static void test_speed_and_interval_are_each_others_inverse(void)
{
    for (uint32_t v = 1000; v < 15000000; v += v / 7) {
        ramp_time_t t = interval_at(v);
        uint32_t back = ramp_velocity(&constants, t.ticks + (t.frac_q16 >= 32768));
        /* Half a tick and the 24 bits of a float. */
        TEST_ASSERT_UINT32_WITHIN(1 + v / t.ticks + (v >> 22), v, back);
    }
}

static uint32_t first_linear_interval(uint16_t steps_per_rev, uint8_t factor_log2)
{
    ramp_constants(&constants, steps_per_rev, 16000000);
    case_t c = {.linear = 1, .faster = 1, .factor_log2 = factor_log2, .centi = 1047, .pulses = 1000};
    begin(&c);
    ramp_time_t first;
    (void)ramp_next(&ramp, 1, &first, &block);
    return first.ticks;
}

/* LIN-003, LIN-010, LIN-017 */
static void test_the_linear_start_follows_motor_and_acceleration(void)
{
    /* sqrt(2 * (2 pi / 200) / 10.47) * 16e6 ticks, and with twice the steps or sixteen microsteps */
    TEST_ASSERT_UINT32_WITHIN(1, 1239471, first_linear_interval(200, 0));
    TEST_ASSERT_UINT32_WITHIN(1, 876438, first_linear_interval(400, 0));
    TEST_ASSERT_UINT32_WITHIN(1, 309868, first_linear_interval(200, 4));
}

#ifndef __AVR__
static void exact_of(exact_ramp_t *law, const case_t *c)
{
    exact_motor_t motor = {.steps_per_rev = 200, .factor = 1u << c->factor_log2, .slow_rpm = SLOW_RPM};
    if (c->linear && !c->faster)
        exact_decel(law, &motor, c->pulses, 0, c->centi, true);
    else
        exact_accel(law, &motor, c->rpm, c->rpm == 0, c->faster, 0, c->centi, c->linear);
}

static void test_the_sums_of_the_table_are_those_of_the_law(void)
{
    for (size_t i = 0; i < CASES; i++) {
        exact_ramp_t law;
        exact_of(&law, &cases[i]);
        TEST_ASSERT_EQUAL_UINT32((uint32_t)llroundl(exact_ramp_time(&law, cases[i].pulses)), cases[i].ticks);
    }
}

static void test_the_law_in_closed_form_is_the_sum_of_its_intervals(void)
{
    for (size_t i = 0; i < CASES; i++) {
        exact_ramp_t law;
        exact_of(&law, &cases[i]);
        long double sum = 0;
        for (uint32_t k = 0; k < cases[i].pulses; k++)
            sum += exact_ramp_interval(&law, k);
        TEST_ASSERT_DOUBLE_WITHIN(0.001, (double)sum, (double)exact_ramp_time(&law, cases[i].pulses));
    }
}

/* Pulse i of the last group as the engine plays it (but for what is carried from run to run): runs of two neighbouring
 * values, along the group's parabola; or without runs, all of them. */
static long double played_interval(const ramp_time_t *sum, uint16_t group, uint16_t i)
{
    unsigned run = block.runs ? block.pulses : group;
    long double mean = (sum->ticks + sum->frac_q16 / 65536.0L) / group;
    if (block.runs) {
        long double k = i / run;
        mean = 1.0L + (block.top_q16 + block.slope_q16 * k + block.curve_q16 * k * (k - 1.0L) / 2.0L) / 65536.0L;
    }
    long double longer = (mean - floorl(mean)) * run;
    long double place = ramp.faster ? i % run : run - 1 - i % run;
    return floorl(mean) + (place < longer - 0.5L);
}

/* Each pulse against its own interval of the law: 0.1 % or one tick, 0.03 % in the mean square. */
static void assert_intervals(const case_t *c)
{
    exact_ramp_t law;
    exact_of(&law, c);
    begin(c);
    uint32_t k = 0;
    long double squares = 0;
    while (k < c->pulses) {
        ramp_time_t sum;
        uint16_t group = ramp_next(&ramp, few(c->pulses - k), &sum, &block);
        for (uint16_t i = 0; i < group; i++, k++) {
            long double exact = exact_ramp_interval(&law, k);
            long double played = played_interval(&sum, group, i);
            long double off = fabsl(played - exact);
            if (off > 1.0L && off > exact / 1000.0L) {
                char text[160];
                snprintf(text, sizeof text, "l%u a%.2f, %u RPM, factor %u, pulse %u: %.3Lf, exact %.3Lf", c->linear,
                         c->centi / 100.0, c->rpm, 1u << c->factor_log2, k, played, exact);
                TEST_FAIL_MESSAGE(text);
            }
            off = off > 1.0L ? off / exact : 0;
            squares += off * off;
        }
    }
    TEST_ASSERT_TRUE(sqrtl(squares / c->pulses) <= 0.0003L);
}

/* HAR-002, HAR-013, LIN-001, SLO-005 */
static void test_every_interval_of_usual_ramps_is_within_a_thousandth_or_one_tick(void)
{
    static const uint16_t harmonic[] = {10, 50, 100, 125, 250, 333, 500, 800, 1000};
    static const uint16_t linear[] = {100, 500, 1047, 2500, 5000, 12000, 25000, 50000};
    for (uint8_t factor_log2 = 0; factor_log2 < 5; factor_log2++) {
        uint32_t top_rpm = 60000u >> factor_log2; /* 200 kHz */
        for (size_t i = 0; i < sizeof harmonic / sizeof harmonic[0]; i++) {
            uint32_t pulses = ((top_rpm - SLOW_RPM) * 100u << factor_log2) / harmonic[i];
            pulses = pulses > 60000u ? 60000u : pulses;
            case_t c = {.faster = 1, .factor_log2 = factor_log2, .rpm = SLOW_RPM, .centi = harmonic[i],
                        .pulses = (uint16_t)pulses};
            assert_intervals(&c);
            c.faster = 0;
            c.rpm = (uint16_t)(SLOW_RPM + ((pulses - 1) * harmonic[i] / 100u >> factor_log2));
            c.pulses = (uint16_t)((((uint32_t)c.rpm - SLOW_RPM) * 100u << factor_log2) / harmonic[i]);
            assert_intervals(&c);
        }
        for (size_t i = 0; i < sizeof linear / sizeof linear[0]; i++) {
            if ((uint32_t)linear[i] << factor_log2 > 50000u)
                continue; /* steeper in pulses: shares intervals more widely */
            case_t c = {.linear = 1, .faster = 1, .factor_log2 = factor_log2, .centi = linear[i], .pulses = 40000};
            assert_intervals(&c);
            c.faster = 0;
            assert_intervals(&c);
        }
    }
}

/* SLO-005. Where pulses have runs of their own they are within half a percent, and none is slower than slow speed. */
static void test_a_steep_ramp_begins_at_slow_speed(void)
{
    case_t c = {.faster = 1, .factor_log2 = 6, .rpm = SLOW_RPM, .pulses = 300};
    for (c.centi = 3000; c.centi < 30000; c.centi += 100) {
        exact_ramp_t law;
        exact_of(&law, &c);
        begin(&c);
        unsigned alone = 0;
        for (uint32_t k = 0; k < c.pulses;) {
            ramp_time_t sum;
            uint16_t group = ramp_next(&ramp, few(c.pulses - k), &sum, &block);
            for (uint16_t i = 0; i < group; i++, k++) {
                long double played = played_interval(&sum, group, i);
                TEST_ASSERT_TRUE(played <= 7500);
                if (group > 1 && block.runs == group) {
                    long double exact = exact_ramp_interval(&law, k);
                    TEST_ASSERT_TRUE(fabsl(played - exact) <= exact / 200 + 1);
                    alone++;
                }
            }
        }
        TEST_ASSERT_TRUE(alone > 0);
    }
}

/* LIN-018 */
static void test_axes_whose_speed_and_acceleration_are_scaled_alike_arrive_together(void)
{
    /* 100 RPM at 10.47 and 50 RPM at 5.235 (5.24): ramps of 166 and 83 steps. */
    case_t fast = {.linear = 1, .faster = 1, .centi = 1047, .pulses = 166};
    case_t slow = {.linear = 1, .faster = 1, .centi = 524, .pulses = 83};
    begin(&fast);
    uint64_t one = run(fast.pulses);
    begin(&slow);
    uint64_t other = run(slow.pulses);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, (double)one / (double)other);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, (double)one / 65536.0 / 16e6);
}
#endif

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_ramps_take_the_time_that_their_law_says);
    RUN_TEST(test_ramps_take_the_same_time_with_another_clock);
    RUN_TEST(test_constants_follow_the_clock);
    RUN_TEST(test_pieces_of_a_ramp_add_up_to_the_whole);
    RUN_TEST(test_the_runs_of_a_group_add_up_to_it);
    RUN_TEST(test_the_interval_at_a_speed_is_300000_us_by_rpm);
    RUN_TEST(test_speed_and_interval_are_each_others_inverse);
    RUN_TEST(test_the_linear_start_follows_motor_and_acceleration);
#ifndef __AVR__
    RUN_TEST(test_the_sums_of_the_table_are_those_of_the_law);
    RUN_TEST(test_the_law_in_closed_form_is_the_sum_of_its_intervals);
    RUN_TEST(test_every_interval_of_usual_ramps_is_within_a_thousandth_or_one_tick);
    RUN_TEST(test_a_steep_ramp_begins_at_slow_speed);
    RUN_TEST(test_axes_whose_speed_and_acceleration_are_scaled_alike_arrive_together);
#endif
    return UNITY_END();
}
