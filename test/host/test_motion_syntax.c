/* cli/motion_syntax: motion commands and the single values v, vc, a, d. */
#include "cli/motion_syntax.h"
#include "cli/range.h"
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "host/fakes/engine_fake.h"
#include "settings.h"
#include "unity.h"

static settings_t factory;
static motion_syntax_t syntax;
static session_t defaults;
static const motion_command_t *const command = &syntax.command;

void setUp(void)
{
    factory = settings;
    session_init();
    defaults = session;
}

void tearDown(void)
{
    settings = factory;
}

static status_t read(const char *text)
{
    motion_syntax_begin(&syntax, text[0], &defaults);
    for (const char *c = text + 1; *c != '\0'; c++) {
        motion_syntax_take(&syntax, *c);
    }
    const status_t status = motion_syntax_end(&syntax);
    if (status == STATUS_OK) {
        motion_syntax_keep(&syntax, &defaults);
    }
    return status;
}

/* Reads a text that must be refused, and that the session defaults are as before. */
static void assert_refused(status_t expected, const char *text)
{
    const session_t before = defaults;
    TEST_ASSERT_EQUAL_MESSAGE(expected, read(text), text);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &defaults, sizeof before, text);
}

static void assert_refused_range(const char *range, const char *text)
{
    assert_refused(STATUS_RANGE, text);
    TEST_ASSERT_EQUAL_STRING(range, range_text(range_refused()));
}

/* MOT-001, MOT-007 */
static void test_a_count_alone_takes_everything_else_from_the_session(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200"));
    TEST_ASSERT_EQUAL_UINT32(200, command->count);
    TEST_ASSERT_EQUAL_UINT32(3000, command->velocity);
    TEST_ASSERT_EQUAL_UINT16(100, command->accel);
    TEST_ASSERT_EQUAL_UINT16(100, command->decel);
    TEST_ASSERT_EQUAL_UINT32(0, command->start_wait_us);
    TEST_ASSERT_EQUAL_UINT8(0, command->extra_pulses);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE, command->flags);
}

/* MOT-002, MOT-011 */
static void test_one_command_can_give_every_parameter(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m-2000vc1500a1.25d.5l1u6t50000sp"));
    TEST_ASSERT_EQUAL_UINT32(2000, command->count);
    TEST_ASSERT_EQUAL_UINT32(1500, command->velocity);
    TEST_ASSERT_EQUAL_UINT16(125, command->accel);
    TEST_ASSERT_EQUAL_UINT16(50, command->decel);
    TEST_ASSERT_EQUAL_UINT8(6, command->extra_pulses);
    TEST_ASSERT_EQUAL_UINT32(50000, command->start_wait_us);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CCW | MOTION_CYCLE | MOTION_LINEAR | MOTION_SYNC | MOTION_PULSES, command->flags);
}

/* MOT-003 */
static void test_parameters_may_come_in_any_order(void)
{
    static const char *const parameters[] = {"v150", "a1.5", "d2", "l1", "u7", "t300", "s", "p"};
    enum { N = 8 };
    TEST_ASSERT_EQUAL(STATUS_OK, read("m400v150a1.5d2l1u7t300sp"));
    const motion_command_t expected = *command;
    srand(1);
    for (int round = 0; round < 2000; round++) {
        int order[N];
        for (int i = 0; i < N; i++) {
            const int j = rand() % (i + 1);
            order[i] = order[j];
            order[j] = i;
        }
        char text[80] = "m400";
        for (int i = 0; i < N; i++) {
            strcat(text, parameters[order[i]]);
        }
        session_init();
        defaults = session;
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, read(text), text);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expected, command, sizeof expected, text);
    }
}

/* MOT-004 */
static void test_upper_and_lower_case_are_the_same(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m-200vc1000a1d2l0u3t4sp"));
    const motion_command_t expected = *command;
    TEST_ASSERT_EQUAL(STATUS_OK, read("M-200VC1000A1D2L0U3T4SP"));
    TEST_ASSERT_EQUAL_MEMORY(&expected, command, sizeof expected);
}

/* MOT-010 */
static void test_the_manuals_example_reads_as_it_says(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m3000a2d1"));
    TEST_ASSERT_EQUAL_UINT32(3000, command->count);
    TEST_ASSERT_EQUAL_UINT16(200, command->accel);
    TEST_ASSERT_EQUAL_UINT16(100, command->decel);
    TEST_ASSERT_FALSE(command->flags & MOTION_CCW);
}

/* DIR-001 */
static void test_the_sign_decides_the_direction_whatever_the_default(void)
{
    for (uint8_t direction = 0; direction < 2; direction++) {
        settings.direction = direction;
        TEST_ASSERT_EQUAL(STATUS_OK, read("m200"));
        TEST_ASSERT_FALSE(command->flags & MOTION_CCW);
        TEST_ASSERT_EQUAL(STATUS_OK, read("m-200"));
        TEST_ASSERT_TRUE(command->flags & MOTION_CCW);
    }
}

/* TRM-005 */
static void test_a_space_ends_the_command(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200v50 v60 ?! 999999999999"));
    TEST_ASSERT_EQUAL_UINT32(200, command->count);
    TEST_ASSERT_EQUAL_UINT32(50, command->velocity);
}

/* MOT-008, VEL-006, ACC-009 */
static void test_velocity_ramp_and_kind_of_count_become_session_defaults(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200v120a1.2d3l1p"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("m300"));
    TEST_ASSERT_EQUAL_UINT32(120, command->velocity);
    TEST_ASSERT_EQUAL_UINT16(120, command->accel);
    TEST_ASSERT_EQUAL_UINT16(300, command->decel);
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_PULSES, command->flags);
    TEST_ASSERT_EQUAL(STATUS_OK, read("m300f"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("m300"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR, command->flags);
}

/* MOT-009, SWT-004 */
static void test_count_sync_wait_and_extra_pulses_do_not(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m-200st500u9"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200"));
    TEST_ASSERT_EQUAL_UINT32(0, command->start_wait_us);
    TEST_ASSERT_EQUAL_UINT8(0, command->extra_pulses);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE, command->flags);
}

static void test_the_last_of_two_equal_parameters_wins(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200v50vc2000v60a1a2s1s0fpf"));
    TEST_ASSERT_EQUAL_UINT32(60, command->velocity);
    TEST_ASSERT_EQUAL_UINT16(200, command->accel);
    TEST_ASSERT_EQUAL_HEX8(0, command->flags);
}

static void test_missing_numbers_have_their_meaning(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200v77"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200vltus"));
    TEST_ASSERT_EQUAL_UINT32(3000, command->velocity);
    TEST_ASSERT_EQUAL_UINT32(0, command->start_wait_us);
    TEST_ASSERT_EQUAL_UINT8(0, command->extra_pulses);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE | MOTION_LINEAR | MOTION_SYNC, command->flags);
}

static void test_explicit_zeros_clear(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200l1"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200s1s0t5t0u5u0l0"));
    TEST_ASSERT_EQUAL_UINT32(0, command->start_wait_us);
    TEST_ASSERT_EQUAL_UINT8(0, command->extra_pulses);
    TEST_ASSERT_EQUAL_HEX8(MOTION_CYCLE, command->flags);
}

/* -- velocity --------------------------------------------------------------------------------------------------------- */

/* VEL-001, VEL-005 */
static void test_v_alone_sets_the_session_velocity_in_rpm(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("v120"));
    TEST_ASSERT_EQUAL_UINT32(120, defaults.velocity);
    TEST_ASSERT_FALSE(defaults.flags & MOTION_CYCLE);
}

/* VEL-002, VEL-003 */
static void test_vc_sets_it_as_a_cycle(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("v120"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("VC42567"));
    TEST_ASSERT_EQUAL_UINT32(42567, defaults.velocity);
    TEST_ASSERT_TRUE(defaults.flags & MOTION_CYCLE);
}

static void test_v_without_a_number_restores_the_system_default(void)
{
    settings.cycle_us = 2500;
    TEST_ASSERT_EQUAL(STATUS_OK, read("v120"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("v"));
    TEST_ASSERT_EQUAL_UINT32(2500, defaults.velocity);
    TEST_ASSERT_TRUE(defaults.flags & MOTION_CYCLE);
}

/* VEL-009 */
static void test_a_fraction_of_v_is_dropped(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("v65.9"));
    TEST_ASSERT_EQUAL_UINT32(65, defaults.velocity);
    TEST_ASSERT_EQUAL(STATUS_OK, read("m200v65.999999999999999a1"));
    TEST_ASSERT_EQUAL_UINT32(65, command->velocity);
    TEST_ASSERT_EQUAL_UINT16(100, command->accel);
}

/* VEL-010 */
static void test_velocities_from_below_1_to_above_2200_rpm_are_taken(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("vc600000"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("v2400"));
    TEST_ASSERT_EQUAL(STATUS_OK, read("vc4294967295"));
}

/* CLK-015 */
static void test_velocities_that_cannot_be_kept_are_refused(void)
{
    assert_refused(STATUS_VELOCITY_ZERO, "v0");
    assert_refused(STATUS_VELOCITY_ZERO, "v0.9");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "vc0");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "vc1");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "vc2"); /* the pulse of 2 us and 1 us of rest */
    assert_refused(STATUS_PERIOD_TOO_SHORT, "v4294967295");
    assert_refused(STATUS_VELOCITY_ZERO, "m200v0");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "m200vc1a5");
    assert_refused(STATUS_PERIOD_TOO_SHORT, "m200v200000d5");
    TEST_ASSERT_EQUAL(STATUS_OK, read("vc3"));
    settings.pulse_us = 1;
    TEST_ASSERT_EQUAL(STATUS_OK, read("vc2"));
    assert_refused(STATUS_PERIOD_TOO_SHORT, "vc1");
}

/* -- accel and decel -------------------------------------------------------------------------------------------------- */

/* ACC-001..ACC-003, ACC-005 */
static void test_ramp_values_have_two_decimals_below_100_and_none_from_100(void)
{
    static const struct {
        const char *text;
        accel_code_t code;
    } rows[] = {{"a1.234", 123},   {"a.8", 80},        {"a0.8", 80},     {"a1", 100},           {"a1.5", 150},
                {"a0.01", 1},      {"a99.99", 9999},   {"a99.999", 9999}, {"a100", 10000},       {"a150.7", 10050},
                {"a999", 10899},   {"a100.5", 10000},  {"a10.", 1000},   {"a007.50", 750},      {"a1.005", 100},
                {"a99", 9900},     {"a12.3", 1230}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, read(rows[i].text), rows[i].text);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(rows[i].code, defaults.accel, rows[i].text);
        char decel[16] = "m9d";
        strcat(decel, rows[i].text + 1);
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, read(decel), decel);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(rows[i].code, command->decel, decel);
    }
}

/* ACC-003 */
static void test_ramp_values_out_of_range_are_refused_with_the_range(void)
{
    assert_refused_range("0.01..999", "a1000");
    assert_refused_range("0.01..999", "d1000.5");
    assert_refused_range("0.01..999", "m200a4000000000");
    assert_refused_range("0.01..999", "a.001");
    assert_refused_range("0.01..999", "m200d0.009v50");
}

/* ACC-006 */
static void test_a_or_d_without_a_number_or_with_zero_restores_the_default_of_the_current_ramp(void)
{
    static const char *const texts[] = {"a", "a0", "a.00", "a0.0000"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        defaults.accel = 500;
        TEST_ASSERT_EQUAL(STATUS_OK, read(texts[i]));
        TEST_ASSERT_EQUAL_UINT16(100, defaults.accel);
    }
    session_set_linear(true);
    defaults = session;
    defaults.decel = 500;
    TEST_ASSERT_EQUAL(STATUS_OK, read("d"));
    TEST_ASSERT_EQUAL_UINT16(1047, defaults.decel);
}

/* ACC-007, LIN-011 */
static void test_defaults_are_those_of_the_ramp_the_command_ends_up_with(void)
{
    static const char *const texts[] = {"m4000v160l1ad", "m4000adl1v160", "m4000al1d", "m4000l1", "m4000a0l1"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        session_init();
        defaults = session;
        defaults.accel = 300;
        defaults.decel = 400;
        TEST_ASSERT_EQUAL(STATUS_OK, read(texts[i]));
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(1047, command->accel, texts[i]);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(1047, command->decel, texts[i]);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(1047, defaults.decel, texts[i]);
    }
}

/* LIN-013 */
static void test_a_given_ramp_replaces_only_what_the_command_does_not_give(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m4000a5l1"));
    TEST_ASSERT_EQUAL_UINT16(500, command->accel);
    TEST_ASSERT_EQUAL_UINT16(1047, command->decel);
    TEST_ASSERT_EQUAL(STATUS_OK, read("m4000l0d7"));
    TEST_ASSERT_EQUAL_UINT16(100, command->accel);
    TEST_ASSERT_EQUAL_UINT16(700, command->decel);
    TEST_ASSERT_EQUAL(STATUS_OK, read("m4000a5"));
    TEST_ASSERT_EQUAL_UINT16(700, command->decel);
}

/* ACC-001 */
static void test_a_ramp_value_alone_is_taken_even_where_the_velocity_would_be_refused(void)
{
    defaults.velocity = 1;
    TEST_ASSERT_EQUAL(STATUS_OK, read("a5"));
    TEST_ASSERT_EQUAL_UINT16(500, defaults.accel);
}

/* -- what is refused -------------------------------------------------------------------------------------------------- */

/* STP-004, SWT-003 */
static void test_numbers_are_taken_up_to_their_limit_and_refused_beyond(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, read("m4294967295u255t4294967295l1s1"));
    TEST_ASSERT_EQUAL_UINT32(4294967295u, command->count);
    TEST_ASSERT_EQUAL_UINT8(255, command->extra_pulses);
    TEST_ASSERT_EQUAL_UINT32(4294967295u, command->start_wait_us);
    assert_refused(STATUS_NUMBER_TOO_LARGE, "m4294967296");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "m200t4294967296");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "m200vc99999999999");
    assert_refused(STATUS_NUMBER_TOO_LARGE, "v4294967296");
    assert_refused_range("0..255", "m200u256");
    assert_refused_range("0..255", "m200v50u4294967295");
    assert_refused_range("0..1", "m200l2");
    assert_refused_range("0..1", "m200s2a5");
}

static void test_letters_and_signs_out_of_place_are_refused(void)
{
    static const char *const texts[] = {"m200k5",  "m200q",    "m--200", "m2-00",  "m200v-5", "m+200",   "m200.5",
                                        "m200c5",  "m200v5c5", "m200p1", "m200f0", "mm200",   "m200m5",  "m200a1.2.3",
                                        "m200t.5", "m200vc5.5", "m200!",  "m200[",  "m200`",   "m200\xE9", "m200\xFF",
                                        "v50a1",   "a5d5",     "v50x",   "a-1",    "v5l1",    "d5p",     "m200v5cv6"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        assert_refused(STATUS_SYNTAX, texts[i]);
    }
}

static void test_a_missing_number_is_refused_where_one_is_needed(void)
{
    assert_refused(STATUS_NUMBER_MISSING, "vc");
    assert_refused(STATUS_NUMBER_MISSING, "m200vc");
    assert_refused(STATUS_NUMBER_MISSING, "m200vca5");
    assert_refused(STATUS_NUMBER_MISSING, "a.");
    assert_refused(STATUS_NUMBER_MISSING, "m200d.u5");
}

/* CON-001, CON-014 */
static void test_a_motion_without_a_count_is_continuous(void)
{
    static const char *const lines[] = {"m", "m-", "m0", "m-0v50", "mv120a.8d1.2"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, read(lines[i]), lines[i]);
        TEST_ASSERT_EQUAL_UINT32(0, command->count);
        TEST_ASSERT_EQUAL_HEX8(lines[i][1] == '-' ? MOTION_CCW : 0, command->flags & MOTION_CCW);
    }
    assert_refused(STATUS_SYNTAX, "mv120k");
    assert_refused(STATUS_VELOCITY_ZERO, "mv0");
}

#define COMMAND_BYTES (offsetof(motion_command_t, flags) + 1) /* without the padding of this machine */

/* An entry that is edited, and what it is afterwards. */
static status_t edit(motion_command_t *entry, const char *text)
{
    motion_syntax_t edited;
    motion_syntax_begin_edit(&edited, entry);
    while (*text != '\0') {
        motion_syntax_take(&edited, *text++);
    }
    const status_t status = motion_syntax_end(&edited);
    if (status == STATUS_OK) {
        *entry = edited.command;
    }
    return status;
}

static const motion_command_t sample = {.count = 800,
                                        .velocity = 150,
                                        .start_wait_us = 3000,
                                        .accel = 1047,
                                        .decel = 500,
                                        .extra_pulses = 7,
                                        .flags = MOTION_LINEAR | MOTION_SYNC};

/* QUE-027, QUE-028: the manual's example */
static void test_an_edit_names_every_parameter(void)
{
    motion_command_t entry = sample;
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "m-2000vc1500a1d1l0pu0s0t0"));
    const motion_command_t expected = {.count = 2000,
                                       .velocity = 1500,
                                       .accel = 100,
                                       .decel = 100,
                                       .flags = MOTION_CCW | MOTION_PULSES | MOTION_CYCLE};
    TEST_ASSERT_EQUAL_MEMORY(&expected, &entry, COMMAND_BYTES);
}

/* QUE-029 */
static void test_an_edit_leaves_what_it_does_not_name(void)
{
    motion_command_t entry = sample;
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "a2"));
    motion_command_t expected = sample;
    expected.accel = 200;
    TEST_ASSERT_EQUAL_MEMORY(&expected, &entry, COMMAND_BYTES);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "l0")); /* the ramp, not its values */
    expected.flags &= (uint8_t)~MOTION_LINEAR;
    TEST_ASSERT_EQUAL_MEMORY(&expected, &entry, COMMAND_BYTES);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "d"));
    expected.decel = settings.decel[0];
    TEST_ASSERT_EQUAL_MEMORY(&expected, &entry, COMMAND_BYTES);
}

/* QUE-006, QUE-023 */
static void test_an_edited_count_is_in_full_steps_unless_p_is_given(void)
{
    motion_command_t entry = sample;
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "p"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_SYNC | MOTION_PULSES, entry.flags);
    TEST_ASSERT_EQUAL_UINT32(800, entry.count);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "v30"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_SYNC | MOTION_PULSES, entry.flags);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "m20"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_SYNC, entry.flags);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "pm20"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_SYNC | MOTION_PULSES, entry.flags);
    TEST_ASSERT_EQUAL(STATUS_OK, edit(&entry, "f"));
    TEST_ASSERT_EQUAL_HEX8(MOTION_LINEAR | MOTION_SYNC, entry.flags);
}

static void test_a_refused_edit_changes_nothing(void)
{
    static const struct {
        const char *text;
        status_t status;
    } refused[] = {{"m", STATUS_NUMBER_MISSING}, {"m0", STATUS_NUMBER_MISSING}, {"pm0", STATUS_NUMBER_MISSING}, {"m5k", STATUS_SYNTAX},
                   {"5", STATUS_SYNTAX},         {"v0", STATUS_VELOCITY_ZERO},  {"u256", STATUS_RANGE},
                   {"vc1", STATUS_PERIOD_TOO_SHORT}};
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        motion_command_t entry = sample;
        TEST_ASSERT_EQUAL_MESSAGE(refused[i].status, edit(&entry, refused[i].text), refused[i].text);
        TEST_ASSERT_EQUAL_MEMORY(&sample, &entry, COMMAND_BYTES);
    }
}

static void test_the_first_error_of_a_line_is_the_one_that_is_told(void)
{
    assert_refused(STATUS_NUMBER_TOO_LARGE, "m99999999999k");
    assert_refused(STATUS_RANGE, "m200u300v0");
}

/* Any 200,000 lines of the syntax's characters: nothing but a status comes out, and a refused one changes nothing. */
/* MOT-002 */
static void test_random_lines_are_taken_whole_or_change_nothing(void)
{
    static const char characters[] = "mvcadlutsfp0123456789.- MVk";
    int taken = 0;
    srand(2);
    for (int round = 0; round < 200000; round++) {
        char text[24] = "m";
        const int length = rand() % 22;
        for (int i = 1; i <= length; i++) {
            text[i] = characters[(unsigned)rand() % (sizeof characters - 1)];
        }
        text[length + 1] = '\0';
        const session_t before = defaults;
        if (read(text) == STATUS_OK) {
            taken++;
            TEST_ASSERT_TRUE(command->velocity > 0);
            TEST_ASSERT_TRUE(command->accel >= 1 && command->accel <= ACCEL_NONE);
            TEST_ASSERT_TRUE(command->decel >= 1 && command->decel <= ACCEL_NONE);
            TEST_ASSERT_EQUAL_HEX8(0, defaults.flags & ~SESSION_FLAGS);
        } else {
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &defaults, sizeof before, text);
        }
    }
    TEST_ASSERT_TRUE(taken > 1000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_count_alone_takes_everything_else_from_the_session);
    RUN_TEST(test_one_command_can_give_every_parameter);
    RUN_TEST(test_parameters_may_come_in_any_order);
    RUN_TEST(test_upper_and_lower_case_are_the_same);
    RUN_TEST(test_the_manuals_example_reads_as_it_says);
    RUN_TEST(test_the_sign_decides_the_direction_whatever_the_default);
    RUN_TEST(test_a_space_ends_the_command);
    RUN_TEST(test_velocity_ramp_and_kind_of_count_become_session_defaults);
    RUN_TEST(test_count_sync_wait_and_extra_pulses_do_not);
    RUN_TEST(test_the_last_of_two_equal_parameters_wins);
    RUN_TEST(test_missing_numbers_have_their_meaning);
    RUN_TEST(test_explicit_zeros_clear);
    RUN_TEST(test_v_alone_sets_the_session_velocity_in_rpm);
    RUN_TEST(test_vc_sets_it_as_a_cycle);
    RUN_TEST(test_v_without_a_number_restores_the_system_default);
    RUN_TEST(test_a_fraction_of_v_is_dropped);
    RUN_TEST(test_velocities_from_below_1_to_above_2200_rpm_are_taken);
    RUN_TEST(test_velocities_that_cannot_be_kept_are_refused);
    RUN_TEST(test_ramp_values_have_two_decimals_below_100_and_none_from_100);
    RUN_TEST(test_ramp_values_out_of_range_are_refused_with_the_range);
    RUN_TEST(test_a_or_d_without_a_number_or_with_zero_restores_the_default_of_the_current_ramp);
    RUN_TEST(test_defaults_are_those_of_the_ramp_the_command_ends_up_with);
    RUN_TEST(test_a_given_ramp_replaces_only_what_the_command_does_not_give);
    RUN_TEST(test_a_ramp_value_alone_is_taken_even_where_the_velocity_would_be_refused);
    RUN_TEST(test_numbers_are_taken_up_to_their_limit_and_refused_beyond);
    RUN_TEST(test_letters_and_signs_out_of_place_are_refused);
    RUN_TEST(test_a_missing_number_is_refused_where_one_is_needed);
    RUN_TEST(test_a_motion_without_a_count_is_continuous);
    RUN_TEST(test_an_edit_names_every_parameter);
    RUN_TEST(test_an_edit_leaves_what_it_does_not_name);
    RUN_TEST(test_an_edited_count_is_in_full_steps_unless_p_is_given);
    RUN_TEST(test_a_refused_edit_changes_nothing);
    RUN_TEST(test_the_first_error_of_a_line_is_the_one_that_is_told);
    RUN_TEST(test_random_lines_are_taken_whole_or_change_nothing);
    return UNITY_END();
}
