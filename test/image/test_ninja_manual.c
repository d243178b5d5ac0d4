/* The examples of docs/ninja.md, each at a head that has just been centred, and its tables.
 *
 * In a block that begins with ```ninja each line is typed, without an end of line. One that begins with "... " is not:
 *   at X,Y [after N s]         the head comes to rest there, its last coil goes off so long after the last byte (+-50 ms)
 *   N s later                  time passes
 *   coils on, coils off        they are
 *   X makes N steps, Y M       the head comes to rest; so many since the line before that was typed
 *   Backspace, Ctrl-R          is typed */
#include "ninja_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MANUAL "docs/ninja.md"
#define BEGIN "```ninja"
#define END "```"
#define MOST_LINES 1000

static char *lines[MOST_LINES];
static size_t line_count;
static size_t at;            /* the line in hand */
static uint64_t typed_until; /* end of the last byte */

void setUp(void)
{
}

void tearDown(void)
{
    if (Unity.CurrentTestFailed && at < line_count)
        printf("at line %zu: %s\n", at + 1, lines[at]);
    ninja_off();
}

static void type(const char *text)
{
    ninja_forget();
    for (; *text != '\0'; text++)
        typed_until = ninja_send((uint8_t)*text);
    image_run(typed_until - board_cycle(board));
}

static void come_to_rest(void)
{
    image_run(MS);
    ninja_rest(100 * SECOND);
}

static uint64_t last_off(void)
{
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    TEST_ASSERT_GREATER_THAN_MESSAGE(0, count, "nothing has moved");
    return event[count - 1].cycle;
}

static void act(const char *what)
{
    int x, y;
    double seconds;
    char after[8] = "";
    const int numbers = sscanf(what, "at %d,%d %7s %lf s", &x, &y, after, &seconds);
    if (numbers >= 2) {
        come_to_rest();
        ninja_assert_at(x, y);
        if (numbers == 4)
            image_assert_near("seconds", seconds, (double)(last_off() - typed_until) / SECOND, 0.05);
    } else if (sscanf(what, "X makes %d steps, Y %d", &x, &y) == 2) {
        come_to_rest();
        TEST_ASSERT_EQUAL(x, ninja_count(AXIS_X, NINJA_UP) + ninja_count(AXIS_X, NINJA_DOWN));
        TEST_ASSERT_EQUAL(y, ninja_count(AXIS_Y, NINJA_UP) + ninja_count(AXIS_Y, NINJA_DOWN));
    } else if (sscanf(what, "%lf s %7s", &seconds, after) == 2 && strcmp(after, "later") == 0) {
        image_run((uint64_t)(seconds * SECOND));
    } else if (strcmp(what, "coils on") == 0) {
        TEST_ASSERT_TRUE(ninja_current());
    } else if (strcmp(what, "coils off") == 0) {
        TEST_ASSERT_FALSE(ninja_current());
    } else if (strcmp(what, "Backspace") == 0) {
        type("\b");
        image_run(SECOND / 10);
    } else if (strcmp(what, "Ctrl-R") == 0) {
        type("\022");
        image_run(SECOND / 10);
    } else {
        image_fail("not known: ... %s", what);
    }
}

static void test_example(void)
{
    ninja_home();
    for (at++; strcmp(lines[at], END) != 0; at++) {
        if (strncmp(lines[at], "... ", 4) == 0)
            act(lines[at] + 4);
        else
            type(lines[at]);
    }
}

/* NIN-012, NIN-013 */
static void test_the_table_of_velocities_is_right(void)
{
    int rows = 0;
    for (size_t i = 0; i < line_count; i++) {
        int v, us;
        double rate;
        if (sscanf(lines[i], "| %d | %lf | %d |", &v, &rate, &us) != 3)
            continue;
        image_assert_near("steps/s", 8 * pow(62.5, v / 63.0), rate, 0.05001);
        TEST_ASSERT_EQUAL(ninja_v_us(v), us);
        rows++;
    }
    TEST_ASSERT_EQUAL(17, rows);
}

#define CONSTANT(name) {#name, name}
static const struct {
    const char *name;
    int value;
} constants[] = {
    CONSTANT(NINJA_START_STEPS_PER_S),
    CONSTANT(NINJA_TOP_STEPS_PER_S),
    CONSTANT(NINJA_CREEP_STEPS_PER_S),
    CONSTANT(NINJA_ACCELERATION),
    CONSTANT(NINJA_POWER_UP_V),
    CONSTANT(NINJA_X_MIN),
    CONSTANT(NINJA_X_MAX),
    CONSTANT(NINJA_Y_MIN),
    CONSTANT(NINJA_Y_MAX),
    CONSTANT(NINJA_BACKLASH_X),
    CONSTANT(NINJA_BACKLASH_Y),
    CONSTANT(NINJA_SEARCH_STEPS_PER_S),
    CONSTANT(NINJA_APPROACH_STEPS_PER_S),
    CONSTANT(NINJA_RUN_UP),
    CONSTANT(NINJA_SEARCH_MARGIN),
};

static void test_the_table_of_constants_is_right(void)
{
    for (size_t i = 0; i < sizeof constants / sizeof constants[0]; i++) {
        char row[80];
        bool found = false;
        snprintf(row, sizeof row, "| `%s` | %d |", constants[i].name, constants[i].value);
        for (size_t line = 0; line < line_count; line++)
            found |= strncmp(lines[line], row, strlen(row)) == 0;
        TEST_ASSERT_TRUE_MESSAGE(found, row);
    }
}

int main(void)
{
    char line[1000];
    size_t examples = 0;
    UNITY_BEGIN();
    FILE *file = fopen(MANUAL, "r");
    while (file != NULL && line_count < MOST_LINES && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = '\0';
        lines[line_count++] = strdup(line);
    }
    for (size_t i = 0; i < line_count; i++) {
        if (strcmp(lines[i], BEGIN) != 0)
            continue;
        char name[60];
        snprintf(name, sizeof name, "example_at_line_%zu", i + 1);
        at = i;
        UnityDefaultTestRun(test_example, name, (int)i + 1);
        examples++;
    }
    RUN_TEST(test_the_table_of_velocities_is_right);
    RUN_TEST(test_the_table_of_constants_is_right);
    if (file != NULL)
        fclose(file);
    while (line_count > 0)
        free(lines[--line_count]);
    return examples == 0 ? 1 : UNITY_END();
}
