/* cli/commands: the table, and what each command does. */
#include "cli/commands.h"
#include "cli/range.h"
#include <string.h>
#include "cli/display.h"
#include "cli/network.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "unity.h"

void setUp(void)
{
    terminal_port_fake_reset();
    engine_fake_reset();
    commands_init();
    network_init();
    queue_init();
    display_init();
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
static void test_b_toggles_debug_mode(void)
{
    TEST_ASSERT_FALSE(commands_debugging());
    execute("b");
    TEST_ASSERT_TRUE(commands_debugging());
    execute("B");
    TEST_ASSERT_FALSE(commands_debugging());
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
    assert_refused(STATUS_RANGE, "m5u256");
    TEST_ASSERT_EQUAL_STRING("0..255", range_text(range_refused()));
}

/* `$` stops first, as it must; nothing else changes. */
static void test_a_wrong_ramp_number_is_refused_with_the_range(void)
{
    const session_t before = session;
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$L2"));
    TEST_ASSERT_EQUAL_STRING("0..1", range_text(range_refused()));
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$L10"));
    TEST_ASSERT_EQUAL(STATUS_SYNTAX, execute("$Lx"));
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof before);
}

/* NET-009, NET-015: what is sent, and when, is shown by test_network.c. */
static void test_a_line_with_an_address_is_not_executed_here(void)
{
    assert_refused(STATUS_WAIT, "86m200"); /* the bus has been silent for no time at all */
    assert_refused(STATUS_WAIT, "0m200");
    assert_refused(STATUS_SYNTAX, "0");
    assert_refused(STATUS_SYNTAX, "85");
    assert_refused(STATUS_RANGE, "256m200");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "99999999999m200");
    assert_refused(STATUS_NOBODY, "/m200");
    assert_refused(STATUS_NOBODY, "\\m200");
}

/* NET-010, A-NET-08 */
static void test_a_line_with_the_own_address_is_executed_here(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, execute("85m300v50"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(300, engine_fake.submitted[0].count);
    assert_refused(STATUS_SYNTAX, "85m200k");
}

/* OPS-006, SYS-006, SYS-007, SYS-013 */
static void test_options_of_the_session_are_switched(void)
{
    static const struct {
        const char *line;
        uint8_t option;
        bool on;
    } switched[] = {{"$O1", SESSION_SOFT_OPS, true}, {"$O", SESSION_SOFT_OPS, true}, {"$O0", SESSION_SOFT_OPS, false},
                    {"$H0", SESSION_CRC, false},     {"$H", SESSION_CRC, true},      {"$H0", SESSION_CRC, false},
                    {"$H5", SESSION_CRC, true},      {"$K0", SESSION_ACK, false},    {"$K", SESSION_ACK, true}};
    for (size_t i = 0; i < sizeof switched / sizeof switched[0]; i++) {
        const uint8_t others = session.options & (uint8_t)~switched[i].option;
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, execute(switched[i].line), switched[i].line);
        TEST_ASSERT_EQUAL_HEX8(others | (switched[i].on ? switched[i].option : 0), session.options);
    }
    TEST_ASSERT_EQUAL(STATUS_RANGE, execute("$O2"));
    TEST_ASSERT_EQUAL(STATUS_SYNTAX, execute("$Kx"));
}

/* What the engine is offered is begun, and its count told; 0: there is nothing. */
static uint32_t begin_next(void)
{
    queue_poll();
    if (engine_fake.offered == NULL) {
        return 0;
    }
    const uint32_t count = engine_fake.offered->count;
    engine_fake_begin();
    queue_poll();
    return count;
}

/* Entries 1, 2, 3 ... of 1, 2, 3 ... steps, without motion. */
static void number_the_entries(void)
{
    engine_fake.accepts = false;
    for (unsigned i = 1; i <= 30; i++) {
        char line[16];
        sprintf(line, "q%um%u", i, i);
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, execute(line), line);
    }
}

/* LOO-001, LOO-002, LOO-007, LOO-011, LOO-012 */
static void test_loops_are_set_up_by_l_and_a_letter(void)
{
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_OK, execute("LN2"));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("ls9"));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("Lf10"));
    static const uint32_t order[] = {9, 10, 9, 10, 0};
    for (unsigned i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_UINT32(order[i], begin_next());
    }
    TEST_ASSERT_EQUAL(STATUS_OK, execute("LA"));
    for (uint32_t i = 1; i <= 30; i++) {
        TEST_ASSERT_EQUAL_UINT32(i, begin_next());
    }
    TEST_ASSERT_EQUAL(STATUS_OK, execute("l"));
    TEST_ASSERT_EQUAL_UINT32(0, begin_next());
}

/* XRF-001, XRF-006, XRF-010, XRF-011, THR-001 */
static void test_xref_executes_entries_and_its_array(void)
{
    number_the_entries();
    TEST_ASSERT_EQUAL(STATUS_OK, execute("x7"));
    TEST_ASSERT_EQUAL_UINT32(7, begin_next());
    assert_refused(STATUS_RANGE, "x0");
    assert_refused(STATUS_RANGE, "x31");
    assert_refused(STATUS_ARRAY_EMPTY, "xl");
    assert_refused(STATUS_ARRAY_EMPTY, "l2");
    TEST_ASSERT_EQUAL(STATUS_OK, execute("xp"));
    TEST_ASSERT_EQUAL_STRING("X>", commands_prompt());
    static const char *const entries[] = {"0,4", "1,2", "2,0"};
    for (unsigned i = 0; i < 3; i++) {
        while (display_poll()) {
            terminal_port_fake_drain(31);
        }
        TEST_ASSERT_EQUAL(STATUS_OK, execute(entries[i]));
    }
    TEST_ASSERT_EQUAL(STATUS_OK, execute("x"));
    TEST_ASSERT_EQUAL_STRING("SAC>", commands_prompt());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("l2"));
    static const uint32_t order[] = {4, 2, 4, 2, 0};
    for (unsigned i = 0; i < 5; i++) {
        TEST_ASSERT_EQUAL_UINT32(order[i], begin_next());
    }
    TEST_ASSERT_EQUAL(STATUS_OK, execute("XL"));
    for (unsigned i = 0; i < 100; i++) {
        TEST_ASSERT_EQUAL_UINT32(order[i % 2], begin_next());
    }
}

/* THR-003, THR-004, THR-005 */
static void test_a_one_shot_takes_the_session_defaults_and_leaves_them(void)
{
    execute("v50");
    const session_t before = session;
    TEST_ASSERT_EQUAL(STATUS_OK, execute("xm100a5"));
    TEST_ASSERT_EQUAL_UINT32(100, engine_fake.submitted[0].count);
    TEST_ASSERT_EQUAL_UINT32(50, engine_fake.submitted[0].velocity);
    TEST_ASSERT_EQUAL_UINT16(500, engine_fake.submitted[0].accel);
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof before);
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
}

/* CON-001, CON-004, CON-005, CON-006 */
static void test_what_continuous_motion_names_it_keeps_for_itself(void)
{
    const session_t before = session;
    TEST_ASSERT_EQUAL(STATUS_OK, execute("m-v120a.8d1.2"));
    TEST_ASSERT_EQUAL_UINT32(0, engine_fake.submitted[0].count);
    TEST_ASSERT_EQUAL_UINT32(120, engine_fake.submitted[0].velocity);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CCW, engine_fake.submitted[0].flags & MOTION_CCW);
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof before);
    TEST_ASSERT_EQUAL_UINT8(1, queue_next_position());
    /* A velocity of its own persists, and is followed. */
    TEST_ASSERT_EQUAL(STATUS_OK, execute("v70"));
    TEST_ASSERT_EQUAL_UINT32(70, session.velocity);
    TEST_ASSERT_EQUAL_UINT32(70, engine_fake.submitted[1].velocity);
    TEST_ASSERT_EQUAL_UINT32(0, engine_fake.submitted[1].count);
}

/* QUE-022, QUE-023, QUE-024, QUE-025, QUE-026, QUE-031 */
static void test_entries_are_edited_in_program_mode_and_out_of_it(void)
{
    const session_t before = session;
    TEST_ASSERT_EQUAL(STATUS_OK, execute("QP"));
    TEST_ASSERT_EQUAL_STRING("Q>", commands_prompt());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("8m2000"));
    TEST_ASSERT_EQUAL_UINT32(2000, queue_entry(8)->count);
    assert_refused(STATUS_RANGE, "0m5");
    assert_refused(STATUS_SYNTAX, "m200");
    assert_refused(STATUS_SYNTAX, "ls1");
    assert_refused(STATUS_SYNTAX, "y");
    TEST_ASSERT_FALSE(commands_at_once('+'));
    TEST_ASSERT_EQUAL(STATUS_OK, execute("X"));
    TEST_ASSERT_EQUAL_STRING("SAC>", commands_prompt());
    TEST_ASSERT_EQUAL(STATUS_OK, execute("q9v60"));
    TEST_ASSERT_EQUAL_UINT32(60, queue_entry(9)->velocity);
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof before);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
}

/* THR-001, LOO-003 */
static void test_numbers_of_positions_are_checked(void)
{
    static const char *const out_of_range[] = {"q0m200", "q31m200", "ls0", "lf31", "ln65536", "l65536", "x99"};
    for (unsigned i = 0; i < sizeof out_of_range / sizeof out_of_range[0]; i++) {
        assert_refused(STATUS_RANGE, out_of_range[i]);
    }
    assert_refused(STATUS_NUMBER_MISSING, "ls");
    assert_refused(STATUS_SYNTAX, "lsx");
    assert_refused(STATUS_SYNTAX, "ls5x");
    assert_refused(STATUS_SYNTAX, "xk");
    assert_refused(STATUS_SYNTAX, "qk");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "l4294967296");
    TEST_ASSERT_EQUAL(STATUS_OK, execute("ls5"));
    assert_refused(STATUS_LOOP_BOUNDS, "lf5");
}

/* SYN-002, SYN-008 */
static void test_y_in_lower_case_releases(void)
{
    TEST_ASSERT_EQUAL(STATUS_UNKNOWN_COMMAND, execute("Y"));
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.releases);
    TEST_ASSERT_EQUAL(STATUS_OK, execute("y"));
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.releases);
}

/* TRM-012 */
static void test_z_takes_back_the_last_edit(void)
{
    execute("q9v60");
    TEST_ASSERT_EQUAL(STATUS_OK, execute("Z"));
    TEST_ASSERT_EQUAL_UINT32(3000, queue_entry(9)->velocity);
    assert_refused(STATUS_NOTHING_TO_UNDO, "z");
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
    RUN_TEST(test_b_toggles_debug_mode);
    RUN_TEST(test_dollar_l_selects_the_ramp_and_its_defaults);
    RUN_TEST(test_dollar_f_p_and_u_select_steps_or_pulses);
    RUN_TEST(test_a_system_command_ends_all_activity_even_if_it_is_refused);
    RUN_TEST(test_case_matters_where_the_manual_says_so);
    RUN_TEST(test_each_wrong_line_is_refused_and_changes_nothing);
    RUN_TEST(test_a_wrong_ramp_number_is_refused_with_the_range);
    RUN_TEST(test_a_line_with_an_address_is_not_executed_here);
    RUN_TEST(test_a_line_with_the_own_address_is_executed_here);
    RUN_TEST(test_options_of_the_session_are_switched);
    RUN_TEST(test_loops_are_set_up_by_l_and_a_letter);
    RUN_TEST(test_xref_executes_entries_and_its_array);
    RUN_TEST(test_a_one_shot_takes_the_session_defaults_and_leaves_them);
    RUN_TEST(test_what_continuous_motion_names_it_keeps_for_itself);
    RUN_TEST(test_entries_are_edited_in_program_mode_and_out_of_it);
    RUN_TEST(test_numbers_of_positions_are_checked);
    RUN_TEST(test_y_in_lower_case_releases);
    RUN_TEST(test_z_takes_back_the_last_edit);
    RUN_TEST(test_a_space_ends_the_command_and_a_leading_one_makes_it_blank);
    RUN_TEST(test_too_many_displays_at_once_are_refused);
    return UNITY_END();
}
