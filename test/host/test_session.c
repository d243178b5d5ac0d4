/* queue/session: the session defaults. */
#include "queue/session.h"
#include <string.h>
#include "settings.h"
#include "unity.h"

static settings_t factory;

void setUp(void)
{
    settings_to_factory();
    factory = settings;
    session_init();
}

void tearDown(void)
{
    settings = factory;
}

/* DEF-004, VEL-008 */
static void test_the_session_starts_with_the_system_defaults(void)
{
    settings.cycle_us = 2000;
    settings.accel[0] = 150;
    settings.decel[0] = 250;
    session_init();
    TEST_ASSERT_EQUAL_UINT32(2000, session.velocity);
    TEST_ASSERT_EQUAL_UINT16(150, session.accel);
    TEST_ASSERT_EQUAL_UINT16(250, session.decel);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE, session.flags);
}

/* STP-001, STP-009 */
static void test_the_full_step_setting_decides_what_counts_are(void)
{
    TEST_ASSERT_FALSE(session.flags & MOTION_PULSES);
    settings.full_step = 0;
    session_init();
    TEST_ASSERT_TRUE(session.flags & MOTION_PULSES);
}

static void test_the_ramp_setting_decides_the_ramp_at_start(void)
{
    settings.ramp = 1;
    session_init();
    TEST_ASSERT_TRUE(session.flags & MOTION_LINEAR);
    TEST_ASSERT_EQUAL_UINT16(1047, session.accel);
    TEST_ASSERT_EQUAL_UINT16(1047, session.decel);
}

/* LIN-013 */
static void test_changing_the_ramp_swaps_accel_and_decel_to_its_defaults(void)
{
    settings.accel[1] = 2000;
    settings.decel[1] = 3000;
    session.accel = 500;
    session.decel = 600;
    session_set_linear(true);
    TEST_ASSERT_EQUAL_UINT16(2000, session.accel);
    TEST_ASSERT_EQUAL_UINT16(3000, session.decel);
    session_set_linear(false);
    TEST_ASSERT_EQUAL_UINT16(100, session.accel);
    TEST_ASSERT_EQUAL_UINT16(100, session.decel);
    TEST_ASSERT_FALSE(session.flags & MOTION_LINEAR);
}

/* MOT-007, MOT-009 */
static void test_a_template_has_the_defaults_and_no_count_wait_sync_or_extra_pulses(void)
{
    motion_command_t command;
    memset(&command, 0xFF, sizeof command);
    session_set_pulses(true);
    session_template(&session, &command);
    TEST_ASSERT_EQUAL_UINT32(0, command.count);
    TEST_ASSERT_EQUAL_UINT32(3000, command.velocity);
    TEST_ASSERT_EQUAL_UINT32(0, command.start_wait_us);
    TEST_ASSERT_EQUAL_UINT16(100, command.accel);
    TEST_ASSERT_EQUAL_UINT8(0, command.extra_pulses);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE | MOTION_PULSES, command.flags);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_session_starts_with_the_system_defaults);
    RUN_TEST(test_the_full_step_setting_decides_what_counts_are);
    RUN_TEST(test_the_ramp_setting_decides_the_ramp_at_start);
    RUN_TEST(test_changing_the_ramp_swaps_accel_and_decel_to_its_defaults);
    RUN_TEST(test_a_template_has_the_defaults_and_no_count_wait_sync_or_extra_pulses);
    return UNITY_END();
}
