/* motion/group: shape and runs of groups. On the AVR, where it is assembler, the same as in C for each of many groups. */
#include "motion/group.h"
#include "host/any_ramp.h"
#include "unity.h"

/* group.c once more, under other names. */
#define GROUP_IN_C
#define group_series series_in_c
#define group_plan plan_in_c
#include "motion/group.c"
#undef group_plan

#define MIDDLE_Q16 (500ul << 16)
#define RATE_Q40 ((1ull << 40) / 8 / 64 / 500)

static ramp_t ramp;
static group_t group;
static block_t block;

void setUp(void)
{
    ramp = (ramp_t){.faster = true, .least_run = 1, .split_ticks = 128, .ticks = MIDDLE_Q16 >> 16, .rate = RATE_Q40};
    group = (group_t){.sum_q16 = MIDDLE_Q16};
    block = (block_t){.runs = 0};
}

void tearDown(void)
{
}

/* Any ramp, whether there can be such a one or not. */
static void choose_ramp(void)
{
    uint32_t bits = choose_kind(&ramp);
    ramp.ticks = (uint16_t)next_value();
    ramp.rate = next_value();
    ramp.rest = bits >> 4 == 0;
    group.sum_q16 = next_value();
    block.runs = 0;
}

static uint16_t choose_pulses(void)
{
    uint32_t bits = next_bits();
    uint16_t pulses = (uint16_t)(bits >> 16 & 511);
    if (bits & 1)
        return (uint16_t)(2u << pulses % 9);
    return pulses < 2 ? 2 : pulses;
}

static void assert_same_as_in_c(uint16_t pulses)
{
    ramp_t ramp_before = ramp;
    group_t expected = group;
    block_t expected_block = block;
    plan_in_c(&ramp, &expected, &expected_block, pulses);
    group_plan(&ramp, &group, &block, pulses);
    TEST_ASSERT_EQUAL_MEMORY(&ramp_before, &ramp, sizeof ramp);
    TEST_ASSERT_TRUE(expected.sum_q16 == group.sum_q16);
    TEST_ASSERT_TRUE(expected.end_q16 == group.end_q16);
    TEST_ASSERT_EQUAL_UINT8(expected_block.runs, block.runs);
    if (block.runs == 0)
        return;
    TEST_ASSERT_EQUAL_UINT8(expected_block.pulses, block.pulses);
    TEST_ASSERT_EQUAL_HEX32(expected_block.top_q16, block.top_q16);
    TEST_ASSERT_EQUAL_HEX32(expected_block.slope_q16, block.slope_q16);
    TEST_ASSERT_EQUAL_HEX32(expected_block.curve_q16, block.curve_q16);
}

static void test_any_group_is_the_same_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 5000; i++) {
        choose_ramp();
        assert_same_as_in_c(choose_pulses());
    }
}

static uint16_t choose_short_group(void)
{
    choose_ramp();
    const uint16_t pulses = choose_pulses();
    group.sum_q16 = (uint32_t)group.sum_q16 / pulses | 0x10000;
    ramp.ticks = (uint16_t)((uint32_t)group.sum_q16 >> 16);
    return pulses;
}

static void test_groups_of_less_than_65536_ticks_are_the_same_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 5000; i++) {
        const uint16_t pulses = choose_short_group();
        assert_same_as_in_c(pulses);
    }
}

static void test_groups_in_which_the_velocity_changes_by_little_are_the_same_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 5000; i++) {
        const uint16_t pulses = choose_short_group();
        ramp.rate = (uint32_t)((RATE_Q40 * 64 * 500 + (next_bits() >> 8 & 0xFFFFFF)) / pulses / ramp.ticks);
        assert_same_as_in_c(pulses);
    }
}

/* An eighth in 64 pulses. */
static void test_intervals_of_a_harmonic_group_fall_by_the_part(void)
{
    uint32_t mean = MIDDLE_Q16 + MIDDLE_Q16 / 768 + MIDDLE_Q16 / 327680;
    group_plan(&ramp, &group, &block, 64);
    TEST_ASSERT_UINT32_WITHIN(100 * 64, mean * 64, (uint32_t)group.sum_q16);
    TEST_ASSERT_UINT32_WITHIN(100, mean - MIDDLE_Q16 / 16, (uint32_t)group.end_q16);
}

static void test_runs_last_long_enough_and_sum_up_to_the_group(void)
{
    group_plan(&ramp, &group, &block, 64);
    TEST_ASSERT_EQUAL_UINT8(2, block.pulses);
    TEST_ASSERT_EQUAL_UINT8(32, block.runs);
    uint32_t first = block.top_q16, sum = 0;
    for (uint8_t run = 0; run < 32; run++) {
        sum += 2 * (block.top_q16 + 65536u);
        block.top_q16 += (uint32_t)block.slope_q16;
        block.slope_q16 += block.curve_q16;
    }
    TEST_ASSERT_UINT32_WITHIN(64, (uint32_t)group.sum_q16, sum);
    TEST_ASSERT_UINT32_WITHIN(MIDDLE_Q16 / 100, MIDDLE_Q16 / 8, first - block.top_q16);
}

static void test_the_last_few_pulses_have_no_runs(void)
{
    ramp.rest = true;
    group_plan(&ramp, &group, &block, 64);
    TEST_ASSERT_EQUAL_UINT8(0, block.runs);
    ramp.rest = false;
    ramp.ticks = 100;
    group.sum_q16 = 100ul << 16;
    group_plan(&ramp, &group, &block, 7);
    TEST_ASSERT_EQUAL_UINT8(0, block.runs);
    group.sum_q16 = 100ul << 16;
    group_plan(&ramp, &group, &block, 8);
    TEST_ASSERT_EQUAL_UINT8(1, block.runs);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_any_group_is_the_same_in_c_to_the_bit);
    RUN_TEST(test_groups_of_less_than_65536_ticks_are_the_same_in_c_to_the_bit);
    RUN_TEST(test_groups_in_which_the_velocity_changes_by_little_are_the_same_in_c_to_the_bit);
    RUN_TEST(test_intervals_of_a_harmonic_group_fall_by_the_part);
    RUN_TEST(test_runs_last_long_enough_and_sum_up_to_the_group);
    RUN_TEST(test_the_last_few_pulses_have_no_runs);
    return UNITY_END();
}
