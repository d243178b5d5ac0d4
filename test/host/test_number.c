/* base/number: digits to numbers and back. */
#include "base/number.h"
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* Reads a text of digits; false if number_add_digit refused one. */
static bool read_digits(const char *text, uint32_t *value)
{
    *value = 0;
    for (; *text != '\0'; text++) {
        if (!number_add_digit(value, (uint8_t)(*text - '0'))) {
            return false;
        }
    }
    return true;
}

static const uint32_t samples[] = {0,       1,       9,        10,        99,         100,        255,        256,
                                   999,     1000,    65535,    65536,     99999,      100000,     1234567890, 999999999,
                                   1000000, 9999999, 10000000, 429496729, 2147483647, 2147483648, 4294967294, 4294967295};
enum { SAMPLES = sizeof samples / sizeof samples[0] };

static void test_what_is_written_reads_back_as_the_same_number(void)
{
    for (int i = 0; i < SAMPLES; i++) {
        char text[NUMBER_TEXT_BYTES];
        uint32_t value;
        TEST_ASSERT_TRUE(read_digits(number_format(text, samples[i], 0), &value));
        TEST_ASSERT_EQUAL_UINT32(samples[i], value);
    }
}

static void test_unsigned_numbers_are_written_without_leading_zeros(void)
{
    for (int i = 0; i < SAMPLES; i++) {
        char text[NUMBER_TEXT_BYTES], expected[16];
        const char *begin = number_format(text, samples[i], 0);
        snprintf(expected, sizeof expected, "%" PRIu32, samples[i]);
        TEST_ASSERT_EQUAL_STRING(expected, begin);
        TEST_ASSERT_EQUAL_PTR(text + sizeof text - 1, begin + strlen(begin));
    }
}

/* SWT-003 */
static void test_the_largest_number_that_fits_32_bits_is_read(void)
{
    uint32_t value;
    TEST_ASSERT_TRUE(read_digits("4294967295", &value));
    TEST_ASSERT_EQUAL_UINT32(4294967295u, value);
}

static void test_a_number_beyond_32_bits_is_refused_and_changes_nothing(void)
{
    uint32_t value;
    TEST_ASSERT_FALSE(read_digits("4294967296", &value));
    TEST_ASSERT_EQUAL_UINT32(429496729u, value);
    TEST_ASSERT_FALSE(read_digits("4294967300", &value));
    TEST_ASSERT_FALSE(read_digits("10000000000", &value));
}

static void test_leading_zeros_do_not_count(void)
{
    uint32_t value;
    TEST_ASSERT_TRUE(read_digits("00000000000000200", &value));
    TEST_ASSERT_EQUAL_UINT32(200, value);
}

/* QUE-009 */
static void test_hundredths_are_written_with_two_decimals(void)
{
    static const struct {
        uint16_t hundredths;
        const char *text;
    } rows[] = {{1, "0.01"}, {80, "0.80"}, {100, "1.00"}, {123, "1.23"}, {1047, "10.47"}, {9999, "99.99"}, {0, "0.00"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[NUMBER_TEXT_BYTES];
        const char *begin = number_format(text, rows[i].hundredths, 2);
        TEST_ASSERT_EQUAL_STRING(rows[i].text, begin);
        TEST_ASSERT_EQUAL_PTR(text + sizeof text - 1, begin + strlen(begin));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_written_reads_back_as_the_same_number);
    RUN_TEST(test_unsigned_numbers_are_written_without_leading_zeros);
    RUN_TEST(test_the_largest_number_that_fits_32_bits_is_read);
    RUN_TEST(test_a_number_beyond_32_bits_is_refused_and_changes_nothing);
    RUN_TEST(test_leading_zeros_do_not_count);
    RUN_TEST(test_hundredths_are_written_with_two_decimals);
    return UNITY_END();
}
