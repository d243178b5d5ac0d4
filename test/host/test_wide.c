/* base/wide: 64-bit arithmetic through pointers; the same cases on the host and on the AVR, where it is assembler. */
#include "base/wide.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* A value for each trial, all lengths from 1 to 64 bits. */
static uint64_t next_value(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return *state >> (*state >> 58);
}

/* The parts of the product that reach 64 bits, from 32-bit multiplications. */
static uint64_t product_of(uint64_t x, uint64_t y)
{
    uint32_t x0 = (uint32_t)x, x1 = (uint32_t)(x >> 32);
    uint32_t y0 = (uint32_t)y, y1 = (uint32_t)(y >> 32);
    return (uint64_t)x0 * y0 + ((uint64_t)(uint32_t)(x0 * y1 + x1 * y0) << 32);
}

static void test_sums_and_differences_are_modulo_two_to_the_64(void)
{
    uint64_t state = 1;
    for (uint16_t i = 0; i < 500; i++) {
        wide_t x = next_value(&state), y = next_value(&state);
        wide_t sum = x, difference = x;
        wide_add(&sum, &y);
        wide_subtract(&difference, &y);
        TEST_ASSERT_TRUE(sum == x + y);
        TEST_ASSERT_TRUE(difference == x - y);
    }
}

static void test_carries_run_through_all_eight_bytes(void)
{
    wide_t x = UINT64_MAX, one = 1;
    wide_add(&x, &one);
    TEST_ASSERT_TRUE(x == 0);
    wide_subtract(&x, &one);
    TEST_ASSERT_TRUE(x == UINT64_MAX);
    wide_add(&x, &x);
    TEST_ASSERT_TRUE(x == UINT64_MAX - 1);
    wide_subtract(&x, &x);
    TEST_ASSERT_TRUE(x == 0);
}

static void test_products_are_modulo_two_to_the_64(void)
{
    uint64_t state = 2;
    for (uint16_t i = 0; i < 500; i++) {
        wide_t x = next_value(&state), product = x;
        uint32_t factor = (uint32_t)next_value(&state);
        wide_multiply(&product, factor);
        TEST_ASSERT_TRUE(product == product_of(x, factor));
    }
}

static void test_products_of_negative_numbers_are_right_modulo_two_to_the_64(void)
{
    for (int16_t a = -300; a <= 300; a += 37) {
        for (int16_t b = 0; b <= 300; b += 41) {
            wide_t product = (wide_t)(int64_t)a;
            wide_multiply(&product, (uint32_t)b);
            TEST_ASSERT_TRUE(product == (wide_t)((int64_t)a * b));
        }
    }
}

static void test_the_largest_product_has_all_its_carries(void)
{
    wide_t x;
    wide_set(&x, UINT32_MAX);
    wide_multiply(&x, UINT32_MAX);
    TEST_ASSERT_TRUE(x == 0xFFFFFFFE00000001u);
    x = UINT64_MAX;
    wide_multiply(&x, UINT32_MAX);
    TEST_ASSERT_TRUE(x == 0xFFFFFFFF00000001u);
}

static void test_setting_clears_the_upper_half(void)
{
    wide_t x = UINT64_MAX;
    wide_set(&x, 0x12345678u);
    TEST_ASSERT_TRUE(x == 0x12345678u);
}

static void test_a_fraction_is_the_upper_half_of_the_product_or_up_to_four_less(void)
{
    uint64_t state = 3;
    for (uint16_t i = 0; i < 500; i++) {
        uint32_t x = (uint32_t)next_value(&state), y = (uint32_t)next_value(&state);
        uint32_t exact = (uint32_t)((uint64_t)x * y >> 32);
        uint32_t less = exact - wide_fraction(x, y);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(4, less);
    }
    TEST_ASSERT_EQUAL_UINT32(0x40000000u, wide_fraction(0x80000000u, 0x80000000u));
    TEST_ASSERT_EQUAL_UINT32(0xFFFFFFFBu, wide_fraction(UINT32_MAX, UINT32_MAX));
    TEST_ASSERT_EQUAL_UINT32(0x00123456u, wide_fraction(0x12345600u, 0x01000000u));
}

static void test_a_fraction_is_that_of_the_products_which_are_not_left_out(void)
{
    uint64_t state = 5;
    for (uint16_t i = 0; i < 2000; i++) {
        uint32_t x = (uint32_t)next_value(&state), y = (uint32_t)next_value(&state);
        uint64_t product = (uint64_t)x * y;
        for (uint8_t a = 0; a < 3; a++) {
            for (uint8_t b = 0; a + b < 3; b++)
                product -= (uint64_t)((x >> 8 * a & 0xFF) * (y >> 8 * b & 0xFF)) << 8 * (a + b);
        }
        TEST_ASSERT_EQUAL_HEX32((uint32_t)(product >> 32), wide_fraction(x, y));
    }
}

static void test_shifts_go_both_ways_and_lose_what_leaves(void)
{
    uint64_t state = 4;
    for (int8_t bits = -63; bits <= 63; bits++) {
        wide_t x = next_value(&state);
        wide_t shifted = x;
        wide_shift(&shifted, bits);
        TEST_ASSERT_TRUE(shifted == (bits < 0 ? x << -bits : x >> bits));
    }
}

static void test_a_root_is_truncated_and_0_of_what_is_below_0(void)
{
    uint64_t state = 6;
    for (uint16_t i = 0; i < 500; i++) {
        uint64_t root = (uint32_t)next_value(&state) >> 1;
        wide_t square = product_of(root, root), next = square + 2 * root, negative = 0 - square - 1;
        TEST_ASSERT_EQUAL_UINT32(root, wide_root(&square));
        TEST_ASSERT_EQUAL_UINT32(root, wide_root(&next));
        TEST_ASSERT_EQUAL_UINT32(0, wide_root(&negative));
    }
    wide_t most = INT64_MAX;
    TEST_ASSERT_EQUAL_UINT32(3037000499u, wide_root(&most));
}

static void test_32_bits_are_taken_from_any_of_the_lower_bytes(void)
{
    wide_t x = 0x8877665544332211u;
    TEST_ASSERT_EQUAL_HEX32(0x44332211u, (uint32_t)wide_from_byte(&x, 0));
    TEST_ASSERT_EQUAL_HEX32(0x55443322u, (uint32_t)wide_from_byte(&x, 1));
    TEST_ASSERT_EQUAL_HEX32(0x66554433u, (uint32_t)wide_from_byte(&x, 2));
    TEST_ASSERT_EQUAL_HEX32(0x88776655u, (uint32_t)wide_from_byte(&x, 4));
    x = (wide_t)-1000;
    TEST_ASSERT_TRUE(wide_from_byte(&x, 0) == -1000);
    TEST_ASSERT_TRUE(wide_from_byte(&x, 1) == -4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sums_and_differences_are_modulo_two_to_the_64);
    RUN_TEST(test_carries_run_through_all_eight_bytes);
    RUN_TEST(test_products_are_modulo_two_to_the_64);
    RUN_TEST(test_products_of_negative_numbers_are_right_modulo_two_to_the_64);
    RUN_TEST(test_the_largest_product_has_all_its_carries);
    RUN_TEST(test_setting_clears_the_upper_half);
    RUN_TEST(test_a_fraction_is_the_upper_half_of_the_product_or_up_to_four_less);
    RUN_TEST(test_a_fraction_is_that_of_the_products_which_are_not_left_out);
    RUN_TEST(test_shifts_go_both_ways_and_lose_what_leaves);
    RUN_TEST(test_a_root_is_truncated_and_0_of_what_is_below_0);
    RUN_TEST(test_32_bits_are_taken_from_any_of_the_lower_bytes);
    return UNITY_END();
}
