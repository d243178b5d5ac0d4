/* image/processor_model: the worked cases of the manual and of the decisions, played by hand. All commands have pulses
 * 1 ms apart unless said otherwise; "3, -2" below means three pulses clockwise, then two counter-clockwise. */
#include "image/processor_model.h"
#include <stdarg.h>
#include <stdio.h>
#include <unity.h>

#define US 16ull
#define MS (1000 * US)
#define END 0x7FFF

static processor_t *p;
static uint64_t now;

void setUp(void)
{
    static const machine_t machine = {.steps_per_rev = 200, .slow_rpm = 100};
    p = processor_new(machine, "m200vc1000a999d999l0f");
    now = 100 * MS;
}

void tearDown(void)
{
    processor_free(p);
}

static void type(const char *line)
{
    TEST_ASSERT_TRUE_MESSAGE(processor_line(p, now, line), line);
}

static bool pulse_after(uint64_t cycles, uint8_t dir)
{
    now += cycles;
    return processor_pulse(p, now, dir);
}

/* So many pulses, negative ones counter-clockwise, until END. */
static void plays(int first, ...)
{
    va_list arguments;
    va_start(arguments, first);
    for (int n = first; n != END; n = va_arg(arguments, int)) {
        for (int i = 0; i < (n < 0 ? -n : n); i++) {
            if (!pulse_after(MS, n < 0)) {
                char message[2200];
                snprintf(message, sizeof message, "pulse %d of %d was refused; %s", i + 1, n, processor_states(p));
                TEST_FAIL_MESSAGE(message);
            }
        }
    }
    va_end(arguments);
}

static void refuses(uint8_t dir)
{
    TEST_ASSERT_FALSE_MESSAGE(pulse_after(MS, dir), processor_states(p));
}

static void rests(void)
{
    now += 100 * MS;
    TEST_ASSERT_TRUE_MESSAGE(processor_silence(p, now), processor_states(p));
    TEST_ASSERT_TRUE_MESSAGE(processor_rests(p, now), processor_states(p));
}

/* Silence in which what was typed takes effect; only where no pulse is due. */
static void later(void)
{
    now += 30 * MS;
    TEST_ASSERT_TRUE_MESSAGE(processor_silence(p, now), processor_states(p));
}

/* Positions 1 to 5 hold 1, -2, 3, -4 and 5 steps. */
static void fill(void)
{
    type("m1");
    type("m-2");
    type("m3");
    type("m-4");
    type("m5");
    plays(1, -2, 3, -4, 5, END);
    rests();
}

/* -- the queue ----------------------------------------------------------------------------------------------------- */

static void test_commands_run_in_order_each_with_its_count_and_direction(void)
{
    type("m3");
    type("m-2vc2000");
    type("m4vc1000");
    plays(3, END);
    pulse_after(MS, 1);
    TEST_ASSERT_TRUE(pulse_after(2 * MS, 1));
    plays(4, END);
    rests();
    TEST_ASSERT_EQUAL(4, processor_next_position(p));
}

static void test_a_pulse_too_many_too_few_or_in_the_wrong_direction_is_noticed(void)
{
    type("m3");
    plays(3, END);
    refuses(0);
    tearDown(), setUp();
    type("m3");
    plays(2, END);
    TEST_ASSERT_FALSE(processor_silence(p, now + 20 * MS));
    tearDown(), setUp();
    type("m3");
    type("m-3");
    plays(2, END);
    refuses(1);
    tearDown(), setUp();
    refuses(0);
}

static void test_a_pending_command_that_is_not_executed_is_noticed(void)
{
    type("m3");
    type("m3");
    plays(3, END);
    TEST_ASSERT_FALSE(processor_silence(p, now + 40 * MS));
}

static void test_an_interval_that_is_not_the_commands_is_noticed(void)
{
    type("m5");
    plays(3, END);
    TEST_ASSERT_FALSE(pulse_after(MS + 10, 0));
}

static void test_extra_pulses_are_added_and_omitted_parameters_come_from_the_session(void)
{
    type("m3u4");
    plays(7, END);
    rests();
    type("m3");
    plays(3, END);
    rests();
    type("vc500");
    type("m2");
    TEST_ASSERT_TRUE(pulse_after(MS, 0));
    TEST_ASSERT_TRUE(pulse_after(500 * US, 0));
    rests();
}

static void test_a_start_wait_delays_and_is_forgotten(void)
{
    type("m2t50000");
    now += 40 * MS;
    TEST_ASSERT_TRUE(processor_silence(p, now));
    refuses(0);
    tearDown(), setUp();
    type("m2t50000");
    now += 50 * MS;
    plays(2, END);
    type("m2");
    plays(2, END);
    rests();
}

static void test_plus_and_minus_are_a_pulse_each_at_rest_only(void)
{
    type("+");
    plays(1, END);
    later();
    type("-");
    plays(-1, END);
    rests();
    type("m20");
    plays(5, END);
    type("-");
    plays(15, END);
    rests();
}

static void test_the_31st_command_takes_the_first_position_again(void)
{
    for (int n = 1; n <= 31; n++) {
        type(n % 2 ? "m1" : "m-1");
        plays(n % 2 ? 1 : -1, END);
        rests();
    }
    TEST_ASSERT_EQUAL(2, processor_next_position(p));
}

/* -- stop and next ------------------------------------------------------------------------------------------------- */

static void test_capital_s_ends_all_at_once(void)
{
    type("m50");
    type("m-5");
    plays(10, END);
    type("S");
    later();
    rests();
    type("m2");
    plays(2, END);
    rests();
    TEST_ASSERT_EQUAL(4, processor_next_position(p));
    tearDown(), setUp();
    type("m50");
    plays(10, END);
    type("S");
    plays(3, END);
    refuses(0);
}

static void test_capital_n_cuts_the_running_command_only(void)
{
    type("m50");
    type("m-5");
    plays(10, END);
    type("N");
    plays(2, -5, END);
    rests();
    tearDown(), setUp();
    type("m50");
    type("m-5");
    plays(10, END);
    type("N");
    plays(5, END);
    unsigned more = 0;
    while (pulse_after(MS, 0))
        more++;
    TEST_ASSERT_LESS_THAN(18, more);
}

static void test_small_n_ramps_down_with_the_commands_deceleration(void)
{
    /* 300 RPM, 20 a step: 10 steps to slow speed. */
    type("m100vc1000a999d20");
    type("m-5");
    plays(50, END);
    type("n");
    plays(3, END);
    for (int k = 1; k <= 10; k++)
        TEST_ASSERT_TRUE(pulse_after((uint64_t)(16 * 300000.0 / (300 - 20 * (k - 1))), 0));
    TEST_ASSERT_TRUE(pulse_after(3 * MS, 1));
    tearDown(), setUp();
    type("m100vc1000a999d20");
    plays(50, END);
    type("n");
    plays(2, END); /* too few */
    TEST_ASSERT_FALSE(processor_silence(p, now + 30 * MS));
}

static void test_small_s_ramps_down_and_drops_what_is_pending(void)
{
    type("m100");
    type("m-5");
    type("d999");
    plays(50, END);
    type("s");
    plays(3, END);
    rests();
}

static void test_a_next_before_the_end_may_come_after_it(void)
{
    type("m10");
    type("m-10");
    type("m3");
    plays(8, END);
    type("N"); /* 2 ms before the end: the first is cut or over; or the second is cut */
    plays(2, -10, 3, END);
    rests();
    tearDown(), setUp();
    type("m10");
    type("m-10");
    type("m3");
    plays(8, END);
    type("N");
    plays(2, -2, 3, END);
    rests();
}

/* -- loops --------------------------------------------------------------------------------------------------------- */

static void test_a_loop_runs_from_start_to_finish_so_many_times(void)
{
    fill();
    type("ln2");
    type("ls2");
    type("lf4");
    plays(-2, 3, -4, -2, 3, -4, END);
    rests();
    /* Bounds and number are forgotten. */
    type("lf3");
    later();
    rests();
    type("ls2");
    plays(-2, 3, -2, 3, -2, 3, -2, 3, END);
}

static void test_a_loop_wraps_from_30_to_1(void)
{
    fill();
    type("q29m-6");
    type("q30m7");
    type("ln1");
    type("ls29");
    type("lf2");
    plays(-6, 7, 1, -2, END);
    rests();
}

static void test_equal_bounds_are_ignored(void)
{
    fill();
    type("ls2");
    type("lf2");
    later();
    rests();
    type("lf3");
    plays(-2, 3, -2, END);
}

static void test_l_ends_a_loop_when_the_running_command_is_done(void)
{
    fill();
    type("q2m-40");
    type("ls2");
    type("lf3");
    plays(-40, 3, -10, END);
    type("L");
    plays(-30, END);
    rests();
}

static void test_bounds_change_while_a_loop_runs(void)
{
    fill();
    type("q2m-40");
    type("q3m40");
    type("ls2");
    type("lf3");
    plays(-40, 10, END);
    type("lf4"); /* goes on upward */
    plays(30, -4, -10, END);
    type("ls3");
    plays(-30, 40, -4, 40, -4, END);
}

static void test_what_is_typed_in_a_loop_runs_after_it(void)
{
    fill();
    type("q2m-40");
    type("ln2");
    type("ls2");
    type("lf3");
    plays(-10, END);
    type("m9");
    plays(-30, 3, -40, 3, 9, END);
    rests();
}

static void test_next_in_a_loop_goes_on_with_the_loops_next_command(void)
{
    fill();
    type("q2m-60");
    type("ln1");
    type("ls2");
    type("lf4");
    plays(-10, END);
    type("N");
    plays(-2, 3, -4, END);
    rests();
}

static void test_an_edit_counts_from_the_next_time(void)
{
    fill();
    type("q2m-40");
    type("ln2");
    type("ls2");
    type("lf3");
    plays(-10, END);
    type("q2m5");
    plays(-30, 3, 5, 3, END);
    rests();
}

/* The manual's array, 0,1 1,3 2,7 3,5 4,0. */
static void test_the_array_runs_in_its_order_so_many_times(void)
{
    fill();
    type("q7m-7");
    type("xp");
    type("0,1");
    type("1,3");
    type("2,7");
    type("3,5");
    type("4,0");
    type("x");
    later();
    rests();
    type("l2");
    plays(1, 3, -7, 5, 1, 3, -7, 5, END);
    rests();
    type("xl");
    plays(1, 3, -7, 5, 1, 3, -7, 5, 1, END);
    type("S");
    later();
    rests();
}

/* -- what preempts ------------------------------------------------------------------------------------------------- */

static void test_x_cuts_and_the_queue_goes_on_at_its_next_command(void)
{
    fill();
    type("m60");
    type("m-9");
    plays(10, END);
    type("x4");
    plays(1, -4, -9, END);
    rests();
}

static void test_a_throw_away_command_leaves_queue_and_session(void)
{
    char before[50], after[50];
    processor_row(p, 1, before, sizeof before);
    type("xm-4vc500");
    TEST_ASSERT_TRUE(pulse_after(MS, 1));
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_TRUE(pulse_after(500 * US, 1));
    rests();
    processor_row(p, 1, after, sizeof after);
    TEST_ASSERT_EQUAL_STRING(before, after);
    TEST_ASSERT_EQUAL(1, processor_next_position(p));
    type("m3");
    plays(3, END);
    rests();
}

static void test_x_in_a_loop_suspends_it_for_itself_only(void)
{
    fill();
    type("q2m-60");
    type("ln1");
    type("ls2");
    type("lf4");
    plays(-10, END);
    type("x5");
    plays(5, 3, -4, END);
    rests();
}

static void test_continuous_runs_until_n_and_then_the_queue(void)
{
    type("m60");
    type("m-9");
    plays(10, END);
    type("m");
    plays(500, END);
    type("N");
    plays(3, -9, END);
    rests();
    TEST_ASSERT_EQUAL(3, processor_next_position(p));
}

static void test_continuous_ended_by_next_lets_an_interrupted_loop_take_one_more(void)
{
    fill();
    type("q2m-60");
    type("ls2");
    type("lf4");
    plays(-10, END);
    type("m");
    plays(100, END);
    type("N");
    plays(3, END);
    rests();
    TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_AT_REST));
}

static void test_x_ends_continuous_and_the_loop_goes_on(void)
{
    fill();
    type("q2m-60");
    type("ls2");
    type("lf4");
    plays(-10, END);
    type("m");
    plays(100, END);
    type("x5");
    plays(2, 5, 3, -4, -60, 3, END);
}

static void test_stop_and_l_end_continuous_and_its_loop(void)
{
    static const char *const ends[] = {"S", "s", "L", "l"};
    for (unsigned i = 0; i < 4; i++) {
        fill();
        type("q2m-60");
        type("ls2");
        type("lf4");
        plays(-10, END);
        type("m");
        plays(100, END);
        type(ends[i]);
        later();
        rests();
        TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_AT_REST));
        tearDown(), setUp();
    }
}

/* -- sync and Estop ------------------------------------------------------------------------------------------------ */

static void test_a_synced_command_is_held_until_y_or_the_pin(void)
{
    type("m3s");
    type("m-2");
    later();
    TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_HELD));
    type("y");
    plays(3, -2, END);
    rests();
    type("m3s");
    later();
    processor_sync_edge(p, now);
    plays(3, END);
    rests();
    type("m3s");
    later();
    refuses(0);
}

static void test_a_release_before_the_turn_is_forgotten(void)
{
    type("y");
    later();
    type("m40");
    type("m-3s");
    plays(10, END);
    type("y");
    plays(30, END);
    later();
    TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_HELD));
    type("y");
    plays(-3, END);
    rests();
}

static void test_a_wait_counts_from_the_release(void)
{
    type("m3st30000");
    later();
    later();
    type("y");
    now += 28 * MS;
    refuses(0);
}

static void test_a_loop_holds_at_every_pass(void)
{
    fill();
    type("q3s");
    type("ls2");
    type("lf3");
    for (unsigned i = 0; i < 3; i++) {
        plays(-2, END);
        later();
        TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_HELD));
        type("y");
        plays(3, END);
    }
}

static void test_n_drops_a_held_command_and_x_too(void)
{
    static const char *const ends[] = {"N", "n"};
    for (unsigned i = 0; i < 2; i++) {
        type("m3s");
        type("m-2");
        later();
        type(ends[i]);
        plays(-2, END);
        rests();
    }
    tearDown(), setUp();
    fill();
    type("m3s");
    later();
    type("x4");
    plays(-4, END);
    rests();
    TEST_ASSERT_TRUE(processor_must_be(p, PROCESSOR_AT_REST));
}

static void test_estop_stops_and_while_it_is_low_motion_is_refused(void)
{
    type("m60");
    type("m-2");
    plays(10, END);
    processor_estop(p, now, 0);
    later();
    type("m3");
    later();
    processor_estop(p, now, 1);
    later();
    rests();
    type("m4");
    plays(4, END);
    rests();
    TEST_ASSERT_EQUAL(4, processor_next_position(p));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_commands_run_in_order_each_with_its_count_and_direction);
    RUN_TEST(test_a_pulse_too_many_too_few_or_in_the_wrong_direction_is_noticed);
    RUN_TEST(test_a_pending_command_that_is_not_executed_is_noticed);
    RUN_TEST(test_an_interval_that_is_not_the_commands_is_noticed);
    RUN_TEST(test_extra_pulses_are_added_and_omitted_parameters_come_from_the_session);
    RUN_TEST(test_a_start_wait_delays_and_is_forgotten);
    RUN_TEST(test_plus_and_minus_are_a_pulse_each_at_rest_only);
    RUN_TEST(test_the_31st_command_takes_the_first_position_again);
    RUN_TEST(test_capital_s_ends_all_at_once);
    RUN_TEST(test_capital_n_cuts_the_running_command_only);
    RUN_TEST(test_small_n_ramps_down_with_the_commands_deceleration);
    RUN_TEST(test_small_s_ramps_down_and_drops_what_is_pending);
    RUN_TEST(test_a_next_before_the_end_may_come_after_it);
    RUN_TEST(test_a_loop_runs_from_start_to_finish_so_many_times);
    RUN_TEST(test_a_loop_wraps_from_30_to_1);
    RUN_TEST(test_equal_bounds_are_ignored);
    RUN_TEST(test_l_ends_a_loop_when_the_running_command_is_done);
    RUN_TEST(test_bounds_change_while_a_loop_runs);
    RUN_TEST(test_what_is_typed_in_a_loop_runs_after_it);
    RUN_TEST(test_next_in_a_loop_goes_on_with_the_loops_next_command);
    RUN_TEST(test_an_edit_counts_from_the_next_time);
    RUN_TEST(test_the_array_runs_in_its_order_so_many_times);
    RUN_TEST(test_x_cuts_and_the_queue_goes_on_at_its_next_command);
    RUN_TEST(test_a_throw_away_command_leaves_queue_and_session);
    RUN_TEST(test_x_in_a_loop_suspends_it_for_itself_only);
    RUN_TEST(test_continuous_runs_until_n_and_then_the_queue);
    RUN_TEST(test_continuous_ended_by_next_lets_an_interrupted_loop_take_one_more);
    RUN_TEST(test_x_ends_continuous_and_the_loop_goes_on);
    RUN_TEST(test_stop_and_l_end_continuous_and_its_loop);
    RUN_TEST(test_a_synced_command_is_held_until_y_or_the_pin);
    RUN_TEST(test_a_release_before_the_turn_is_forgotten);
    RUN_TEST(test_a_wait_counts_from_the_release);
    RUN_TEST(test_a_loop_holds_at_every_pass);
    RUN_TEST(test_n_drops_a_held_command_and_x_too);
    RUN_TEST(test_estop_stops_and_while_it_is_low_motion_is_refused);
    return UNITY_END();
}
