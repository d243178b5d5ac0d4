/* cli/line: bytes to lines. */
#include "cli/line.h"
#include <string.h>
#include "unity.h"

static line_t line;
static char ended[8][LINE_CHARACTERS + 1];
static status_t ended_status[8];
static int ended_count;

void setUp(void)
{
    memset(&line, 0, sizeof line);
    line_reset(&line);
    ended_count = 0;
}

void tearDown(void)
{
}

static void take(uint8_t byte)
{
    if (line_take(&line, byte) == LINE_ENDED) {
        strcpy(ended[ended_count], line.text);
        ended_status[ended_count++] = line.status;
        line_reset(&line);
    }
}

static void type(const char *text)
{
    while (*text != '\0') {
        take((uint8_t)*text++);
    }
}

/* TRM-002 */
static void test_nothing_ends_without_a_terminator(void)
{
    type("m200");
    TEST_ASSERT_EQUAL_INT(0, ended_count);
}

/* TRM-003 */
static void test_cr_lf_and_crlf_each_end_exactly_one_line(void)
{
    type("one\rtwo\nthree\r\nfour\r\n");
    TEST_ASSERT_EQUAL_INT(4, ended_count);
    TEST_ASSERT_EQUAL_STRING("one", ended[0]);
    TEST_ASSERT_EQUAL_STRING("two", ended[1]);
    TEST_ASSERT_EQUAL_STRING("three", ended[2]);
    TEST_ASSERT_EQUAL_STRING("four", ended[3]);
}

/* TRM-017 */
static void test_two_returns_end_a_blank_line_and_lfcr_ends_two(void)
{
    type("a\r\r");
    TEST_ASSERT_EQUAL_INT(2, ended_count);
    TEST_ASSERT_EQUAL_STRING("", ended[1]);
    type("\n");
    TEST_ASSERT_EQUAL_INT(2, ended_count);
    type("b\n\r");
    TEST_ASSERT_EQUAL_INT(4, ended_count);
}

static void test_backspace_and_delete_take_back_the_last_character(void)
{
    type("m201\b0\x7F\x7F""00\r");
    TEST_ASSERT_EQUAL_STRING("m200", ended[0]);
}

static void test_backspace_on_an_empty_line_does_nothing(void)
{
    type("\b\x7Fg\r");
    TEST_ASSERT_EQUAL_STRING("g", ended[0]);
}

static void test_escape_clears_the_line_and_what_was_wrong_with_it(void)
{
    type("m2000");
    TEST_ASSERT_EQUAL(LINE_CLEARED, line_take(&line, 0x1B));
    TEST_ASSERT_EQUAL(0, line_begun(&line));
    TEST_ASSERT_EQUAL(LINE_UNCHANGED, line_take(&line, 0x1B));
    line_damage(&line);
    type("\x1Bq\r");
    TEST_ASSERT_EQUAL_STRING("q", ended[0]);
    TEST_ASSERT_EQUAL(STATUS_OK, ended_status[0]);
}

static void test_other_control_characters_are_ignored(void)
{
    for (uint8_t c = 0; c < 0x20; c++) {
        if (c != '\b' && c != '\n' && c != '\r' && c != 0x1B) {
            take(c);
        }
    }
    TEST_ASSERT_EQUAL(0, line_begun(&line));
}

static void test_a_line_of_64_characters_is_taken(void)
{
    for (int i = 0; i < 64; i++) {
        take('x');
    }
    type("\r");
    TEST_ASSERT_EQUAL(STATUS_OK, ended_status[0]);
    TEST_ASSERT_EQUAL_INT(64, strlen(ended[0]));
}

static void test_a_longer_line_is_refused_whole_up_to_its_end(void)
{
    for (int i = 0; i < 1000; i++) {
        take('x');
    }
    TEST_ASSERT_EQUAL_INT(0, ended_count);
    type("\rg\r");
    TEST_ASSERT_EQUAL_INT(2, ended_count);
    TEST_ASSERT_EQUAL(STATUS_LINE_TOO_LONG, ended_status[0]);
    TEST_ASSERT_EQUAL(STATUS_OK, ended_status[1]);
    TEST_ASSERT_EQUAL_STRING("g", ended[1]);
}

static void test_taking_characters_back_does_not_mend_a_line_that_was_too_long(void)
{
    for (int i = 0; i < 70; i++) {
        take('x');
    }
    for (int i = 0; i < 70; i++) {
        take('\b');
    }
    TEST_ASSERT_NOT_EQUAL(0, line_begun(&line));
    type("g\r");
    TEST_ASSERT_EQUAL(STATUS_LINE_TOO_LONG, ended_status[0]);
}

/* CLK-014 */
static void test_a_damaged_byte_refuses_its_line_and_no_other(void)
{
    type("g\rm2");
    line_damage(&line);
    type("00\rq\r");
    TEST_ASSERT_EQUAL_INT(3, ended_count);
    TEST_ASSERT_EQUAL(STATUS_OK, ended_status[0]);
    TEST_ASSERT_EQUAL(STATUS_LINE_DAMAGED, ended_status[1]);
    TEST_ASSERT_EQUAL(STATUS_OK, ended_status[2]);
}

static void test_a_line_whose_first_byte_was_lost_is_not_blank(void)
{
    line_damage(&line);
    TEST_ASSERT_NOT_EQUAL(0, line_begun(&line));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_ends_without_a_terminator);
    RUN_TEST(test_cr_lf_and_crlf_each_end_exactly_one_line);
    RUN_TEST(test_two_returns_end_a_blank_line_and_lfcr_ends_two);
    RUN_TEST(test_backspace_and_delete_take_back_the_last_character);
    RUN_TEST(test_backspace_on_an_empty_line_does_nothing);
    RUN_TEST(test_escape_clears_the_line_and_what_was_wrong_with_it);
    RUN_TEST(test_other_control_characters_are_ignored);
    RUN_TEST(test_a_line_of_64_characters_is_taken);
    RUN_TEST(test_a_longer_line_is_refused_whole_up_to_its_end);
    RUN_TEST(test_taking_characters_back_does_not_mend_a_line_that_was_too_long);
    RUN_TEST(test_a_damaged_byte_refuses_its_line_and_no_other);
    RUN_TEST(test_a_line_whose_first_byte_was_lost_is_not_blank);
    return UNITY_END();
}
