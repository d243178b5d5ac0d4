/* settings.def: the factory values and what is made of the table. */
#include "settings.h"
#include <stddef.h>
#include <string.h>
#include "unity.h"

void setUp(void)
{
    memset(&settings, 0xA5, sizeof settings);
}

void tearDown(void)
{
}

/* CFG-013..CFG-015, CFG-017..CFG-034, CFG-036..CFG-039, DEF-001, QUE-021, AUT-001 */
static void test_the_factory_values_are_those_of_the_annex(void)
{
    settings_to_factory();
    TEST_ASSERT_EQUAL_UINT8(0, settings.autorun);
    TEST_ASSERT_EQUAL_UINT8(0, settings.ramp);
    TEST_ASSERT_EQUAL_UINT8(1, settings.internal_clock);
    TEST_ASSERT_EQUAL_UINT8(0, settings.auto_microstep);
    TEST_ASSERT_EQUAL_UINT8(0, settings.network);
    TEST_ASSERT_EQUAL_UINT8(0, settings.cw_level);
    TEST_ASSERT_EQUAL_UINT8(0, settings.direction);
    TEST_ASSERT_EQUAL_UINT8(0, settings.ihd_counts);
    TEST_ASSERT_EQUAL_UINT8(0, settings.xclk_counts);
    TEST_ASSERT_EQUAL_UINT8(0, settings.ustep);
    TEST_ASSERT_EQUAL_UINT8(2, settings.pulse_us);
    TEST_ASSERT_EQUAL_UINT8(10, settings.slow_rpm);
    TEST_ASSERT_EQUAL_UINT8(85, settings.device_id);
    TEST_ASSERT_EQUAL_UINT8(0, settings.driver_id);
    TEST_ASSERT_EQUAL_UINT16(200, settings.steps_per_rev);
    TEST_ASSERT_EQUAL_UINT32(3000, settings.cycle_us);
    TEST_ASSERT_EQUAL_UINT32(1000000, settings.xclk_hz);
    TEST_ASSERT_EQUAL_UINT16(100, settings.accel[0]);
    TEST_ASSERT_EQUAL_UINT16(100, settings.decel[0]);
    TEST_ASSERT_EQUAL_UINT16(1047, settings.accel[1]);
    TEST_ASSERT_EQUAL_UINT16(1047, settings.decel[1]);
    TEST_ASSERT_EQUAL_UINT8(36, settings.ops_mask);
    TEST_ASSERT_EQUAL_UINT8(0, settings.soft_ops);
    TEST_ASSERT_EQUAL_UINT8(1, settings.acknowledge);
    TEST_ASSERT_EQUAL_UINT8(1, settings.crc_mode);
    TEST_ASSERT_EQUAL_UINT32(38400, settings.hw_baud);
    TEST_ASSERT_EQUAL_UINT32(38400, settings.sw_baud);
    TEST_ASSERT_EQUAL_UINT8(1, settings.full_step);
    for (uint8_t i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL_UINT8(i, settings.driver_map[i]);
    }
}

/* CFG-011 */
static void test_the_values_lie_in_the_order_of_the_table_without_padding(void)
{
    TEST_ASSERT_EQUAL_size_t(53, sizeof settings);
    TEST_ASSERT_EQUAL_size_t(0, offsetof(settings_t, autorun));
    TEST_ASSERT_EQUAL_size_t(12, offsetof(settings_t, steps_per_rev));
    TEST_ASSERT_EQUAL_size_t(14, offsetof(settings_t, cycle_us));
    TEST_ASSERT_EQUAL_size_t(22, offsetof(settings_t, accel));
    TEST_ASSERT_EQUAL_size_t(35, offsetof(settings_t, driver_map));
    TEST_ASSERT_EQUAL_size_t(43, SETTINGS_PATH); /* E, M, m, n, and nothing else */
    TEST_ASSERT_EQUAL_size_t(45, offsetof(settings_t, hw_baud));
    TEST_ASSERT_EQUAL_size_t(10, SETTINGS_PATH_BYTES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_factory_values_are_those_of_the_annex);
    RUN_TEST(test_the_values_lie_in_the_order_of_the_table_without_padding);
    return UNITY_END();
}
