/* BOO, EST on the whole image: what a reset is followed by, what restores the factory settings, and the watchdog. */
#include "image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONG_WAIT (60 * SECOND)
#define HANG_LIMIT (150 * MS) /* from the last sign of life to the reset */

void setUp(void)
{
    image_power_on();
}

void tearDown(void)
{
    image_off();
}

/* -- what was printed, with its times ------------------------------------------------------------------------------ */

/* When byte n of what was printed began. */
static uint64_t began(size_t n)
{
    size_t count;
    const board_uart_byte_t *bytes = board_uart_received(board, &count);
    if (n >= count)
        image_fail("byte %zu asked for, %zu seen", n, count);
    return bytes[n].start_cycle;
}

/* Where a part begins in what was printed. */
static size_t printed_at(const char *part)
{
    const char *seen = board_uart_text(board);
    const char *found = strstr(seen, part);
    if (found == NULL)
        image_fail("expected \"%s\" in \"%s\"", part, seen);
    return (size_t)(found - seen);
}

static unsigned times_printed(const char *part)
{
    unsigned times = 0;
    for (const char *seen = strstr(board_uart_text(board), part); seen != NULL; seen = strstr(seen + 1, part))
        times++;
    return times;
}

/* `cf` shows these settings. */
static void assert_cycle(unsigned cycle_us)
{
    char part[40];
    snprintf(part, sizeof part, " cycle %u\r\n", cycle_us);
    image_assert_holds(image_display("cf"), part);
}

/* What stands on the line is gone. */
static void clear_line(void)
{
    image_send("\x1B");
    image_sent();
    image_run(20 * MS);
    image_take_text();
}

static void assert_alive(void)
{
    image_train_clear();
    image_do("m20v100");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
}

/* -- the window ---------------------------------------------------------------------------------------------------- */

/* BOO-001 */
static void test_the_version_line_is_the_first_that_is_sent(void)
{
    uint64_t start = board_cycle(board);
    image_run(1500 * MS);
    const char *seen = board_uart_text(board);
    char version[20], date[20];
    int end = 0;
    if (sscanf(seen, "SAC %19s %19[0-9-]%n", version, date, &end) != 2 || strcmp(seen + end, "\r\nSAC>") != 0)
        image_fail("expected \"SAC <version> <date>\\r\\nSAC>\", saw \"%s\"", seen);
    if (began(0) > start + 2 * MS)
        image_fail("expected the version line at once, saw it after %llu us",
                   (unsigned long long)((began(0) - start) / US));
}

static uint64_t window(void)
{
    image_run(1500 * MS);
    return began(printed_at("SAC>")) - began(printed_at("\n"));
}

/* BOO-002 */
static void test_a_second_passes_before_the_first_prompt(void)
{
    image_assert_near("window, s", 1.0, (double)window() / (double)SECOND, 0.1);
    board_reset(board, BOARD_RESET_EXTERNAL);
    board_uart_clear(board);
    image_assert_near("window after an external reset, s", 1.0, (double)window() / (double)SECOND, 0.1);
    board_reset(board, BOARD_RESET_POWER_ON);
    board_uart_clear(board);
    image_assert_near("window after power-on again, s", 1.0, (double)window() / (double)SECOND, 0.1);
}

/* BOO-003 */
static void test_escape_three_times_in_the_window_restores_the_factory_settings(void)
{
    IMAGE_SET(cycle_us, 2000);
    image_run(500 * MS);
    image_send("\x1B\x1B\x1B");
    image_prompt();
    assert_cycle(3000);
    assert_alive();
}

static void test_escapes_far_apart_and_other_bytes_around_them_restore_too(void)
{
    IMAGE_SET(cycle_us, 2000);
    image_run(100 * MS);
    image_send("m5\r\x1B");
    image_run(300 * MS);
    image_send("\x1B");
    image_run(300 * MS);
    image_send("\x1Bq");
    image_run(800 * MS);
    clear_line();
    assert_cycle(3000);
}

/* BOO-003 */
static void test_anything_else_in_the_window_restores_nothing(void)
{
    static const char *const typed[] = {"\x1B\x1B", "x", "\r\r\r", "\x1B\x1Bx\x1B"};
    for (size_t i = 0; i < sizeof typed / sizeof typed[0]; i++) {
        image_off();
        image_power_on();
        IMAGE_SET(cycle_us, 2000);
        image_run(100 * MS); /* the port listens */
        image_send(typed[i]);
        image_run(1400 * MS);
        clear_line();
        assert_cycle(2000);
    }
}

static void test_a_damaged_byte_in_the_window_does_not_count(void)
{
    IMAGE_SET(cycle_us, 2000);
    image_run(100 * MS);
    image_send("\x1B\x1B");
    board_uart_send_bad(board, 0x1B);
    board_uart_send_bad(board, 0x1B);
    image_prompt();
    clear_line();
    assert_cycle(2000);
}

/* BOO-005 */
static void test_escapes_after_the_window_restore_nothing(void)
{
    IMAGE_SET(cycle_us, 2000);
    image_run(500 * MS);
    image_send("\x1B\x1B");
    image_run(700 * MS);
    image_send("\x1B");
    image_sent();
    image_send("\x1B\x1B\x1B");
    clear_line();
    assert_cycle(2000);
}

static void test_lines_typed_in_the_window_are_executed_after_it(void)
{
    image_run(200 * MS);
    image_send("m20v100\rm30v100\rv77\r");
    image_run(700 * MS);
    image_assert_pulses(0);
    TEST_ASSERT_EQUAL_UINT(0, times_printed("SAC>"));
    image_run(500 * MS);
    image_idle(LONG_WAIT);
    image_assert_pulses(50);
    image_assert_holds(image_display("cf"), "v 77 ");
}

/* A host that chatters does not wipe the unit, and what did not fit is not executed by halves. */
static void test_a_flood_in_the_window_restores_nothing_and_leaves_the_unit_at_work(void)
{
    IMAGE_SET(cycle_us, 2000);
    for (unsigned i = 0; i < 600; i++)
        image_send("U0*\x1Bm\xFF");
    image_run(1500 * MS);
    clear_line();
    assert_cycle(2000);
    image_assert_pulses(0);
}

/* -- RST ----------------------------------------------------------------------------------------------------------- */

static void test_rst_held_low_at_power_on_restores_the_factory_settings(void)
{
    IMAGE_SET(cycle_us, 2000);
    board_pin_drive(board, RST, 0);
    image_prompt();
    board_pin_drive(board, RST, -1);
    assert_cycle(3000);
    assert_alive();
}

/* Biased high; it takes more than a glitch. */
static void test_rst_open_or_low_for_a_moment_restores_nothing(void)
{
    IMAGE_SET(cycle_us, 2000);
    board_pin_drive(board, RST, 0);
    board_pin_drive_at(board, RST, 1, board_cycle(board) + 5 * MS);
    image_prompt();
    assert_cycle(2000);
    image_off();
    image_power_on();
    IMAGE_SET(cycle_us, 2000);
    image_prompt();
    TEST_ASSERT_EQUAL_MESSAGE(1, board_pin_level(board, RST), "pulled up");
    assert_cycle(2000);
}

/* EST-005 */
static void test_rst_has_no_effect_in_the_window_and_in_motion(void)
{
    IMAGE_SET(cycle_us, 2000);
    image_run(500 * MS);
    board_pin_drive(board, RST, 0);
    image_prompt();
    assert_cycle(2000);
    image_do("m2000vc500a999d999");
    for (unsigned i = 0; i < 50; i++) {
        board_pin_drive(board, RST, i & 1);
        image_run(10 * MS);
    }
    image_idle(LONG_WAIT);
    image_assert_pulses(2000);
    image_assert_intervals(0, 1999, 500 * US, 0);
    image_do("v"); /* the system default */
    assert_cycle(2000);
}

/* -- other resets -------------------------------------------------------------------------------------------------- */

static void assert_warm(board_reset_t cause, const char *report)
{
    image_off();
    image_power_on();
    image_prompt();
    image_do("v77");
    image_send("m2000v100\r");
    image_sent();
    image_until_pulses(20, LONG_WAIT);
    board_pin_drive(board, RST, 0);
    board_reset(board, cause);
    board_uart_clear(board);
    image_train_clear();
    image_send("\x1B\x1B\x1B");
    uint64_t start = board_cycle(board);
    image_run(100 * MS);
    if (began(printed_at("\nSAC>")) > start + 40 * MS)
        image_fail("expected no window");
    printed_at(report);
    TEST_ASSERT_EQUAL_UINT(0, printed_at("SAC "));
    image_assert_no_pulse_for(3 * SECOND);
    assert_alive();
}

static void test_after_a_brown_out_its_cause_is_reported_and_nothing_moves(void)
{
    assert_warm(BOARD_RESET_BROWN_OUT, "\r\n?18 reset: brown-out\r\n");
}

static void test_after_a_watchdog_reset_its_cause_is_reported_and_nothing_moves(void)
{
    assert_warm(BOARD_RESET_WATCHDOG, "\r\n?17 reset: watchdog\r\n");
}

/* EST-005 */
static void test_after_them_nothing_restores(void)
{
    static const board_reset_t causes[] = {BOARD_RESET_BROWN_OUT, BOARD_RESET_WATCHDOG};
    for (unsigned i = 0; i < 2; i++) {
        board_pin_drive(board, RST, 0);
        board_reset(board, causes[i]);
        image_load_settings();
        IMAGE_SET(cycle_us, 2000);
        image_run(MS); /* until the port listens: it would take the rest of a character for another one */
        image_send("\x1B\x1B\x1B");
        image_prompt();
        clear_line();
        assert_cycle(2000);
    }
}

/* -- the watchdog -------------------------------------------------------------------------------------------------- */

/* From now on the program hangs where it is. */
static void assert_hang_ends_in_a_reset(void)
{
    board_uart_clear(board);
    board_hang(board);
    uint64_t at = board_cycle(board);
    image_run(HANG_LIMIT);
    size_t made = train.count;
    image_run(2 * SECOND);
    if (train.count != made)
        image_fail("hung at cycle %llu: expected no pulse %u ms later, saw %zu", (unsigned long long)at,
                   (unsigned)(HANG_LIMIT / MS), train.count - made);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, times_printed("SAC 0"), "resets");
    printed_at("\r\n?17 reset: watchdog\r\nSAC>");
    if (began(printed_at("SAC 0")) > at + HANG_LIMIT)
        image_fail("expected the version line %u ms after the hang, saw it after %llu ms",
                   (unsigned)(HANG_LIMIT / MS), (unsigned long long)((began(printed_at("SAC 0")) - at) / MS));
    TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, CLK), "clk");
    assert_alive();
}

/* At whatever the main loop does; what the compiler has drawn into its caller is left out. */
static void test_a_hang_in_motion_stops_the_motor_and_is_reported(void)
{
    static const char *const functions[] = {
        "main", "terminal_poll", "pay", "echo", "end_line", "display_poll", "print_piece", "queue_poll", "engine_poll",
        "fill", "emit", "append", "emit_ramp", "begin_ramp", "look_for_end", "ramp_next", "block_next", "block_run",
        "wide_divide", "wide_multiply", "wide_fraction", "terminal_port_get", "terminal_port_put", "wake_sleep",
    };
    image_prompt();
    unsigned hung = 0;
    for (unsigned i = 0; i < sizeof functions / sizeof functions[0]; i++) {
        uint16_t address;
        if (!board_symbol(board, functions[i], &address))
            continue;
        image_send(i & 1 ? "m1000000vc40a1d10\rq\r" : "m1000000vc1000a.1d10\rq\r");
        image_sent();
        if (board_run_to_pc(board, address, SECOND) != BOARD_MATCHED) {
            image_do("S");
            continue;
        }
        assert_hang_ends_in_a_reset();
        hung++;
    }
    TEST_ASSERT_GREATER_THAN_UINT(5, hung);
}

static void test_a_hang_in_an_interrupt_stops_the_motor_and_is_reported(void)
{
    static const char *const vectors[] = {"TIMER1_OVF_vect", "__vector_13", "TIMER0_OVF_vect", "__vector_16"};
    image_prompt();
    unsigned hung = 0;
    for (unsigned i = 0; i < sizeof vectors / sizeof vectors[0]; i++) {
        uint16_t address;
        if (!board_symbol(board, vectors[i], &address))
            continue; /* it has one of two names */
        image_send("m1000000vc100a10d10\r");
        image_sent();
        TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_to_pc(board, address, SECOND));
        assert_hang_ends_in_a_reset();
        hung++;
    }
    TEST_ASSERT_EQUAL_UINT(2, hung);
}

static void test_a_hang_at_rest_is_reported(void)
{
    image_prompt();
    image_run(300 * MS);
    assert_hang_ends_in_a_reset();
}

static void test_a_hang_in_the_window_is_reported(void)
{
    image_run(400 * MS);
    assert_hang_ends_in_a_reset();
}

/* Ten hangs leave as many reports, and no more resets than that. */
static void test_a_unit_that_hangs_again_and_again_is_there_in_between(void)
{
    image_prompt();
    uint16_t poll_at;
    TEST_ASSERT_TRUE(board_symbol(board, "engine_poll", &poll_at));
    for (unsigned i = 0; i < 10; i++) {
        /* In the main loop: a program cannot hang in the time base's interrupt, which would then be entered anew. */
        board_run_to_pc(board, poll_at, SECOND);
        assert_hang_ends_in_a_reset();
    }
    board_reset(board, BOARD_RESET_EXTERNAL);
    board_uart_clear(board);
    image_run(1500 * MS);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, times_printed("?17"), "an external reset is none by the watchdog");
}

/* AUT-007 */
static void test_the_position_does_not_outlast_a_loss_of_power(void)
{
    image_prompt();
    image_do("m37v300");
    image_idle(LONG_WAIT);
    TEST_ASSERT_EQUAL(37, image_position());
    image_do("qs");
    image_run(SECOND);
    image_off();
    image_power_on();
    image_prompt();
    TEST_ASSERT_EQUAL(0, image_position());
    image_assert_no_pulse_for(SECOND);
}

static void test_neither_sleep_nor_silence_nor_work_sets_the_watchdog_off(void)
{
    image_prompt();
    image_run(20 * SECOND);
    TEST_ASSERT_EQUAL_STRING("", image_take_text());
    image_do("m4vc5000000a999d999"); /* a pulse in 5 s */
    image_idle(LONG_WAIT);
    image_assert_pulses(4);
    image_train_clear();
    image_do("m1000vc30a999d999t3000000");
    image_idle(LONG_WAIT);
    image_assert_pulses(1000);
    image_train_clear();
    image_do("m200000vc10a10d10");
    image_idle(LONG_WAIT);
    image_assert_pulses(200000);
    (void)image_position();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_version_line_is_the_first_that_is_sent);
    RUN_TEST(test_a_second_passes_before_the_first_prompt);
    RUN_TEST(test_escape_three_times_in_the_window_restores_the_factory_settings);
    RUN_TEST(test_escapes_far_apart_and_other_bytes_around_them_restore_too);
    RUN_TEST(test_anything_else_in_the_window_restores_nothing);
    RUN_TEST(test_a_damaged_byte_in_the_window_does_not_count);
    RUN_TEST(test_escapes_after_the_window_restore_nothing);
    RUN_TEST(test_lines_typed_in_the_window_are_executed_after_it);
    RUN_TEST(test_a_flood_in_the_window_restores_nothing_and_leaves_the_unit_at_work);
    RUN_TEST(test_rst_held_low_at_power_on_restores_the_factory_settings);
    RUN_TEST(test_rst_open_or_low_for_a_moment_restores_nothing);
    RUN_TEST(test_rst_has_no_effect_in_the_window_and_in_motion);
    RUN_TEST(test_after_a_brown_out_its_cause_is_reported_and_nothing_moves);
    RUN_TEST(test_after_a_watchdog_reset_its_cause_is_reported_and_nothing_moves);
    RUN_TEST(test_after_them_nothing_restores);
    RUN_TEST(test_a_hang_in_motion_stops_the_motor_and_is_reported);
    RUN_TEST(test_a_hang_in_an_interrupt_stops_the_motor_and_is_reported);
    RUN_TEST(test_a_hang_at_rest_is_reported);
    RUN_TEST(test_a_hang_in_the_window_is_reported);
    RUN_TEST(test_a_unit_that_hangs_again_and_again_is_there_in_between);
    RUN_TEST(test_the_position_does_not_outlast_a_loss_of_power);
    RUN_TEST(test_neither_sleep_nor_silence_nor_work_sets_the_watchdog_off);
    return UNITY_END();
}
