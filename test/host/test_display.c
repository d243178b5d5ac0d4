/* cli/display: what q, cf, vd, p and ? print. */
#include "cli/display.h"
#include "cli/text.h"
#include <stdio.h>
#include <string.h>
#include "cli/commands.h"
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
    queue_init();
    display_init();
}

void tearDown(void) {}

static void execute(const char *text)
{
    TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, commands_execute(text, (uint8_t)strlen(text)), text);
}

/* What the command prints. */
static const char *shown(const char *text)
{
    terminal_port_fake_clear();
    execute(text);
    while (display_poll()) {
    }
    TEST_ASSERT_FALSE(display_active());
    return terminal_port_fake_text();
}

static void add(const char *text)
{
    execute(text);
    queue_poll();
}

#define LINE_OF_70 "======================================================================\r\n"

/* QUE-002..QUE-010, QUE-012, QUE-021 */
static void test_the_queue_is_printed_exactly_as_the_template(void)
{
    add("m800vc2000t3000");
    add("m-600v50st3000");
    execute("v");
    add("m4000v160l1a5d5");
    add("m-2000vc1500l0u255p");
    add("m4294967295vc4294967295a999d100l1t4294967295f");
    char expected[4000] = "Q\tSteps\t\tRPM\tCycle\t Acc\tDec\tusteps\t deltaT\r\n" LINE_OF_70
                          "1\t800\t CW\t150\t2000\t 1.00\t1.00\t0\t  3000\r\n"
                          "2\t600\t CCW\t50\t6000\t 1.00\t1.00\t0\ts 3000\r\n"
                          "3\t4000\t CW\t160\t1875\t*5.00\t5.00\t0\t  0\r\n"
                          "4\t2000\t+CCW\t200\t1500\t 1.00\t1.00\t255\t  0\r\n"
                          "5\t4294967295\t CW\t0\t4294967295\t*999\t100\t0\t  4294967295\r\n";
    for (int i = 6; i <= 30; i++) {
        sprintf(expected + strlen(expected), "%d\t200\t CW\t100\t3000\t 1.00\t1.00\t0\t  0\r\n", i);
    }
    strcat(expected, LINE_OF_70 "Q is at 6\t+ pulse\t\t\t* linear\t\ts sync\r\n");
    TEST_ASSERT_EQUAL_STRING(expected, shown("q"));
}

/* The columns of the manual's screen, tabs expanded to stops of 8. */
static void expand(const char *row, char *screen)
{
    int column = 0;
    for (; *row != '\0' && *row != '\r'; row++) {
        if (*row == '\t') {
            do {
                screen[column++] = ' ';
            } while (column % 8 != 0);
        } else {
            screen[column++] = *row;
        }
    }
    screen[column] = '\0';
}

/* QUE-003, QUE-005..QUE-008, QUE-010 */
static void test_the_columns_stand_where_the_manual_shows_them(void)
{
    add("m-2000vc1500l1sp");
    const char *text = shown("q");
    char header[120], row[120], footer[120];
    expand(text, header);
    expand(strstr(text, "1\t2000"), row);
    expand(strstr(text, "Q is at"), footer);
    TEST_ASSERT_EQUAL_STRING_LEN("deltaT", header + 65, 6);
    TEST_ASSERT_EQUAL_STRING_LEN("usteps", header + 56, 6);
    TEST_ASSERT_EQUAL_STRING_LEN("Acc", header + 41, 3);
    TEST_ASSERT_EQUAL_STRING_LEN("RPM", header + 24, 3);
    TEST_ASSERT_EQUAL_STRING_LEN("+CCW", row + 16, 4);
    TEST_ASSERT_EQUAL_STRING_LEN("*10.47", row + 40, 6);
    TEST_ASSERT_EQUAL_STRING_LEN("s 0", row + 64, 3);
    TEST_ASSERT_EQUAL_STRING_LEN("+ pulse", footer + 16, 7);
    TEST_ASSERT_EQUAL_STRING_LEN("* linear", footer + 40, 8);
    TEST_ASSERT_EQUAL_STRING_LEN("s sync", footer + 64, 6);
}

/* VEL-003, VEL-004, CLK-003, CLK-004 */
static void test_rpm_and_cycle_are_shown_whichever_was_given(void)
{
    add("m200vc42567");
    add("m200vc4567");
    add("m200v65");
    const char *text = shown("q");
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\n1\t200\t CW\t7\t42567\t"));
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\n2\t200\t CW\t65\t4567\t"));
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\n3\t200\t CW\t65\t4615\t"));
}

/* STP-012, SWT-005, SWT-003 */
static void test_extra_pulses_and_start_wait_are_shown(void)
{
    add("m2000u6t50000");
    TEST_ASSERT_NOT_NULL(strstr(shown("q"), "\t6\t  50000\r\n"));
}

/* QUE-012, QUE-013, TRM-010 */
static void test_debug_shows_positions_0_and_31_and_what_is_executed(void)
{
    TEST_ASSERT_NULL(strstr(shown("q"), "\r\n0\t"));
    execute("b");
    add("m7");
    const char *text = shown("q");
    TEST_ASSERT_NOT_NULL(strstr(text, LINE_OF_70 "0\t200\t"));
    TEST_ASSERT_NOT_NULL(strstr(text, "s sync\r\nexecuting 1\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\n31\t200\t"));
}

/* A-QUE-08 */
static void test_one_row_is_shown_by_its_number(void)
{
    add("m7");
    TEST_ASSERT_EQUAL_STRING("1\t7\t CW\t100\t3000\t 1.00\t1.00\t0\t  0\r\n", shown("q1"));
}

/* XRF-007, XRF-012 */
static void test_the_array_is_shown_through_its_terminator(void)
{
    TEST_ASSERT_EQUAL_STRING("x_ 0 0\r\n", shown("xd"));
    static const uint8_t positions[] = {1, 3, 7, 5, 0};
    for (uint8_t i = 0; i < sizeof positions; i++) {
        queue_array_set(i, positions[i]);
    }
    TEST_ASSERT_EQUAL_STRING("x_ 0 1\r\nx_ 1 3\r\nx_ 2 7\r\nx_ 3 5\r\nx_ 4 0\r\n", shown("xd"));
}

/* TRM-013, TRM-014, GAP-001, GAP-003 */
static void test_cf_shows_the_session_defaults_and_the_flags(void)
{
    TEST_ASSERT_EQUAL_STRING("v 100 cycle 3000\r\n"
                             "a 1.00 d 1.00 harmonic\r\n"
                             "GAP on, full step, EnF\r\n"
                             "ops 36, soft_ops off, CRC 1, ACK on\r\n",
                             shown("cf"));
    execute("v65");
    execute("a1.234");
    execute("d150.7");
    execute("g");
    execute("$P");
    TEST_ASSERT_EQUAL_STRING("v 65 cycle 4615\r\n"
                             "a 1.23 d 150 harmonic\r\n"
                             "GAP off, pulses, EnF\r\n"
                             "ops 36, soft_ops off, CRC 1, ACK on\r\n",
                             shown("cf"));
    execute("$L1");
    TEST_ASSERT_NOT_NULL(strstr(shown("cf"), "a 10.47 d 10.47 linear\r\n"));
}

/* VEL-007 */
static void test_vd_shows_rpm_and_cycle_of_the_velocity_in_play(void)
{
    engine_fake.rpm = 65;
    engine_fake.cycle_us = 4567;
    TEST_ASSERT_EQUAL_STRING("65 4567\r\n", shown("vd"));
}

static void test_p_shows_position_state_and_faults(void)
{
    engine_fake.position = -2147483647 - 1;
    engine_fake.state = MOTION_DECEL;
    engine_fake.faults = 3;
    TEST_ASSERT_EQUAL_STRING("position -2147483648 DECEL faults 3\r\n", shown("p"));
    engine_fake.state = MOTION_STANDBY;
    TEST_ASSERT_NOT_NULL(strstr(shown("p"), " STANDBY "));
}

static void test_the_list_has_one_line_for_each_available_command(void)
{
    const char *text = shown("?");
    static const char *const forms[] = {
#define HELP(form, words) form,
#define UNLISTED
#define COMMAND(name, first, second, case_rule, argument, action, help) help
#include "cli/commands.def"
#undef COMMAND
    };
    unsigned lines = 0;
    for (const char *c = text; *c != '\0'; c++) {
        lines += *c == '\n';
    }
    TEST_ASSERT_EQUAL_UINT(sizeof forms / sizeof forms[0], lines);
    const char *line = text;
    for (unsigned i = 0; i < lines; i++) {
        TEST_ASSERT_EQUAL_STRING_LEN(forms[i], line, strlen(forms[i]));
        TEST_ASSERT_EQUAL('\t', line[strlen(forms[i])]);
        char screen[160];
        expand(line, screen);
        TEST_ASSERT_TRUE_MESSAGE(strlen(screen) <= 79, screen);
        line = strchr(line, '\n') + 1;
    }
}

/* A display never asks for more room than there is: the fake port asserts it; here the line takes one byte at a time. */
static void test_a_display_waits_for_the_line_and_loses_nothing(void)
{
    char whole[4000];
    strcpy(whole, shown("q"));
    terminal_port_fake_clear();
    terminal_port_fake_hold(1);
    execute("q");
    while (display_active()) {
        display_poll();
        terminal_port_fake_drain(1);
    }
    TEST_ASSERT_EQUAL_STRING(whole, terminal_port_fake_text());
}

static void test_displays_follow_each_other_in_the_order_asked_for(void)
{
    execute("vd");
    execute("p");
    execute("vd");
    while (display_poll()) {
    }
    TEST_ASSERT_EQUAL_STRING("10 30000\r\nposition 0 STANDBY faults 0\r\n10 30000\r\n", terminal_port_fake_text());
}

static void test_cf_shows_what_held_when_it_was_asked_for(void)
{
    execute("cf");
    display_poll();
    execute("a5");
    execute("g");
    while (display_poll()) {
    }
    TEST_ASSERT_NOT_NULL(strstr(terminal_port_fake_text(), "a 1.00 d 1.00 harmonic\r\nGAP on"));
}

/* Texts are packed for the AVR alone (tools/pack_texts.py): here the pairs themselves. */
static void test_a_pair_prints_the_two_that_it_stands_for(void)
{
    static const unsigned char pairs[][2] = {
#define PAIR(first, second) {first, second},
#include "cli/pairs.def"
#undef PAIR
    };
    for (unsigned i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        char expected[TEXT_PIECE_BYTES] = "";
        unsigned c = 0x80 + i;
        for (; c >= 0x80; c = pairs[c - 0x80][1]) {
            TEST_ASSERT_TRUE(pairs[c - 0x80][0] < 0x80 && strlen(expected) < TEXT_LONGEST - 1);
            strcat(expected, (const char[]){(char)pairs[c - 0x80][0], '\0'});
        }
        strcat(expected, (const char[]){(char)c, '\0'});
        terminal_port_fake_clear();
        TEST_ASSERT_EQUAL_UINT8(strlen(expected), text_put((uint8_t)(0x80 + i)));
        TEST_ASSERT_EQUAL_STRING(expected, terminal_port_fake_text());
    }
    terminal_port_fake_clear();
    TEST_ASSERT_EQUAL_UINT8(3, text_put_flash("abc"));
    TEST_ASSERT_EQUAL_STRING("abc", terminal_port_fake_text());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_queue_is_printed_exactly_as_the_template);
    RUN_TEST(test_the_columns_stand_where_the_manual_shows_them);
    RUN_TEST(test_rpm_and_cycle_are_shown_whichever_was_given);
    RUN_TEST(test_extra_pulses_and_start_wait_are_shown);
    RUN_TEST(test_debug_shows_positions_0_and_31_and_what_is_executed);
    RUN_TEST(test_one_row_is_shown_by_its_number);
    RUN_TEST(test_the_array_is_shown_through_its_terminator);
    RUN_TEST(test_cf_shows_the_session_defaults_and_the_flags);
    RUN_TEST(test_vd_shows_rpm_and_cycle_of_the_velocity_in_play);
    RUN_TEST(test_p_shows_position_state_and_faults);
    RUN_TEST(test_the_list_has_one_line_for_each_available_command);
    RUN_TEST(test_a_display_waits_for_the_line_and_loses_nothing);
    RUN_TEST(test_a_pair_prints_the_two_that_it_stands_for);
    RUN_TEST(test_displays_follow_each_other_in_the_order_asked_for);
    RUN_TEST(test_cf_shows_what_held_when_it_was_asked_for);
    return UNITY_END();
}
