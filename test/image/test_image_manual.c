/* The examples of the manual, each at a board that has just been powered on: the answers are compared byte for byte.
 *
 * In docs/manual/ a fenced block that begins with ```sac is an example: what is typed stands behind a prompt, the lines
 * below it are the answer. [...] stands for any text. A line that begins with "... " is not typed; it is done:
 *   N s later, N ms later            time passes
 *   the motor stands                 time passes until it does
 *   keys ABC ESC                     these keys are pressed, without Return
 *   Estop to ground, Estop open      likewise sync and RST
 *   xclk to 1 MHz                    the two posts are joined
 *   encoder N lines cw (or ccw)      it is turned, 4 ms a line
 *   power off and on, reset button; and: reset button, keys ESC ESC ESC
 *   N pulses on clk                  so many since the last such line; the firmware's own count is not asked
 *   DC1 DC2                          these bytes have arrived since the last such line; in answers they are left out
 *   at the second unit, at the first unit   the terminal is that one's from now on; what it has printed meanwhile follows
 * A block that begins with the version line shows what is printed at power-on.
 * ```sac two units: on one RS485 line, if the image has packets (if not, the block is left out).
 *
 * SAC_MANUAL_OUT=folder: writes the chapters there, with the answers that came instead of those that differ. */
#include "image.h"

#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FOLDER "docs/manual/"
#define MOST_LINES 4000
#define ANY "[...]"
#define DC1 0x11
#define DC2 0x12
#define ONE_UNIT "```sac"
#define TWO_UNITS "```sac two units"

static char *lines[MOST_LINES];
static size_t line_count;
static size_t block_at; /* its first line */
static FILE *out;

static char printed[65536]; /* since the last action, CR, DC1 and DC2 left out */
static char signals[200];   /* DC1 and DC2 since they were asked for */
static char prompt[8];
static unsigned encoder_at;
static board_t *both[2]; /* of an example with two */

void setUp(void)
{
}

void tearDown(void)
{
    bus_free(image_bus);
    image_bus = NULL;
    if (both[0] != NULL)
        board_free(board == both[0] ? both[1] : both[0]);
    both[0] = both[1] = NULL;
    image_off();
}

/* -- what is printed ------------------------------------------------------------------------------------------------ */

static void collect(void)
{
    size_t length = strlen(printed);
    for (const char *text = image_take_text(); *text != '\0'; text++) {
        if (*text == DC1 || *text == DC2)
            strcat(signals, *text == DC1 ? " DC1" : " DC2");
        else if (*text != '\r' && length < sizeof printed - 1)
            printed[length++] = *text;
    }
    printed[length] = '\0';
}

/* The prompt that was printed last, cut off; null: none. */
static const char *cut_prompt(void)
{
    static const char *const prompts[] = {"SAC>", "Q>", "X>"};
    size_t length = strlen(printed);
    for (size_t i = 0; i < 3; i++) {
        size_t end = strlen(prompts[i]);
        if (length >= end && strcmp(printed + length - end, prompts[i]) == 0 &&
            (length == end || printed[length - end - 1] == '\n')) {
            printed[length - end] = '\0';
            return prompts[i];
        }
    }
    return NULL;
}

static void until_prompt(const char *what)
{
    uint64_t end = board_cycle(board) + 5 * SECOND;
    const char *found;
    do {
        if (board_cycle(board) > end)
            image_fail("\"%s\": expected a prompt, saw \"%s\"", what, printed);
        image_run(MS);
        collect();
    } while (board_uart_sending(board) || (found = cut_prompt()) == NULL);
    strcpy(prompt, found);
}

static bool matches(const char *expected, const char *seen)
{
    for (; *expected != '\0'; expected++, seen++) {
        if (strncmp(expected, ANY, strlen(ANY)) == 0) {
            do {
                if (matches(expected + strlen(ANY), seen))
                    return true;
            } while (*seen++ != '\0');
            return false;
        }
        if (*expected != *seen)
            return false;
    }
    return *seen == '\0';
}

/* -- what is done --------------------------------------------------------------------------------------------------- */

static void power_on(void)
{
    image_power_on();
    encoder_at = 2; /* open: both high */
    printed[0] = signals[0] = '\0';
}

static void type(const char *line)
{
    printed[0] = '\0';
    image_send(line);
    image_send("\r");
    until_prompt(line);
    size_t echo = strlen(line);
    if (strncmp(printed, line, echo) != 0 || printed[echo] != '\n')
        image_fail("expected the echo \"%s\", saw \"%s\"", line, printed);
    memmove(printed, printed + echo + 1, strlen(printed + echo));
}

static void press(const char *keys)
{
    char key[2] = "";
    for (; *keys != '\0'; keys++) {
        if (strncmp(keys, "ESC", 3) == 0) {
            image_send("\x1b");
            keys += 2;
        } else if (*keys != ' ') {
            key[0] = *keys;
            image_send(key);
        }
    }
    image_sent();
    image_run(5 * MS);
}

static void turn(unsigned lines_turned, bool cw)
{
    for (unsigned quarter = 0; quarter < 4 * lines_turned; quarter++) {
        encoder_at = (encoder_at + (cw ? 1u : 3u)) & 3;
        board_pin_drive(board, BOARD_PIN('C', 0), (encoder_at + 1) >> 1 & 1);
        board_pin_drive(board, BOARD_PIN('C', 1), encoder_at >> 1 & 1);
        image_run(MS);
    }
}

static bool ground(const char *what)
{
    static const struct {
        const char *name;
        board_pin_t pin;
    } posts[] = {{"Estop ", BOARD_PIN('D', 2)}, {"sync ", BOARD_PIN('D', 3)}, {"RST ", RST}};
    for (size_t i = 0; i < 3; i++) {
        size_t length = strlen(posts[i].name);
        if (strncmp(what, posts[i].name, length) == 0) {
            board_pin_drive(board, posts[i].pin, strcmp(what + length, "to ground") == 0 ? 0 : -1);
            image_run(20 * MS);
            return strcmp(what + length, "to ground") == 0 || strcmp(what + length, "open") == 0;
        }
    }
    return false;
}

static void act(const char *what)
{
    unsigned number;
    char unit[8] = "", word[8] = "";
    printed[0] = '\0';
    if (sscanf(what, "%u %7s %7s", &number, unit, word) == 3 && strcmp(word, "later") == 0) {
        image_run(number * (strcmp(unit, "ms") == 0 ? MS : SECOND));
    } else if (strcmp(what, "the motor stands") == 0) {
        image_idle(600 * SECOND);
    } else if (strncmp(what, "keys ", 5) == 0) {
        press(what + 5);
    } else if (sscanf(what, "encoder %u lines %7s", &number, word) == 2) {
        turn(number, strcmp(word, "cw") == 0);
    } else if (strcmp(what, "power off and on") == 0 || strncmp(what, "reset button", 12) == 0) {
        if (*what == 'p') {
            static uint8_t eeprom[BOARD_EEPROM_BYTES];
            bool held = board_pin_level(board, RST) == 0;
            memcpy(eeprom, board_eeprom(board), sizeof eeprom);
            image_off();
            image_power_on_with(eeprom);
            if (held)
                board_pin_drive(board, RST, 0);
            encoder_at = 2;
        } else {
            board_reset(board, BOARD_RESET_EXTERNAL);
            if (what[12] != '\0') {
                image_run(100 * MS);
                collect();
                press(what + strlen("reset button, keys "));
            }
        }
        until_prompt(what);
    } else if (sscanf(what, "%u pulses on %7s", &number, word) == 2) {
        image_run(MS);
        image_assert_pulses(number);
        image_train_clear();
    } else if (both[0] != NULL && (strcmp(what, "at the first unit") == 0 || strcmp(what, "at the second unit") == 0)) {
        board = both[strcmp(what, "at the second unit") == 0];
    } else if (strncmp(what, "DC", 2) == 0) {
        collect();
        if (strcmp(signals[0] ? signals + 1 : "", what) != 0)
            image_fail("expected %s, saw%s", what, signals);
        signals[0] = '\0';
    } else if (strcmp(what, "xclk to 1 MHz") == 0) {
        board_pin_wire(board, BOARD_PIN('B', 3), BOARD_PIN('D', 5));
    } else if (!ground(what)) {
        image_fail("not known: ... %s", what);
    }
    collect();
    (void)cut_prompt(); /* behind what came by itself */
}

/* -- a block -------------------------------------------------------------------------------------------------------- */

static const char *typed_in(const char *line)
{
    const char *end = strchr(line, '>');
    bool is = strncmp(line, "SAC>", 4) == 0 || strncmp(line, "Q>", 2) == 0 || strncmp(line, "X>", 2) == 0;
    return is ? end + 1 : NULL;
}

static bool is_action(const char *line)
{
    return typed_in(line) != NULL || strncmp(line, "... ", 4) == 0 || strcmp(line, "```") == 0;
}

/* Compares the lines from `at` on with what was printed; returns the first line behind them. */
static size_t compare(size_t at, const char *action)
{
    static char expected[65536];
    expected[0] = '\0';
    for (; !is_action(lines[at]); at++)
        strcat(strcat(expected, lines[at]), "\n");
    bool same = matches(expected, printed);
    if (out)
        fputs(same ? expected : printed, out);
    else if (!same)
        image_fail("line %zu, behind \"%s\": expected \"%s\", saw \"%s\"", at + 1, action, expected, printed);
    return at;
}

static void power_on_two(void)
{
    for (size_t i = 0; i < 2; i++) {
        power_on();
        until_prompt("power on");
        both[i] = board;
    }
    image_bus = bus_new();
    bus_join(image_bus, both[0]);
    bus_join(image_bus, both[1]);
    board = both[0];
}

static void test_example(void)
{
    size_t at = block_at;
    if (strcmp(lines[at - 1], TWO_UNITS) == 0) {
        power_on_two();
    } else {
        power_on();
        until_prompt("power on");
    }
    image_train_clear();
    if (!is_action(lines[at]))
        at = compare(at, "power on");
    while (strcmp(lines[at], "```") != 0) {
        const char *line = lines[at];
        const char *keys = typed_in(line);
        if (out)
            fprintf(out, "%s\n", line);
        if (keys == NULL) {
            act(line + 4);
        } else {
            if (strncmp(line, prompt, strlen(prompt)) != 0)
                image_fail("line %zu: expected \"%s\", the prompt is %s", at + 1, line, prompt);
            printed[0] = '\0';
            if (*keys != '\0')
                type(keys);
        }
        at = compare(at + 1, line);
    }
}

/* -- the files ------------------------------------------------------------------------------------------------------ */

static void read_lines(const char *path)
{
    char line[4096];
    FILE *file = fopen(path, "r");
    while (line_count > 0)
        free(lines[--line_count]);
    if (file == NULL)
        return;
    while (line_count < MOST_LINES && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\n")] = '\0';
        lines[line_count++] = strdup(line);
    }
    fclose(file);
}

static size_t run_examples(const char *path)
{
    size_t count = 0;
    const char *only = getenv("SAC_MANUAL_ONLY"); /* part of name:line */
    read_lines(path);
    for (size_t at = 0; at < line_count; at++) {
        if (out)
            fprintf(out, "%s\n", lines[at]);
        if (strcmp(lines[at], ONE_UNIT) != 0 && strcmp(lines[at], TWO_UNITS) != 0)
            continue;
        char name[300];
        snprintf(name, sizeof name, "example_at_%s:%zu", path + strlen(FOLDER), at + 1);
        block_at = at + 1;
        while (at < line_count - 1 && strcmp(lines[at], "```") != 0)
            at++;
        if (only == NULL || strstr(name, only) != NULL)
            UnityDefaultTestRun(test_example, name, (int)block_at);
        if (out)
            fprintf(out, "```\n");
        count++;
    }
    return count;
}

static size_t examples;

static void test_the_manual_has_examples(void)
{
    TEST_ASSERT_GREATER_THAN(0, examples);
}

int main(void)
{
    UNITY_BEGIN();
    glob_t found;
    if (glob(FOLDER "*.md", 0, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i++) {
            const char *folder = getenv("SAC_MANUAL_OUT");
            char path[300];
            if (folder) {
                snprintf(path, sizeof path, "%s/%s", folder, found.gl_pathv[i] + strlen(FOLDER));
                out = fopen(path, "w");
            }
            examples += run_examples(found.gl_pathv[i]);
            if (out)
                fclose(out);
        }
        globfree(&found);
    }
    RUN_TEST(test_the_manual_has_examples);
    return UNITY_END();
}
