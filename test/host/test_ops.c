/* The ops signals: a pair for every command that has been played. */
#include <unity.h>
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "queue/ops.h"
#include "queue/session.h"

static uint8_t played; /* since the program began: it never goes back */

void setUp(void)
{
    engine_fake_reset();
    engine_fake.played = played;
    terminal_port_fake_reset();
    session_set_option(SESSION_SOFT_OPS, false);
}

void tearDown(void) {}

/* So many commands begun, ended and played more; what OPSA has done since the test began. */
static void step(motion_state_t state, uint8_t begun, uint8_t ended, uint8_t more_played, const char *expected)
{
    engine_fake.state = state;
    engine_fake.begun = (uint8_t)(engine_fake.begun + begun);
    engine_fake.ended = (uint8_t)(engine_fake.ended + ended);
    engine_fake.played = played = (uint8_t)(played + more_played);
    ops_poll();
    TEST_ASSERT_EQUAL_STRING(expected, engine_fake.ops);
}

/* OPS-001, PIN-012, SWT-006 */
static void test_the_flag_is_up_from_the_first_pulse_to_the_end(void)
{
    step(MOTION_STANDBY, 0, 0, 0, "");
    step(MOTION_STANDBY, 1, 0, 0, ""); /* it waits */
    step(MOTION_ACCEL, 0, 0, 0, "1");
    step(MOTION_CRUISE, 0, 0, 0, "1");
    step(MOTION_STOP, 0, 1, 1, "10");
    step(MOTION_STANDBY, 0, 0, 0, "10");
}

/* OPS-001 */
static void test_streamed_commands_have_a_pair_each(void)
{
    step(MOTION_CRUISE, 1, 0, 0, "1");
    step(MOTION_CRUISE, 1, 0, 0, "1"); /* the next one is planned */
    step(MOTION_CRUISE, 0, 1, 1, "101");
    step(MOTION_DECEL, 0, 0, 0, "101");
    step(MOTION_STANDBY, 0, 1, 1, "1010");
}

/* OPS-001 */
static void test_commands_that_ended_unseen_have_a_pair_each(void)
{
    step(MOTION_STANDBY, 3, 3, 3, "101010");
    step(MOTION_CRUISE, 1, 0, 0, "1010101");
    step(MOTION_CRUISE, 3, 3, 3, "1010101010101");
    step(MOTION_STANDBY, 0, 1, 1, "10101010101010");
}

/* OPS-001, SWT-007 */
static void test_a_command_stopped_in_its_wait_has_none(void)
{
    step(MOTION_STANDBY, 1, 0, 0, "");
    step(MOTION_STANDBY, 0, 1, 0, "");
}

/* OPS-001 */
static void test_a_single_pulse_has_none(void)
{
    step(MOTION_CRUISE, 0, 0, 0, ""); /* whatever its state may be: no command has begun */
}

/* OPS-004, OPS-005, OPS-006, OPS-008 */
static void test_soft_ops_send_dc1_and_dc2_with_the_flag(void)
{
    step(MOTION_CRUISE, 1, 0, 0, "1");
    step(MOTION_STANDBY, 0, 1, 1, "10");
    TEST_ASSERT_EQUAL_STRING("", terminal_port_fake_text());
    session_set_option(SESSION_SOFT_OPS, true);
    step(MOTION_CRUISE, 1, 0, 0, "101");
    TEST_ASSERT_EQUAL_STRING("\x11", terminal_port_fake_text());
    step(MOTION_STANDBY, 0, 1, 1, "1010");
    TEST_ASSERT_EQUAL_STRING("\x11\x12", terminal_port_fake_text());
    session_set_option(SESSION_SOFT_OPS, false);
}

/* OPS-004: the pins change though the line is full */
static void test_soft_ops_never_wait(void)
{
    session_set_option(SESSION_SOFT_OPS, true);
    terminal_port_fake_hold(1);
    for (unsigned i = 0; i < 20; i++) {
        engine_fake.ops[0] = '\0';
        step(MOTION_STANDBY, 1, 1, 1, "10");
        engine_fake.ops[1] = '\0';
        engine_fake.ops[0] = '\0';
    }
    TEST_ASSERT_EQUAL(31, terminal_port_fake_sent());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_flag_is_up_from_the_first_pulse_to_the_end);
    RUN_TEST(test_streamed_commands_have_a_pair_each);
    RUN_TEST(test_commands_that_ended_unseen_have_a_pair_each);
    RUN_TEST(test_a_command_stopped_in_its_wait_has_none);
    RUN_TEST(test_a_single_pulse_has_none);
    RUN_TEST(test_soft_ops_send_dc1_and_dc2_with_the_flag);
    RUN_TEST(test_soft_ops_never_wait);
    return UNITY_END();
}
