/* MIC, PIN on the whole image: what the microstep pins are for each driver, and that pulses are counted alike. */
#include "image.h"

#define MS1 BOARD_PIN('C', 3)
#define MS2 BOARD_PIN('C', 4)
#define MS3 BOARD_PIN('B', 4)
#define LONG_WAIT (60 * SECOND)

enum { A4988, DRV8825, MAPPED };

void setUp(void)
{
    image_power_on();
}

void tearDown(void)
{
    image_off();
}

static unsigned pins(void)
{
    return (unsigned)(board_pin_level(board, MS1) | board_pin_level(board, MS2) << 1 | board_pin_level(board, MS3) << 2);
}

static void power_on_with(unsigned driver, unsigned ustep)
{
    image_off();
    image_power_on();
    IMAGE_SET(driver_id, driver);
    IMAGE_SET(ustep, ustep);
}

static void assert_driver(unsigned driver, const unsigned expected[8])
{
    for (unsigned ustep = 0; ustep < 8; ustep++) {
        power_on_with(driver, ustep);
        image_run(100 * MS);
        if (pins() != expected[ustep])
            image_fail("driver %u, ustep %u: expected pins %u, saw %u", driver, ustep, expected[ustep], pins());
    }
}

/* PIN-004, MIC-003, MIC-004 */
static void test_an_a4988_gets_the_pins_of_its_table(void)
{
    assert_driver(A4988, (const unsigned[8]){0, 1, 2, 3, 7, 7, 7, 7});
}

/* PIN-004, MIC-005 */
static void test_a_drv8825_gets_the_pins_of_its_table(void)
{
    assert_driver(DRV8825, (const unsigned[8]){0, 1, 2, 3, 4, 5, 5, 5});
}

/* PIN-004, MIC-006 */
static void test_any_other_driver_gets_the_pins_of_its_map(void)
{
    assert_driver(MAPPED, (const unsigned[8]){0, 1, 2, 3, 4, 5, 6, 7});
    for (unsigned ustep = 0; ustep < 8; ustep++) {
        power_on_with(MAPPED, ustep);
        IMAGE_SET(driver_map[ustep], 7 - ustep);
        image_run(100 * MS);
        TEST_ASSERT_EQUAL_UINT(7 - ustep, pins());
    }
}

/* MIC-008: M1 high, M2 and M3 low */
static void test_the_tb6600_of_the_manual_gets_high_low_low(void)
{
    power_on_with(MAPPED, 2);
    IMAGE_SET(driver_map[2], 1);
    image_run(100 * MS);
    TEST_ASSERT_EQUAL(1, board_pin_level(board, MS1));
    TEST_ASSERT_EQUAL(0, board_pin_level(board, MS2));
    TEST_ASSERT_EQUAL(0, board_pin_level(board, MS3));
}

/* MIC-001, MIC-010: the driver and the count go by the same factor, also where the driver does not go so far */
static void test_a_step_has_as_many_pulses_as_the_pins_say(void)
{
    static const unsigned pulses[3][8] = {
        {1, 2, 4, 8, 16, 16, 16, 16}, {1, 2, 4, 8, 16, 32, 32, 32}, {1, 2, 4, 8, 16, 32, 64, 128}};
    for (unsigned driver = 0; driver < 3; driver++) {
        for (unsigned ustep = 0; ustep < 8; ustep++) {
            power_on_with(driver, ustep);
            image_prompt();
            image_do("m3v60a999d999");
            image_idle(LONG_WAIT);
            image_assert_pulses(3 * pulses[driver][ustep]);
            image_assert_interval(1, 5000.0 * US / pulses[driver][ustep], 1);
        }
    }
}

/* MIC-009 */
static void test_the_pins_change_at_a_reset_only(void)
{
    power_on_with(A4988, 3);
    image_prompt();
    image_do("m100v100");
    image_run(100 * MS);
    IMAGE_SET(ustep, 1);
    image_idle(LONG_WAIT);
    image_assert_pulses(800);
    image_train_clear();
    image_do("m10v100");
    image_idle(LONG_WAIT);
    image_assert_pulses(80);
    TEST_ASSERT_EQUAL_UINT(3, pins());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_a4988_gets_the_pins_of_its_table);
    RUN_TEST(test_a_drv8825_gets_the_pins_of_its_table);
    RUN_TEST(test_any_other_driver_gets_the_pins_of_its_map);
    RUN_TEST(test_the_tb6600_of_the_manual_gets_high_low_low);
    RUN_TEST(test_a_step_has_as_many_pulses_as_the_pins_say);
    RUN_TEST(test_the_pins_change_at_a_reset_only);
    return UNITY_END();
}
