/* cli/commands: the table, and what each command does. */
#include "cli/commands.h"
#include <string.h>
#include "cli/display.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "queue/ops.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "unity.h"

void setUp(void)
{
    terminal_port_fake_reset();
    engine_fake_reset();
    commands_init();
    queue_init();
    display_init();
    timebase_fake_running = false;
}

void tearDown(void)
{
}

static status_t execute(const char *text)
{
    return commands_execute(text, (uint8_t)strlen(text));
}

static void finish_displays(void)
{
    while (display_poll()) {
    }
}

/* Everything that a refused line must leave as it is. */
typedef struct {
    session_t session;
    motion_command_t entries[QUEUE_POSITIONS];
    uint8_t next, pending;
    engine_fake_t engine;
} everything_t;

static void look(everything_t *all)
{
    memset(all, 0, sizeof *all);
    all->session = session;
    for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
        all->entries[i] = *queue_entry(i);
    }
    all->next = queue_next_position();
    all->pending = queue_pending();
    all->engine = engine_fake;
}

static void assert_refused(status_t expected, const char *text)
{
    static everything_t before, after;
    look(&before);
    TEST_ASSERT_EQUAL_MESSAGE(expected, execute(text), text);
    look(&after);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &after, sizeof before, text);
    TEST_ASSERT_FALSE(display_active());
}

/* MOT-005, MOT-006 */
static void test_a_motion_command_is_stored_and_pending(void)
{
    engine_fake.accepts = false;
    TEST_ASSERT_EQUAL(STATUS_OK, execute("m200v50"));
    TEST_ASSERT_EQUAL_UINT8(1, queue_pending());
    TEST_ASSERT_EQUAL_UINT32(200, queue_entry(1)->count);
    TEST_ASSERT_EQUAL_UINT32(50, queue_entry(1)->velocity);
    TEST_ASSERT_EQUAL_UINT32(50, session.velocity);
}

/* MOT-006 */
static void test_a_motion_command_is_handed_to_an_idle_engine_at_once(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("m200"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
}

static void test_a_line_read_ahead_is_the_same_as_one_read_at_its_end(void)
{
    const char *text = "m-1200vc4321a2.5d999l0u3t77p";
    execute(text);
    const motion_command_t expected = *queue_entry(1);
    session_init();
    for (uint8_t length = 1; length <= strlen(text); length++) {
        commands_read_ahead(text, length);
    }
    TEST_ASSERT_EQUAL(STATUS_OK, execute(text));
    TEST_ASSERT_EQUAL_MEMORY(&expected, queue_entry(2), sizeof expected);
}

static void test_characters_taken_back_are_forgotten_by_the_reading_ahead(void)
{
    commands_read_ahead("m999k", 5);
    commands_read_ahead("m99", 3);
    commands_read_ahead("m", 1);
    commands_read_ahead("m2", 2);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("m25"));
    TEST_ASSERT_EQUAL_UINT32(25, queue_entry(1)->count);
    commands_read_ahead("m7777", 5);
    commands_read_ahead("", 0);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("m8"));
    TEST_ASSERT_EQUAL_UINT32(8, queue_entry(2)->count);
}

/* A refused motion command, and the session that it would have set. */
static void test_a_full_queue_refuses_the_command_and_its_session_values(void)
{
    engine_fake.accepts = false;
    for (int i = 0; i < 30; i++) {
        TEST_ASSERT_EQUAL(STATUS_OK, execute("m5"));
    }
    assert_refused(STATUS_QUEUE_FULL, "m200v77a5l1p");
}

/* VEL-005, ACC-001, ACC-008 */
static void test_v_vc_a_and_d_alone_change_the_session_and_move_nothing(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("v120"));
    TEST_ASSERT_EQUAL_UINT32(120, session.velocity);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("VC4000 and a remark"));
    TEST_ASSERT_EQUAL_UINT32(4000, session.velocity);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("a1.5"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("D2"));
    TEST_ASSERT_EQUAL_UINT16(150, session.accel);
    TEST_ASSERT_EQUAL_UINT16(200, session.decel);
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
}

/* TRM-004, STO-001, STO-004 */
static void test_capital_s_stops_now_and_small_s_with_the_session_deceleration(void)
{
    execute("$L1");
    execute("d2.5");
    engine_fake.stops = 0;
    TEST_ASSERT_EQUAL(STATUS_OK, execute("s"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops_graceful);
    TEST_ASSERT_EQUAL_UINT16(250, engine_fake.graceful_decel);
    TEST_ASSERT_TRUE(engine_fake.graceful_linear);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.stops);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("S"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops_graceful);
}

/* STO-002, STO-003 */
static void test_both_stops_drop_what_is_pending(void)
{
    engine_fake.accepts = false;
    execute("m100");
    execute("s");
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
    execute("m100");
    execute("S");
    TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
    TEST_ASSERT_EQUAL_UINT8(3, queue_next_position());
}

/* NXT-001, NXT-002, TRM-004 */
static void test_capital_n_is_next_now_and_small_n_next_with_grace(void)
{
    execute("N");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts);
    execute("n");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts_graceful);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.nexts);
}

/* PUL-001, PUL-006 */
static void test_plus_and_minus_give_one_pulse_each_and_leave_the_queue(void)
{
    TEST_ASSERT_TRUE(commands_at_once('+'));
    TEST_ASSERT_TRUE(commands_at_once('+'));
    TEST_ASSERT_TRUE(commands_at_once('-'));
    TEST_ASSERT_FALSE(commands_at_once('m'));
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.pulses_cw);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.pulses_ccw);
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
}

/* GAP-002 */
static void test_g_toggles_gap_testing(void)
{
    execute("g");
    TEST_ASSERT_FALSE(engine_fake.gap);
    execute("G");
    TEST_ASSERT_TRUE(engine_fake.gap);
}

/* TRM-008 */
static void test_b_toggles_debug_mode_and_its_clock(void)
{
    TEST_ASSERT_FALSE(commands_debugging());
    execute("b");
    TEST_ASSERT_TRUE(commands_debugging());
    TEST_ASSERT_TRUE(timebase_fake_running);
    execute("B");
    TEST_ASSERT_FALSE(commands_debugging());
    TEST_ASSERT_FALSE(timebase_fake_running);
}

/* LIN-012, LIN-013, SYS-008 */
static void test_dollar_l_selects_the_ramp_and_its_defaults(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$L1"));
    TEST_ASSERT_TRUE(session.flags & MOTION_LINEAR);
    TEST_ASSERT_EQUAL_UINT16(1047, session.accel);
    execute("a5");
    execute("a");
    TEST_ASSERT_EQUAL_UINT16(1047, session.accel);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$L"));
    TEST_ASSERT_TRUE(session.flags & MOTION_LINEAR);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$L0 "));
    TEST_ASSERT_FALSE(session.flags & MOTION_LINEAR);
    TEST_ASSERT_EQUAL_UINT16(100, session.accel);
}

/* STP-006..STP-008, SYS-005 */
static void test_dollar_f_p_and_u_select_steps_or_pulses(void)
{
    execute("$P");
    TEST_ASSERT_TRUE(session.flags & MOTION_PULSES);
    execute("m100");
    TEST_ASSERT_TRUE(queue_entry(1)->flags & MOTION_PULSES);
    execute("$F");
    TEST_ASSERT_FALSE(session.flags & MOTION_PULSES);
    execute("$U");
    TEST_ASSERT_TRUE(session.flags & MOTION_PULSES);
    execute("$U");
    TEST_ASSERT_FALSE(session.flags & MOTION_PULSES);
}

/* SYS-002 */
static void test_a_system_command_ends_all_activity_even_if_it_is_refused(void)
{
    static const char *const lines[] = {"$L1", "$L", "$L2", "$F", "$R", "$?", "$"};
    engine_fake.accepts = false;
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        execute("m100");
        execute(lines[i]);
        TEST_ASSERT_EQUAL_UINT(i + 1, engine_fake.stops);
        TEST_ASSERT_EQUAL_UINT8(0, queue_pending());
    }
}

/* SYS-001, TRM-004 */
static void test_case_matters_where_the_manual_says_so(void)
{
    TEST_ASSERT_EQUAL(STATUS_UNKNOWN_COMMAND, execute("$l1"));
    TEST_ASSERT_EQUAL(STATUS_UNKNOWN_COMMAND, execute("$f"));
    TEST_ASSERT_EQUAL(STATUS_UNKNOWN_COMMAND, execute("Y"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("M5"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("V50"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("CF"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("vD"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("Q"));
}

static void test_each_wrong_line_is_refused_and_changes_nothing(void)
{
    assert_refused(STATUS_UNKNOWN_COMMAND, "k");
    assert_refused(STATUS_UNKNOWN_COMMAND, "hello");
    assert_refused(STATUS_UNKNOWN_COMMAND, "\xE9");
    assert_refused(STATUS_SYNTAX, "m200k5");
    assert_refused(STATUS_SYNTAX, "g5");
    assert_refused(STATUS_SYNTAX, "S5");
    assert_refused(STATUS_SYNTAX, "vd5");
    assert_refused(STATUS_SYNTAX, "??");
    assert_refused(STATUS_NUMBER_MISSING, "vc");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "m4294967296");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "vc1");
    assert_refused(STATUS_VELOCITY_ZERO, "v0");
    assert_refused(STATUS_NOT_YET, "m");
    assert_refused(STATUS_RANGE, "m5u256");
    TEST_ASSERT_EQUAL_STRING("0..255", commands_refused_range());
}

/* `$` stops first, as it must; nothing else changes. */
static void test_a_wrong_ramp_number_is_refused_with_the_range(void)
{
    const session_t before = session;
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$L2"));
    TEST_ASSERT_EQUAL_STRING("0..1", commands_refused_range());
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$L10"));
    TEST_ASSERT_EQUAL(STATUS_SYNTAX, execute("$Lx"));
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof before);
}

/* TRM-006 */
static void test_a_line_that_begins_with_a_number_is_not_executed(void)
{
    assert_refused(STATUS_NOT_YET, "85m200");
    assert_refused(STATUS_NOT_YET, "0");
}

static void test_commands_of_later_versions_say_that_they_are_not_available(void)
{
    static const char *const lines[] = {"x", "xm200", "x3", "l", "L5", "ls1", "z", "cc", "qs", "q9m200"};
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        assert_refused(STATUS_NOT_YET, lines[i]);
    }
    TEST_ASSERT_EQUAL(STATUS_NOT_YET, execute("$R"));
    TEST_ASSERT_EQUAL(STATUS_NOT_YET, execute("$Cb2000"));
}

/* SYN-002, SYN-008 */
static void test_y_releases_what_is_held(void)
{
    assert_refused(STATUS_UNKNOWN_COMMAND, "Y");
    TEST_ASSERT_EQUAL(0, engine_fake.releases);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("y"));
    TEST_ASSERT_EQUAL(1, engine_fake.releases);
}

/* OPS-006, SYS-010 */
static void test_soft_ops_are_switched_for_the_session(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$O1"));
    TEST_ASSERT_TRUE(ops_soft());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$O"));
    TEST_ASSERT_TRUE(ops_soft());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("$O0"));
    TEST_ASSERT_FALSE(ops_soft());
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$O2"));
}

/* EST-001: motion is refused while Estop is active */
static void test_while_estop_is_active_no_motion_is_accepted(void)
{
    engine_fake.estop = true;
    TEST_ASSERT_EQUAL(STATUS_ESTOP, execute("m200"));
    TEST_ASSERT_EQUAL(0, queue_pending());
    TEST_ASSERT_EQUAL(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("v50"));
}

/* TRM-005, TRM-017 */
static void test_a_space_ends_the_command_and_a_leading_one_makes_it_blank(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("v50 junk"));
    TEST_ASSERT_EQUAL_UINT32(50, session.velocity);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("g junk"));
    TEST_ASSERT_FALSE(engine_fake.gap);
    assert_refused(STATUS_OK, "");
    assert_refused(STATUS_OK, " m200");
}

static void test_too_many_displays_at_once_are_refused(void)
{
    for (int i = 0; i < 1 + DISPLAY_WAITING; i++) {
        TEST_ASSERT_EQUAL(STATUS_OK, execute("vd"));
    }
    TEST_ASSERT_EQUAL(STATUS_BUSY, execute("q"));
    finish_displays();
    TEST_ASSERT_EQUAL(STATUS_OK, execute("q"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_motion_command_is_stored_and_pending);
    RUN_TEST(test_a_motion_command_is_handed_to_an_idle_engine_at_once);
    RUN_TEST(test_a_line_read_ahead_is_the_same_as_one_read_at_its_end);
    RUN_TEST(test_characters_taken_back_are_forgotten_by_the_reading_ahead);
    RUN_TEST(test_a_full_queue_refuses_the_command_and_its_session_values);
    RUN_TEST(test_v_vc_a_and_d_alone_change_the_session_and_move_nothing);
    RUN_TEST(test_capital_s_stops_now_and_small_s_with_the_session_deceleration);
    RUN_TEST(test_both_stops_drop_what_is_pending);
    RUN_TEST(test_capital_n_is_next_now_and_small_n_next_with_grace);
    RUN_TEST(test_plus_and_minus_give_one_pulse_each_and_leave_the_queue);
    RUN_TEST(test_g_toggles_gap_testing);
    RUN_TEST(test_b_toggles_debug_mode_and_its_clock);
    RUN_TEST(test_dollar_l_selects_the_ramp_and_its_defaults);
    RUN_TEST(test_dollar_f_p_and_u_select_steps_or_pulses);
    RUN_TEST(test_a_system_command_ends_all_activity_even_if_it_is_refused);
    RUN_TEST(test_case_matters_where_the_manual_says_so);
    RUN_TEST(test_each_wrong_line_is_refused_and_changes_nothing);
    RUN_TEST(test_a_wrong_ramp_number_is_refused_with_the_range);
    RUN_TEST(test_a_line_that_begins_with_a_number_is_not_executed);
    RUN_TEST(test_commands_of_later_versions_say_that_they_are_not_available);
    RUN_TEST(test_y_releases_what_is_held);
    RUN_TEST(test_soft_ops_are_switched_for_the_session);
    RUN_TEST(test_while_estop_is_active_no_motion_is_accepted);
    RUN_TEST(test_a_space_ends_the_command_and_a_leading_one_makes_it_blank);
    RUN_TEST(test_too_many_displays_at_once_are_refused);
    return UNITY_END();
}
