/* queue/queue: 30 entries in a circle, executed in order. */
#include "queue/queue.h"
#include "queue/session.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "settings.h"
#include "unity.h"

static settings_t factory;

void setUp(void)
{
    factory = settings;
    terminal_port_fake_reset();
    engine_fake_reset();
    session_init();
    queue_init();
}

void tearDown(void)
{
    settings = factory;
}

static motion_command_t command_of(uint32_t count)
{
    return (motion_command_t){.count = count, .velocity = 100, .accel = 100, .decel = 100};
}

static status_t add(uint32_t count)
{
    const motion_command_t command = command_of(count);
    return queue_add(&command);
}

/* QUE-021 */
static void test_entries_are_seeded_with_the_system_defaults(void)
{
    settings.direction = 1;
    settings.steps_per_rev = 400;
    settings.cycle_us = 1234;
    session_init();
    queue_init();
    for (uint8_t position = 0; position < QUEUE_POSITIONS; position++) {
        const motion_command_t *entry = queue_entry(position);
        TEST_ASSERT_EQUAL_UINT32(400, entry->count);
        TEST_ASSERT_EQUAL_UINT32(1234, entry->velocity);
        TEST_ASSERT_EQUAL_UINT16(100, entry->accel);
        TEST_ASSERT_EQUAL_UINT16(100, entry->decel);
        TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE | MOTION_CCW, entry->flags);
    }
}

static void test_seeds_of_a_linear_start_up_ramp_carry_its_values_and_its_flag(void)
{
    settings.ramp = 1;
    session_init();
    queue_init();
    TEST_ASSERT_EQUAL_UINT16(1047, queue_entry(1)->accel);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE | MOTION_LINEAR, queue_entry(1)->flags);
}

/* QUE-015 */
static void test_seeded_entries_are_not_executed(void)
{
    TEST_ASSERT_FALSE(queue_poll());
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
}

/* MOT-005, MOT-006, QUE-013 */
static void test_a_command_is_stored_at_the_next_position_and_executed(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, add(500));
    TEST_ASSERT_EQUAL_UINT32(500, queue_entry(1)->count);
    TEST_ASSERT_EQUAL_UINT8(2, queue_next_position());
    TEST_ASSERT_TRUE(queue_poll());
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(500, engine_fake.submitted[0].count);
    TEST_ASSERT_FALSE(queue_poll());
}

/* MOT-012 */
static void test_commands_wait_until_the_engine_accepts_and_follow_in_order(void)
{
    engine_fake.accepts = false;
    for (uint32_t i = 1; i <= 5; i++) {
        add(i);
    }
    TEST_ASSERT_FALSE(queue_poll());
    TEST_ASSERT_EQUAL_UINT8(5, queue_pending());
    engine_fake.accepts = true;
    for (uint32_t i = 1; i <= 5; i++) {
        TEST_ASSERT_TRUE(queue_poll());
        TEST_ASSERT_EQUAL_UINT32(i, engine_fake.submitted[i - 1].count);
    }
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
}

/* QUE-001, QUE-033 */
static void test_the_31st_command_wraps_to_position_1(void)
{
    for (uint32_t i = 1; i <= 30; i++) {
        TEST_ASSERT_EQUAL_UINT8(i, queue_next_position());
        add(i);
        queue_poll();
    }
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
    TEST_ASSERT_EQUAL(STATUS_OK, add(31));
    TEST_ASSERT_EQUAL_UINT32(31, queue_entry(1)->count);
    TEST_ASSERT_EQUAL_UINT32(2, queue_entry(2)->count);
}

static void test_with_all_30_pending_a_command_is_refused_and_nothing_is_overwritten(void)
{
    engine_fake.accepts = false;
    for (uint32_t i = 1; i <= 30; i++) {
        TEST_ASSERT_EQUAL(STATUS_OK, add(i));
    }
    TEST_ASSERT_EQUAL(STATUS_QUEUE_FULL, add(31));
    for (uint8_t i = 1; i <= 30; i++) {
        TEST_ASSERT_EQUAL_UINT32(i, queue_entry(i)->count);
    }
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
    engine_fake.accepts = true;
    TEST_ASSERT_TRUE(queue_poll());
    TEST_ASSERT_EQUAL(STATUS_OK, add(31)); /* the engine has its copy of position 1 */
    for (int i = 0; i < 30; i++) {
        TEST_ASSERT_TRUE(queue_poll());
    }
    TEST_ASSERT_EQUAL_UINT32(31, engine_fake.submitted[30].count);
}

/* QUE-012 */
static void test_positions_0_and_31_are_never_filled_by_motion_commands(void)
{
    for (uint32_t i = 1; i <= 90; i++) {
        add(1000 + i);
        queue_poll();
    }
    TEST_ASSERT_EQUAL_UINT32(200, queue_entry(QUEUE_CONTINUOUS)->count);
    TEST_ASSERT_EQUAL_UINT32(200, queue_entry(QUEUE_ONE_SHOT)->count);
}

/* STO-001..STO-003 */
static void test_stop_drops_what_is_pending_and_keeps_the_entries(void)
{
    engine_fake.accepts = false;
    for (uint32_t i = 1; i <= 3; i++) {
        add(i);
    }
    queue_stop();
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops);
    engine_fake.accepts = true;
    TEST_ASSERT_FALSE(queue_poll());
    TEST_ASSERT_EQUAL_UINT8(4, queue_next_position());
    TEST_ASSERT_EQUAL_UINT32(3, queue_entry(3)->count);
    add(4);
    TEST_ASSERT_TRUE(queue_poll());
    TEST_ASSERT_EQUAL_UINT32(4, engine_fake.submitted[0].count);
}

/* STO-004 */
static void test_graceful_stop_passes_the_session_deceleration_and_drops_what_is_pending(void)
{
    engine_fake.accepts = false;
    add(1);
    queue_stop_graceful(250, true);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops_graceful);
    TEST_ASSERT_EQUAL_UINT16(250, engine_fake.graceful_decel);
    TEST_ASSERT_TRUE(engine_fake.graceful_linear);
    engine_fake.accepts = true;
    TEST_ASSERT_FALSE(queue_poll());
}

/* NXT-001, NXT-002 */
static void test_next_leaves_what_is_pending_pending(void)
{
    engine_fake.accepts = false;
    add(7);
    queue_next();
    queue_next_graceful();
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts_graceful);
    engine_fake.accepts = true;
    TEST_ASSERT_TRUE(queue_poll());
    TEST_ASSERT_EQUAL_UINT32(7, engine_fake.submitted[0].count);
}

/* QUE-013 */
static void test_the_executing_position_follows_the_engine_around_the_circle(void)
{
    TEST_ASSERT_EQUAL_UINT8(0, queue_executing_position());
    for (uint8_t i = 1; i <= 65; i++) {
        const uint8_t position = (uint8_t)((i - 1) % 30 + 1);
        add(i);
        queue_poll();
        TEST_ASSERT_EQUAL_UINT8(position, queue_executing_position());
        add(i);
        queue_poll(); /* the engine plans one ahead: still the first one runs */
        TEST_ASSERT_EQUAL_UINT8(position, queue_executing_position());
        engine_fake.ended++;
        TEST_ASSERT_EQUAL_UINT8(position % 30 + 1, queue_executing_position());
        engine_fake.ended++;
        i++;
    }
    TEST_ASSERT_EQUAL_UINT8(0, queue_executing_position());
    add(1);
    queue_poll();
    queue_stop();
    TEST_ASSERT_EQUAL_UINT8(0, queue_executing_position());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_entries_are_seeded_with_the_system_defaults);
    RUN_TEST(test_seeds_of_a_linear_start_up_ramp_carry_its_values_and_its_flag);
    RUN_TEST(test_seeded_entries_are_not_executed);
    RUN_TEST(test_a_command_is_stored_at_the_next_position_and_executed);
    RUN_TEST(test_commands_wait_until_the_engine_accepts_and_follow_in_order);
    RUN_TEST(test_the_31st_command_wraps_to_position_1);
    RUN_TEST(test_with_all_30_pending_a_command_is_refused_and_nothing_is_overwritten);
    RUN_TEST(test_positions_0_and_31_are_never_filled_by_motion_commands);
    RUN_TEST(test_stop_drops_what_is_pending_and_keeps_the_entries);
    RUN_TEST(test_graceful_stop_passes_the_session_deceleration_and_drops_what_is_pending);
    RUN_TEST(test_next_leaves_what_is_pending_pending);
    RUN_TEST(test_the_executing_position_follows_the_engine_around_the_circle);
    return UNITY_END();
}
