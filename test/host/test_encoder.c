/* queue/encoder: follow and throttle. */
#include "queue/encoder.h"
#include "host/fakes/encoder_port_fake.h"
#include "host/fakes/engine_fake.h"
#include "unity.h"

static int throttled_rpm;
static unsigned throttles;

void queue_throttle(int8_t rpm)
{
    throttled_rpm += rpm;
    throttles++;
}

static void be(motion_state_t state)
{
    engine_fake.state = state;
    (void)encoder_poll();
}

/* The override of the test before is gone, too. */
void setUp(void)
{
    engine_fake_reset();
    encoder_port_fake_lines = 0;
    be(MOTION_CRUISE);
    be(MOTION_STANDBY);
    throttled_rpm = 0;
    throttles = 0;
}

void tearDown(void) {}

static void turn(int8_t lines)
{
    encoder_port_fake_lines = lines;
    TEST_ASSERT_TRUE(encoder_poll());
}

static void assert_effect(unsigned pulses_cw, unsigned pulses_ccw, int rpm)
{
    TEST_ASSERT_EQUAL_UINT(pulses_cw, engine_fake.pulses_cw);
    TEST_ASSERT_EQUAL_UINT(pulses_ccw, engine_fake.pulses_ccw);
    TEST_ASSERT_EQUAL_INT(rpm, throttled_rpm);
}

/* ENC-001 */
static void test_in_standby_each_line_is_a_pulse_in_its_direction(void)
{
    turn(1);
    assert_effect(1, 0, 0);
    turn(-1);
    assert_effect(1, 1, 0);
    turn(31);
    turn(-32);
    assert_effect(32, 33, 0);
    TEST_ASSERT_FALSE(encoder_throttles());
}

/* ENC-002, ENC-007 */
static void test_in_motion_lines_are_rpm_and_no_pulses(void)
{
    static const motion_state_t states[] = {MOTION_ACCEL, MOTION_CRUISE, MOTION_DECEL, MOTION_STOP};
    for (unsigned i = 0; i < 4; i++) {
        be(states[i]);
        TEST_ASSERT_TRUE(encoder_throttles());
        turn(3);
        turn(-2);
        assert_effect(0, 0, (int)i + 1);
    }
    be(MOTION_STANDBY);
    turn(1);
    assert_effect(1, 0, 4);
}

/* ENC-006, ENC-008 */
static void test_throttle_in_standby_and_follow_in_motion_do_nothing(void)
{
    encoder_toggle();
    TEST_ASSERT_TRUE(encoder_throttles());
    turn(5);
    encoder_toggle();
    assert_effect(0, 0, 0);
    be(MOTION_CRUISE);
    encoder_toggle();
    TEST_ASSERT_FALSE(encoder_throttles());
    turn(5);
    assert_effect(0, 0, 0);
    TEST_ASSERT_EQUAL_UINT(0, throttles);
}

/* ENC-008 */
static void test_a_second_toggle_and_any_change_of_state_end_the_override(void)
{
    encoder_toggle();
    encoder_toggle();
    turn(1);
    assert_effect(1, 0, 0);
    encoder_toggle();
    be(MOTION_ACCEL);
    be(MOTION_CRUISE);
    turn(1);
    assert_effect(1, 0, 1);
    encoder_toggle();
    be(MOTION_STANDBY);
    turn(1);
    assert_effect(2, 0, 1);
}

/* As $n does, which stops first: what counts is the state that it leaves. */
static void test_a_toggle_right_after_a_stop_holds(void)
{
    be(MOTION_CRUISE);
    engine_fake.state = MOTION_STANDBY;
    encoder_toggle();
    TEST_ASSERT_TRUE(encoder_throttles());
    turn(1);
    assert_effect(0, 0, 0);
}

static void test_without_a_line_there_is_nothing_to_do(void)
{
    TEST_ASSERT_FALSE(encoder_poll());
    assert_effect(0, 0, 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_in_standby_each_line_is_a_pulse_in_its_direction);
    RUN_TEST(test_in_motion_lines_are_rpm_and_no_pulses);
    RUN_TEST(test_throttle_in_standby_and_follow_in_motion_do_nothing);
    RUN_TEST(test_a_second_toggle_and_any_change_of_state_end_the_override);
    RUN_TEST(test_a_toggle_right_after_a_stop_holds);
    RUN_TEST(test_without_a_line_there_is_nothing_to_do);
    return UNITY_END();
}
