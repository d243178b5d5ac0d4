/* CON, THR, XRF, LOO, SYN, live edits on the whole image: in which order commands are executed, and when. */
#include "image.h"

#include <stdio.h>
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

/* Entry n counts so many pulses that runs of one direction tell them apart: odd ones turn clockwise, even ones back. No
 * ramps, 4 ms a step: longer than the 10 ms by which a command is planned ahead. */
static unsigned steps_of(unsigned n)
{
    return 10 + n;
}

static void number_the_entries(unsigned last)
{
    for (unsigned n = 1; n <= last; n++) {
        char line[64];
        snprintf(line, sizeof line, "q%um%s%uvc4000a999d999", n, n % 2 ? "" : "-", steps_of(n));
        image_do(line);
    }
    image_train_clear();
}

/* The runs of pulses in one direction since the train was cleared, as the numbers of their entries, from run `skip` on. A
 * run whose length is no entry's is shown as (its length). */
static const char *runs(void)
{
    static char text[4000];
    text[0] = '\0';
    size_t length = 0;
    for (size_t k = 0; k < train.count; k++) {
        length++;
        if (k + 1 == train.count || train.pulse[k + 1].dir != train.pulse[k].dir) {
            char *end = text + strlen(text);
            size_t left = sizeof text - (size_t)(end - text);
            if (length > 10 && length <= 40)
                snprintf(end, left, "%s%zu", end == text ? "" : " ", length - 10);
            else
                snprintf(end, left, "%s(%zu)", end == text ? "" : " ", length);
            length = 0;
        }
    }
    return text;
}

static void assert_runs(const char *expected)
{
    if (strcmp(runs(), expected) != 0)
        image_fail("expected the entries \"%s\", saw \"%s\"", expected, runs());
}

static void assert_begins(const char *expected)
{
    if (strncmp(runs(), expected, strlen(expected)) != 0)
        image_fail("expected the entries to begin with \"%s\", saw \"%s\"", expected, runs());
}

/* -- LOO ----------------------------------------------------------------------------------------------------------- */

/* LOO-001, LOO-002, LOO-004, LOO-006, LOO-007, LOO-008, LOO-010 */
static void test_a_loop_runs_so_many_times_from_start_to_finish(void)
{
    number_the_entries(4);
    image_do("ln2");
    image_do("lf3");
    image_assert_no_pulse_for(50 * MS);
    image_do("ls2");
    image_idle(LONG_WAIT);
    assert_runs("2 3 2 3");
    image_train_clear();
    image_do("ls2");
    image_assert_no_pulse_for(50 * MS);
}

/* LOO-005, LOO-009, LOO-012 */
static void test_a_loop_wraps_and_ends_with_the_running_command(void)
{
    number_the_entries(2);
    image_do("q29m39vc4000a999d999");
    image_do("q30m-40vc4000a999d999");
    image_do("ls29");
    image_do("lf2");
    image_until_pulses(39 + 40 + 11 + 12 + 39 + 10, 40 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    assert_runs("29 30 1 2 29 30");
}

/* LOO-009: 100 passes, none of them missing */
static void test_an_endless_loop_makes_a_hundred_passes(void)
{
    number_the_entries(2);
    image_do("ls1");
    image_do("lf2");
    image_until_pulses(100 * (11 + 12) + 5, 40 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    image_assert_pulses(100 * (11 + 12) + 11);
}

/* LOO-003 */
static void test_a_loop_of_one_position_is_refused(void)
{
    image_do("ls3");
    image_refused("lf3", "?15 start is finish");
    image_assert_no_pulse_for(50 * MS);
}

/* LOO-011 */
static void test_the_whole_queue_is_looped(void)
{
    number_the_entries(30);
    image_do("ln1");
    image_do("LA");
    image_idle(LONG_WAIT);
    assert_runs("1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30");
}

/* LOO-014 */
static void test_the_finish_can_be_moved_while_the_loop_runs(void)
{
    number_the_entries(5);
    image_do("ls1");
    image_do("lf2");
    image_until_pulses(11 + 12 + 4, 4 * SECOND);
    image_do("lf4");
    image_until_pulses(2 * 11 + 2 * 12 + 13 + 14 + 4, 4 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    assert_runs("1 2 1 2 3 4 1");
}

/* QUE-030, QUE-034: an edit acts when its entry is reached again */
static void test_an_entry_of_a_running_loop_can_be_edited(void)
{
    number_the_entries(2);
    image_do("ls1");
    image_do("lf2");
    image_until_pulses(11 + 12 + 3, 4 * SECOND); /* in the second pass of entry 1 */
    image_do("q2m-30");
    image_until_pulses(11 + 12 + 11 + 30 + 3, 4 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    assert_runs("1 2 1 20 1");
}

/* A command typed while a loop runs is stored, and executed after it. */
/* MOT-012 */
static void test_a_command_typed_in_a_loop_comes_after_it(void)
{
    number_the_entries(3);
    image_do("ln3");
    image_do("ls2");
    image_do("lf3");
    image_do("m25vc4000a999d999"); /* at position 1 */
    image_idle(LONG_WAIT);
    assert_begins("2 3 2 3 2 28"); /* 3 and what was typed turn alike: 13 + 25 */
    image_assert_pulses(3 * (12 + 13) + 25);
}

/* NXT-004 */
static void test_next_in_a_loop_goes_on_with_the_loop(void)
{
    number_the_entries(3);
    image_do("q2m-5000");
    image_do("ls1");
    image_do("lf3");
    image_until_pulses(11 + 40, 4 * SECOND);
    image_send("N\r");
    image_run(400 * MS);
    const char *seen = runs();
    unsigned cut = 0;
    if (sscanf(seen, "1 (%u) 14 ", &cut) != 1 || cut > 70) /* 3 and 1 turn alike: 24 pulses */
        image_fail("expected entry 1, a cut one of at most 70, then 3 and 1; saw \"%s\"", seen);
    image_do("S");
}

/* -- XRF ----------------------------------------------------------------------------------------------------------- */

/* XRF-001, XRF-003, LOO-013 */
static void test_xref_preempts_a_loop_which_then_goes_on(void)
{
    number_the_entries(4);
    image_do("q2m-400");
    image_do("q20m-33vc4000a999d999");
    image_do("ls1");
    image_do("lf4");
    image_until_pulses(11 + 20, 4 * SECOND);
    image_send("x20\r");
    image_until_pulses(11 + 20 + 33 + 13 + 14 + 11 + 60, 8 * SECOND);
    image_do("S");
    unsigned cut = 0;
    if (sscanf(runs(), "1 (%u) 3 4 1", &cut) != 1 || cut < 20 + 33 || cut > 60 + 33)
        image_fail("expected 1, what was cut with entry 20's 33, 3, 4, 1; saw \"%s\"", runs());
}

/* XRF-001, QUE-016 */
static void test_xref_at_standstill_executes_the_entry_at_once(void)
{
    number_the_entries(3);
    image_do("x3");
    image_idle(LONG_WAIT);
    assert_runs("3");
    TEST_ASSERT_EQUAL(13, image_position());
}

/* XRF-005, XRF-006, XRF-007, XRF-008, XRF-009, XRF-010, XRF-012, XRF-013, XRF-015 */
static void test_the_array_is_programmed_shown_and_run(void)
{
    number_the_entries(7);
    TEST_ASSERT_EQUAL_STRING("x_ 0 0\r\n", image_ask("xp"));
    static const char *const shown[][2] = {{"0,1", "x_ 0 1\r\nx_ 1 0\r\n"},
                                           {"1,4", "x_ 0 1\r\nx_ 1 4\r\nx_ 2 0\r\n"},
                                           {"2,7", "x_ 0 1\r\nx_ 1 4\r\nx_ 2 7\r\nx_ 3 0\r\n"},
                                           {"3,2", "x_ 0 1\r\nx_ 1 4\r\nx_ 2 7\r\nx_ 3 2\r\nx_ 4 0\r\n"},
                                           {"4,0", "x_ 0 1\r\nx_ 1 4\r\nx_ 2 7\r\nx_ 3 2\r\nx_ 4 0\r\n"}};
    for (size_t i = 0; i < sizeof shown / sizeof shown[0]; i++)
        TEST_ASSERT_EQUAL_STRING(shown[i][1], image_ask(shown[i][0]));
    image_refused("31,1", "?12 range 0..30");
    image_refused("1,31", "?12 range 0..30");
    image_refused("1", "?2 syntax");
    image_do("x");
    image_train_clear();
    image_do("l2");
    image_idle(LONG_WAIT);
    assert_runs("1 4 7 2 1 4 7 2");
    TEST_ASSERT_EQUAL_STRING(shown[4][1], image_ask("xd"));
}

/* XRF-010, XRF-011 */
static void test_an_endless_array_runs_until_it_is_ended(void)
{
    number_the_entries(2);
    image_refused("xl", "?13 xRef array empty");
    image_ask("xp");
    image_ask("0,2");
    image_ask("1,1");
    image_do("x");
    image_train_clear();
    image_do("xl");
    image_until_pulses(40 * (11 + 12) + 5, 40 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    image_assert_pulses(40 * (11 + 12) + 12);
}

/* XRF-014 */
static void test_an_array_of_one_entry_without_deceleration_is_continuous(void)
{
    image_do("q1m200vc1000a999d999");
    image_ask("xp");
    image_ask("0,1");
    image_do("x");
    image_train_clear();
    image_do("xl");
    image_until_pulses(1100, 5 * SECOND);
    image_do("q1vc800");
    image_until_pulses(1600, 5 * SECOND);
    image_assert_intervals(0, 1199, 16000, 0.5); /* across five boundaries */
    image_assert_intervals(1200, 399, 12800, 0.5);
    image_do("S");
}

/* -- THR ----------------------------------------------------------------------------------------------------------- */

/* THR-002, THR-003, THR-004, THR-005, THR-006 */
static void test_a_one_shot_preempts_and_leaves_no_trace(void)
{
    image_do("vc1000");
    image_do("a999");
    image_do("d999");
    image_do("m500");
    image_do("m-21");
    image_train_clear();
    char before[4000];
    snprintf(before, sizeof before, "%s%s", image_display("q"), image_display("cf"));
    image_send("xm-33a5\r");
    image_idle(LONG_WAIT);
    char after[4000];
    snprintf(after, sizeof after, "%s%s", image_display("q"), image_display("cf"));
    TEST_ASSERT_EQUAL_STRING(before, after);
    /* What ran has been cut; then the one-shot and the pending one, both backwards. */
    unsigned cut = 0;
    if (sscanf(runs(), "(%u) (54)", &cut) != 1 || cut > 480)
        image_fail("expected a cut command, then 33 + 21 backwards; saw \"%s\"", runs());
}

/* THR-008, SYN-001, SYN-002, SWT-002 */
static void test_a_one_shot_can_wait_for_sync(void)
{
    image_do("xm20vc1000a999d999st2000");
    image_assert_no_pulse_for(100 * MS);
    image_train_clear();
    uint64_t from = board_cycle(board);
    image_do("y");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    if (train.pulse[0].cycle - from < 2 * MS)
        image_fail("expected the first pulse 2 ms after the release, it came after %llu cycles",
                   (unsigned long long)(train.pulse[0].cycle - from));
}

/* THR-001 */
static void test_position_0_and_31_are_out_of_reach(void)
{
    static const char *const lines[] = {"q0m200", "q31m200", "ls0", "lf31", "x0", "x31"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        image_refused(lines[i], "?12 range 1..30");
    image_assert_no_pulse_for(50 * MS);
}

/* -- CON ----------------------------------------------------------------------------------------------------------- */

/* CON-001, CON-003, CON-014, CON-015 */
static void test_continuous_turns_until_it_is_ended_with_its_own_deceleration(void)
{
    static const char *const lines[] = {"m", "m0", "m-", "m-0", "mv120a2d4"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        image_train_clear();
        image_do(lines[i]);
        image_until_state(CRUISE, 5 * SECOND);
        image_run(3 * SECOND);
        size_t before = train.count;
        image_assert_interval(before - 2, i == 4 ? 40000 : 48000, 1);
        TEST_ASSERT_EQUAL(lines[i][1] == '-', train.pulse[before - 1].dir);
        image_trace(true);
        image_send("n\r");
        image_until_state(DECEL, 4 * SECOND);
        size_t braking = train.count;
        image_idle(LONG_WAIT);
        /* 90 steps of 1 RPM; from 120 RPM 110 / 4 */
        image_assert_near("pulses of the deceleration", i == 4 ? 27 : 90, (double)(train.count - braking), 2);
    }
}

/* CON-004, CON-005, CON-007, MOT-009 */
static void test_continuous_leaves_queue_and_session_alone(void)
{
    char before[4000], after[4000];
    snprintf(before, sizeof before, "%s%s", image_display("q"), image_display("cf"));
    image_do("mv120a.8d1.2");
    image_run(500 * MS);
    image_do("S");
    snprintf(after, sizeof after, "%s%s", image_display("q"), image_display("cf"));
    TEST_ASSERT_EQUAL_STRING(before, after);
    image_do("b");
    image_assert_holds(image_display("q"), "\n0\t0\t CW\t120\t2500\t 0.80\t1.20\t0\t  0\r\n");
}

/* CON-006 */
static void test_values_given_before_continuous_persist(void)
{
    image_do("v120");
    image_do("a.8");
    image_do("d1.2");
    image_do("m");
    image_run(100 * MS);
    image_do("S");
    image_assert_holds(image_display("cf"), "v 120 cycle 2500\r\na 0.80 d 1.20");
}

/* CON-002, CON-009 */
static void test_continuous_preempts_and_n_goes_on_with_the_queue(void)
{
    image_do("vc1000");
    image_do("a999");
    image_do("d999");
    image_do("m5000");
    image_do("m-21");
    image_do("m22");
    image_run(100 * MS);
    image_send("m-\r");
    image_run(300 * MS);
    size_t before = train.count;
    TEST_ASSERT_EQUAL(1, train.pulse[before - 1].dir);
    image_send("n\r");
    image_idle(LONG_WAIT);
    /* continuous and 21 backwards, then 22 forwards */
    TEST_ASSERT_EQUAL(0, train.pulse[train.count - 22].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[train.count - 23].dir);
    image_assert_no_pulse_for(50 * MS);
}

/* CON-010 */
static void test_next_in_continuous_lets_the_loop_take_one_more(void)
{
    number_the_entries(4);
    image_do("ls1");
    image_do("lf4");
    image_until_pulses(11 + 5, 4 * SECOND);
    image_send("m-vc1000a999d999\r");
    image_run(300 * MS);
    image_send("n\r");
    image_idle(LONG_WAIT);
    /* Entry 2 was cut, 3 is the one more; it turns clockwise. */
    TEST_ASSERT_EQUAL(0, train.pulse[train.count - 13].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[train.count - 14].dir);
    image_assert_no_pulse_for(100 * MS);
}

/* CON-011, XRF-002, XRF-004 */
static void test_xref_ends_continuous_and_the_loop_resumes(void)
{
    number_the_entries(4);
    image_do("q20m33vc4000a999d999");
    image_do("ls1");
    image_do("lf4");
    image_until_pulses(11 + 5, 4 * SECOND);
    image_send("m-vc1000a999d999\r");
    image_run(300 * MS);
    image_send("x20\r");
    while (train.pulse[train.count - 1].dir != 0)
        image_run(MS);
    image_until_pulses(train.count + 33 + 13 + 5, 4 * SECOND);
    image_do("l");
    image_idle(LONG_WAIT);
    /* 1, the rest backwards, 20 and 3 both clockwise, then 4 and so on. */
    unsigned backwards = 0, forwards = 0;
    if (sscanf(runs(), "1 (%u) (%u) 4", &backwards, &forwards) != 2 || forwards != 33 + 13)
        image_fail("expected 1, backwards, 33 + 13 forwards, 4; saw \"%s\"", runs());
}

/* XRF-002 */
static void test_xref_ends_continuous_and_then_the_motor_stands(void)
{
    number_the_entries(3);
    image_do("m-vc1000a999d999");
    image_run(200 * MS);
    image_send("x3\r");
    image_idle(LONG_WAIT);
    TEST_ASSERT_EQUAL(0, train.pulse[train.count - 13].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[train.count - 14].dir);
}

/* CON-012, STO-005, STO-008 */
static void test_l_ends_continuous_with_grace(void)
{
    image_do("m");
    image_until_state(CRUISE, 5 * SECOND);
    image_trace(true);
    image_do("l");
    image_idle(LONG_WAIT);
    image_assert_states("CDP0");
}

/* CON-008 */
static void test_s_ends_continuous_and_the_loop_it_interrupted(void)
{
    number_the_entries(4);
    image_do("ls1");
    image_do("lf4");
    image_until_pulses(11 + 5, 4 * SECOND);
    image_do("m-vc1000a999d999");
    image_run(300 * MS);
    image_do("S");
    image_assert_no_pulse_for(SECOND);
    image_train_clear();
    image_do("m-vc1000");
    image_run(300 * MS);
    image_do("s");
    image_idle(LONG_WAIT);
    image_assert_no_pulse_for(SECOND);
}

/* VEL-011: a velocity typed in continuous motion is followed, with the session's acceleration */
static void test_a_velocity_typed_in_continuous_motion_is_followed(void)
{
    image_do("a4");
    image_do("m");
    image_until_state(CRUISE, 5 * SECOND);
    image_do("v200");
    image_run(2 * SECOND);
    image_assert_interval(train.count - 2, 24000, 1);
    image_do("v50");
    image_run(2 * SECOND);
    image_assert_interval(train.count - 2, 96000, 1);
    image_do("vc1000");
    image_run(2 * SECOND);
    image_assert_interval(train.count - 2, 16000, 1);
    /* No step of the velocity but by the ramp: 4 RPM a step, and what is left over. */
    for (size_t k = 1; k + 1 < train.count; k++) {
        double before = 4.8e6 / (double)image_interval(k - 1), after = 4.8e6 / (double)image_interval(k);
        if (after - before > 8.5 || before - after > 8.5)
            image_fail("pulse %zu: from %.1f to %.1f RPM in one step", k, before, after);
    }
    image_do("S");
    /* a and d are for what comes next. */
    image_do("mvc900a999d999");
    image_run(200 * MS);
    image_do("a5");
    image_do("d5");
    image_run(200 * MS);
    image_assert_interval(train.count - 2, 14400, 1);
    image_do("S");
}

/* -- SYN, QUE -------------------------------------------------------------------------------------------------------- */

/* SYN-001, SYN-002, SYN-006, SYN-007, SYN-009 */
static void test_sync_holds_an_entry_at_every_pass(void)
{
    number_the_entries(2);
    image_do("q1s");
    image_do("y"); /* releases nothing that is held later */
    image_do("ls1");
    image_do("lf2");
    image_assert_no_pulse_for(200 * MS);
    image_do("y");
    image_run(300 * MS);
    image_assert_pulses(11 + 12);
    image_do("y");
    image_run(300 * MS);
    image_assert_pulses(2 * (11 + 12));
    image_do("q1s0");
    image_do("y");
    image_run(300 * MS);
    TEST_ASSERT_TRUE(train.count > 4 * (11 + 12));
    image_do("S");
}

/* SYN-004, PIN-008 */
static void test_a_falling_edge_of_the_sync_pin_releases(void)
{
    image_do("m20vc1000a999d999s");
    board_pin_drive(board, BOARD_PIN('D', 3), true);
    image_assert_no_pulse_for(50 * MS);
    board_pin_drive(board, BOARD_PIN('D', 3), false);
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    /* A low level or a rising edge releases nothing. */
    image_do("m20s");
    image_assert_no_pulse_for(50 * MS);
    board_pin_drive(board, BOARD_PIN('D', 3), true);
    image_assert_no_pulse_for(50 * MS);
    board_pin_drive(board, BOARD_PIN('D', 3), false);
    image_idle(LONG_WAIT);
    image_assert_pulses(40);
}

/* STO-002, SWT-007 */
static void test_stop_ends_what_is_held(void)
{
    image_do("m20s");
    image_do("m30");
    image_do("S");
    image_do("y");
    image_assert_no_pulse_for(SECOND);
    image_do("m7");
    image_idle(LONG_WAIT);
    image_assert_pulses(7);
}

/* NXT-001 */
static void test_next_goes_past_what_is_held(void)
{
    image_do("m20s");
    image_do("m-30");
    image_assert_no_pulse_for(100 * MS);
    image_do("N");
    image_idle(LONG_WAIT);
    image_assert_pulses(30);
    TEST_ASSERT_EQUAL(-30, image_position());
}

/* QUE-022..QUE-029, QUE-031 */
static void test_entries_are_edited_as_in_the_manual(void)
{
    image_do("q9m-2000vc1500a1d1l0pu0s0t0");
    TEST_ASSERT_EQUAL_STRING("9\t2000\t+CCW\t200\t1500\t 1.00\t1.00\t0\t  0\r\n", image_ask("q9"));
    image_do("qp");
    image_do("8m2000");
    image_refused("m5", "?2 syntax");
    image_do("x");
    image_assert_row(8, "8\t2000\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
    image_do("q8a2");
    image_assert_row(8, "8\t2000\t CW\t100\t3000\t 2.00\t1.00\t0\t  0");
    image_assert_holds(image_display("cf"), "v 100 cycle 3000\r\na 1.00 d 1.00");
    image_assert_pulses(0);
}

/* QUE-019 */
static void test_the_queue_is_cleared_to_the_session_defaults(void)
{
    image_do("v50");
    image_do("qc");
    for (unsigned n = 1; n <= 30; n++) {
        char row[60];
        snprintf(row, sizeof row, "%u\t200\t CW\t50\t6000\t 1.00\t1.00\t0\t  0", n);
        image_assert_row(n, row);
    }
}

/* TRM-012 */
static void test_undo_restores_an_entry(void)
{
    image_do("q9v60");
    image_do("z");
    image_assert_row(9, "9\t200\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
    image_refused("z", "?14 nothing to undo");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_loop_runs_so_many_times_from_start_to_finish);
    RUN_TEST(test_a_loop_wraps_and_ends_with_the_running_command);
    RUN_TEST(test_an_endless_loop_makes_a_hundred_passes);
    RUN_TEST(test_a_loop_of_one_position_is_refused);
    RUN_TEST(test_the_whole_queue_is_looped);
    RUN_TEST(test_the_finish_can_be_moved_while_the_loop_runs);
    RUN_TEST(test_an_entry_of_a_running_loop_can_be_edited);
    RUN_TEST(test_a_command_typed_in_a_loop_comes_after_it);
    RUN_TEST(test_next_in_a_loop_goes_on_with_the_loop);
    RUN_TEST(test_xref_preempts_a_loop_which_then_goes_on);
    RUN_TEST(test_xref_at_standstill_executes_the_entry_at_once);
    RUN_TEST(test_the_array_is_programmed_shown_and_run);
    RUN_TEST(test_an_endless_array_runs_until_it_is_ended);
    RUN_TEST(test_an_array_of_one_entry_without_deceleration_is_continuous);
    RUN_TEST(test_a_one_shot_preempts_and_leaves_no_trace);
    RUN_TEST(test_a_one_shot_can_wait_for_sync);
    RUN_TEST(test_position_0_and_31_are_out_of_reach);
    RUN_TEST(test_continuous_turns_until_it_is_ended_with_its_own_deceleration);
    RUN_TEST(test_continuous_leaves_queue_and_session_alone);
    RUN_TEST(test_values_given_before_continuous_persist);
    RUN_TEST(test_continuous_preempts_and_n_goes_on_with_the_queue);
    RUN_TEST(test_next_in_continuous_lets_the_loop_take_one_more);
    RUN_TEST(test_xref_ends_continuous_and_the_loop_resumes);
    RUN_TEST(test_xref_ends_continuous_and_then_the_motor_stands);
    RUN_TEST(test_l_ends_continuous_with_grace);
    RUN_TEST(test_s_ends_continuous_and_the_loop_it_interrupted);
    RUN_TEST(test_a_velocity_typed_in_continuous_motion_is_followed);
    RUN_TEST(test_sync_holds_an_entry_at_every_pass);
    RUN_TEST(test_a_falling_edge_of_the_sync_pin_releases);
    RUN_TEST(test_stop_ends_what_is_held);
    RUN_TEST(test_next_goes_past_what_is_held);
    RUN_TEST(test_entries_are_edited_as_in_the_manual);
    RUN_TEST(test_the_queue_is_cleared_to_the_session_defaults);
    RUN_TEST(test_undo_restores_an_entry);
    return UNITY_END();
}
