/* hal/baud.h: the divisor of a serial port. */
#include "hal/baud.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* Datasheet, 20.11: errors at 16 MHz. */
static void test_divisors_are_those_of_the_datasheet(void)
{
    static const struct {
        uint32_t baud;
        uint16_t ubrr;
        bool u2x;
    } rows[] = {{300, 3332, false},  {2400, 832, true},  {9600, 103, false},  {19200, 51, false},
                {38400, 25, false},  {57600, 34, true},   {76800, 12, false},  {115200, 16, true},
                {250000, 3, false},  {500000, 1, false},  {1000000, 0, false}, {2000000, 0, true}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const baud_divisor_t d = baud_divisor(rows[i].baud);
        TEST_ASSERT_EQUAL_UINT16(rows[i].ubrr, d.ubrr);
        TEST_ASSERT_EQUAL(rows[i].u2x, d.u2x);
    }
}

/* One part in 33 is what rounding to a whole divisor of 8 clocks costs at 115,200 Bd. */
static void test_every_rate_up_to_115200_is_kept_within_3_percent(void)
{
    for (uint32_t baud = 300; baud <= 115200; baud += 7) {
        const baud_divisor_t d = baud_divisor(baud);
        const uint32_t real = (uint32_t)BOARD_CPU_HZ / (d.u2x ? 8 : 16) / (d.ubrr + 1u);
        TEST_ASSERT_UINT32_WITHIN(baud * 3 / 100, baud, real);
    }
}

static void test_rates_out_of_range_take_the_nearest_divisor(void)
{
    TEST_ASSERT_EQUAL_UINT16(4095, baud_divisor(1).ubrr);
    TEST_ASSERT_EQUAL_UINT16(0, baud_divisor(4000000000u).ubrr);
    TEST_ASSERT_TRUE(baud_divisor(4000000000u).u2x);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_divisors_are_those_of_the_datasheet);
    RUN_TEST(test_every_rate_up_to_115200_is_kept_within_3_percent);
    RUN_TEST(test_rates_out_of_range_take_the_nearest_divisor);
    return UNITY_END();
}
