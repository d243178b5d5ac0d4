/* Backspace and Ctrl-R on the Ninja's image, in every state it can be in. */
#include "ninja.h"

#include <string.h>

#define BYTES_16 "MMMMMMMMMMMMMMMM"
#define FILLING_MS 50 /* with them */
#define TRIES 3       /* of each state, at other moments */
#define MACRO "(X5MP3X-5M)"

void setUp(void)
{
}

void tearDown(void)
{
    ninja_off();
}

/* Sends one byte: when its stop bit has ended, and it has. */
static uint64_t press(uint8_t key)
{
    const uint64_t end = ninja_send(key);
    image_run(end - board_cycle(board));
    return end;
}

/* The last time that a coil was switched, 0 if none was since the last ninja_forget(). */
static uint64_t last_change(void)
{
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    return count == 0 ? 0 : event[count - 1].cycle;
}

/* A step of the motors after this cycle is one that nobody asked for. */
static void assert_no_step_after(uint64_t end, const char *when)
{
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    for (size_t i = 0; i < count; i++)
        if (event[i].cycle > end && event[i].what != NINJA_OFF)
            image_fail("%s: %c %s %.1f us after the halt", when, "XY"[event[i].axis], ninja_names[event[i].what],
                       (double)(event[i].cycle - end) / US);
}

static const struct {
    const char *when;
    const char *before; /* typed, and its end waited for */
    const char *text;
    unsigned delay_ms;
    double interval_ms; /* of the steps then, at most */
} states[] = {
    {"start interval", "", "X1000S", 5, 20},
    {"first interval", "", "X1000S", 30, 44.7},
    {"acceleration", "", "X1000S", 200, 7},
    {"cruise", "", "X1000S", 1200, 2},
    {"deceleration", "", "X1000S", 2300, 9},
    {"end of a move", "", "X1S", 40, 44.7},
    {"both axes", "", "X200Y100S", 400, 4},
    {"creep", "", "V0X100M", 700, 125},
    {"search", "X-300Y-100S", "C", 700, 5},
    {"approach", "", "C", 1300, 40},
    {"search of Y", "Y-200S", "C", 2900, 5},
    {"macro", "", "R", 120, 44.7},
    {"pause in a macro", "", "R", 300, 0},
    {"pause", "", "P50", 300, 0},
    {"rest", "", "", 10, 0},
};

/* NIN-006, NIN-025, NIN-027: at most one step interval from the end of the byte to the last change of a coil; the FIFO is
 * empty, the macro as it was, and it begins at its beginning */
static void test_a_halt_takes_one_interval_in_every_state(void)
{
    ninja_home();
    for (size_t i = 0; i < sizeof states / sizeof states[0]; i++) {
        double worst = 0;
        for (unsigned j = 0; j < TRIES; j++) {
            ninja_type("V63" MACRO);
            ninja_type(states[i].before);
            ninja_rest(10 * SECOND);
            ninja_type(states[i].text);
            if (strchr(states[i].text, 'P'))
                ninja_type(" ");
            if (states[i].delay_ms < FILLING_MS) {
                image_run(states[i].delay_ms * j * MS / TRIES);
            } else {
                const uint64_t begun = board_cycle(board);
                if (j % 2)
                    ninja_type(BYTES_16 "X9");
                const double part = j * states[i].interval_ms / TRIES;
                image_run(begun + states[i].delay_ms * MS + (uint64_t)(part * MS) - board_cycle(board));
            }
            ninja_forget();
            const uint64_t end = press('\b');
            image_run(500 * MS);
            TEST_ASSERT_FALSE_MESSAGE(ninja_current(), states[i].when);
            assert_no_step_after(end, states[i].when);
            const uint64_t last = last_change();
            if (last > end) {
                const double ms = (double)(last - end) / MS;
                worst = ms > worst ? ms : worst;
                if (ms > states[i].interval_ms + 0.02)
                    image_fail("%s: the last coil goes off %.3f ms after the halt, an interval is %.1f ms",
                               states[i].when, ms, states[i].interval_ms);
            }
            ninja_forget();
            ninja_type("X-20SR");
            ninja_rest(10 * SECOND); /* longer than its pause */
            TEST_ASSERT_EQUAL_MESSAGE(-5, ninja_platform(AXIS_X), states[i].when);
            const uint64_t off = ninja_cycle(AXIS_X, NINJA_OFF, ninja_count(AXIS_X, NINJA_OFF) - 2);
            const double pause = (double)(ninja_last(AXIS_X, NINJA_ON) - off) / MS;
            image_assert_near("pause in the macro, in ms", 300, pause, 1);
            ninja_type("CX0Y0V63");
            ninja_rest(30 * SECOND);
            ninja_assert_at(0, 0);
        }
        printf("%-16s %6.3f ms after the halt at the latest, an interval is %.1f ms\n", states[i].when, worst,
               states[i].interval_ms);
    }
}

/* NIN-026: M and S go on to where the move was to end */
static void test_a_halted_move_is_resumed(void)
{
    ninja_home();
    ninja_type("X400Y-200V60M");
    image_run(600 * MS);
    ninja_type("\b");
    ninja_rest(SECOND);
    TEST_ASSERT_INT_WITHIN(150, 200, ninja_platform(AXIS_X));
    const int there = ninja_platform(AXIS_X);
    ninja_forget();
    ninja_type("M");
    image_run(300 * MS);
    ninja_type("\b");
    ninja_rest(SECOND);
    TEST_ASSERT_GREATER_THAN(there, ninja_platform(AXIS_X));
    ninja_type("S");
    ninja_rest(3 * SECOND);
    ninja_assert_at(400, -200);
    TEST_ASSERT_EQUAL_MESSAGE(0, ninja_count(AXIS_X, NINJA_DOWN), "it goes on, without a way back");
}

/* NIN-020, NIN-025: an unfinished macro is gone, and so is the one before it */
static void test_a_halt_ends_a_definition(void)
{
    ninja_home();
    ninja_type("V63" MACRO "(X100M\b");
    ninja_type("R");
    image_run(SECOND);
    ninja_assert_at(0, 0);
    ninja_type("X20M"); /* is executed again */
    ninja_rest(SECOND);
    ninja_assert_at(20, 0);
}

/* NIN-006: a number that was being typed is forgotten */
static void test_a_halt_forgets_a_number(void)
{
    ninja_home();
    ninja_type("X300\b");
    ninja_type(" V63M");
    image_run(SECOND);
    ninja_assert_at(0, 0);
}

/* NIN-024, NIN-025: without a motion or a pause, too */
static void test_a_macro_that_only_repeats_is_halted(void)
{
    ninja_home();
    ninja_type("V63(X1X7R)R");
    image_run(300 * MS);
    ninja_type("\b");
    ninja_type("X10M");
    ninja_rest(SECOND);
    ninja_assert_at(10, 0);
}

/* NIN-006, NIN-018, NIN-028: at once, whatever is under way and with a full FIFO: centring, registers as at power-up, no
 * macro */
static void test_ctrl_r_is_as_power_up(void)
{
    static const char *const busy[] = {"X300Y200S", "P600 ", "R", "C", ""};
    ninja_home();
    for (size_t i = 0; i < sizeof busy / sizeof busy[0]; i++) {
        ninja_type("X40Y40V63(X5MX-5MR)");
        ninja_type(busy[i]);
        if (busy[i][0] != '\0')
            ninja_type(BYTES_16);
        ninja_forget();
        const uint64_t end = press(0x12);
        ninja_rest(20 * SECOND);
        ninja_assert_at(0, 0);
        TEST_ASSERT_TRUE_MESSAGE(ninja_cycle(AXIS_X, NINJA_ON, 0) < end + 40 * MS, busy[i]);
        const uint64_t before_last = ninja_cycle(AXIS_Y, NINJA_UP, ninja_count(AXIS_Y, NINJA_UP) - 2);
        image_assert_near("approach of Y in ms", 40, (double)(ninja_last(AXIS_Y, NINJA_UP) - before_last) / MS, 0.1);
        ninja_forget();
        ninja_type("RM");
        image_run(500 * MS);
        TEST_ASSERT_EQUAL_MESSAGE(0, ninja_count(AXIS_X, NINJA_ON) + ninja_count(AXIS_Y, NINJA_ON), "no macro, X0 Y0");
        ninja_type("X200M"); /* at V32 */
        ninja_rest(10 * SECOND);
        const uint64_t interval = ninja_cycle(AXIS_X, NINJA_UP, 100) - ninja_cycle(AXIS_X, NINJA_UP, 99);
        image_assert_near("V32: interval in ms", 15.3, (double)interval / MS, 0.1);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_halt_takes_one_interval_in_every_state);
    RUN_TEST(test_a_halted_move_is_resumed);
    RUN_TEST(test_a_halt_ends_a_definition);
    RUN_TEST(test_a_halt_forgets_a_number);
    RUN_TEST(test_a_macro_that_only_repeats_is_halted);
    RUN_TEST(test_ctrl_r_is_as_power_up);
    return UNITY_END();
}
