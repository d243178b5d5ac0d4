/* base/status: the table of errors. */
#include "base/status.h"
#include <string.h>
#include "cli/text.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

static const struct {
    status_t status;
    int number;
    const char *words;
    const char *remedy;
} table[] = {
#define STATUS(name, number, words, remedy) {STATUS_##name, number, words, remedy},
#include "base/status.def"
#undef STATUS
};
enum { ERRORS = sizeof table / sizeof table[0] };

static void test_numbers_run_from_one_without_a_gap(void)
{
    for (int i = 0; i < ERRORS; i++) {
        TEST_ASSERT_EQUAL_INT(i + 1, table[i].number);
    }
}

static void test_each_error_has_its_words_and_says_what_to_do(void)
{
    for (int i = 0; i < ERRORS; i++) {
        TEST_ASSERT_EQUAL_STRING(table[i].words, status_words(table[i].status));
        TEST_ASSERT_TRUE(strlen(table[i].words) > 0 && strlen(table[i].remedy) > 0);
    }
    TEST_ASSERT_EQUAL_STRING("", status_words(STATUS_OK));
}

static const char *const ranges[] = {
#define SETTING_KIND(kind, range) range,
#include "settings.def"
};

/* `?nn words range`, CR LF. */
static void test_every_answer_fits_the_room_the_terminal_asks_for(void)
{
    size_t longest = 0;
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++) {
        if (strlen(ranges[i]) > longest)
            longest = strlen(ranges[i]);
    }
    for (int i = 0; i < ERRORS; i++) {
        const size_t range = table[i].status == STATUS_RANGE ? 1 + longest : 0;
        TEST_ASSERT_TRUE(strlen("?nn ") + strlen(table[i].words) + range + 2 <= TEXT_ERROR_BYTES);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_numbers_run_from_one_without_a_gap);
    RUN_TEST(test_each_error_has_its_words_and_says_what_to_do);
    RUN_TEST(test_every_answer_fits_the_room_the_terminal_asks_for);
    return UNITY_END();
}
