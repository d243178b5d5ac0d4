/* QUE, MOT, GAP, SWT on the whole image: what is stored, shown and executed, and when. */
#include "image.h"
#include "model.h"

#include <ctype.h>
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

static const char header[] = "Q\tSteps\t\tRPM\tCycle\t Acc\tDec\tusteps\t deltaT";
static const char rule[] = "======================================================================";
static const char legend[] = "\t+ pulse\t\t\t* linear\t\ts sync";

/* Line n of a display, from 0, with its tabs turned into blanks. */
static const char *expanded_line(const char *shown, unsigned n)
{
    static char line[300];
    while (n-- > 0) {
        shown = strchr(shown, '\n');
        if (shown == NULL)
            image_fail("the display has too few lines");
        shown++;
    }
    size_t column = 0;
    for (; *shown != '\0' && *shown != '\r' && *shown != '\n' && column < sizeof line - 9; shown++) {
        if (*shown == '\t') {
            do
                line[column++] = ' ';
            while (column % 8 != 0);
        } else {
            line[column++] = *shown;
        }
    }
    line[column] = '\0';
    return line;
}

static void assert_at_column(const char *line, size_t column, const char *word)
{
    if (strlen(line) < column || strncmp(line + column, word, strlen(word)) != 0)
        image_fail("expected \"%s\" at column %zu of \"%s\"", word, column, line);
}

static void stop_and_settle(void)
{
    image_do("S");
    image_idle(SECOND);
}

/* -- QUE ----------------------------------------------------------------------------------------------------------- */

/* QUE-002, QUE-004, QUE-005, QUE-009, QUE-010, QUE-011, QUE-012 */
static void test_the_queue_of_a_fresh_unit_is_printed_as_in_the_template(void)
{
    char expected[8000];
    size_t n = (size_t)snprintf(expected, sizeof expected, "%s\r\n%s\r\n", header, rule);
    for (unsigned row = 1; row <= 30; row++)
        n += (size_t)snprintf(expected + n, sizeof expected - n, "%u\t200\t CW\t100\t3000\t 1.00\t1.00\t0\t  0\r\n",
                              row);
    snprintf(expected + n, sizeof expected - n, "%s\r\nQ is at 1%s\r\n", rule, legend);
    const char *seen = image_display("q");
    if (strcmp(seen, expected) != 0) {
        size_t i = 0;
        while (seen[i] != '\0' && seen[i] == expected[i])
            i++;
        image_fail("byte %zu: expected \"%.40s\", saw \"%.40s\"", i, expected + i, seen + i);
    }
    /* image_display() has seen the prompt behind it; capital Q is the same command. */
    seen = image_display("Q");
    TEST_ASSERT_EQUAL_STRING(expected, seen);
}

/* QUE-003, QUE-004 */
static void test_the_header_stands_at_its_columns_above_70_signs(void)
{
    static const struct {
        size_t column;
        const char *word;
    } words[] = {{0, "Q"},    {8, "Steps"}, {24, "RPM"},    {32, "Cycle"},
                 {41, "Acc"}, {48, "Dec"},  {56, "usteps"}, {65, "deltaT"}};
    const char *shown = image_display("q");
    const char *line = expanded_line(shown, 0);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        assert_at_column(line, words[i].column, words[i].word);
    TEST_ASSERT_EQUAL_STRING(rule, expanded_line(shown, 1));
    TEST_ASSERT_EQUAL_STRING(rule, expanded_line(shown, 32));
}

/* QUE-005..QUE-009, STP-012 */
static void test_a_row_stands_at_its_columns_with_its_flags(void)
{
    image_do("m-1234vc4567a10.47d.5l1u7t98765sp");
    const char *line = expanded_line(image_display("q"), 2);
    static const struct {
        size_t column;
        const char *word;
    } cells[] = {{0, "1 "}, {8, "1234 "},   {16, "+"},     {17, "CCW "}, {24, "65 "}, {32, "4567 "},
                 {40, "*"}, {41, "10.47 "}, {48, "0.50 "}, {56, "7 "},   {64, "s"},   {66, "98765"}};
    for (size_t i = 0; i < sizeof cells / sizeof cells[0]; i++)
        assert_at_column(line, cells[i].column, cells[i].word);
    stop_and_settle();
    image_do("m12v150a1d150l0f");
    line = expanded_line(image_display("q"), 3);
    assert_at_column(line, 16, " CW ");
    assert_at_column(line, 40, " 1.00");
    assert_at_column(line, 48, "150 ");
    assert_at_column(line, 64, "  0");
}

/* QUE-010 */
static void test_the_legend_stands_below_the_flags(void)
{
    image_do("m1v50");
    image_idle(LONG_WAIT);
    const char *line = expanded_line(image_display("q"), 33);
    assert_at_column(line, 0, "Q is at 2 ");
    assert_at_column(line, 16, "+ pulse");
    assert_at_column(line, 40, "* linear");
    assert_at_column(line, 64, "s sync");
}

/* QUE-001, MOT-005 */
static void test_the_31st_entry_wraps_to_position_1(void)
{
    char line[20];
    for (unsigned n = 1; n <= 31; n++) {
        snprintf(line, sizeof line, "m%uv2000a999d999", n);
        image_do(line);
        image_idle(LONG_WAIT);
    }
    const char *shown = image_display("q");
    image_assert_holds(image_row(shown, 1), "1\t31\t");
    image_assert_holds(image_row(shown, 2), "2\t2\t");
    image_assert_holds(image_row(shown, 30), "30\t30\t");
    image_assert_holds(shown, "Q is at 2\t");
    TEST_ASSERT_EQUAL(31 * 32 / 2, image_position());
}

/* QUE-001 */
static void test_30_pending_entries_run_in_order(void)
{
    image_train_clear();
    image_do("m20v5");
    /* One runs, one is planned: 30 more fit. */
    char line[20];
    for (unsigned n = 1; n <= 30; n++) {
        snprintf(line, sizeof line, "m%s%uv100a1d1", n % 2 ? "-" : "", n);
        image_do(line);
    }
    image_idle(LONG_WAIT);
    image_assert_pulses(20 + 465);
    size_t k = 20;
    for (unsigned n = 1; n <= 30; n++)
        for (unsigned i = 0; i < n; i++, k++)
            if (train.pulse[k].dir != n % 2)
                image_fail("pulse %zu, of entry %u: expected dir %u, saw %u, at cycle %llu", k, n, n % 2,
                           train.pulse[k].dir, (unsigned long long)train.pulse[k].cycle);
}

/* QUE-012 */
static void test_positions_0_and_31_are_shown_in_debug_mode_only(void)
{
    const char *shown = image_display("q");
    TEST_ASSERT_NULL(strstr(shown, "\n0\t"));
    TEST_ASSERT_NULL(strstr(shown, "\n31\t"));
    image_do("b");
    shown = image_display("q");
    image_assert_holds(shown, "\n0\t200\t");
    image_assert_holds(shown, "\n31\t200\t");
}

/* -- MOT ----------------------------------------------------------------------------------------------------------- */

/* MOT-001, MOT-004, MOT-006 */
static void test_m_in_either_case_moves_without_a_further_command(void)
{
    image_do("m20v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    image_do("M20V100A1D1");
    image_idle(LONG_WAIT);
    image_assert_pulses(40);
    const char *shown = image_display("q");
    char first[100];
    snprintf(first, sizeof first, "%s", image_row(shown, 1));
    TEST_ASSERT_EQUAL_STRING(first + 1, image_row(shown, 2) + 1);
}

/* MOT-002, MOT-003 */
static void test_parameters_in_any_order_give_the_same_entry(void)
{
    static const char *const lines[] = {"m-300v120a2.5d7l0u3t44s1p", "m-300t44s1pv120l0a2.5d7u3",
                                        "M-300PS1T44U3L0D7A2.50V120", "m-300l0d7.00a2.5v120s1u3pt44",
                                        "m-300psu3t44d7l0v120a2.5"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        image_do(lines[i]);
        char expected[100];
        snprintf(expected, sizeof expected, "%zu\t300\t+CCW\t120\t2500\t 2.50\t7.00\t3\ts 44", i + 1);
        image_assert_row((unsigned)(i + 1), expected);
        stop_and_settle();
    }
}

/* MOT-002, MOT-003, MOT-004 */
static void test_random_commands_are_stored_as_typed(void)
{
    srand(7);
    for (unsigned n = 0; n < 60; n++) {
        unsigned steps = 1 + (unsigned)rand() % 100000;
        unsigned rpm = 1 + (unsigned)rand() % 2000;
        unsigned cycle = 150 + (unsigned)rand() % 100000;
        bool by_cycle = rand() % 2;
        unsigned a = 1 + (unsigned)rand() % 9999;
        unsigned d = 100 + (unsigned)rand() % 900;
        unsigned u = (unsigned)rand() % 256;
        unsigned t = (unsigned)rand();
        bool ccw = rand() % 2, lin = rand() % 2, sync = rand() % 2, pulses = rand() % 2;
        char part[8][24];
        snprintf(part[0], 24, by_cycle ? "vc%u" : "v%u", by_cycle ? cycle : rpm);
        snprintf(part[1], 24, "a%u.%02u", a / 100, a % 100);
        snprintf(part[2], 24, "d%u", d);
        snprintf(part[3], 24, lin ? "l" : "l0");
        snprintf(part[4], 24, "u%u", u);
        snprintf(part[5], 24, "t%u", t);
        snprintf(part[6], 24, sync ? "s" : "s0");
        snprintf(part[7], 24, pulses ? "p" : "f");
        for (unsigned i = 7; i > 0; i--) {
            unsigned j = (unsigned)rand() % (i + 1);
            char swap[24];
            memcpy(swap, part[i], 24), memcpy(part[i], part[j], 24), memcpy(part[j], swap, 24);
        }
        char line[120];
        size_t length = (size_t)snprintf(line, sizeof line, "m%s%u", ccw ? "-" : "", steps);
        for (unsigned i = 0; i < 8; i++)
            length += (size_t)snprintf(line + length, sizeof line - length, "%s", part[i]);
        for (size_t i = 0; i < length; i++)
            if (rand() % 2)
                line[i] = (char)toupper(line[i]);
        char expected[120];
        snprintf(expected, sizeof expected, "%u\t%u\t%c%s\t%u\t%u\t%c%u.%02u\t%u\t%u\t%c %u", n % 30 + 1, steps,
                 pulses ? '+' : ' ', ccw ? "CCW" : "CW", by_cycle ? 300000 / cycle : rpm,
                 by_cycle ? cycle : 300000 / rpm, lin ? '*' : ' ', a / 100, a % 100, d, u, sync ? 's' : ' ', t);
        image_do(line);
        image_do("S");
        const char *seen = image_row(image_display("q"), n % 30 + 1);
        if (strcmp(seen, expected) != 0)
            image_fail("\"%s\": expected \"%s\", saw \"%s\"", line, expected, seen);
    }
}

/* MOT-007, MOT-008, VEL-005, VEL-006, ACC-009 */
static void test_omitted_parameters_come_from_the_session_and_given_ones_stay_in_it(void)
{
    image_do("m20u6t500");
    image_do("v123");
    image_do("m10a1.2d3l0p");
    image_do("m11");
    image_idle(LONG_WAIT);
    image_assert_row(1, "1\t20\t CW\t100\t3000\t 1.00\t1.00\t6\t  500");
    image_assert_row(2, "2\t10\t+CW\t123\t2439\t 1.20\t3.00\t0\t  0");
    image_assert_row(3, "3\t11\t+CW\t123\t2439\t 1.20\t3.00\t0\t  0");
    image_assert_holds(image_display("cf"), "v 123 cycle 2439");
    image_assert_holds(image_display("cf"), "a 1.20 d 3.00 harmonic");
}

/* MOT-009, SWT-004 */
static void test_sync_start_wait_direction_and_extra_pulses_are_forgotten(void)
{
    image_do("m-20u5st500");
    image_do("m20");
    image_assert_no_pulse_for(50 * MS);
    image_do("y");
    image_idle(LONG_WAIT);
    image_assert_pulses(40); /* truncated, the first one has no cruise for the 5 (STP-005) */
    image_assert_row(1, "1\t20\t CCW\t100\t3000\t 1.00\t1.00\t5\ts 500");
    image_assert_row(2, "2\t20\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
}

/* MOT-010 */
static void test_m3000a2d1_is_3000_clockwise_accel_2_decel_1(void)
{
    image_do("m3000a2d1");
    image_assert_row(1, "1\t3000\t CW\t100\t3000\t 2.00\t1.00\t0\t  0");
    image_idle(LONG_WAIT);
    image_assert_pulses(3000);
    TEST_ASSERT_EQUAL(3000, image_position());
    TEST_ASSERT_EQUAL(0, train.pulse[0].dir);
}

/* MOT-011 */
static void test_every_parameter_of_a_command_acts(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 2);
    image_prompt();
    image_train_clear();
    image_do("m-100v60a5d999l0u7t20000s0f");
    image_idle(LONG_WAIT);
    image_assert_pulses(407);
    TEST_ASSERT_EQUAL(1, train.pulse[0].dir);
    image_assert_interval(0, 7500 * US, 1);           /* slow speed, four microsteps */
    image_assert_interval(39, 4 * 300000 / 58.75, 1); /* 10 full steps of 5 RPM */
    image_assert_intervals(40, 366, 1250 * US, 0);
    TEST_ASSERT_EQUAL(-407, image_position());
}

/* MOT-012 */
static void test_commands_are_accepted_while_one_is_executed(void)
{
    image_train_clear();
    image_do("m100v100a1d1");
    image_until_state(CRUISE + 1, SECOND); /* truncated: DECEL */
    for (unsigned i = 0; i < 5; i++)
        image_do("m10v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(150);
    TEST_ASSERT_EQUAL(150, image_position());
}

/* -- GAP ----------------------------------------------------------------------------------------------------------- */

/* GAP-001..GAP-003 */
static void test_gap_testing_is_on_at_first_and_g_toggles_it(void)
{
    image_assert_holds(image_display("cf"), "GAP on");
    image_do("g");
    image_assert_holds(image_display("cf"), "GAP off");
    image_do("G");
    image_assert_holds(image_display("cf"), "GAP on");
}

/* A command that ends at 15 RPM (20,000 us), a second one typed but for its CR, which is sent `us` after the last pulse. */
static void second_command_after(uint64_t us)
{
    image_train_clear();
    image_do("m20v15a1d999");
    image_send("m20v15a1d999");
    image_until_pulses(20, LONG_WAIT);
    image_run(us * US - (board_cycle(board) - train.last_rise) - 4160);
    image_send("\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(40);
}

/* GAP-004, GAP-005 */
static void test_a_command_that_comes_within_the_last_interval_streams_on(void)
{
    second_command_after(15000);
    image_assert_intervals(5, 34, 20000 * US, 0);
}

/* GAP-004, GAP-005 */
static void test_a_command_that_comes_in_the_gap_goes_on_at_the_velocity_in_play(void)
{
    second_command_after(30000);
    image_assert_near("first pulse, us after the last one before", 30300,
                      (double)(train.pulse[20].cycle - train.pulse[19].cycle) / 16, 300);
    image_assert_intervals(20, 19, 20000 * US, 0);
}

/* GAP-004, GAP-006 */
static void test_a_command_that_comes_after_the_gap_starts_from_slow_speed(void)
{
    second_command_after(42000);
    image_assert_interval(20, 30000 * US, 1);
    image_assert_interval(24, 16 * 300000.0 / 14, 1);
    second_command_after(60000);
    image_assert_interval(20, 30000 * US, 1);
}

/* GAP-005 */
static void test_repeated_within_the_gap_a_command_without_decel_has_no_ramp(void)
{
    image_train_clear();
    image_trace(true);
    image_send("m200v100a1d999\rm200v100a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_states("0ACPCP0");
    image_assert_intervals(200, 199, 3000 * US, 0);
}

/* GAP-007, VEL-007 */
static void test_the_velocity_in_play_is_slow_again_once_the_gap_has_passed(void)
{
    image_do("m50v100a999d999");
    image_idle(LONG_WAIT);
    TEST_ASSERT_EQUAL_STRING("10 30000\r\n", image_ask("vd"));
}

/* GAP-008 */
static void test_without_gap_testing_the_velocity_stays_in_play(void)
{
    image_do("g");
    image_do("m200v100a1d999");
    image_idle(LONG_WAIT);
    image_run(5 * SECOND);
    TEST_ASSERT_EQUAL_STRING("100 3000\r\n", image_ask("vd"));
    image_train_clear();
    image_do("m200v100a1d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(200);
    image_assert_intervals(0, 199, 3000 * US, 0);
}

/* GAP-009 */
static void test_one_decel_step_brings_the_velocity_in_play_back_to_slow(void)
{
    image_train_clear();
    image_send("m200v100a1d60\rm200v100a1d60\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_intervals(90, 109, 3000 * US, 0);
    image_assert_intervals(199, 2, 30000 * US, 1);
    image_assert_interval(201, 16 * 300000.0 / 11, 1);
}

/* -- SWT ----------------------------------------------------------------------------------------------------------- */

/* From the end of the CR to the first pulse. */
static uint64_t delay_of(const char *line)
{
    image_train_clear();
    image_send(line);
    image_send("\r");
    image_sent();
    uint64_t end = board_uart_last_sent(board);
    image_until_pulses(1, LONG_WAIT);
    uint64_t delay = train.pulse[0].cycle - end;
    image_idle(LONG_WAIT);
    return delay;
}

/* SWT-001 */
static void test_a_start_wait_delays_the_first_pulse_by_so_many_microseconds(void)
{
    double none = (double)delay_of("m2v100a1d1");
    if (none > 150 * US)
        image_fail("newline to first pulse: expected at most 150 us, saw %.1f us", none / 16);
    image_assert_near("us", 1000, ((double)delay_of("m2v100a1d1t1000")) / 16, 300);
    image_assert_near("us", 50000, ((double)delay_of("m2v100a1d1t50000")) / 16, 300);
    image_assert_near("us", 7654321, ((double)delay_of("m2v100a1d1t7654321")) / 16, 300);
}

/* SWT-001 */
static void test_between_commands_the_wait_counts_from_the_end_of_the_one_before(void)
{
    image_train_clear();
    image_send("m20v100a999d999\rm20v100a999d999t1000\rm20v100a999d999t50000\rm-20v100a999d999t20000\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(80);
    image_assert_interval(19, 4000 * US, 160);
    image_assert_interval(39, 53000 * US, 160);
    image_assert_interval(59, 23000 * US, 160);
}

/* SWT-003, SWT-005, SWT-007, STO-002 */
static void test_a_wait_has_32_bits_is_shown_and_ends_with_stop(void)
{
    image_do("m5t4294967295");
    image_assert_row(1, "1\t5\t CW\t100\t3000\t 1.00\t1.00\t0\t  4294967295");
    image_assert_no_pulse_for(100 * SECOND);
    image_do("S");
    image_idle(SECOND);
    image_refused("m5t4294967296", "?4 number too large");
    image_assert_no_pulse_for(SECOND);
    image_do("m5v100");
    image_idle(LONG_WAIT);
    image_assert_pulses(5);
    TEST_ASSERT_EQUAL(5, image_position());
}

/* SWT-007 */
static void test_both_stops_and_next_cancel_a_wait(void)
{
    static const char *const ends[] = {"S", "s", "N", "n"};
    for (size_t i = 0; i < 4; i++) {
        image_train_clear();
        image_do("m5v100a1d1t500000");
        image_run(100 * MS);
        image_do(ends[i]);
        image_run(2 * SECOND);
        if (train.count != 0)
            image_fail("after %s: expected no pulse, saw %zu, the last one at cycle %llu", ends[i], train.count,
                       (unsigned long long)train.last_rise);
        image_do("m5v100a1d1");
        image_run(2 * MS);
        if (train.count != 1)
            image_fail("after %s: expected the next command to start at once, saw %zu pulses", ends[i], train.count);
        image_idle(LONG_WAIT);
        image_assert_pulses(5);
    }
    TEST_ASSERT_EQUAL(20, image_position());
}

/* SWT-001, GAP-006 */
static void test_a_wait_longer_than_the_gap_means_a_start_from_slow_speed(void)
{
    image_train_clear();
    image_send("m200v100a1d999\rm100v100a1d999t10000\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(300);
    image_assert_interval(199, 13000 * US, 160);
    image_assert_interval(200, 30000 * US, 1);
    image_train_clear();
    image_send("m200v100a1d999\rm100v100a1d999t2000\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_interval(199, 5000 * US, 160);
    image_assert_intervals(200, 99, 3000 * US, 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_queue_of_a_fresh_unit_is_printed_as_in_the_template);
    RUN_TEST(test_the_header_stands_at_its_columns_above_70_signs);
    RUN_TEST(test_a_row_stands_at_its_columns_with_its_flags);
    RUN_TEST(test_the_legend_stands_below_the_flags);
    RUN_TEST(test_the_31st_entry_wraps_to_position_1);
    RUN_TEST(test_30_pending_entries_run_in_order);
    RUN_TEST(test_positions_0_and_31_are_shown_in_debug_mode_only);
    RUN_TEST(test_m_in_either_case_moves_without_a_further_command);
    RUN_TEST(test_parameters_in_any_order_give_the_same_entry);
    RUN_TEST(test_random_commands_are_stored_as_typed);
    RUN_TEST(test_omitted_parameters_come_from_the_session_and_given_ones_stay_in_it);
    RUN_TEST(test_sync_start_wait_direction_and_extra_pulses_are_forgotten);
    RUN_TEST(test_m3000a2d1_is_3000_clockwise_accel_2_decel_1);
    RUN_TEST(test_every_parameter_of_a_command_acts);
    RUN_TEST(test_commands_are_accepted_while_one_is_executed);
    RUN_TEST(test_gap_testing_is_on_at_first_and_g_toggles_it);
    RUN_TEST(test_a_command_that_comes_within_the_last_interval_streams_on);
    RUN_TEST(test_a_command_that_comes_in_the_gap_goes_on_at_the_velocity_in_play);
    RUN_TEST(test_a_command_that_comes_after_the_gap_starts_from_slow_speed);
    RUN_TEST(test_repeated_within_the_gap_a_command_without_decel_has_no_ramp);
    RUN_TEST(test_the_velocity_in_play_is_slow_again_once_the_gap_has_passed);
    RUN_TEST(test_without_gap_testing_the_velocity_stays_in_play);
    RUN_TEST(test_one_decel_step_brings_the_velocity_in_play_back_to_slow);
    RUN_TEST(test_a_start_wait_delays_the_first_pulse_by_so_many_microseconds);
    RUN_TEST(test_between_commands_the_wait_counts_from_the_end_of_the_one_before);
    RUN_TEST(test_a_wait_has_32_bits_is_shown_and_ends_with_stop);
    RUN_TEST(test_both_stops_and_next_cancel_a_wait);
    RUN_TEST(test_a_wait_longer_than_the_gap_means_a_start_from_slow_speed);
    return UNITY_END();
}
