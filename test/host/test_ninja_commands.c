/* ninja/commands: numbers, the FIFO, macros, what waits and what does not; and under bytes of all kinds. The whole
 * firmware above its ports, on a head that plays its waits. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "host/fakes/head_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "ninja/centre.h"
#include "ninja/commands.h"
#include "ninja/drive.h"
#include "ninja/path.h"
#include "ninja/pause.h"
#include "splitmix64.h"
#include "unity.h"

#define DEFAULT_BYTES 100000
#define MOST_WAITS 100000

void setUp(void)
{
    head_boot();
    TEST_ASSERT_TRUE(head_rest(MOST_WAITS));
    head_fake_forget();
}

void tearDown(void) {}

static void assert_at(int x, int y)
{
    TEST_ASSERT_TRUE(head_rest(MOST_WAITS));
    TEST_ASSERT_EQUAL_MESSAGE(x, path_position(AXIS_X), "X");
    TEST_ASSERT_EQUAL_MESSAGE(y, path_position(AXIS_Y), "Y");
}

/* Says it and looks where that has led. */
static void leads_to(const char *line, int x, int y)
{
    head_say(line);
    assert_at(x, y);
}

/* The time that a step takes at full speed, in the middle of a move. */
static double middle_us(void)
{
    const head_event_t *middle = &head_events[head_event_count / 2];
    return (double)(middle[1].ticks - middle[0].ticks) * 1e6 / STEPPER_HZ;
}

/* -- commands and numbers ------------------------------------------------------------------------------------------ */

/* NIN-003, NIN-007, NIN-008 */
static void test_letters_of_either_case_in_a_stream(void)
{
    leads_to("x100Y-50v63m", 100, -50);
    leads_to("X110,?Y5 M", 110, 5);
    leads_to("\r\nX 7M", 0, 5);       /* the blank ends the number: missing */
    leads_to("X-+5 Y+9M", 0, 9);      /* one sign; what follows is ignored */
    leads_to("X12-3M", 12, 9);        /* a number ends where no digit comes */
    leads_to("5X33!44mA", 33, 9);
    leads_to("X\3775M", 0, 9);        /* a damaged byte */
    leads_to("YX-M", 0, 0);
}

/* NIN-003: a letter with a number takes effect with the next byte of any kind */
static void test_a_number_ends_with_the_next_byte(void)
{
    head_say("X10MX-20");
    assert_at(10, 0);
    head_say("\r");
    leads_to("M", -20, 0);
}

/* NIN-004, NIN-009, NIN-010, NIN-011 */
static void test_positions_saturate(void)
{
    leads_to("V63X1801Y551M", 1800, 550);
    leads_to("X-1801Y-1201M", -1800, -1200);
    leads_to("X99999999999999999999Y99999999999999999999M", 1800, 550);
    leads_to("X-99999999999999999999Y-99999999999999999999M", -1800, -1200);
    leads_to("X65535Y65535M", 1800, 550);
    leads_to("X-32768Y-32768M", -1800, -1200);
    leads_to("X00000000000000000000001800Y-0M", 1800, 0);
    head_fake_forget();
    leads_to("X3Y4", 1800, 0);
    TEST_ASSERT_EQUAL(0, head_moves);
}

/* NIN-012, NIN-013, NIN-015: V's 64 velocities, all others are 63; S has the last, and leaves V as it is */
static void test_velocities(void)
{
    double before = 1e9;
    for (int v = -3; v <= 66; v++) {
        char line[40];
        setUp();
        snprintf(line, sizeof line, "V%dX350M", v);
        leads_to(line, 350, 0);
        const double us = middle_us();
        const int taken = v < 0 || v > 63 ? 63 : v;
        TEST_ASSERT_DOUBLE_WITHIN(0.5001, 125000 / pow(62.5, taken / 63.), us);
        TEST_ASSERT_TRUE(v < 1 || v > 63 || us < before);
        before = us;
    }
    setUp();
    leads_to("X350V10SX700", 350, 0);
    TEST_ASSERT_EQUAL_DOUBLE(2000, middle_us());
    head_fake_forget();
    leads_to("M", 700, 0);
    TEST_ASSERT_TRUE(middle_us() > 60000);
    setUp();
    leads_to("X350M", 350, 0); /* after power-up */
    TEST_ASSERT_DOUBLE_WITHIN(0.5001, 125000 / pow(62.5, NINJA_POWER_UP_V / 63.), middle_us());
}

/* NIN-016 */
static void test_increments(void)
{
    leads_to("X10Y-5I", 10, -5);
    leads_to("M", 10, -5);
    leads_to("I", 20, -10);
    leads_to("X1700Y0IM", 1720, -10);
    leads_to("X100Y0I", 1800, -10);
    leads_to("X-1Y-1I", 1799, -11);
    leads_to("V63X-32768Y-32768I", -1, -1200); /* X saturates before, too */
}

/* NIN-005, NIN-011: M, S, I, C and P wait for the motion before; X, Y and V do not */
static void test_what_waits_for_motion(void)
{
    const char *const waiting[] = {"M", "S", "I", "C", "P1M"};
    for (unsigned i = 0; i < 5; i++) {
        setUp();
        head_say("X100M");
        head_say(waiting[i]);
        head_say("X50");
        TEST_ASSERT_EQUAL(1, head_moves);
        TEST_ASSERT_TRUE(head_rest(MOST_WAITS));
    }
    setUp();
    head_say("X100MX50Y7V63");
    TEST_ASSERT_EQUAL(1, head_moves);
    leads_to("M", 50, 7);
    TEST_ASSERT_EQUAL(2, head_moves);
}

/* NIN-019: n tenths after the closing interval; 16 bits without sign */
static void test_pauses(void)
{
    const struct {
        const char *text;
        unsigned tenths;
    } cases[] = {{"P3", 3},           {"P", 0},        {"P0", 0},           {"P65535", 65535},
                 {"P65536", 65535}, {"P-1", 65535}, {"P-32769", 32768}};
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        setUp();
        head_say("X10M");
        head_say(cases[i].text);
        head_say("X20M");
        assert_at(20, 0);
        unsigned end = 0;
        while (head_events[end].axes != 0)
            end++;
        TEST_ASSERT_EQUAL_UINT64((uint64_t)cases[i].tenths * STEPPER_HZ / 10,
                                 head_events[end + 1].ticks - head_events[end].ticks);
    }
}

/* NIN-019: its tenths add up, whenever it is polled */
static void test_a_pause_does_not_drift(void)
{
    timebase_fake_us = UINT32_MAX - 5000000;
    const uint32_t begun = timebase_fake_us;
    timebase_fake_step_us = 70;
    pause_begin(100);
    while (pause_poll()) {
    }
    TEST_ASSERT_UINT32_WITHIN(140, 10000000, timebase_fake_us - begun);
}

/* -- the FIFO ------------------------------------------------------------------------------------------------------ */

/* NIN-005: 16 bytes, in sequence; the 17th is lost */
static void test_the_fifo_holds_sixteen_bytes(void)
{
    head_say("V63X100M");
    head_say("MX9MX8MX7MX6MY5M"); /* 16 */
    head_say("Y1Y2");             /* lost */
    assert_at(6, 5);
    TEST_ASSERT_EQUAL(6, head_moves);
    head_say("V63X100M");
    head_say("MX9MX8MX7MX6MX54M"); /* the last byte is lost */
    leads_to("\r", 6, 5);
    leads_to("M", 54, 5);
}

/* NIN-006, NIN-025: with a full FIFO, in each state; the number that was being read is gone, too */
static void test_a_halt_purges_everything_but_the_macro(void)
{
    leads_to("(X5M)", 0, 0);
    head_say("V63X1000M");
    for (int i = 0; i < 50; i++) {
        head_fake_play();
        head_settle();
    }
    head_say("MX9MX8MX7MX6MY5MX9");
    head_say("\b");
    TEST_ASSERT_TRUE(head_rest(2));
    TEST_ASSERT_EQUAL(50, path_position(AXIS_X));
    TEST_ASSERT_EQUAL(50, head_counts[AXIS_X]);
    TEST_ASSERT_EQUAL(0, path_position(AXIS_Y));
    leads_to("X7\b8M", 1000, 0); /* X is what it was, 8 is nothing */
    leads_to("R", 5, 0);
    head_say("P100X6M");
    TEST_ASSERT_TRUE(pause_runs());
    head_say("\b");
    TEST_ASSERT_FALSE(pause_runs());
    assert_at(5, 0);
    head_say("C");
    TEST_ASSERT_TRUE(centre_runs());
    head_say("\b");
    TEST_ASSERT_TRUE(head_rest(2));
}

/* NIN-026: what was begun is completed by M or S */
static void test_a_move_is_resumed(void)
{
    for (unsigned waits = 0; waits < 60; waits++) {
        setUp();
        head_say("V63X-30Y20M");
        for (unsigned i = 0; i < waits; i++) {
            head_fake_play();
            head_settle();
        }
        head_say("\b");
        leads_to(waits % 2 ? "M" : "S", -30, 20);
        TEST_ASSERT_EQUAL(-30 - NINJA_BACKLASH_X, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(20, head_counts[AXIS_Y]);
    }
}

/* -- macros -------------------------------------------------------------------------------------------------------- */

/* NIN-020, NIN-022, NIN-023 */
static void test_a_macro_is_kept_and_run(void)
{
    leads_to("V63(x10Y-20MP5X0M)", 0, 0);
    TEST_ASSERT_EQUAL(0, head_moves);
    leads_to("R", 0, -20);
    TEST_ASSERT_EQUAL(2, head_moves);
    leads_to("X5Y5MR", 0, -20);
    leads_to("(X3M)RX4", 3, -20); /* the one before is cleared */
    leads_to("M", 4, -20);
    leads_to("R", 3, -20);
    leads_to("()R", 3, -20);
    TEST_ASSERT_EQUAL(8, head_moves);
}

static void define(unsigned commands, const char *more)
{
    head_say("(");
    for (unsigned i = 0; i < commands; i++) {
        char command[16];
        snprintf(command, sizeof command, "X%u", i + 1);
        head_say(command);
    }
    head_say(more);
    head_say("X777Y7M");
    assert_at(777, 7);
    head_say("R");
    TEST_ASSERT_TRUE(head_rest(MOST_WAITS));
}

/* NIN-021: 21 commands with numbers and ) fill it; what does not fit is left out whole, ) always closes */
static void test_a_macro_holds_64_bytes(void)
{
    define(20, "MY5)"); /* 60 + 1 + 3: no room for ), which closes all the same */
    leads_to("M", 20, 5);
    setUp();
    define(21, "MY5)"); /* 63 + 1 */
    leads_to("", 21, 7);
    setUp();
    define(21, ")");
    leads_to("M", 21, 7);
    setUp();
    define(22, "MS)"); /* the 22nd and S have no room */
    leads_to("", 21, 7);
    setUp();
    define(20, "MMX50M)"); /* 62: no room for X50, but for M and ) */
    leads_to("", 20, 7);
    leads_to("M", 20, 7);
}

/* NIN-020: each value as its command takes it, in two bytes */
static void test_numbers_in_a_macro(void)
{
    leads_to("(V63X-1M)R", -1, 0);
    leads_to("(X65535Y-32768M)R", 1800, -1200);
    leads_to("(XYM)R", 0, 0);
    head_fake_forget();
    leads_to("(X350V-1MP-1)R", 350, 0);
    TEST_ASSERT_EQUAL_DOUBLE(2000, middle_us());
    TEST_ASSERT_TRUE(head_ticks > (uint64_t)65535 * STEPPER_HZ / 10);
}

/* NIN-020: ( inside is ignored, a stray ) too */
static void test_brackets_where_they_have_no_meaning(void)
{
    leads_to(")X5M)", 5, 0);
    leads_to("(X6(M)R", 6, 0);
    leads_to("(X7M", 6, 0);
    leads_to("X8)R", 7, 0);
    leads_to("M", 8, 0);
}

/* NIN-023: nested: R repeats from the beginning, wherever it stands; with no macro it is nothing */
static void test_r_in_a_macro_repeats_it(void)
{
    leads_to("RX1M", 1, 0);
    head_say("(X10Y0IRX999M)X0R");
    for (int i = 0; i < 300; i++) {
        head_fake_play();
        head_settle();
    }
    head_say("\b");
    TEST_ASSERT_TRUE(head_rest(10));
    TEST_ASSERT_TRUE(path_position(AXIS_X) > 50);
    TEST_ASSERT_TRUE(head_moves > 5);
    head_say("(R)R"); /* nothing but that */
    TEST_ASSERT_FALSE(head_rest(100));
    head_say("X5MMMMMMMMMMMMMMMMMM\b");
    TEST_ASSERT_TRUE(head_rest(10));
}

/* NIN-024, NIN-025, NIN-027: what arrives meanwhile waits; a halt ends it, and the next run begins at its beginning */
static void test_a_halted_macro_begins_anew(void)
{
    head_say("V63(X10MX20MX0MR)R");
    for (int i = 0; i < 200; i++) {
        head_fake_play();
        head_settle();
    }
    head_say("Y9");
    TEST_ASSERT_TRUE(head_moves > 4);
    head_say("\b");
    TEST_ASSERT_TRUE(head_rest(2));
    leads_to("X500M", 500, 0);
    head_fake_forget();
    head_say("R");
    for (int i = 0; i < 600; i++) {
        head_fake_play();
        head_settle();
    }
    head_say("\b");
    TEST_ASSERT_TRUE(head_rest(2));
    unsigned end = 0;
    while (head_events[end].axes != 0)
        end++;
    TEST_ASSERT_EQUAL(10 - NINJA_BACKLASH_X, head_events[end].counts[AXIS_X]); /* the first move was to 10 */
    leads_to("X0Y0M", 0, 0);
    head_fake_forget();
    leads_to("(X5MX7M)RY9M", 7, 9); /* Y9 waits until it has ended */
    TEST_ASSERT_EQUAL(3, head_moves);
}

/* NIN-025: a definition that is halted is discarded */
static void test_a_halt_discards_a_definition(void)
{
    leads_to("(X5M)", 0, 0);
    leads_to("(X6M\b", 0, 0);
    leads_to("R", 0, 0);
    leads_to("X7M", 7, 0);
}

/* -- reset --------------------------------------------------------------------------------------------------------- */

/* NIN-017, NIN-028 */
static void test_ctrl_r_is_as_a_power_up(void)
{
    head_edges[AXIS_X] = -30;
    head_edges[AXIS_Y] = 25;
    leads_to("V63X100Y100M(X5M)", 100, 100);
    head_say("X200M");
    head_fake_play();
    leads_to("\022", 0, 0);
    TEST_ASSERT_EQUAL(-30, head_counts[AXIS_X]);
    TEST_ASSERT_EQUAL(25, head_counts[AXIS_Y]);
    head_fake_forget();
    leads_to("RM", 0, 0);
    TEST_ASSERT_EQUAL(0, head_moves);
    leads_to("X350M", 350, 0);
    TEST_ASSERT_DOUBLE_WITHIN(0.5001, 125000 / pow(62.5, NINJA_POWER_UP_V / 63.), middle_us());
}

/* NIN-017: C keeps the registers and the macro */
static void test_centring_keeps_the_registers(void)
{
    leads_to("V63X350Y20(X5M)C", 0, 0);
    head_fake_forget();
    leads_to("M", 350, 20);
    TEST_ASSERT_EQUAL_DOUBLE(2000, middle_us());
    leads_to("R", 5, 20);
}

/* -- bytes of all kinds -------------------------------------------------------------------------------------------- */

static uint64_t number_from(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? strtoull(text, NULL, 0) : otherwise;
}

static uint8_t next_byte(uint64_t *seed)
{
    static const char useful[] = "XYVPMSICR()XYVPMM0123456789+- xym\r";
    const uint64_t bits = splitmix64(seed);
    if (bits % 8 == 0)
        return (uint8_t)(bits >> 8);
    if (bits % 300 == 1)
        return bits >> 60 == 0 ? 0x12 : '\b';
    return (uint8_t)useful[(bits >> 8) % (sizeof useful - 1)];
}

/* NIN-004, NIN-005, NIN-008, NIN-020: whatever comes, at whatever pace: no position that was asked for lies beyond the
 * limits, at rest no coil is on, and a halt always leads to rest. NINJA_BYTES, NINJA_SEED in the environment. */
static void test_bytes_of_all_kinds(void)
{
    const uint64_t bytes = number_from("NINJA_BYTES", DEFAULT_BYTES);
    uint64_t seed = number_from("NINJA_SEED", 1);
    head_edges[AXIS_X] = 3;
    for (uint64_t i = 0; i < bytes; i++) {
        const uint64_t bits = splitmix64(&seed);
        if (i % 1000 == 0) {
            head_fake_forget();
            head_stuck[AXIS_X] = bits % 8 == 0 ? (int)(bits >> 8 & 1) : -1;
        }
        commands_receive(next_byte(&seed));
        for (unsigned rounds = (unsigned)(bits >> 16) % 4; rounds != 0; rounds--)
            commands_poll();
        for (unsigned waits = bits >> 32 & 7 ? (unsigned)(bits >> 40) % 4 : 200; waits != 0; waits--) {
            head_settle();
            if (!head_fake_play() && pause_runs()) {
                timebase_fake_us += 100000;
                pause_poll();
            }
        }
        if (bits % 500 == 0) {
            commands_receive('\b');
            TEST_ASSERT_TRUE(head_rest(3));
            TEST_ASSERT_FALSE(drive_runs());
            if (head_event_count != 0 && head_event_count <= HEAD_EVENTS)
                TEST_ASSERT_EQUAL(0, head_events[head_event_count - 1].axes);
            commands_receive('M');
            while (!head_rest(MOST_WAITS)) {
            }
            TEST_ASSERT_TRUE(path_position(AXIS_X) >= NINJA_X_MIN && path_position(AXIS_X) <= NINJA_X_MAX);
            TEST_ASSERT_TRUE(path_position(AXIS_Y) >= NINJA_Y_MIN && path_position(AXIS_Y) <= NINJA_Y_MAX);
        }
    }
    printf("%" PRIu64 " bytes, %d %d\n", bytes, head_counts[AXIS_X], head_counts[AXIS_Y]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_letters_of_either_case_in_a_stream);
    RUN_TEST(test_a_number_ends_with_the_next_byte);
    RUN_TEST(test_positions_saturate);
    RUN_TEST(test_velocities);
    RUN_TEST(test_increments);
    RUN_TEST(test_what_waits_for_motion);
    RUN_TEST(test_pauses);
    RUN_TEST(test_a_pause_does_not_drift);
    RUN_TEST(test_the_fifo_holds_sixteen_bytes);
    RUN_TEST(test_a_halt_purges_everything_but_the_macro);
    RUN_TEST(test_a_move_is_resumed);
    RUN_TEST(test_a_macro_is_kept_and_run);
    RUN_TEST(test_a_macro_holds_64_bytes);
    RUN_TEST(test_numbers_in_a_macro);
    RUN_TEST(test_brackets_where_they_have_no_meaning);
    RUN_TEST(test_r_in_a_macro_repeats_it);
    RUN_TEST(test_a_halted_macro_begins_anew);
    RUN_TEST(test_a_halt_discards_a_definition);
    RUN_TEST(test_ctrl_r_is_as_a_power_up);
    RUN_TEST(test_centring_keeps_the_registers);
    RUN_TEST(test_bytes_of_all_kinds);
    return UNITY_END();
}
