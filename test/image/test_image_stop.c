/* STO, NXT, PUL, DIR on the whole image: ending motion, single pulses, direction. */
#include "image.h"
#include "model.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONG_WAIT (600 * SECOND)

void setUp(void)
{
    image_boot();
}

void tearDown(void)
{
    image_off();
}

static void assert_levels_at_rest(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, CLK), "clk");
    TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, OPSA), "OPSA");
    TEST_ASSERT_EQUAL_MESSAGE(1, board_pin_level(board, OPSB), "OPSB");
    TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, TX_EN), "Tx En");
}

/* The position that `p` shows is the number of edges, clockwise ones less the others. */
static void assert_position_is_what_was_made(void)
{
    int32_t shown = image_position();
    if (shown != train.position)
        image_fail("expected position %lld as the edges say, saw %ld", (long long)train.position, (long)shown);
}

/* -- STO ----------------------------------------------------------------------------------------------------------- */

/* STO-001, STO-003 */
static void test_capital_s_ends_the_pulses_at_once_and_nothing_pending_is_executed(void)
{
    image_do("m2000v100a1d1");
    image_do("m300");
    image_do("m-400");
    image_until_pulses(200, LONG_WAIT);
    static char before[4000];
    snprintf(before, sizeof before, "%s", image_display("q"));
    image_send("S\r");
    while (board_uart_sending(board))
        image_run(10);
    uint64_t end = board_uart_last_sent(board);
    size_t at_end = train.count;
    image_run(20 * MS);
    /* Accepted a few hundred microseconds after the CR: one pulse may still be due in that time. */
    if (train.count > at_end + 1 || train.last_rise > end + 500 * US)
        image_fail("expected no pulse from cycle %llu on, saw %zu, the last one at %llu", (unsigned long long)end,
                   train.count - at_end, (unsigned long long)train.last_rise);
    TEST_ASSERT_EQUAL(STANDBY, image_peek("motion_state"));
    image_take_text();
    image_assert_no_pulse_for(20 * SECOND);
    TEST_ASSERT_EQUAL_STRING(before, image_display("q"));
    assert_position_is_what_was_made();
}

/* STO-001 */
static void test_stop_at_any_phase_of_fast_motion_keeps_count_and_pulse_width(void)
{
    int64_t made = 0;
    for (unsigned i = 0; i < 60; i++) {
        image_train_clear();
        image_do(i % 3 == 0 ? "m100000vc30a999d999" : i % 3 == 1 ? "m-100000vc11a999d999" : "m100000v3000a50d5");
        image_run(20 * MS + i * 7919);
        image_do("S");
        image_idle(SECOND);
        if (train.high_min != 2 * US || train.high_max != 2 * US)
            image_fail("round %u: expected pulses of 32 ticks, saw %llu to %llu", i, (unsigned long long)train.high_min,
                       (unsigned long long)train.high_max);
        int64_t here = train.position;
        image_train_clear();
        image_assert_no_pulse_for(10 * MS);
        made += here;
        TEST_ASSERT_EQUAL(made, image_position());
        assert_levels_at_rest();
    }
}

/* STO-001: where a period hardly leaves time for anything but the step interrupt, and where it leaves more */
static void test_stop_at_any_period_comes_at_once_and_keeps_count_and_pulse_width(void)
{
    for (unsigned ticks = 32; ticks < 130; ticks++) {
        image_off();
        image_power_on();
        IMAGE_SET(ustep, 4); /* microseconds a full step are ticks a pulse */
        IMAGE_SET(pulse_us, 1);
        image_prompt();
        char line[40];
        snprintf(line, sizeof line, "m%s100000000vc%ua999d999", ticks & 1 ? "-" : "", ticks);
        for (unsigned i = 0; i < 4; i++) {
            image_train_clear();
            train.keep = false;
            int32_t before = image_position();
            image_do(line);
            image_run(20 * MS + i * 7919);
            image_send("S\r");
            image_sent();
            uint64_t end = board_uart_last_sent(board);
            image_run(200 * MS);
            image_assert_holds(image_take_text(), "S\r\nSAC>");
            if (train.last_rise > end + 2 * MS)
                image_fail("%u ticks: expected no pulse 2 ms behind the line, saw one %llu us behind it", ticks,
                           (unsigned long long)((train.last_rise - end) / US));
            if (train.high_min != US || train.high_max != US)
                image_fail("%u ticks: expected pulses of 16 ticks, saw %llu to %llu", ticks,
                           (unsigned long long)train.high_min, (unsigned long long)train.high_max);
            TEST_ASSERT_EQUAL(before + train.position, image_position());
            assert_levels_at_rest();
        }
    }
}

/* STO-002 */
static void test_both_stops_end_motion_pending_commands_and_waits(void)
{
    static const char *const stops[] = {"S", "s"};
    for (size_t i = 0; i < 2; i++) {
        image_do("m500v100a1d1");
        image_do("m300");
        image_run(500 * MS);
        image_do(stops[i]);
        image_idle(10 * SECOND);
        image_assert_no_pulse_for(5 * SECOND);
        image_do("m100t1000000");
        image_do("m300");
        image_run(100 * MS);
        image_do(stops[i]);
        image_assert_no_pulse_for(5 * SECOND);
    }
    assert_position_is_what_was_made();
}

/* STO-004 */
static void test_small_s_ramps_down_with_the_sessions_decel(void)
{
    image_do("m2000v100a1d1");
    image_do("m300");
    image_do("d2");
    image_until_pulses(300, LONG_WAIT);
    image_trace(true);
    image_do("s");
    image_idle(LONG_WAIT);
    image_assert_states("CDP0");
    /* 45 steps: 98, 96, ... 10 RPM. */
    size_t last = train.count - 1;
    for (size_t k = 1; k < 45; k++)
        image_assert_interval(last - k, 16 * 300000.0 / (10 + 2 * (double)k), 1);
    image_assert_interval(last - 45, 3000 * US, 1);
    assert_position_is_what_was_made();
}

/* STO-004 */
static void test_small_s_without_decel_ends_at_once(void)
{
    image_do("m2000v100a1d1");
    image_do("d999");
    image_until_pulses(300, LONG_WAIT);
    size_t before = train.count;
    image_do("s");
    image_idle(SECOND);
    if (train.count > before + 6)
        image_fail("expected no ramp, saw %zu more pulses", train.count - before);
    image_assert_intervals(200, train.count - 201, 3000 * US, 1);
    assert_position_is_what_was_made();
}

/* STO-004 */
static void test_small_s_in_a_ramp_turns_it_round(void)
{
    image_do("m2000v300a1d1");
    image_until_pulses(100, LONG_WAIT);
    image_do("s");
    image_idle(LONG_WAIT);
    size_t last = train.count - 1;
    for (size_t k = 1; k < 90; k++)
        image_assert_interval(last - k, 16 * 300000.0 / (10 + (double)k), 200);
    if (train.count > 240)
        image_fail("expected about 110 pulses up and as many down, saw %zu", train.count);
    assert_position_is_what_was_made();
}

/* STO-005 */
static void test_after_a_stop_the_next_command_starts_from_slow_speed(void)
{
    image_do("m500v100a1d999");
    image_until_pulses(200, LONG_WAIT);
    image_send("S\rm200v100a1d1\r");
    image_run(2 * MS); /* S is executed, the second line on its way */
    image_train_clear();
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(200);
    image_assert_interval(0, 30000 * US, 1);
    image_assert_interval(1, 16 * 300000.0 / 11, 1);
}

/* STO-006, PIN-023 */
static void test_after_a_stop_the_outputs_are_at_rest(void)
{
    assert_levels_at_rest();
    image_do("m500v100a1d1");
    image_run(500 * MS);
    image_do("S");
    image_run(MS);
    assert_levels_at_rest();
    image_do("m100v100a1d1");
    image_idle(LONG_WAIT);
    assert_levels_at_rest();
}

/* -- NXT ----------------------------------------------------------------------------------------------------------- */

/* NXT-001, NXT-005 */
static void test_capital_n_goes_on_with_the_next_command_without_a_ramp(void)
{
    image_do("m2000v100a1d1");
    image_do("m-100v100a1d1");
    image_do("m50v100a1d1");
    image_until_pulses(200, LONG_WAIT);
    image_do("N");
    image_idle(LONG_WAIT);
    size_t turn = 0;
    while (train.pulse[turn].dir == 0)
        turn++;
    if (turn < 200 || turn > 210)
        image_fail("expected the next command after 200 to 210 pulses, saw %zu", turn);
    image_assert_interval(turn - 1, 3000 * US, 8000);
    image_assert_pulses(turn + 150);
    for (size_t k = turn; k < turn + 100; k++)
        TEST_ASSERT_EQUAL(1, train.pulse[k].dir);
    TEST_ASSERT_EQUAL((int32_t)turn - 50, image_position());
}

/* NXT-002, NXT-005 */
static void test_small_n_goes_on_after_the_commands_own_deceleration(void)
{
    image_do("m2000v100a1d3");
    image_do("m-100v100a1d1");
    image_until_pulses(200, LONG_WAIT);
    image_do("n");
    image_idle(LONG_WAIT);
    size_t turn = 0;
    while (train.pulse[turn].dir == 0)
        turn++;
    for (size_t k = 1; k <= 30; k++)
        image_assert_interval(turn - k, 16 * 300000.0 / (10 + 3 * ((double)k - 1)), 1);
    image_assert_interval(turn - 31, 3000 * US, 1);
    image_assert_pulses(turn + 100);
    TEST_ASSERT_EQUAL((int32_t)turn - 100, image_position());
}

/* NXT-003 */
static void test_with_nothing_pending_next_ends_in_standby(void)
{
    static const char *const next[] = {"N", "n"};
    for (size_t i = 0; i < 2; i++) {
        image_do("m2000v100a1d1");
        image_run(SECOND);
        image_do(next[i]);
        image_idle(5 * SECOND);
        image_assert_no_pulse_for(SECOND);
        image_do(next[i]);
        image_assert_no_pulse_for(SECOND);
    }
    assert_position_is_what_was_made();
}

/* NXT-005 */
static void test_after_next_counts_and_ramps_are_as_ever(void)
{
    image_do("m2000v100a1d1");
    image_run(SECOND);
    image_do("n");
    image_idle(LONG_WAIT);
    image_train_clear();
    image_do("m200v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(200);
    for (size_t k = 0; k < 90; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k), 1);
}

/* NXT-006 */
static void test_small_n_without_decel_leaves_the_velocity_in_play(void)
{
    image_do("m2000v100a1d999");
    image_do("m200v100a1d999");
    image_until_pulses(300, LONG_WAIT);
    image_do("n");
    image_idle(LONG_WAIT);
    if (train.count < 500 || train.count > 510)
        image_fail("expected 500 to 510 pulses, saw %zu", train.count);
    image_assert_intervals(90, train.count - 91, 3000 * US, 1);
}

/* NXT-001, NXT-002, STO-001, STO-004 */
static void test_stops_and_nexts_at_random_lose_and_add_no_pulse(void)
{
    static const char *const words[] = {"S", "s", "N", "n"};
    srand(3);
    image_train_clear();
    train.keep = false;
    for (unsigned i = 0; i < 600; i++) {
        char line[60];
        unsigned choice = (unsigned)rand() % 7;
        char count[12];
        snprintf(count, sizeof count, "%s%d", rand() % 2 ? "-" : "", 1 + rand() % 3000);
        if (choice < 4)
            snprintf(line, sizeof line, "%s", words[choice]);
        else
            snprintf(line, sizeof line, choice == 6 ? "m%sv%da%dd%dl1" : "m%sv%da%dd%dl0", count, 1 + rand() % 2500,
                     choice == 6 ? 50 + rand() % 450 : 1 + rand() % 20, 1 + rand() % 50);
        const char *answer = image_ask(line);
        if (answer[0] != '\0' && strcmp(answer, "?6 queue full\r\n") != 0)
            image_fail("\"%s\": expected no answer, saw \"%s\"", line, answer);
        image_run((unsigned)(rand() % 100) * MS);
        if (i % 20 == 19) {
            image_do("S");
            image_idle(LONG_WAIT);
            int32_t shown = image_position();
            if (shown != train.position)
                image_fail("after line %u, \"%s\": expected position %lld as the edges say, saw %ld", i, line,
                           (long long)train.position, (long)shown);
        }
    }
}

/* -- PUL ----------------------------------------------------------------------------------------------------------- */

/* PUL-001, PUL-002, PUL-004 */
static void test_plus_and_minus_are_one_pulse_each_at_once(void)
{
    image_send("+");
    image_sent();
    image_assert_pulses(1);
    TEST_ASSERT_EQUAL(0, train.pulse[0].dir);
    if (train.last_rise > board_uart_last_sent(board) + MS)
        image_fail("expected the pulse within 1 ms of the character, saw it at cycle %llu",
                   (unsigned long long)train.last_rise);
    image_send("-");
    image_sent();
    image_assert_pulses(2);
    TEST_ASSERT_EQUAL(1, train.pulse[1].dir);
    image_assert_no_pulse_for(SECOND);
    image_send("-");
    image_sent();
    TEST_ASSERT_EQUAL(-1, image_position());
}

/* PUL-003 */
static void test_a_single_pulse_is_one_pulse_whatever_the_microsteps(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 4);
    image_prompt();
    image_send("+");
    image_sent();
    image_assert_pulses(1);
    TEST_ASSERT_EQUAL(1, image_position());
}

/* PUL-005 */
static void test_single_pulses_can_be_stacked(void)
{
    image_send("+++");
    image_sent();
    image_assert_pulses(3);
    image_send("--+-");
    image_sent();
    image_assert_pulses(7);
    static const uint8_t dirs[] = {0, 0, 0, 1, 1, 0, 1};
    for (size_t k = 0; k < 7; k++)
        TEST_ASSERT_EQUAL(dirs[k], train.pulse[k].dir);
    TEST_ASSERT_EQUAL(1, image_position());
}

/* PUL-005 */
static void test_400_stacked_pulses_at_250000_bd_are_400(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(hw_baud, 250000);
    board_uart_baud(board, 250000);
    image_prompt();
    for (unsigned i = 0; i < 50; i++)
        image_send("+-++--+-");
    image_sent();
    image_run(10 * MS);
    image_assert_pulses(400);
    TEST_ASSERT_EQUAL(0, image_position());
    if (train.dir_setup_min < 5 * US)
        image_fail("expected dir 5 us before clk, saw %llu ticks", (unsigned long long)train.dir_setup_min);
}

/* PUL-006 */
static void test_single_pulses_do_not_enter_the_queue(void)
{
    static char before[4000];
    snprintf(before, sizeof before, "%s", image_display("q"));
    image_send("++-");
    image_sent();
    image_assert_pulses(3);
    TEST_ASSERT_EQUAL_STRING(before, image_display("q"));
}

/* PUL-007 */
static void test_a_minus_within_a_command_is_no_pulse(void)
{
    image_do("m-20v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    for (size_t k = 0; k < 20; k++)
        TEST_ASSERT_EQUAL(1, train.pulse[k].dir);
    TEST_ASSERT_EQUAL(-20, image_position());
}

/* PUL-001 */
static void test_single_pulses_are_ignored_while_the_motor_moves(void)
{
    image_do("m200v100a1d1");
    image_until_pulses(50, LONG_WAIT);
    image_send("++--+");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(200);
    TEST_ASSERT_EQUAL(200, image_position());
}

/* -- DIR ----------------------------------------------------------------------------------------------------------- */

/* DIR-001, PIN-003 */
static void test_a_minus_sign_turns_counter_clockwise_and_dir_leads_clk(void)
{
    image_do("m100v100a1d1");
    image_idle(LONG_WAIT);
    image_do("m-100v100a1d1");
    image_idle(LONG_WAIT);
    image_do("m100v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(300);
    for (size_t k = 0; k < 300; k++)
        if (train.pulse[k].dir != (k / 100 == 1))
            image_fail("pulse %zu: expected dir %u, saw %u, at cycle %llu", k, k / 100 == 1, train.pulse[k].dir,
                       (unsigned long long)train.pulse[k].cycle);
    if (train.dir_setup_min < 5 * US)
        image_fail("expected dir 5 us before clk, saw %llu ticks", (unsigned long long)train.dir_setup_min);
}

/* DIR-002 */
static void test_the_cw_parameter_is_the_level_of_dir_for_clockwise(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(cw_level, 1);
    image_prompt();
    image_do("m20v100a1d1");
    image_do("m-20v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(40);
    for (size_t k = 0; k < 40; k++)
        TEST_ASSERT_EQUAL(k < 20, train.pulse[k].dir);
    TEST_ASSERT_EQUAL(0, image_position());
}

/* DIR-003 */
static void test_the_dir_parameter_is_the_direction_where_none_is_given(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(direction, 1);
    image_prompt();
    image_assert_row(1, "1\t200\t CCW\t100\t3000\t 1.00\t1.00\t0\t  0");
    image_do("m20v100a1d1"); /* a number without a sign is clockwise all the same */
    image_idle(LONG_WAIT);
    TEST_ASSERT_EQUAL(0, train.pulse[0].dir);
    TEST_ASSERT_EQUAL(20, image_position());
}

/* DIR-006, PIN-003 */
static void test_without_decel_a_reversal_comes_one_cycle_after_the_last_pulse(void)
{
    image_send("m200v100a1d999\rm-200v100a1d999\rm200v100a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(600);
    image_assert_intervals(90, 509, 3000 * US, 0);
    TEST_ASSERT_EQUAL(0, train.pulse[199].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[200].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[399].dir);
    TEST_ASSERT_EQUAL(0, train.pulse[400].dir);
    if (train.dir_setup_min < 5 * US || train.dir_hold_min < 1 * US)
        image_fail("expected dir 5 us before clk and 1 us behind it, saw %llu and %llu ticks",
                   (unsigned long long)train.dir_setup_min, (unsigned long long)train.dir_hold_min);
}

/* DIR-006 */
static void test_fast_reversals_keep_their_cycle(void)
{
    image_send("m100vc30a999d999\rm-100vc30a999d999\rm100vc30a999d999t0\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(300);
    TEST_ASSERT_EQUAL(100, image_position());
    if (train.dir_setup_min < 5 * US || train.dir_hold_min < 1 * US)
        image_fail("expected dir 5 us before clk and 1 us behind it, saw %llu and %llu ticks",
                   (unsigned long long)train.dir_setup_min, (unsigned long long)train.dir_hold_min);
}

/* DIR-007 */
static void test_reversals_at_random_keep_the_position(void)
{
    srand(11);
    int64_t expected = 0;
    size_t total = 0;
    for (unsigned i = 0; i < 200; i++) {
        char line[60];
        int count = (rand() % 2 ? -1 : 1) * (1 + rand() % 300);
        snprintf(line, sizeof line, "m%dv%da%dd%d", count, 10 + rand() % 1500, 1 + rand() % 30,
                 rand() % 2 ? 999 : 1 + rand() % 30);
        while (strcmp(image_ask(line), "?6 queue full\r\n") == 0)
            image_run(100 * MS);
        expected += count;
        total += (size_t)abs(count);
    }
    image_idle(LONG_WAIT);
    image_assert_pulses(total);
    TEST_ASSERT_EQUAL(expected, train.position);
    TEST_ASSERT_EQUAL(expected, image_position());
    if (train.dir_setup_min < 5 * US || train.dir_hold_min < 1 * US)
        image_fail("expected dir 5 us before clk and 1 us behind it, saw %llu and %llu ticks",
                   (unsigned long long)train.dir_setup_min, (unsigned long long)train.dir_hold_min);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_capital_s_ends_the_pulses_at_once_and_nothing_pending_is_executed);
    RUN_TEST(test_stop_at_any_phase_of_fast_motion_keeps_count_and_pulse_width);
    RUN_TEST(test_stop_at_any_period_comes_at_once_and_keeps_count_and_pulse_width);
    RUN_TEST(test_both_stops_end_motion_pending_commands_and_waits);
    RUN_TEST(test_small_s_ramps_down_with_the_sessions_decel);
    RUN_TEST(test_small_s_without_decel_ends_at_once);
    RUN_TEST(test_small_s_in_a_ramp_turns_it_round);
    RUN_TEST(test_after_a_stop_the_next_command_starts_from_slow_speed);
    RUN_TEST(test_after_a_stop_the_outputs_are_at_rest);
    RUN_TEST(test_capital_n_goes_on_with_the_next_command_without_a_ramp);
    RUN_TEST(test_small_n_goes_on_after_the_commands_own_deceleration);
    RUN_TEST(test_with_nothing_pending_next_ends_in_standby);
    RUN_TEST(test_after_next_counts_and_ramps_are_as_ever);
    RUN_TEST(test_small_n_without_decel_leaves_the_velocity_in_play);
    RUN_TEST(test_stops_and_nexts_at_random_lose_and_add_no_pulse);
    RUN_TEST(test_plus_and_minus_are_one_pulse_each_at_once);
    RUN_TEST(test_a_single_pulse_is_one_pulse_whatever_the_microsteps);
    RUN_TEST(test_single_pulses_can_be_stacked);
    RUN_TEST(test_400_stacked_pulses_at_250000_bd_are_400);
    RUN_TEST(test_single_pulses_do_not_enter_the_queue);
    RUN_TEST(test_a_minus_within_a_command_is_no_pulse);
    RUN_TEST(test_single_pulses_are_ignored_while_the_motor_moves);
    RUN_TEST(test_a_minus_sign_turns_counter_clockwise_and_dir_leads_clk);
    RUN_TEST(test_the_cw_parameter_is_the_level_of_dir_for_clockwise);
    RUN_TEST(test_the_dir_parameter_is_the_direction_where_none_is_given);
    RUN_TEST(test_without_decel_a_reversal_comes_one_cycle_after_the_last_pulse);
    RUN_TEST(test_fast_reversals_keep_their_cycle);
    RUN_TEST(test_reversals_at_random_keep_the_position);
    return UNITY_END();
}
