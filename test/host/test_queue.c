/* queue/queue: 30 entries in a circle, executed in order. */
#include "queue/queue.h"
#include "queue/session.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "settings.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>

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
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(500, engine_fake.submitted[0].count);
    TEST_ASSERT_FALSE(queue_poll());
}

/* What begins next, taken from the engine's point of view; 0: nothing is offered. */
static uint32_t begin_next(void)
{
    queue_poll();
    if (engine_fake.offered == NULL) {
        return 0;
    }
    engine_fake_begin();
    queue_poll();
    return engine_fake.submitted[engine_fake.submitted_count - 1].count;
}

static void expect_order(const char *expected)
{
    char seen[400] = "";
    for (size_t n = 0; n < strlen(expected) / 2 + 1; n++) {
        sprintf(seen + strlen(seen), "%s%u", n == 0 ? "" : " ", (unsigned)begin_next());
        if (strlen(seen) >= strlen(expected)) {
            break;
        }
    }
    TEST_ASSERT_EQUAL_STRING(expected, seen);
}

/* Each entry counts as many steps as its position, and nothing is pending; the engine is in motion. */
static void number_the_entries(void)
{
    engine_fake.accepts = false;
    for (uint8_t position = 1; position <= 30; position++) {
        const motion_command_t command = command_of(position);
        queue_edit(position, &command);
    }
}

/* MOT-012 */
static void test_commands_wait_until_the_engine_begins_them_and_follow_in_order(void)
{
    engine_fake.accepts = false;
    for (uint32_t i = 1; i <= 5; i++) {
        add(i);
    }
    TEST_ASSERT_FALSE(queue_poll());
    TEST_ASSERT_EQUAL_UINT8(5, queue_pending());
    expect_order("1 2 3 4 5 0");
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
    for (int i = 0; i < 40; i++) {
        queue_poll();
    }
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
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
        add(i);
        TEST_ASSERT_EQUAL_UINT8((i - 1) % 30 + 1, queue_executing_position());
        engine_fake.accepts = false;
        add(i); /* waits for the first one's end */
        queue_poll();
        TEST_ASSERT_EQUAL_UINT8((i - 1) % 30 + 1, queue_executing_position());
        engine_fake.ended++;
        engine_fake_begin();
        queue_poll();
        TEST_ASSERT_EQUAL_UINT8(i % 30 + 1, queue_executing_position());
        engine_fake.ended++;
        engine_fake.accepts = true;
        i++;
    }
    TEST_ASSERT_EQUAL_UINT8(0, queue_executing_position());
    add(1);
    queue_stop();
    TEST_ASSERT_EQUAL_UINT8(0, queue_executing_position());
}

/* QUE-030, QUE-034 */
static void test_an_entry_that_is_offered_can_still_be_edited(void)
{
    engine_fake.accepts = false;
    add(1);
    queue_poll();
    const motion_command_t command = command_of(77);
    queue_edit(1, &command);
    expect_order("77 0");
}

/* QUE-019, QUE-020, QUE-027 */
static void test_clear_gives_every_entry_the_session_defaults(void)
{
    add(5);
    session.velocity = 50;
    session.flags &= (uint8_t)~MOTION_CYCLE;
    queue_clear();
    for (uint8_t position = 1; position <= 30; position++) {
        TEST_ASSERT_EQUAL_UINT32(50, queue_entry(position)->velocity);
        TEST_ASSERT_EQUAL_UINT32(200, queue_entry(position)->count);
    }
    TEST_ASSERT_EQUAL_UINT8(2, queue_next_position());
}

/* LOO-001, LOO-002, LOO-004, LOO-006, LOO-009 */
static void test_a_loop_begins_with_its_second_bound_and_goes_around(void)
{
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_FINISH, 5));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_START, 3));
    expect_order("3 4 5 3 4 5 3");
}

/* LOO-003 */
static void test_a_loop_needs_two_different_bounds(void)
{
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_START, 3));
    TEST_ASSERT_EQUAL(STATUS_LOOP_BOUNDS, queue_loop_bound(QUEUE_LOOP_FINISH, 3));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_FINISH, 4));
    expect_order("3 4 3");
}

/* LOO-005 */
static void test_a_loop_wraps_from_30_to_1(void)
{
    number_the_entries();
    queue_loop_bound(QUEUE_LOOP_START, 29);
    queue_loop_bound(QUEUE_LOOP_FINISH, 2);
    expect_order("29 30 1 2 29");
}

/* LOO-007, LOO-008, LOO-010 */
static void test_a_loop_makes_so_many_passes_and_forgets_its_bounds(void)
{
    number_the_entries();
    queue_loop_passes(2);
    queue_loop_bound(QUEUE_LOOP_START, 1);
    queue_loop_bound(QUEUE_LOOP_FINISH, 3);
    expect_order("1 2 3 1 2 3 0");
    engine_fake.ended = engine_fake.begun;
    queue_poll();
    queue_loop_bound(QUEUE_LOOP_FINISH, 3);
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    queue_loop_bound(QUEUE_LOOP_START, 2);
    expect_order("2 3 2 3 2 3 2");
}

/* LOO-011 */
static void test_a_loop_of_all_begins_with_the_first(void)
{
    number_the_entries();
    queue_loop_from_first(QUEUE_LAST);
    for (unsigned n = 0; n < 61; n++) {
        TEST_ASSERT_EQUAL_UINT32(n % 30 + 1, begin_next());
    }
}

/* AUT-002 */
static void test_autorun_of_one_repeats_the_first_entry(void)
{
    number_the_entries();
    queue_loop_from_first(1);
    expect_order("1 1 1 1");
}

/* LOO-012 */
static void test_a_loop_ends_with_the_running_command(void)
{
    number_the_entries();
    queue_loop_from_first(3);
    expect_order("1 2");
    queue_loop_end();
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.nexts_graceful);
}

/* LOO-014 */
static void test_bounds_can_be_changed_while_the_loop_runs(void)
{
    number_the_entries();
    queue_loop_from_first(3);
    expect_order("1 2");
    queue_loop_bound(QUEUE_LOOP_FINISH, 5);
    expect_order("3 4 5 1 2");
    queue_loop_bound(QUEUE_LOOP_START, 4);
    expect_order("3 4 5 4 5");
}

/* LOO-014: what counts are the bounds when a command is done, not when it begins. */
static void test_bounds_can_be_changed_while_the_last_command_of_a_pass_runs(void)
{
    number_the_entries();
    queue_loop_passes(2);
    queue_loop_from_first(3);
    expect_order("1 2 3");
    queue_loop_bound(QUEUE_LOOP_FINISH, 4);
    expect_order("4 1 2");
    queue_loop_bound(QUEUE_LOOP_FINISH, 2);
    expect_order("0");
    queue_loop_bound(QUEUE_LOOP_FINISH, 3);
    expect_order("3 0");
}

/* LOO-014: the engine may begin at any moment what it was offered. */
static void test_a_changed_bound_changes_at_once_what_is_offered(void)
{
    number_the_entries();
    queue_loop_passes(1);
    queue_loop_from_first(3);
    expect_order("1 2 3");
    engine_fake.accepts = false;
    add(100);
    queue_loop_bound(QUEUE_LOOP_FINISH, 5);
    TEST_ASSERT_EQUAL_PTR(queue_entry(4), engine_fake.offered);
    queue_loop_passes(0);
    queue_loop_bound(QUEUE_LOOP_FINISH, 3);
    TEST_ASSERT_EQUAL_PTR(queue_entry(1), engine_fake.offered);
}

/* What was typed while a loop runs comes after it. */
static void test_commands_that_are_pending_follow_the_loop(void)
{
    number_the_entries();
    queue_loop_passes(1);
    queue_loop_from_first(3);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    add(100); /* at position 1, which is not executed again */
    expect_order("2 3 100 0");
}

/* XRF-001, XRF-003, LOO-013 */
static void test_xref_preempts_and_the_loop_goes_on_with_its_next_command(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    expect_order("1 2");
    queue_preempt(20);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts);
    expect_order("20 3 4 1");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts);
}

static void test_a_running_command_that_cannot_be_cut_now_is_cut_later(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    engine_fake.cannot_end = true;
    queue_preempt(20);
    queue_poll();
    engine_fake.cannot_end = false;
    const unsigned asked = engine_fake.nexts;
    queue_poll();
    TEST_ASSERT_EQUAL_UINT(asked + 1, engine_fake.nexts);
    queue_poll();
    TEST_ASSERT_EQUAL_UINT(asked + 1, engine_fake.nexts);
    TEST_ASSERT_EQUAL_UINT32(20, begin_next());
}

/* What preempts is not cut itself when it has begun by another way. */
static void test_a_preempting_command_that_has_begun_is_not_cut(void)
{
    number_the_entries();
    add(1);
    begin_next();
    engine_fake.cannot_end = true;
    queue_preempt(20);
    engine_fake_begin();
    queue_poll();
    const unsigned asked = engine_fake.nexts;
    engine_fake.cannot_end = false;
    queue_poll();
    TEST_ASSERT_EQUAL_UINT(asked, engine_fake.nexts);
}

/* THR-002, THR-003, THR-006, THR-007 */
static void test_a_one_shot_preempts_from_a_position_of_its_own(void)
{
    number_the_entries();
    add(1);
    add(2);
    add(3);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    const motion_command_t command = command_of(500);
    queue_preempt_with(QUEUE_ONE_SHOT, &command);
    expect_order("500 2 3 0");
    TEST_ASSERT_EQUAL_UINT8(4, queue_next_position());
}

static void start_continuous(void)
{
    const motion_command_t endless = command_of(0);
    queue_preempt_with(QUEUE_CONTINUOUS, &endless);
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
}

/* CON-002, CON-004, CON-009 */
static void test_continuous_preempts_and_next_goes_on_with_the_queue(void)
{
    engine_fake.accepts = false;
    add(1);
    add(2);
    add(3);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    start_continuous();
    TEST_ASSERT_EQUAL_UINT8(2, queue_pending());
    queue_next_graceful();
    expect_order("2 3 0");
}

/* CON-010 */
static void test_next_in_continuous_lets_an_interrupted_loop_take_one_more(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    expect_order("1 2");
    start_continuous();
    queue_next();
    expect_order("3 0 0");
}

/* NXT-004 */
static void test_next_in_a_loop_goes_on_with_the_loop(void)
{
    number_the_entries();
    queue_loop_from_first(3);
    expect_order("1 2");
    queue_next();
    expect_order("3 1 2");
}

/* CON-011, XRF-002, XRF-004 */
static void test_xref_ends_continuous_and_the_loop_resumes(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    expect_order("1 2");
    start_continuous();
    queue_preempt(9);
    expect_order("9 3 4 1");
}

/* CON-012, STO-008 */
static void test_the_loop_terminator_ends_continuous_with_grace_and_its_loop(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    start_continuous();
    queue_loop_end();
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts_graceful);
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
}

/* CON-008 */
static void test_stop_ends_continuous_and_the_loop_it_interrupted(void)
{
    number_the_entries();
    queue_loop_from_first(4);
    TEST_ASSERT_EQUAL_UINT32(1, begin_next());
    start_continuous();
    queue_stop();
    queue_poll();
    TEST_ASSERT_NULL(engine_fake.offered);
}

/* VEL: a throttle for continuous motion, and for nothing else. */
static void test_a_velocity_is_followed_by_continuous_motion_only(void)
{
    number_the_entries();
    motion_command_t faster = command_of(1);
    faster.velocity = 333;
    faster.accel = 50;
    queue_follow(&faster);
    queue_poll();
    TEST_ASSERT_NULL(engine_fake.offered);
    start_continuous();
    queue_follow(&faster);
    TEST_ASSERT_EQUAL_PTR(queue_entry(QUEUE_CONTINUOUS), engine_fake.offered);
    TEST_ASSERT_EQUAL_UINT32(0, engine_fake.offered->count);
    TEST_ASSERT_EQUAL_UINT32(333, engine_fake.offered->velocity);
    TEST_ASSERT_EQUAL_UINT16(50, engine_fake.offered->accel);
    TEST_ASSERT_EQUAL_UINT16(100, engine_fake.offered->decel);
}

/* XRF-008, XRF-009, XRF-010, XRF-013 */
static void test_the_array_is_run_up_to_its_null_so_many_times(void)
{
    static const uint8_t positions[] = {3, 3, 1, 30, 0};
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_ARRAY_EMPTY, queue_array_run(2));
    for (uint8_t entry = 0; entry < sizeof positions; entry++) {
        queue_array_set(entry, positions[entry]);
    }
    TEST_ASSERT_EQUAL(STATUS_OK, queue_array_run(2));
    expect_order("3 3 1 30 3 3 1 30 0");
    TEST_ASSERT_EQUAL(STATUS_OK, queue_array_run(0));
    expect_order("3 3 1 30 3 3 1 30 3 3 1 30 3");
}

static void test_a_full_array_ends_at_its_end(void)
{
    number_the_entries();
    for (uint8_t entry = 0; entry < QUEUE_ARRAY; entry++) {
        queue_array_set(entry, 7);
    }
    queue_array_run(1);
    for (uint8_t entry = 0; entry < QUEUE_ARRAY; entry++) {
        TEST_ASSERT_EQUAL_UINT32(7, begin_next());
    }
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
}

static void test_an_array_shortened_while_it_runs_begins_anew(void)
{
    number_the_entries();
    for (uint8_t entry = 0; entry < 4; entry++) {
        queue_array_set(entry, (uint8_t)(entry + 1));
    }
    queue_array_run(0);
    expect_order("1 2");
    queue_array_set(2, 0);
    expect_order("1 2 1");
    queue_array_set(0, 0);
    TEST_ASSERT_EQUAL_UINT32(2, begin_next());
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
}

/* TRM-012 */
static void test_undo_takes_back_one_command_or_edit(void)
{
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_OK, queue_undo()); /* the last edit */
    TEST_ASSERT_EQUAL_UINT32(200, queue_entry(30)->count);
    TEST_ASSERT_EQUAL(STATUS_NOTHING_TO_UNDO, queue_undo());
    add(100);
    add(101);
    TEST_ASSERT_EQUAL(STATUS_OK, queue_undo());
    TEST_ASSERT_EQUAL_UINT8(2, queue_next_position());
    TEST_ASSERT_EQUAL_UINT32(2, queue_entry(2)->count);
    expect_order("100 0");
}

/* TRM-012 */
static void test_what_is_executing_is_not_taken_back(void)
{
    add(100);
    TEST_ASSERT_EQUAL(STATUS_NOTHING_TO_UNDO, queue_undo());
    TEST_ASSERT_EQUAL_UINT32(100, queue_entry(1)->count);
    engine_fake.ended++;
    TEST_ASSERT_EQUAL(STATUS_OK, queue_undo());
    TEST_ASSERT_EQUAL_UINT32(200, queue_entry(1)->count);
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
}

/* EST-001: refused, nothing changed, whatever would begin motion */
static void test_while_estop_is_active_nothing_begins(void)
{
    const motion_command_t command = *queue_entry(QUEUE_FIRST);
    engine_fake.estop = true;
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_add(&command));
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_preempt(3));
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_preempt_with(QUEUE_ONE_SHOT, &command));
    (void)queue_loop_bound(QUEUE_LOOP_START, 1);
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_loop_bound(QUEUE_LOOP_FINISH, 2));
    queue_array_set(0, 1);
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_array_run(1));
    TEST_ASSERT_EQUAL(0, queue_pending());
    (void)queue_poll();
    engine_fake.estop = false;
    (void)queue_poll();
    TEST_ASSERT_EQUAL(0, engine_fake.submitted_count);
}

/* EST: what is refused while Estop is low leaves everything as it was. */
static void test_estop_refuses_loops_and_forgets_nothing(void)
{
    number_the_entries();
    queue_loop_passes(1);
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_START, 3));
    engine_fake.estop = true;
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_loop_bound(QUEUE_LOOP_FINISH, 4));
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_loop_from_first(30));
    TEST_ASSERT_EQUAL(STATUS_ESTOP, queue_preempt(5));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    engine_fake.estop = false;
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_FINISH, 4));
    expect_order("3 4 0");
}

/* Entries that were possible before a warm boot need not be so after it. */
static void test_entries_that_have_become_impossible_are_not_executed(void)
{
    number_the_entries();
    motion_command_t fast = command_of(7);
    fast.velocity = 60000; /* 5 us a step */
    queue_edit(7, &fast);
    queue_array_set(0, 1);
    queue_array_set(1, 7);
    settings.ustep = 4;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, queue_preempt(7));
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, queue_loop_from_first(30));
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, queue_array_run(1));
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_START, 29));
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, queue_loop_bound(QUEUE_LOOP_FINISH, 7));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    TEST_ASSERT_EQUAL(STATUS_OK, queue_loop_bound(QUEUE_LOOP_FINISH, 2));
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, queue_loop_bound(QUEUE_LOOP_FINISH, 8));
    expect_order("29 30 1 2 29");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_entries_are_seeded_with_the_system_defaults);
    RUN_TEST(test_seeds_of_a_linear_start_up_ramp_carry_its_values_and_its_flag);
    RUN_TEST(test_seeded_entries_are_not_executed);
    RUN_TEST(test_a_command_is_stored_at_the_next_position_and_executed);
    RUN_TEST(test_commands_wait_until_the_engine_begins_them_and_follow_in_order);
    RUN_TEST(test_the_31st_command_wraps_to_position_1);
    RUN_TEST(test_with_all_30_pending_a_command_is_refused_and_nothing_is_overwritten);
    RUN_TEST(test_positions_0_and_31_are_never_filled_by_motion_commands);
    RUN_TEST(test_stop_drops_what_is_pending_and_keeps_the_entries);
    RUN_TEST(test_graceful_stop_passes_the_session_deceleration_and_drops_what_is_pending);
    RUN_TEST(test_next_leaves_what_is_pending_pending);
    RUN_TEST(test_the_executing_position_follows_the_engine_around_the_circle);
    RUN_TEST(test_an_entry_that_is_offered_can_still_be_edited);
    RUN_TEST(test_clear_gives_every_entry_the_session_defaults);
    RUN_TEST(test_a_loop_begins_with_its_second_bound_and_goes_around);
    RUN_TEST(test_a_loop_needs_two_different_bounds);
    RUN_TEST(test_a_loop_wraps_from_30_to_1);
    RUN_TEST(test_a_loop_makes_so_many_passes_and_forgets_its_bounds);
    RUN_TEST(test_a_loop_of_all_begins_with_the_first);
    RUN_TEST(test_autorun_of_one_repeats_the_first_entry);
    RUN_TEST(test_a_loop_ends_with_the_running_command);
    RUN_TEST(test_bounds_can_be_changed_while_the_loop_runs);
    RUN_TEST(test_bounds_can_be_changed_while_the_last_command_of_a_pass_runs);
    RUN_TEST(test_a_changed_bound_changes_at_once_what_is_offered);
    RUN_TEST(test_commands_that_are_pending_follow_the_loop);
    RUN_TEST(test_xref_preempts_and_the_loop_goes_on_with_its_next_command);
    RUN_TEST(test_a_running_command_that_cannot_be_cut_now_is_cut_later);
    RUN_TEST(test_a_preempting_command_that_has_begun_is_not_cut);
    RUN_TEST(test_a_one_shot_preempts_from_a_position_of_its_own);
    RUN_TEST(test_continuous_preempts_and_next_goes_on_with_the_queue);
    RUN_TEST(test_next_in_continuous_lets_an_interrupted_loop_take_one_more);
    RUN_TEST(test_next_in_a_loop_goes_on_with_the_loop);
    RUN_TEST(test_xref_ends_continuous_and_the_loop_resumes);
    RUN_TEST(test_the_loop_terminator_ends_continuous_with_grace_and_its_loop);
    RUN_TEST(test_stop_ends_continuous_and_the_loop_it_interrupted);
    RUN_TEST(test_a_velocity_is_followed_by_continuous_motion_only);
    RUN_TEST(test_the_array_is_run_up_to_its_null_so_many_times);
    RUN_TEST(test_a_full_array_ends_at_its_end);
    RUN_TEST(test_an_array_shortened_while_it_runs_begins_anew);
    RUN_TEST(test_undo_takes_back_one_command_or_edit);
    RUN_TEST(test_what_is_executing_is_not_taken_back);
    RUN_TEST(test_while_estop_is_active_nothing_begins);
    RUN_TEST(test_estop_refuses_loops_and_forgets_nothing);
    RUN_TEST(test_entries_that_have_become_impossible_are_not_executed);
    return UNITY_END();
}
