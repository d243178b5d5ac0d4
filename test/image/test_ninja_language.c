/* What can be typed at the Ninja's image, one rule at a time; and random bytes.
 *
 * SAC_NINJA_BYTES=n: so many random bytes of each kind instead of 1,500. */
#include "ninja.h"
#include "splitmix64.h"

#include <stdlib.h>
#include <string.h>

#define RANDOM_BYTES 1500
#define LONGEST_INTERVAL (125 * MS)

void setUp(void)
{
}

void tearDown(void)
{
    ninja_off();
}

/* Each text from where the one before has ended, at V63. */
typedef struct {
    const char *text;
    int x, y; /* of the platform, at the end */
} case_t;

static void assert_cases(const case_t *cases, size_t count)
{
    ninja_home();
    ninja_type("V63");
    for (size_t i = 0; i < count; i++) {
        ninja_type(cases[i].text);
        ninja_rest(20 * SECOND);
        const int x = ninja_platform(AXIS_X);
        const int y = ninja_platform(AXIS_Y);
        if (x != cases[i].x || y != cases[i].y)
            image_fail("\"%s\": expected the platform at %d,%d, saw %d,%d", cases[i].text, cases[i].x, cases[i].y, x,
                       y);
    }
}
#define ASSERT_CASES(...) \
    do { \
        static const case_t cases[] = {__VA_ARGS__}; \
        assert_cases(cases, sizeof cases / sizeof cases[0]); \
    } while (0)

/* -- line ---------------------------------------------------------------------------------------------------------- */

/* NIN-001: 4,800 baud, also 2 % off, a byte behind the other with one stop bit; not 9,600 */
static void test_the_line_is_at_4800_baud(void)
{
    static const double bauds[] = {4800, 4896, 4704};
    ninja_home();
    ninja_type("V63");
    for (int i = 0; i < 3; i++) {
        char text[20];
        board_uart_baud(board, bauds[i]);
        snprintf(text, sizeof text, "X%dY%dM", 10 + i, -10 - i);
        ninja_type(text);
        ninja_rest(SECOND);
        ninja_assert_at(10 + i, -10 - i);
    }
    board_uart_baud(board, 9600);
    ninja_type("X40M");
    ninja_rest(SECOND);
    ninja_assert_at(12, -12);
}

/* NIN-002: whatever is typed (ninja_off() looks at the transmitter and its pin after each test, too) */
static void test_nothing_is_transmitted(void)
{
    ninja_home();
    ninja_type("?X10V63M\r\n(X1)R\b\022V?");
    ninja_rest(20 * SECOND);
    size_t bytes;
    board_uart_received(board, &bytes);
    TEST_ASSERT_EQUAL(0, bytes);
}

/* -- commands ------------------------------------------------------------------------------------------------------ */

/* NIN-003, NIN-007: either case, signs, no number, no punctuation */
static void test_commands_are_letters_and_numbers(void)
{
    ASSERT_CASES({"X20Y-10M", 20, -10}, {"x30y-20m", 30, -20}, {"X+40Y+5M", 40, 5}, {"X007M", 7, 5}, {"XM", 0, 5},
                 {"X-M", 0, 5}, {"Y-0M", 0, 0}, {"X9Y8V63MX1Y2S", 1, 2}, {"X5X6M", 6, 2});
}

/* NIN-004: P takes 16 bits without sign, X and Y both ways; what is outside saturates */
static void test_numbers_saturate(void)
{
    ASSERT_CASES({"X-900M", -900, 0}, {"X99999999999M", 1800, 0}, {"X-99999999999M", -1800, 0}, {"X0Y65536M", 0, 550},
                 {"Y-32769M", 0, -1200}, {"Y0M", 0, 0});
    ninja_type("P-1 X10M"); /* 6553.5 s */
    image_run(5 * SECOND);
    ninja_assert_at(0, 0);
    ninja_type("\bP-65535 X10M"); /* saturates to -32768, 3276.8 s */
    image_run(5 * SECOND);
    ninja_assert_at(0, 0);
}

/* NIN-005: 16 bytes wait while a move is made, and all are executed; the 17th and what follows is lost */
static void test_sixteen_bytes_wait(void)
{
    ninja_home();
    ninja_type("V63X300M");
    ninja_type("MX1Y2MX3Y4MX5Y6M"  /* 16: */
               "X99Y99M");         /* lost */
    ninja_rest(10 * SECOND);
    ninja_assert_at(5, 6);
    TEST_ASSERT_EQUAL_MESSAGE(4, ninja_count(AXIS_X, NINJA_ON), "one after the other");
    ninja_type("M");
    ninja_rest(SECOND);
    ninja_assert_at(5, 6);
}

/* NIN-008 */
static void test_other_characters_are_ignored(void)
{
    ASSERT_CASES({"X100,?Y5 M", 100, 5}, {"\r\nX5\r\nY6\r\nM\r\n", 5, 6}, {"QWTUabdefghjkl~!@#$%^&*=X9M", 9, 6},
                 {"12X8 99M", 8, 6}, {"\x80\xff\x7f\x01\x1bX7M", 7, 6}, {"X1-2M", 1, 6}, {"X--5M", 0, 6});
}

/* NIN-011: X and Y move nothing, and stay */
static void test_x_and_y_move_nothing(void)
{
    ninja_home();
    ninja_type("V63X50Y60X70 ");
    image_run(SECOND);
    TEST_ASSERT_EQUAL(0, ninja_count(AXIS_X, NINJA_ON) + ninja_count(AXIS_Y, NINJA_ON));
    ninja_type("M");
    ninja_rest(SECOND);
    ninja_assert_at(70, 60);
    ninja_type("X0MY0M"); /* each leaves the other */
    ninja_rest(5 * SECOND);
    ninja_assert_at(0, 0);
    ninja_type("X20Y30MCM"); /* C too */
    ninja_rest(20 * SECOND);
    ninja_assert_at(20, 30);
}

/* NIN-016: relative; X and Y become where it leads */
static void test_increments_are_relative(void)
{
    ASSERT_CASES({"X10Y0I", 10, 0}, {"M", 10, 0}, {"I", 20, 0}, {"X-5Y7I", 15, 7}, {"X1800Y550I", 1800, 550},
                 {"X-5Y-5I", 1795, 545}, {"X0Y0I", 1795, 545}, {"X-1800Y-1200I", -5, -655}, {"X-1800Y-1200I", -1800, -1200});
}

/* NIN-015, NIN-019: P waits for the end of motion, then so many tenths of a second */
static void test_pauses_are_tenths_of_a_second(void)
{
    static const unsigned tenths[] = {0, 1, 10, 37};
    ninja_home();
    for (size_t i = 0; i < sizeof tenths / sizeof tenths[0]; i++) {
        char text[40];
        snprintf(text, sizeof text, "V63X40MP%uX0S", tenths[i]);
        ninja_forget();
        ninja_type(text);
        image_run(tenths[i] * SECOND / 10 + 2 * SECOND);
        ninja_rest(5 * SECOND);
        const uint64_t off = ninja_cycle(AXIS_X, NINJA_OFF, 0);
        TEST_ASSERT_EQUAL(0, ninja_platform(AXIS_X));
        const double pause = (double)(ninja_cycle(AXIS_X, NINJA_ON, 1) - off) / MS;
        image_assert_near("pause in ms", tenths[i] * 100.0 + 0.3, pause, 0.5);
    }
}

/* -- macros -------------------------------------------------------------------------------------------------------- */

/* NIN-020, NIN-022, NIN-023: not executed until R; what follows ) is */
static void test_a_macro_is_kept_and_run(void)
{
    ASSERT_CASES({"X5(X20MY10MX-1M)", 0, 0}, {"M", 5, 0}, {"R", -1, 10}, {"X3Y3S", 3, 3}, {"r", -1, 10},
                 {"(C)X0Y0M", 0, 0});
    ninja_forget();
    ninja_type("(X20MX0MY15MY0M)RX8M"); /* X8M waits for its end */
    ninja_rest(10 * SECOND);
    ninja_assert_at(8, 0);
    TEST_ASSERT_EQUAL(3, ninja_count(AXIS_X, NINJA_ON));
    TEST_ASSERT_TRUE(ninja_last(AXIS_X, NINJA_ON) > ninja_last(AXIS_Y, NINJA_OFF));
}

/* NIN-020: a new one replaces the old one; "(" inside is nothing; R without a macro neither */
static void test_a_new_macro_replaces_the_old_one(void)
{
    ASSERT_CASES({"R", 0, 0}, {"(X10M)(Y9M)R", 0, 9}, {"((X4(M)R", 4, 9}, {"()RX2M", 2, 9}, {"RX1M", 1, 9});
}

/* Types in pieces that the FIFO has room for. */
static void type_slowly(const char *text)
{
    char byte[2] = "";
    for (; *text != '\0'; text++) {
        byte[0] = *text;
        ninja_type(byte);
    }
}

/* NIN-021: 21 commands of three bytes and ) fill it; a command more is left out, however short; a number takes two bytes
 * however long it is */
static void test_a_macro_has_64_bytes(void)
{
    static const char three[] = "X1X2X3X4X5X6X7X8X9X10X11X12X13X14X15X16X17X18X19";
    char text[200];
    ninja_home();
    ninja_type("V63");
    snprintf(text, sizeof text, "(%sX20X00021)RM", three); /* 21 * 3 + 1 */
    type_slowly(text);
    ninja_rest(SECOND);
    ninja_assert_at(21, 0);
    snprintf(text, sizeof text, "(%sX20X-1500M)R", three); /* M is the 64th */
    type_slowly(text);
    ninja_rest(10 * SECOND);
    ninja_assert_at(-1500, 0);
    snprintf(text, sizeof text, "(%sX20X-1400MC)R", three); /* C is left out, ) too, and still ends it */
    type_slowly(text);
    ninja_rest(10 * SECOND);
    ninja_assert_at(-1400, 0);
    snprintf(text, sizeof text, "(%sX20MMX5M)RM", three); /* 62, where X5 does not fit and M does */
    type_slowly(text);
    ninja_rest(10 * SECOND);
    ninja_assert_at(20, 0);
    snprintf(text, sizeof text, "(%sX20X-1500Y9M)RX3M", three); /* 63, where Y9 does not fit: not a part of it */
    type_slowly(text);
    ninja_rest(20 * SECOND);
    ninja_assert_at(3, 0);
}

/* NIN-023, NIN-024, NIN-027: an R at its end repeats it from its beginning until it is halted; it runs again at once */
static void test_a_macro_repeats_itself(void)
{
    ninja_home();
    ninja_type("V63(X20MX0MR)R");
    ninja_await(AXIS_X, NINJA_ON, 7, 10 * SECOND);
    ninja_type("\b");
    ninja_rest(SECOND);
    const size_t before = ninja_count(AXIS_X, NINJA_ON);
    image_run(2 * SECOND);
    TEST_ASSERT_EQUAL(before, ninja_count(AXIS_X, NINJA_ON));
    ninja_type("X-40S");
    ninja_rest(SECOND);
    ninja_forget();
    ninja_type("R");
    ninja_await(AXIS_X, NINJA_OFF, 1, 5 * SECOND);
    ninja_assert_at(20, 0); /* from its beginning */
    ninja_type("X5X5X5"); /* waits for ever */
    image_run(3 * SECOND);
    ninja_type("\022");
    ninja_rest(20 * SECOND);
    ninja_type("R");
    image_run(SECOND);
    ninja_assert_at(0, 0);
}

/* NIN-023: in the middle of a macro R begins again there and then */
static void test_an_r_in_the_middle_begins_again(void)
{
    ninja_home();
    ninja_type("V63(X20MX0MRY50M)R");
    image_run(5 * SECOND);
    ninja_type("\b");
    ninja_rest(SECOND);
    TEST_ASSERT_EQUAL(0, ninja_platform(AXIS_Y));
    TEST_ASSERT_GREATER_THAN(5, ninja_count(AXIS_X, NINJA_ON));
}

/* -- anything ------------------------------------------------------------------------------------------------------ */

/* Within the limits, as far as the platform has got; and coils are not on without a step. */
static void watch(uint64_t cycles)
{
    static const int low[AXES] = {NINJA_X_MIN, NINJA_Y_MIN};
    static const int high[AXES] = {NINJA_X_MAX, NINJA_Y_MAX};
    for (const uint64_t end = board_cycle(board) + cycles; board_cycle(board) < end;) {
        image_run(10 * MS);
        for (uint8_t axis = 0; axis < AXES; axis++) {
            const int position = ninja_platform(axis);
            if (position < low[axis] || position > high[axis])
                image_fail("%c stands at %d", "XY"[axis], position);
        }
        size_t count;
        const ninja_event_t *event = ninja_events(&count);
        if (ninja_current() && count > 0 && board_cycle(board) - event[count - 1].cycle > LONGEST_INTERVAL + 11 * MS)
            image_fail("coils are on without a step since %llu", (unsigned long long)event[count - 1].cycle);
        if (count > 10000)
            ninja_forget();
    }
}

/* NIN-002, NIN-008, NIN-009, NIN-010, NIN-030: of all kinds, and such as are commands; at the end it can be halted, and
 * used */
static void test_random_bytes_do_no_harm(void)
{
    static const char likely[] = "XYVMSICP()R0123456789-xym\b";
    const char *wanted = getenv("SAC_NINJA_BYTES");
    uint64_t seed = 3;
    for (int kind = 0; kind < 2; kind++) {
        ninja_home();
        for (unsigned long left = wanted ? strtoul(wanted, NULL, 0) : RANDOM_BYTES; left > 0; left--) {
            uint8_t byte = (uint8_t)splitmix64(&seed);
            if (kind == 1)
                byte = splitmix64(&seed) % 1000 ? (uint8_t)likely[byte % (sizeof likely - 1)] : 0x12;
            ninja_send(byte);
            if (left % 16 == 0)
                watch(16 * 10 * NINJA_BIT);
        }
        ninja_type("\b");
        ninja_rest(SECOND);
        TEST_ASSERT_FALSE(ninja_current());
        ninja_type("CX12Y-34S");
        image_run(SECOND);
        ninja_rest(60 * SECOND);
        ninja_assert_at(12, -34);
        if (kind == 0)
            ninja_off();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_line_is_at_4800_baud);
    RUN_TEST(test_nothing_is_transmitted);
    RUN_TEST(test_commands_are_letters_and_numbers);
    RUN_TEST(test_numbers_saturate);
    RUN_TEST(test_sixteen_bytes_wait);
    RUN_TEST(test_other_characters_are_ignored);
    RUN_TEST(test_x_and_y_move_nothing);
    RUN_TEST(test_increments_are_relative);
    RUN_TEST(test_pauses_are_tenths_of_a_second);
    RUN_TEST(test_a_macro_is_kept_and_run);
    RUN_TEST(test_a_new_macro_replaces_the_old_one);
    RUN_TEST(test_a_macro_has_64_bytes);
    RUN_TEST(test_a_macro_repeats_itself);
    RUN_TEST(test_an_r_in_the_middle_begins_again);
    RUN_TEST(test_random_bytes_do_no_harm);
    return UNITY_END();
}
