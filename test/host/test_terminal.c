/* cli/terminal: what is typed, what comes back, and in which order. */
#include "cli/terminal.h"
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include "cli/commands.h"
#include "cli/trial.h"
#include "eeprom/store.h"
#include "host/fakes/eeprom_port_fake.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"
#include "unity.h"

static void run(void)
{
    bool worked;
    do {
        worked = terminal_poll();
        worked |= queue_poll();
    } while (worked);
}

void setUp(void)
{
    terminal_port_fake_reset();
    engine_fake_reset();
    eeprom_fake_reset();
    trial_begin(store_load_settings());
    commands_init();
    queue_init();
    timebase_fake_us = 0;
    timebase_fake_step_us = 0;
    terminal_init(STATUS_OK);
    run();
    terminal_port_fake_clear();
}

void tearDown(void) {}

/* What comes back when this is typed, each character in its time, and everything has been said. */
static const char *answer(const char *text)
{
    terminal_port_fake_clear();
    for (; *text != '\0'; text++) {
        terminal_port_fake_type_byte((unsigned char)*text);
        run();
    }
    run();
    return terminal_port_fake_text();
}

/* BOO-001, TRM-001 */
static void test_the_version_line_stands_before_the_first_prompt(void)
{
    terminal_init(STATUS_OK);
    const char *text = terminal_port_fake_text();
    TEST_ASSERT_EQUAL_STRING_LEN("SAC ", text, 4);
    TEST_ASSERT_EQUAL_PTR(text + strlen(text) - 2, strstr(text, "\r\n"));
    run();
    text = terminal_port_fake_text();
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", text + strlen(text) - 6);
}

/* What a reset left to say stands between them. */
static void test_a_reset_is_reported_before_the_first_prompt(void)
{
    terminal_init(STATUS_WATCHDOG);
    run();
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "\r\n?17 reset: watchdog\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("m5\r\nSAC>", answer("m5\r"));
}

/* TRM-007 */
static void test_a_motion_command_is_answered_by_its_echo_and_the_prompt_alone(void)
{
    TEST_ASSERT_EQUAL_STRING("m200\r\nSAC>", answer("m200\r"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
}

/* TRM-002, TRM-003 */
static void test_each_kind_of_line_end_executes_once(void)
{
    answer("m1");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    answer("\rm2\nm3\r\nm4\r");
    TEST_ASSERT_EQUAL_UINT(4, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(4, engine_fake.submitted[3].count);
}

static void test_the_motion_goes_to_the_engine_before_the_answer_is_queued(void)
{
    answer("m200");
    const unsigned echo = terminal_port_fake_sent();
    answer("\r");
    TEST_ASSERT_EQUAL_UINT(4, echo);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.sent_at_submit);
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", terminal_port_fake_text());
}

/* TRM-017 */
static void test_a_blank_line_repeats_the_prompt_once(void)
{
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", answer("\r"));
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", answer("\r\n"));
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", answer("\n"));
}

static void test_taking_a_character_back_removes_it_from_the_screen_and_the_command(void)
{
    TEST_ASSERT_EQUAL_STRING("m201\b \b\b \b50\r\nSAC>", answer("m201\b\x7F"
                                                                "50\r"));
    TEST_ASSERT_EQUAL_UINT32(250, engine_fake.submitted[0].count);
    TEST_ASSERT_EQUAL_STRING("", answer("\b\b"));
}

static void test_escape_clears_the_line_and_shows_a_new_prompt(void)
{
    TEST_ASSERT_EQUAL_STRING("m999\r\nSAC>m5\r\nSAC>", answer("m999\x1Bm5\r"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(5, engine_fake.submitted[0].count);
}

/* Decisions 0.3.7: any command that is executed, in any mode; + and - are no lines, and noise could be one. */
static void test_a_line_without_an_error_confirms_a_path_on_trial_and_nothing_else_does(void)
{
    static const char *const nothing[] = {"k\r", "m200k\r", "\r", " \r", " m5\r", "256m200\r", "v0\r", "m5\x1B", "m5\b\b\r", "+-", "m5"};
    static const char *const commands[] = {"m5\r", "v20\r", "p\r", "$CL20\r", "$R\r", "xp\r", "5\bS\r", "p the rest is ignored\r"};
    for (size_t i = 0; i < sizeof nothing / sizeof *nothing; i++) {
        setUp();
        trial_begin(true);
        (void)trial_failed();
        answer(nothing[i]);
        TEST_ASSERT_TRUE_MESSAGE(trial_on(), nothing[i]);
        TEST_ASSERT_FALSE(store_busy());
        answer("\x1B");
    }
    trial_begin(true);
    (void)trial_failed();
    terminal_port_fake_type_byte(0xFF);
    answer("p\r");
    TEST_ASSERT_TRUE(trial_on());
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        setUp();
        trial_begin(true);
        (void)trial_failed();
        answer(commands[i]);
        TEST_ASSERT_FALSE_MESSAGE(trial_on(), commands[i]);
        TEST_ASSERT_TRUE(store_busy());
        while (store_poll()) {
        }
        run();
    }
}

/* Decisions 0.3.7: it came by the path before. */
static void test_the_restart_itself_and_what_follows_it_at_once_confirm_nothing(void)
{
    static const uint32_t baud = 250000;
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(offsetof(settings_t, hw_baud), 3, baud));
    while (store_poll()) {
    }
    terminal_port_fake_press(1);
    terminal_port_fake_type("$R\rp\r");
    for (unsigned i = 0; i < 100; i++) {
        TEST_ASSERT_FALSE(trial_failed());
        terminal_poll();
    }
    TEST_ASSERT_EQUAL_size_t(0, terminal_port_fake_untaken());
    TEST_ASSERT_EQUAL_UINT32(baud, settings.hw_baud);
    TEST_ASSERT_TRUE(trial_on());
    TEST_ASSERT_FALSE(store_busy());
    answer("p\r");
    TEST_ASSERT_FALSE(trial_on());
}

/* Decisions 0.3.7 */
static void test_what_is_reported_stands_before_another_prompt_and_keeps_what_is_typed(void)
{
    terminal_report(STATUS_TAKEN_BACK);
    TEST_ASSERT_EQUAL_STRING("\r\n?20 E M m n taken back\r\nSAC>", answer(""));
    terminal_port_fake_hold(1);
    terminal_port_fake_type("k\rk\rk\r");
    run();
    terminal_report(STATUS_TAKEN_BACK); /* errors are owed */
    for (unsigned i = 0; i < 10; i++) {
        terminal_port_fake_drain(1000);
        run();
    }
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "\r\n?20 E M m n taken back\r\nSAC>"));
    terminal_port_fake_hold(0);
    answer("m1");
    terminal_report(STATUS_TAKEN_BACK);
    TEST_ASSERT_EQUAL_STRING("\r\n?20 E M m n taken back\r\nSAC>m1", answer(""));
    TEST_ASSERT_EQUAL_STRING("7\r\nSAC>", answer("7\r"));
    TEST_ASSERT_EQUAL_UINT32(17, engine_fake.submitted[0].count);
}

/* PUL-002, PUL-005 */
static void test_plus_and_minus_act_at_once_without_a_line_end_or_an_echo(void)
{
    TEST_ASSERT_EQUAL_STRING("", answer("++-"));
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.pulses_cw);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.pulses_ccw);
}

/* PUL-007 */
static void test_a_minus_within_a_line_is_no_pulse(void)
{
    answer("m-200\r");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.pulses_ccw);
    TEST_ASSERT_TRUE(engine_fake.submitted[0].flags & MOTION_CCW);
}

static void test_a_minus_after_a_lost_character_is_no_pulse(void)
{
    terminal_port_fake_type_byte(0xFF);
    TEST_ASSERT_EQUAL_STRING("-200\r\n?10 reception error\r\nSAC>", answer("-200\r"));
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.pulses_ccw);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
}

static void test_errors_are_answered_by_number_words_and_range(void)
{
    static const struct {
        const char *line;
        const char *error;
    } rows[] = {{"k", "?1 unknown command"},      {"m200k", "?2 syntax"},
                {"vc", "?3 number missing"},      {"m4294967296", "?4 number too large"},
                {"vc1", "?7 too fast"},           {"v0", "?8 velocity 0"},
                {"m0x", "?2 syntax"},             {"m5u256", "?12 range 0..255"},
                {"a1000", "?12 range 0.01..999"}, {"256m200", "?12 range 0..255"}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[40], expected[80];
        sprintf(text, "%s\r", rows[i].line);
        sprintf(expected, "%s\r\n%s\r\nSAC>", rows[i].line, rows[i].error);
        TEST_ASSERT_EQUAL_STRING(expected, answer(text));
    }
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
}

static void test_a_full_queue_answers_its_error(void)
{
    engine_fake.accepts = false;
    for (int i = 0; i < 30; i++) {
        TEST_ASSERT_EQUAL_STRING("m5\r\nSAC>", answer("m5\r"));
    }
    TEST_ASSERT_EQUAL_STRING("m5\r\n?6 queue full\r\nSAC>", answer("m5\r"));
}

static void test_a_line_that_is_too_long_is_refused_and_nothing_of_it_executed(void)
{
    char text[102];
    memset(text, ' ', sizeof text);
    memcpy(text, "m200", 4);
    strcpy(text + 100, "\r");
    const char *said = answer(text);
    TEST_ASSERT_NOT_NULL(strstr(said, "\r\n?5 line too long\r\nSAC>"));
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_STRING("m7\r\nSAC>", answer("m7\r"));
}

/* CLK-014 */
static void test_a_damaged_line_is_refused_and_the_next_one_taken(void)
{
    terminal_port_fake_type("m20");
    terminal_port_fake_type_byte(0xFF);
    TEST_ASSERT_EQUAL_STRING("m200v50\r\n?10 reception error\r\nSAC>", answer("0v50\r"));
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(3000, session.velocity);
    TEST_ASSERT_EQUAL_STRING("m7\r\nSAC>", answer("m7\r"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
}

/* QUE-002, QUE-011 */
static void test_a_display_ends_with_the_prompt(void)
{
    TEST_ASSERT_EQUAL_STRING("vd\r\n10 30000\r\nSAC>", answer("vd\r"));
    const char *text = answer("q\r");
    TEST_ASSERT_EQUAL_STRING_LEN("q\r\nQ\tSteps\t", text, 11);
    TEST_ASSERT_EQUAL_STRING("s sync\r\nSAC>", text + strlen(text) - 12);
}

static void test_displays_that_were_asked_for_at_once_are_all_printed_before_the_prompt(void)
{
    terminal_port_fake_type("vd\rp\r");
    terminal_poll(); /* vd */
    terminal_poll(); /* p, before the display of vd is through: two lines at once */
    run();
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "10 30000\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "position 0 STANDBY faults 0\r\nSAC>"));
}

static void test_one_display_too_many_is_refused(void)
{
    terminal_port_fake_hold(1);
    terminal_port_fake_type("q\rvd\rvd\rvd\rvd\rvd\r");
    for (int i = 0; i < 5000; i++) {
        terminal_poll();
        terminal_port_fake_drain(1);
    }
    const char *text = terminal_port_fake_text();
    TEST_ASSERT_NOT_NULL(strstr(text, "10 30000\r\n10 30000\r\n10 30000\r\n10 30000\r\n?11 busy\r\nSAC>"));
}

/* STO-001 */
static void test_a_line_typed_during_a_display_is_executed_at_once_and_answered_after_it(void)
{
    terminal_port_fake_hold(1);
    terminal_port_fake_type("q\r");
    for (int i = 0; i < 50; i++) {
        terminal_poll();
    }
    terminal_port_fake_type("S\r300xyz\rm12");
    for (int i = 0; i < 20; i++) {
        terminal_poll(); /* the line is stopped */
    }
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops);
    terminal_port_fake_hold(0);
    terminal_port_fake_drain(63);
    run();
    const char *text = terminal_port_fake_text();
    TEST_ASSERT_NOT_NULL(strstr(text, "s sync\r\n?12 range 0..255\r\nSAC>m12"));
    TEST_ASSERT_EQUAL_STRING("34\r\nSAC>", answer("34\r"));
    TEST_ASSERT_EQUAL_UINT32(1234, engine_fake.submitted[0].count);
}

static void test_the_range_told_after_a_display_is_that_of_the_first_error(void)
{
    terminal_port_fake_type("q\rm5u300\ra1000\r");
    run();
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "s sync\r\n?12 range 0..255\r\nSAC>"));
}

/* CLK-013 */
static void test_a_flood_faster_than_the_answers_is_executed_to_the_last_line(void)
{
    enum { LINES = 1000 };
    terminal_port_fake_hold(1);
    char text[24];
    for (int i = 1; i <= LINES; i++) {
        sprintf(text, "m%dv%d\r", i, i % 50 + 1);
        terminal_port_fake_type(text);
    }
    while (terminal_port_fake_untaken() > 0) {
        terminal_poll(); /* a byte in ... */
        queue_poll();
        terminal_port_fake_drain(1); /* ... a byte out */
    }
    TEST_ASSERT_EQUAL_UINT(LINES, engine_fake.submitted_count);
    for (uint32_t i = 1; i <= LINES; i++) {
        TEST_ASSERT_EQUAL_UINT32(i, engine_fake.submitted[i - 1].count);
        TEST_ASSERT_EQUAL_UINT32(i % 50 + 1, engine_fake.submitted[i - 1].velocity);
    }
    terminal_port_fake_hold(0);
    terminal_port_fake_drain(63);
    run();
    TEST_ASSERT_EQUAL_STRING("m1v2\r\nSAC>", answer("m1v2\r"));
}

static void test_output_rests_while_much_input_waits(void)
{
    terminal_port_fake_press(1);
    for (int i = 0; i < 100; i++) {
        terminal_port_fake_type("m5v50\r");
    }
    run();
    TEST_ASSERT_EQUAL_UINT(100, engine_fake.submitted_count);
    TEST_ASSERT_TRUE(terminal_port_fake_sent() < 60);
    TEST_ASSERT_EQUAL_STRING("m7\r\nSAC>", answer("m7\r"));
}

/* What comes back from a flood are whole lines: `SAC>` and a line as it was typed. */
static void test_echo_of_a_flood_is_thinned_out_by_whole_lines(void)
{
    terminal_port_fake_hold(1);
    for (int i = 0; i < 300; i++) {
        terminal_port_fake_type("v123\r");
    }
    while (terminal_port_fake_untaken() > 0) {
        terminal_poll();             /* a line in ... */
        terminal_port_fake_drain(5); /* ... as many bytes out */
    }
    terminal_port_fake_hold(0);
    terminal_port_fake_drain(63);
    run();
    const char *text = terminal_port_fake_text();
    int lines = 0;
    TEST_ASSERT_EQUAL_STRING_LEN("v123\r\n", text, 6);
    for (text += 6; *text != '\0'; lines++) {
        const size_t length = strncmp(text, "SAC>v123\r\n", 10) == 0 ? 10 : strncmp(text, "SAC>\r\n", 6) == 0 ? 6 : 4;
        if (length == 4) {
            TEST_ASSERT_EQUAL_STRING("SAC>", text);
        }
        text += length;
    }
    TEST_ASSERT_TRUE(lines > 100 && lines < 300);
}

/* TRM-009, TRM-011 */
static void test_debug_reports_how_long_each_line_took(void)
{
    TEST_ASSERT_EQUAL_STRING("b\r\nSAC>", answer("b\r"));
    timebase_fake_step_us = 100; /* each reading of the clock: first character, line end, done */
    TEST_ASSERT_EQUAL_STRING("m200\r\nreceived 100 us, loaded 100 us\r\nSAC>", answer("m200\r"));
    TEST_ASSERT_EQUAL_STRING("k\r\nreceived 100 us, loaded 100 us\r\n?1 unknown command\r\nSAC>", answer("k\r"));
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", answer("\r"));
    TEST_ASSERT_EQUAL_STRING("b\r\nSAC>", answer("b\r"));
    TEST_ASSERT_EQUAL_STRING("m200\r\nSAC>", answer("m200\r"));
}

static void test_a_line_begun_while_the_last_times_are_owed_is_not_timed(void)
{
    answer("b\r");
    timebase_fake_step_us = 100;
    terminal_port_fake_type("q\r");
    terminal_poll();
    terminal_port_fake_type("k");
    run();
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "received 100 us, loaded 100 us\r\nSAC>k"));
    TEST_ASSERT_EQUAL_STRING("\r\n?1 unknown command\r\nSAC>", answer("\r"));
    TEST_ASSERT_EQUAL_STRING("k\r\nreceived 100 us, loaded 100 us\r\n?1 unknown command\r\nSAC>", answer("k\r"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_version_line_stands_before_the_first_prompt);
    RUN_TEST(test_a_reset_is_reported_before_the_first_prompt);
    RUN_TEST(test_a_motion_command_is_answered_by_its_echo_and_the_prompt_alone);
    RUN_TEST(test_each_kind_of_line_end_executes_once);
    RUN_TEST(test_the_motion_goes_to_the_engine_before_the_answer_is_queued);
    RUN_TEST(test_a_blank_line_repeats_the_prompt_once);
    RUN_TEST(test_taking_a_character_back_removes_it_from_the_screen_and_the_command);
    RUN_TEST(test_escape_clears_the_line_and_shows_a_new_prompt);
    RUN_TEST(test_a_line_without_an_error_confirms_a_path_on_trial_and_nothing_else_does);
    RUN_TEST(test_the_restart_itself_and_what_follows_it_at_once_confirm_nothing);
    RUN_TEST(test_what_is_reported_stands_before_another_prompt_and_keeps_what_is_typed);
    RUN_TEST(test_plus_and_minus_act_at_once_without_a_line_end_or_an_echo);
    RUN_TEST(test_a_minus_within_a_line_is_no_pulse);
    RUN_TEST(test_a_minus_after_a_lost_character_is_no_pulse);
    RUN_TEST(test_errors_are_answered_by_number_words_and_range);
    RUN_TEST(test_a_full_queue_answers_its_error);
    RUN_TEST(test_a_line_that_is_too_long_is_refused_and_nothing_of_it_executed);
    RUN_TEST(test_a_damaged_line_is_refused_and_the_next_one_taken);
    RUN_TEST(test_a_display_ends_with_the_prompt);
    RUN_TEST(test_displays_that_were_asked_for_at_once_are_all_printed_before_the_prompt);
    RUN_TEST(test_one_display_too_many_is_refused);
    RUN_TEST(test_a_line_typed_during_a_display_is_executed_at_once_and_answered_after_it);
    RUN_TEST(test_the_range_told_after_a_display_is_that_of_the_first_error);
    RUN_TEST(test_a_flood_faster_than_the_answers_is_executed_to_the_last_line);
    RUN_TEST(test_output_rests_while_much_input_waits);
    RUN_TEST(test_echo_of_a_flood_is_thinned_out_by_whole_lines);
    RUN_TEST(test_debug_reports_how_long_each_line_took);
    RUN_TEST(test_a_line_begun_while_the_last_times_are_owed_is_not_timed);
    return UNITY_END();
}
