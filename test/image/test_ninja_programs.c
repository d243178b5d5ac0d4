/* The Ninja's image against the model (ninja_model.h): random programs, with halts at random moments and a FIFO that
 * overflows.
 *
 * SAC_NINJA_PROGRAMS=n: so many instead of 60. SAC_NINJA_SEED=n: that program alone, and what it types. */
#include "ninja_play.h"
#include "splitmix64.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define PROGRAMS 60
#define TOKENS 30
#define PATIENCE (4 * SECOND)

static uint64_t number; /* of the program: its seed */
static uint64_t seed;
static bool verbose;

static struct {
    unsigned unclear, moves, halts, drops, pauses;
    size_t steps;
    double seconds;
} sums;

void setUp(void)
{
}

void tearDown(void)
{
    if (Unity.CurrentTestFailed)
        printf("program %llu\n", (unsigned long long)number);
    ninja_off();
}

/* -- random programs ----------------------------------------------------------------------------------------------- */

static unsigned below(unsigned n)
{
    return (unsigned)(splitmix64(&seed) % n);
}

static int between(int low, int high)
{
    return low + (int)below((unsigned)(high - low + 1));
}

typedef struct {
    char text[400];
    size_t length;
} text_t;

static void add(text_t *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void add(text_t *text, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    text->length += (size_t)vsnprintf(text->text + text->length, sizeof text->text - text->length, format, arguments);
    va_end(arguments);
}

static char in_some_case(char letter)
{
    return below(3) == 0 ? (char)(letter + 'a' - 'A') : letter;
}

static void add_number(text_t *text, char letter, int value)
{
    static const char *const forms[] = {"%c%d", "%c%+d", "%c%05d"};
    add(text, forms[below(20) == 0 ? 1 + below(2) : 0], in_some_case(letter), value);
}

static void add_target(text_t *text)
{
    const char letter = below(2) ? 'X' : 'Y';
    const int reach = (int)(below(12) == 0 ? 70000 : below(6) == 0 ? 300 : 50);
    add_number(text, letter, between(-reach, reach));
}

static void add_velocity(text_t *text)
{
    const bool any = below(6) == 0;
    add_number(text, 'V', any ? between(-3, 70) : between(30, 63));
}

static void add_command(text_t *text)
{
    static const char others[] = ",?\r\n 5-+Zz\t;";
    const unsigned kind = below(100);
    if (kind < 40)
        add_target(text);
    else if (kind < 50)
        add_velocity(text);
    else if (kind < 75)
        add(text, "%c", in_some_case("MMSI"[below(4)]));
    else if (kind < 88)
        add_number(text, 'P', (int)below(below(4) ? 4 : 12));
    else if (kind < 90)
        add(text, "C");
    else if (kind < 95)
        add(text, "%c", others[below(sizeof others - 1)]);
    else
        add(text, "R");
}

static void add_macro(text_t *text)
{
    add(text, "(");
    for (int commands = below(5) == 0 ? between(20, 35) : between(1, 8); commands > 0; commands--) {
        if (below(2))
            add_target(text);
        else
            add_command(text);
        while (text->text[text->length - 1] == 'R') /* it would not pass any time */
            text->length--;
        if (below(20) == 0)
            add(text, "(");
    }
    add(text, below(4) == 0 ? "P%uR)" : ")", 1 + below(3));
    if (below(3))
        add(text, "R");
}

/* One thing that somebody does. */
static void do_something(void)
{
    text_t text = {.length = 0};
    const unsigned kind = below(100);
    if (play_model.fifo_count == NINJA_FIFO && below(5) != 0 && kind < 90) {
        play_rests(SECOND);
    } else if (kind < 60) {
        add_command(&text);
    } else if (kind < 70) {
        add_macro(&text);
    } else if (kind < 90) {
        play_run(below(4) ? below(200) * MS + below(1000) * US : below(2000) * MS);
    } else if (kind < 93) {
        play_rests(SECOND);
    } else {
        play_sent(); /* not so near to what was typed before that it is not clear what it halts */
        play_run(4 * MS + below(30000) * US);
        add(&text, kind < 99 ? "\b" : "\022");
    }
    if (verbose)
        printf("%.3f %s\n", (double)board_cycle(board) / SECOND, text.length ? text.text : "...");
    play_type(text.text);
    if (below(2))
        play_sent();
}

static head_options_t somewhere(bool far)
{
    head_options_t head = head_defaults;
    const int reach = far ? 500 : 20;
    head.axis[HEAD_X].start = between(-reach, reach);
    head.axis[HEAD_Y].start = between(-reach, reach);
    return head;
}

/* Whether it was a clear case. */
static bool run_program(void)
{
    seed = number;
    /* Where centring may be halted it begins so near the centre that no stop is met. */
    const bool rests = below(4) != 0;
    const head_options_t head = somewhere(rests && below(20) == 0);
    play_power_on(&head);
    if (rests)
        play_rest(20 * SECOND);
    for (unsigned i = 0; i < TOKENS && play_model.unclear == 0; i++)
        do_something();
    play_sent();
    if (play_model.unclear == 0 && !play_rests(PATIENCE)) {
        play_type("\b");
        play_sent();
    }
    /* The centring may have been halted, and the position lie anywhere. */
    text_t last = {.length = 0};
    add(&last, "%sC X%dY%dS", play_model.macro.defining ? ")" : "", between(-30, 30), between(-30, 30));
    play_type(last.text);
    if (play_model.unclear == 0) {
        play_rest(100 * SECOND);
        ninja_assert_at(play_model.target[AXIS_X], play_model.target[AXIS_Y]);
    }
    size_t events;
    ninja_events(&events);
    sums.unclear += play_model.unclear != 0;
    sums.moves += play_model.moves;
    sums.halts += play_model.halts;
    sums.drops += play_model.drops;
    sums.pauses += play_model.pauses_made;
    sums.steps += events;
    sums.seconds += (double)board_cycle(board) / SECOND;
    const bool clear = play_model.unclear == 0;
    ninja_off();
    return clear;
}

/* NIN-003..NIN-012, NIN-014..NIN-016, NIN-019..NIN-028, NIN-030..NIN-033: number and order of steps, patterns, times,
 * pauses, and where it ends */
static void test_random_programs_do_what_the_model_says(void)
{
    const char *programs = getenv("SAC_NINJA_PROGRAMS");
    const char *only = getenv("SAC_NINJA_SEED");
    if (only != NULL) {
        verbose = true;
        number = strtoull(only, NULL, 0);
        run_program();
        return;
    }
    const unsigned wanted = programs ? (unsigned)strtoul(programs, NULL, 0) : PROGRAMS;
    number = 0;
    for (unsigned done = 0; done < wanted; number++)
        done += run_program();
    printf("%u programs (%u more in which two things were too close together), %.0f s: %u moves, %zu steps and switches, "
           "%u halts, %u bytes lost, %u pauses\n",
           wanted, sums.unclear, sums.seconds, sums.moves, sums.steps, sums.halts, sums.drops, sums.pauses);
    TEST_ASSERT_LESS_THAN_MESSAGE(wanted / 5 + 2, sums.unclear, "too many programs were unclear");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_programs_do_what_the_model_says);
    return UNITY_END();
}
