/* motion/ramp: on the AVR, where its groups come from assembler, the same as in C for each of many ramps, possible or not. */
#include "motion/ramp.h"
#include "host/any_ramp.h"
#include "unity.h"
#include <string.h>

/* ramp.c once more, under other names. */
#define RAMP_IN_C
#define ramp_constants constants_in_c
#define ramp_interval_q16 interval_q16_in_c
#define ramp_velocity velocity_in_c
#define ramp_square square_in_c
#define ramp_divide_k divide_k_in_c
#define ramp_begin begin_in_c
#define ramp_next next_in_c
#include "motion/ramp.c"
#undef ramp_constants
#undef ramp_interval_q16
#undef ramp_square
#undef ramp_begin
#undef ramp_next

static ramp_constants_t constants;
static ramp_t ramp, expected;
static block_t block, expected_block;

void setUp(void)
{
    ramp_constants(&constants, 200, 16000000);
}

void tearDown(void)
{
}

static uint32_t value_of_bits(uint8_t bits)
{
    return (next_bits() | 0x80000000u) >> (32 - bits);
}

/* Of least to most bits. */
static uint32_t value_between(uint8_t least, uint8_t most)
{
    return value_of_bits((uint8_t)(least + (next_bits() >> 16) % (most - least + 1u)));
}

static bool one_in(uint8_t so_many)
{
    return (next_bits() >> 16) % so_many == 0;
}

static void assert_same_ramp(void)
{
    TEST_ASSERT_EQUAL_MEMORY(&expected, &ramp, sizeof ramp);
}

/* Returns the group's pulses. */
static uint16_t next_is_the_same(uint16_t left)
{
    ramp_time_t sum, expected_sum;
    expected = ramp;
    block.runs = expected_block.runs = 99;
    uint16_t expected_pulses = next_in_c(&expected, left, &expected_sum, &expected_block);
    uint16_t pulses = ramp_next(&ramp, left, &sum, &block);
    TEST_ASSERT_EQUAL_UINT16(expected_pulses, pulses);
    assert_same_ramp();
    TEST_ASSERT_TRUE(expected_sum.q16 == sum.q16);
    TEST_ASSERT_EQUAL_UINT8(expected_block.runs, block.runs);
    if (block.runs) {
        TEST_ASSERT_EQUAL_UINT8(expected_block.pulses, block.pulses);
        TEST_ASSERT_EQUAL_HEX32(expected_block.top_q16, block.top_q16);
        TEST_ASSERT_EQUAL_HEX32(expected_block.slope_q16, block.slope_q16);
        TEST_ASSERT_EQUAL_HEX32(expected_block.curve_q16, block.curve_q16);
    }
    return pulses;
}

static wide_t next_wide(void)
{
    wide_t x = next_bits();
    x = x << 32 | next_bits();
    return x >> (next_bits() >> 26);
}

/* Any ramp, whether there can be such a one or not. */
static void choose_ramp(void)
{
    uint32_t bits = choose_kind(&ramp);
    ramp.k_lacks = (uint8_t)(bits & 7);
    ramp.bounded = bits >> 3 == 0;
    bits = next_bits();
    ramp.group_log2 = (uint8_t)((bits & 0xFF) % (GROUP_MAX_LOG2 + 1));
    ramp.most_log2 = (uint8_t)(bits >> 8 & 1 ? GROUP_MAX_LOG2 : (bits >> 9 & 0xFF) % (GROUP_MAX_LOG2 + 1));
    ramp.run_pulses = (uint8_t)(bits >> 17 & 3 ? 1u << (bits >> 19 & 7) : 0);
    ramp.rest = bits >> 22 & 1;
    ramp.v = next_value() >> 2 | 1;
    ramp.step = next_value() | 1;
    ramp.rate = next_value();
    ramp.ticks = (uint16_t)next_value();
    ramp.k2_q16 = next_wide();
    ramp.x = next_wide() >> 1;
    ramp.c = next_wide() >> 1;
    ramp.limit.bound_q16 = next_wide();
    if (!ramp.linear)
        ramp.limit.cap = next_value() >> 1 | 1;
}

static uint16_t choose_left(void)
{
    uint16_t left = (uint16_t)(next_bits() >> 16);
    left = (uint16_t)(left >> (next_bits() >> 28));
    return left ? left : 1;
}

static void test_any_group_is_the_same_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 5000; i++) {
        choose_ramp();
        (void)next_is_the_same(choose_left());
    }
}

/* Motor and clock. */
static void choose_constants(void)
{
    ramp_constants(&constants, (uint16_t)(8 + value_between(1, 12)), one_in(3) ? 400000 + value_between(10, 23) : 16000000);
}

/* A ramp as profile_begin_ramp() has them, and others: v_most and pulses for ramp_begin(). */
static void choose_law(uint32_t *v_most, uint32_t *pulses)
{
    memset(&ramp, 0xA5, sizeof ramp); /* what the last one left */
    ramp.linear = !one_in(2);
    ramp.faster = !one_in(2);
    *v_most = value_between(10, 27);
    *pulses = value_between(1, 14);
    if (!ramp.linear) {
        ramp.v = value_between(10, 24);
        ramp.step = value_between(1, one_in(8) ? 32 : 20);
        ramp.limit.cap = UINT32_MAX >> 1;
        if (!ramp.faster) {
            if (one_in(2))
                ramp.limit.cap = *v_most;
            ramp.v = 1000 + (*pulses - 1) * ramp.step;
        }
        return;
    }
    ramp.v = value_between(7, 20);
    if (ramp.v > *v_most || !ramp.faster || one_in(2))
        ramp.v = 0;
    ramp.step = one_in(4) ? 0 : value_between(1, 23);
    if (ramp.faster)
        ramp.limit.bound_q16 = one_in(2) ? value_of_bits(24) : 0;
    else
        ramp_interval_q16(&ramp.limit.bound_q16, &constants, value_between(9, 16));
}

static void begin_is_the_same(uint32_t v_most, uint32_t pulses)
{
    expected = ramp;
    begin_in_c(&expected, &constants, v_most, pulses);
    ramp_begin(&ramp, &constants, v_most, pulses);
    assert_same_ramp();
}

static void test_any_ramp_begins_as_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 3000; i++) {
        uint32_t v_most, pulses;
        choose_constants();
        choose_law(&v_most, &pulses);
        begin_is_the_same(v_most, pulses);
    }
}

/* Up to so many groups of a ramp, or to its end. */
static void play(uint32_t pulses, uint8_t groups)
{
    while (pulses && groups--) {
        uint16_t left = (uint16_t)pulses;
        if (one_in(8))
            left = (uint16_t)(1 + left % (1u + (next_bits() >> 25)));
        if (one_in(16))
            ramp.least_run = (uint8_t)(1u << (next_bits() >> 30));
        if (one_in(16))
            ramp.split_ticks = one_in(2) ? 0 : constants.split_ticks;
        pulses -= next_is_the_same(left);
    }
}

static void test_any_ramp_goes_on_as_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 500; i++) {
        uint32_t v_most, pulses;
        choose_constants();
        choose_law(&v_most, &pulses);
        begin_is_the_same(v_most, pulses);
        play(pulses, 60);
    }
}

static void test_intervals_and_squares_are_the_same_in_c_to_the_bit(void)
{
    for (uint16_t i = 0; i < 1000; i++) {
        choose_constants();
        uint32_t v = value_between(1, 31);
        wide_t x, in_c;
        ramp_interval_q16(&x, &constants, v);
        interval_q16_in_c(&in_c, &constants, v);
        TEST_ASSERT_TRUE(x == in_c);
        ramp_square(&x, v);
        square_in_c(&in_c, v);
        TEST_ASSERT_TRUE(x == in_c);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_any_group_is_the_same_in_c_to_the_bit);
    RUN_TEST(test_any_ramp_begins_as_in_c_to_the_bit);
    RUN_TEST(test_any_ramp_goes_on_as_in_c_to_the_bit);
    RUN_TEST(test_intervals_and_squares_are_the_same_in_c_to_the_bit);
    return UNITY_END();
}
