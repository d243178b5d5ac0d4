/* motion/block: the runs appended to the ring. On the AVR the same tests run block.S. */
#include "motion/block.h"
#include "motion/segment.h"
#include "unity.h"

segment_t segments[SEGMENT_COUNT] __attribute__((aligned(256)));
volatile uint8_t step_head, step_tail;

static block_t block;
static uint32_t pulses; /* taken from the ring */
static int32_t ticks;   /* of their intervals */
static uint16_t shortest, longest;

void setUp(void)
{
    step_head = step_tail = 0xE0; /* the ring wraps soon */
    pulses = 0;
    ticks = 0;
    shortest = 0xFFFF;
    longest = 0;
    block = (block_t){.width_ticks = 32, .flags = 0x21, .shape = BLOCK_SPLIT, .runs = 1, .pulses = 4};
}

void tearDown(void)
{
}

/* Plays what is in the ring. */
static void take(void)
{
    while (step_tail != step_head) {
        const segment_t *s = &segments[step_tail / SEGMENT_BYTES];
        uint8_t early = (s->flags & SEGMENT_EARLY_MASK) >> SEGMENT_EARLY_SHIFT;
        uint8_t count = (uint8_t)(s->count_low + early);
        uint16_t interval = (uint16_t)(s->top + 1u);
        TEST_ASSERT_EQUAL_UINT8(0, s->count_high);
        TEST_ASSERT_EQUAL_UINT16(s->top - block.width_ticks, s->match);
        TEST_ASSERT_EQUAL_UINT8(block.flags, s->flags & ~SEGMENT_EARLY_MASK);
        TEST_ASSERT_EQUAL_UINT8((interval < SEGMENT_EARLY1_BELOW_TICKS) + (interval < SEGMENT_EARLY2_BELOW_TICKS) +
                                    (interval < SEGMENT_EARLY3_BELOW_TICKS),
                                early);
        pulses += count;
        ticks += (int32_t)interval * count;
        if (interval < shortest)
            shortest = interval;
        if (interval > longest)
            longest = interval;
        step_tail = (uint8_t)(step_tail + SEGMENT_BYTES);
    }
}

static void play(void)
{
    while (block.runs) {
        uint8_t runs = block.runs;
        block_append(&block);
        TEST_ASSERT_TRUE(block.runs < runs);
        take();
    }
}

/* STA-008 */
static void test_a_run_of_a_whole_number_of_ticks_is_one_segment(void)
{
    block.top_q16 = 999UL << 16;
    block_append(&block);
    TEST_ASSERT_EQUAL_UINT8(0, block.runs);
    TEST_ASSERT_EQUAL_UINT8(SEGMENT_BYTES, (uint8_t)(step_head - step_tail));
    take();
    TEST_ASSERT_EQUAL_UINT32(4, pulses);
    TEST_ASSERT_EQUAL_INT32(4000, ticks);
}

/* CLK-015 */
static void test_a_fraction_is_made_of_two_neighbouring_values_the_longer_first_when_speeding_up(void)
{
    for (uint8_t faster = 0; faster < 2; faster++) {
        setUp();
        block.top_q16 = (999UL << 16) + 0xC000;
        block.shape = (uint8_t)(BLOCK_SPLIT | (faster ? BLOCK_FASTER : 0));
        block_append(&block);
        const segment_t *first = &segments[step_tail / SEGMENT_BYTES];
        TEST_ASSERT_EQUAL_UINT16(faster ? 1000 : 999, first->top);
        TEST_ASSERT_EQUAL_UINT8(faster ? 3 : 1, first->count_low);
        take();
        TEST_ASSERT_EQUAL_UINT32(4, pulses);
        TEST_ASSERT_EQUAL_INT32(4003, ticks);
    }
}

/* CLK-015 */
static void test_fractions_are_carried_from_run_to_run_and_on(void)
{
    block.top_q16 = (499UL << 16) + 0x1234;
    block.runs = 200;
    block.pulses = 8;
    block.carry_q16 = 0xF000;
    play();
    uint64_t sum = 1600ULL * ((500UL << 16) + 0x1234) + 0xF000;
    TEST_ASSERT_EQUAL_UINT32(1600, pulses);
    TEST_ASSERT_EQUAL_INT32((int32_t)(sum >> 16), ticks);
    TEST_ASSERT_EQUAL_UINT16((uint16_t)sum, block.carry_q16);
    TEST_ASSERT_EQUAL_UINT16(500, shortest);
    TEST_ASSERT_EQUAL_UINT16(501, longest);
}

/* CLK-002 */
static void test_short_periods_are_not_split_and_reloaded_early(void)
{
    static const uint8_t intervals[] = {32, 39, 40, 47, 48, 81, 82, 127};
    for (uint8_t i = 0; i < sizeof intervals; i++) {
        setUp();
        block.top_q16 = (((uint32_t)intervals[i] - 1u) << 16) + 0x8001;
        block.runs = 64;
        block.pulses = 16;
        block.shape = 0;
        play();
        uint32_t sum = ((uint32_t)intervals[i] << 16) * 64 + (uint32_t)0x8001 * 64;
        TEST_ASSERT_EQUAL_UINT32(1024, pulses);
        TEST_ASSERT_EQUAL_INT32((int32_t)(sum >> 16) * 16, ticks);
        TEST_ASSERT_EQUAL_UINT16((uint16_t)sum, block.carry_q16);
    }
}

/* HAR-002, LIN-002 */
static void test_runs_follow_the_parabola(void)
{
    for (int8_t sign = -1; sign <= 1; sign = (int8_t)(sign + 2)) {
        setUp();
        block.top_q16 = 4999UL << 16;
        block.slope_q16 = (int32_t)(sign * (20L << 16) + 0x8000);
        block.curve_q16 = 0x8000;
        block.runs = 31;
        block.pulses = 2;
        if (sign < 0)
            block.shape |= BLOCK_FASTER;
        for (int32_t i = 0; block.runs; i++) {
            /* One run at a time: the ring is nearly full. */
            step_tail = (uint8_t)(step_head + 5 * SEGMENT_BYTES);
            uint8_t offset = step_head;
            block_append(&block);
            /* In quarters of a tick: i slopes, i (i - 1) / 2 curves. */
            int32_t law_q2 = 4 * 5000 + i * (sign * 80 + 2) + i * (i - 1);
            int32_t two = 0;
            for (; offset != step_head; offset = (uint8_t)(offset + SEGMENT_BYTES))
                two += (segments[offset / SEGMENT_BYTES].top + 1) * segments[offset / SEGMENT_BYTES].count_low;
            TEST_ASSERT_INT32_WITHIN(1, law_q2 / 2, two); /* of two pulses; less than a tick is carried */
        }
    }
}

static void test_an_append_leaves_room_in_the_ring_and_goes_on_later(void)
{
    block.top_q16 = (999UL << 16) + 0x8000;
    block.runs = 100;
    block_append(&block);
    TEST_ASSERT_EQUAL_UINT8(100 - 14, block.runs);
    TEST_ASSERT_EQUAL_UINT8(28 * SEGMENT_BYTES, (uint8_t)(step_head - step_tail));
    block_append(&block);
    TEST_ASSERT_EQUAL_UINT8(100 - 14, block.runs);
    take();
    play();
    TEST_ASSERT_EQUAL_UINT32(400, pulses);
    TEST_ASSERT_EQUAL_INT32(400200, ticks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_run_of_a_whole_number_of_ticks_is_one_segment);
    RUN_TEST(test_a_fraction_is_made_of_two_neighbouring_values_the_longer_first_when_speeding_up);
    RUN_TEST(test_fractions_are_carried_from_run_to_run_and_on);
    RUN_TEST(test_short_periods_are_not_split_and_reloaded_early);
    RUN_TEST(test_runs_follow_the_parabola);
    RUN_TEST(test_an_append_leaves_room_in_the_ring_and_goes_on_later);
    return UNITY_END();
}
