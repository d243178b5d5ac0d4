/* drivers: the microstep pins of each driver. */
#include "drivers.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

static const uint8_t map[8] = {7, 6, 1, 4, 3, 2, 5, 0};

static void assert_driver(uint8_t driver, const uint8_t usteps[8], const uint8_t pins[8])
{
    for (uint8_t ustep = 0; ustep < 8; ustep++) {
        const uint8_t used = drivers_ustep(driver, ustep);
        TEST_ASSERT_EQUAL_UINT8(usteps[ustep], used);
        TEST_ASSERT_EQUAL_UINT8(pins[ustep], drivers_pins(driver, used, map));
    }
}

/* MIC-004 */
static void test_the_a4988_goes_to_16_microsteps_with_all_pins_high(void)
{
    assert_driver(DRIVER_A4988, (const uint8_t[8]){0, 1, 2, 3, 4, 4, 4, 4}, (const uint8_t[8]){0, 1, 2, 3, 7, 7, 7, 7});
}

/* MIC-005 */
static void test_the_drv8825_goes_to_32_microsteps(void)
{
    assert_driver(DRIVER_DRV8825, (const uint8_t[8]){0, 1, 2, 3, 4, 5, 5, 5}, (const uint8_t[8]){0, 1, 2, 3, 4, 5, 5, 5});
}

/* MIC-006 */
static void test_the_map_gives_the_pins_of_any_other_driver(void)
{
    assert_driver(DRIVER_MAPPED, (const uint8_t[8]){0, 1, 2, 3, 4, 5, 6, 7}, map);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_a4988_goes_to_16_microsteps_with_all_pins_high);
    RUN_TEST(test_the_drv8825_goes_to_32_microsteps);
    RUN_TEST(test_the_map_gives_the_pins_of_any_other_driver);
    return UNITY_END();
}
