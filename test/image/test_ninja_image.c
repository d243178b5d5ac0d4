/* NIN on the whole image: build/ninja.elf on the board. Coil patterns as edges of their pins; the head's sensors are
 * scripted by its step counts. */
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <unity.h>
#include "board/board.h"
#include "ninja/path.h"

#define US 16ull
#define MS (1000 * US)
#define SECOND (1000 * MS)
#define BAUD 4800
#define BYTE_CYCLES (10 * 16000000ull / BAUD)
#define MOST_EVENTS 20000
#define HALTS 300
#define JITTER (5 * US) /* of the step interrupt, behind others */

static board_t *nano;

/* -- the oscilloscope ---------------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t cycle;
    uint8_t axis;
    enum { ON, OFF, UP, DOWN } what;
} event_t;

static event_t events[MOST_EVENTS];
static size_t event_count;
static struct {
    uint8_t coils;
    uint64_t changed; /* when */
    int pattern; /* the last one seen, n modulo 4 */
    long steps;  /* of the motor, since power-up */
    long edge;   /* the sensor is low from here on */
    int stuck;   /* level of the sensor, or -1 */
} axes[AXES];

static int pattern_of(uint8_t coils)
{
    static const uint8_t patterns[4] = {0x3, 0x6, 0xC, 0x9};
    for (int i = 0; i < 4; i++)
        if (patterns[i] == coils)
            return i;
    return -1;
}

static int sensor_level(uint8_t axis)
{
    return axes[axis].stuck >= 0 ? axes[axis].stuck : axes[axis].steps < axes[axis].edge;
}

static void note(uint64_t cycle, uint8_t axis, int what)
{
    if (event_count < MOST_EVENTS)
        events[event_count++] = (event_t){cycle, axis, what};
}

/* A step changes two pins in the same cycle: what lies between is no pattern, and does not last. */
static void on_edge(void *ctx, board_edge_t edge)
{
    (void)ctx;
    const uint8_t axis = edge.pin >= BOARD_PIN('D', 0) ? AXIS_X : AXIS_Y;
    const uint8_t bit = (uint8_t)(1 << (axis == AXIS_X ? edge.pin - BOARD_PIN('D', 4) : edge.pin - BOARD_PIN('C', 0)));
    const uint8_t before = axes[axis].coils;
    if (edge.cycle != axes[axis].changed && before != 0 && pattern_of(before) < 0)
        TEST_FAIL_MESSAGE("other than two coils were on"); /* NIN-030 */
    axes[axis].changed = edge.cycle;
    axes[axis].coils = (uint8_t)(edge.level ? before | bit : before & ~bit);
    if (axes[axis].coils == 0) {
        note(edge.cycle, axis, OFF);
        return;
    }
    const int pattern = pattern_of(axes[axis].coils);
    if (pattern < 0)
        return;
    const int change = (pattern - axes[axis].pattern) & 3;
    axes[axis].pattern = pattern;
    if (change == 0) {
        note(edge.cycle, axis, ON);
        return;
    }
    if (change == 2)
        TEST_FAIL_MESSAGE("a pattern was left out");
    axes[axis].steps += change == 1 ? 1 : -1;
    note(edge.cycle, axis, change == 1 ? UP : DOWN);
    board_pin_drive_at(nano, BOARD_PIN('B', axis), sensor_level(axis), edge.cycle + US);
}

static void clear_events(void)
{
    event_count = 0;
}

static size_t count_of(uint8_t axis, int what)
{
    size_t count = 0;
    for (size_t i = 0; i < event_count; i++)
        count += events[i].axis == axis && (int)events[i].what == what;
    return count;
}

static uint64_t cycle_of(uint8_t axis, int what, size_t which)
{
    for (size_t i = 0; i < event_count; i++)
        if (events[i].axis == axis && (int)events[i].what == what && which-- == 0)
            return events[i].cycle;
    TEST_FAIL_MESSAGE("no such event");
    return 0;
}

static void assert_near(const char *what, uint64_t expected, uint64_t seen, uint64_t tolerance)
{
    char text[200];
    snprintf(text, sizeof text, "%s: expected %" PRIu64 " cycles within %" PRIu64 ", saw %" PRIu64, what, expected,
             tolerance, seen);
    TEST_ASSERT_TRUE_MESSAGE(seen + tolerance >= expected && seen <= expected + tolerance, text);
}

/* -- the head ------------------------------------------------------------------------------------------------------ */

static void run(uint64_t cycles)
{
    TEST_ASSERT_EQUAL_MESSAGE(BOARD_RAN, board_run_for(nano, cycles), board_crash(nano));
}

static void power_on(long x_edge, long y_edge, int x_stuck, int y_stuck)
{
    nano = board_new(NINJA_ELF, NULL);
    TEST_ASSERT_NOT_NULL(nano);
    board_uart_baud(nano, BAUD);
    const long edge[AXES] = {x_edge, y_edge};
    const int stuck[AXES] = {x_stuck, y_stuck};
    for (uint8_t axis = 0; axis < AXES; axis++) {
        axes[axis].coils = 0;
        axes[axis].changed = 0;
        axes[axis].pattern = 0;
        axes[axis].steps = 0;
        axes[axis].edge = edge[axis];
        axes[axis].stuck = stuck[axis];
        board_pin_drive(nano, BOARD_PIN('B', axis), sensor_level(axis));
        for (uint8_t coil = 0; coil < 4; coil++)
            board_record(nano, axis == AXIS_X ? BOARD_PIN('D', 4 + coil) : BOARD_PIN('C', coil), true);
    }
    clear_events();
    board_on_edge(nano, on_edge, NULL);
}

static void say(const char *text)
{
    board_uart_send_text(nano, text);
    while (board_uart_sending(nano))
        run(100 * US);
}

static bool at_rest(void)
{
    return (axes[AXIS_X].coils | axes[AXIS_Y].coils) == 0;
}

/* Nothing has been energised for 100 ms. */
static void rest(uint64_t most)
{
    uint64_t still = 0;
    for (uint64_t passed = 0; still < 100 * MS; passed += MS) {
        TEST_ASSERT_TRUE_MESSAGE(passed < most, "the head does not come to rest");
        run(MS);
        still = at_rest() ? still + MS : 0;
    }
}

static void home(void)
{
    power_on(-40, -30, -1, -1); /* it stands on the positive side of both */
    rest(60 * SECOND);
    clear_events();
}

void setUp(void)
{
}

void tearDown(void)
{
    size_t count;
    board_uart_received(nano, &count);
    int pull_ups = 0;
    for (uint8_t axis = 0; axis < AXES; axis++) {
        board_pin_drive(nano, BOARD_PIN('B', axis), -1);
        pull_ups += board_pin_level(nano, BOARD_PIN('B', axis));
    }
    pull_ups += board_pin_level(nano, BOARD_PIN('D', 1)); /* the transmitter's is not driven either */
    board_free(nano);
    nano = NULL;
    TEST_ASSERT_EQUAL_MESSAGE(0, count, "something was transmitted"); /* NIN-002 */
    TEST_ASSERT_EQUAL(3, pull_ups);
}

/* -- centring ------------------------------------------------------------------------------------------------------ */

/* NIN-017, NIN-018: one axis after the other; the last step of each is the one that changes its sensor, upwards and
 * slowly */
static void test_at_power_up_it_centres(void)
{
    const long starts[][2] = {{-40, -30}, {40, 30}, {1700, -500}, {1, 0}};
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++) {
        power_on(starts[i][0], starts[i][1], -1, -1);
        rest(60 * SECOND);
        bool y_begun = false;
        for (size_t e = 0; e < event_count; e++) {
            y_begun |= events[e].axis == AXIS_Y;
            TEST_ASSERT_TRUE_MESSAGE(!y_begun || events[e].axis == AXIS_Y, "X moves after Y has begun");
        }
        for (uint8_t axis = 0; axis < AXES; axis++) {
            TEST_ASSERT_EQUAL(axes[axis].edge, axes[axis].steps);
            const size_t ups = count_of(axis, UP);
            TEST_ASSERT_GREATER_THAN(NINJA_RUN_UP, ups);
            assert_near("approach", SECOND / NINJA_APPROACH_STEPS_PER_S,
                        cycle_of(axis, UP, ups - 1) - cycle_of(axis, UP, ups - 2), JITTER);
        }
        if (i != 3)
            tearDown();
    }
}

/* NIN-017: and the other one is still tried */
static void test_a_sensor_that_never_changes_is_given_up(void)
{
    for (int level = 0; level < 2; level++) {
        power_on(0, 100, level, -1);
        rest(60 * SECOND);
        const size_t bound = NINJA_X_MAX - NINJA_X_MIN + NINJA_SEARCH_MARGIN + NINJA_BACKLASH_X;
        TEST_ASSERT_EQUAL(bound, count_of(AXIS_X, level ? UP : DOWN));
        TEST_ASSERT_EQUAL(0, count_of(AXIS_X, level ? DOWN : UP));
        TEST_ASSERT_EQUAL(100, axes[AXIS_Y].steps);
        if (level == 0)
            tearDown();
    }
}

/* -- the line ------------------------------------------------------------------------------------------------------ */

/* Of USART0 (datasheet, register summary). */
enum { UCSR0A = 0xC0, UCSR0B = 0xC1, UCSR0C = 0xC2, UBRR0 = 0xC4, U2X = 1 << 1, TXEN = 1 << 3, RXEN = 1 << 4 };

static bool transmits(board_t *b, void *ctx)
{
    (void)ctx;
    return (board_peek8(b, UCSR0B) & TXEN) != 0;
}

/* NIN-001, NIN-002: 4,800 Bd within 0.1 %, 8N1; the transmitter is off at any moment */
static void test_the_line_is_only_listened_to(void)
{
    home();
    const unsigned samples = board_peek8(nano, UCSR0A) & U2X ? 8 : 16;
    TEST_ASSERT_DOUBLE_WITHIN(4.8, 4800, 16e6 / samples / (board_peek16(nano, UBRR0) + 1));
    TEST_ASSERT_EQUAL_HEX8(0x06, board_peek8(nano, UCSR0C));
    TEST_ASSERT_EQUAL_HEX8(RXEN, board_peek8(nano, UCSR0B) & (RXEN | TXEN));
    board_uart_send_text(nano, "X10Y10M?\r\b");
    TEST_ASSERT_EQUAL(BOARD_RAN, board_run_until(nano, transmits, NULL, 100 * MS));
    for (double baud = 4704; baud < 4900; baud += 192) { /* 2 % off */
        board_uart_baud(nano, baud);
        clear_events();
        say("V63X20Y20MX0Y0M");
        rest(5 * SECOND);
        TEST_ASSERT_EQUAL(2, count_of(AXIS_X, ON));
    }
}

/* -- moves --------------------------------------------------------------------------------------------------------- */

/* NIN-001, NIN-007, NIN-009, NIN-010, NIN-014, NIN-030: from the start interval to the closing one */
static void test_a_move_has_its_steps_and_times(void)
{
    home();
    say("X20Y-10V63M");
    run(5 * MS);
    TEST_ASSERT_EQUAL(2, event_count); /* both are energised at once */
    rest(5 * SECOND);
    TEST_ASSERT_EQUAL(20, count_of(AXIS_X, UP));
    TEST_ASSERT_EQUAL(10 + NINJA_BACKLASH_Y, count_of(AXIS_Y, DOWN));
    TEST_ASSERT_EQUAL(20 + 16 + 4, event_count);
    const uint64_t on = cycle_of(AXIS_X, ON, 0);
    assert_near("both on", on, cycle_of(AXIS_Y, ON, 0), US);
    assert_near("start interval", SECOND / NINJA_START_STEPS_PER_S, cycle_of(AXIS_X, UP, 0) - on, 10 * US);
    const uint64_t last = cycle_of(AXIS_X, UP, 19);
    assert_near("last steps", last, cycle_of(AXIS_Y, DOWN, 15), 5 * US);
    assert_near("closing interval", SECOND / NINJA_START_STEPS_PER_S, cycle_of(AXIS_X, OFF, 0) - last, JITTER);
    assert_near("both off", cycle_of(AXIS_X, OFF, 0), cycle_of(AXIS_Y, OFF, 0), US);
}

static uint16_t address_of(const char *symbol)
{
    uint16_t address;
    TEST_ASSERT_TRUE_MESSAGE(board_symbol(nano, symbol, &address), symbol);
    return address;
}

/* NIN-014: the ring is made to look empty for a while: what comes too late begins late, and no step is lost */
static void test_a_late_planner_loses_no_step(void)
{
    home();
    say("X6V63M");
    run(10 * MS); /* all waits are in the ring by now */
    const uint16_t head = address_of("head");
    const uint8_t filled = board_peek8(nano, head);
    board_poke8(nano, head, board_peek8(nano, address_of("tail")));
    run(30 * MS);
    TEST_ASSERT_EQUAL(1, count_of(AXIS_X, UP));
    board_poke8(nano, head, filled);
    const uint64_t then = board_cycle(nano);
    rest(SECOND);
    TEST_ASSERT_EQUAL(6, count_of(AXIS_X, UP));
    assert_near("first interval", (uint64_t)(16e6 * sqrt(2.0 / NINJA_ACCELERATION)), cycle_of(AXIS_X, UP, 1) - then,
                MS / 4);
    TEST_ASSERT_EQUAL(1, count_of(AXIS_X, OFF));
}

static bool all_off(board_t *b, void *ctx)
{
    (void)ctx;
    int on = 0;
    for (uint8_t coil = 0; coil < 4; coil++)
        on += board_pin_level(b, BOARD_PIN('D', 4 + coil)) + board_pin_level(b, BOARD_PIN('C', coil));
    return on == 0;
}

/* NIN-030: a program that hangs in the middle of a move leaves no coil on */
static void test_the_watchdog_switches_the_coils_off(void)
{
    home();
    say("X500V63M");
    run(200 * MS);
    TEST_ASSERT_FALSE(at_rest());
    board_on_edge(nano, NULL, NULL);
    board_hang(nano);
    TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_until(nano, all_off, NULL, 150 * MS));
    run(MS); /* it boots */
}

/* NIN-012, NIN-013: each V's step in the middle of a move, within what the interrupt's latency makes of 0.5 us */
static void test_all_velocities(void)
{
    home();
    for (int v = 0; v < 64; v++) {
        char line[40];
        const int steps = v < 30 ? 8 : 300;
        clear_events();
        snprintf(line, sizeof line, "X%dV%dIX0S", steps, v);
        say(line);
        while (count_of(AXIS_X, OFF) == 0)
            run(MS);
        const size_t middle = (size_t)steps / 2;
        assert_near(line, (uint64_t)(16e6 / (8 * pow(62.5, v / 63.0))),
                    cycle_of(AXIS_X, UP, middle) - cycle_of(AXIS_X, UP, middle - 1), JITTER);
        rest(5 * SECOND);
    }
}

/* NIN-012: 125 ms a step are exact, and there is no drift */
static void test_the_slowest_moves_are_even(void)
{
    home();
    say("X10V0M");
    rest(5 * SECOND);
    TEST_ASSERT_EQUAL(0, count_of(AXIS_Y, ON));
    for (size_t k = 1; k < 10; k++)
        assert_near("step", k * 125 * MS, cycle_of(AXIS_X, UP, k) - cycle_of(AXIS_X, UP, 0), JITTER);
    assert_near("off", 10 * 125 * MS, cycle_of(AXIS_X, OFF, 0) - cycle_of(AXIS_X, UP, 0), JITTER);
}

/* NIN-019: between two moves */
static void test_a_pause_begins_when_motion_is_over(void)
{
    home();
    say("X10V63MP3X0M");
    run(5 * SECOND);
    assert_near("pause", 300 * MS, cycle_of(AXIS_X, ON, 1) - cycle_of(AXIS_X, OFF, 0), MS);
}

/* NIN-029 */
static void test_sensors_are_for_centring_alone(void)
{
    home();
    say("X300Y-200V63M");
    for (int i = 0; i < 200; i++) {
        for (uint8_t axis = 0; axis < AXES; axis++)
            axes[axis].stuck = i >> axis & 1;
        run(5 * MS);
    }
    rest(5 * SECOND);
    TEST_ASSERT_EQUAL(axes[AXIS_X].edge + 300, axes[AXIS_X].steps);
    TEST_ASSERT_EQUAL(axes[AXIS_Y].edge - 200 - NINJA_BACKLASH_Y, axes[AXIS_Y].steps);
}

/* NIN-014: what a move of both axes at top speed takes of the processor */
static void test_the_processor_has_room(void)
{
    enum { TIMER1_COMPA = 11 };
    uint16_t path_next;
    home();
    say("X701Y-333V63M");
    board_measures_clear(nano);
    uint64_t longest = 0;
    if (board_symbol(nano, "path_next", &path_next)) { /* unless the compiler has drawn it into its caller */
        while (board_run_to_pc(nano, path_next, 100 * MS) == BOARD_MATCHED) {
            const uint64_t begun = board_cycle(nano);
            TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_past(nano, path_next, 100 * MS));
            if (board_cycle(nano) - begun > longest)
                longest = board_cycle(nano) - begun;
        }
    }
    rest(5 * SECOND);
    const board_measures_t *seen = board_measures(nano);
    printf("step interrupt %u cycles at most, planning %" PRIu64 ", %.0f %% of the time asleep\n",
           seen->isr[TIMER1_COMPA].cycles_max, longest, 100. * (double)seen->sleep_cycles / (double)seen->cycles);
    TEST_ASSERT_LESS_THAN(400, seen->isr[TIMER1_COMPA].cycles_max);
    TEST_ASSERT_LESS_THAN(2 * MS, longest); /* a step at top speed */
}

/* -- halt ---------------------------------------------------------------------------------------------------------- */

/* NIN-006, NIN-025, NIN-026: at random moments of moves at random velocities, with the FIFO full */
static void test_a_halt_takes_effect_within_an_interval(void)
{
    home();
    for (int i = 0; i < HALTS; i++) {
        char line[40];
        const int v = i % 5 == 0 ? 0 : i * 63 / (HALTS - 1);
        snprintf(line, sizeof line, "Y0V%dX%dM", v, i % 2 ? -300 : 300);
        say(line);
        run((50 + (uint64_t)i * 37 % 500) * MS + (uint64_t)i * 137 * US);
        say("Y100MY0MY100MY0M");
        say("Y5"); /* dropped */
        clear_events();
        const uint64_t begun = board_cycle(nano);
        board_uart_send(nano, "\b", 1);
        const uint64_t end = begun + BYTE_CYCLES;
        run(400 * MS);
        TEST_ASSERT_TRUE(at_rest());
        const double cruise = 16e6 / (8 * pow(62.5, v / 63.0));
        const double first = 16e6 * sqrt(2.0 / NINJA_ACCELERATION); /* of a ramp, the longest one */
        const uint64_t interval = (uint64_t)(v < 28 || cruise > first ? fmax(cruise, 20 * MS) : first) + JITTER;
        uint64_t last = 0;
        for (size_t e = 0; e < event_count; e++) {
            TEST_ASSERT_EQUAL(AXIS_X, events[e].axis);
            TEST_ASSERT_TRUE_MESSAGE(events[e].what == OFF || events[e].cycle < end, "a step after the halt");
            if (events[e].what != OFF)
                last = events[e].cycle;
        }
        TEST_ASSERT_EQUAL(1, count_of(AXIS_X, OFF));
        const uint64_t off = cycle_of(AXIS_X, OFF, 0);
        TEST_ASSERT_TRUE(off < end + interval);
        if (last != 0)
            TEST_ASSERT_TRUE(off - last <= interval);
    }
    say("X0Y0V63M");
    rest(30 * SECOND);
    say("X-50SX0S"); /* the backlash is on the positive side again */
    rest(30 * SECOND);
    TEST_ASSERT_EQUAL(axes[AXIS_X].edge, axes[AXIS_X].steps);
    TEST_ASSERT_EQUAL(axes[AXIS_Y].edge, axes[AXIS_Y].steps);
}

/* NIN-006, NIN-025: even if the main loop does not come round: the step interrupt sees it */
static void test_a_halt_needs_no_main_loop(void)
{
    for (int i = 0; i < 2; i++) {
        home();
        say("X300V63M");
        run(400 * MS);
        board_hang(nano);
        clear_events();
        board_uart_send(nano, i ? "\b" : "\022", 1);
        run(BYTE_CYCLES);
        const size_t steps = count_of(AXIS_X, UP);
        run(5 * MS);
        TEST_ASSERT_EQUAL(steps, count_of(AXIS_X, UP));
        TEST_ASSERT_TRUE(at_rest());
        if (i == 0)
            tearDown();
    }
}

/* NIN-024, NIN-025, NIN-027, NIN-028 */
static void test_a_macro_repeats_until_it_is_halted(void)
{
    home();
    say("V63(X10MX0MR)R");
    run(3 * SECOND);
    TEST_ASSERT_GREATER_THAN(2, count_of(AXIS_X, ON));
    say("\b");
    rest(SECOND);
    clear_events();
    say("R");
    run(3 * SECOND);
    TEST_ASSERT_GREATER_THAN(2, count_of(AXIS_X, ON));
    say("\022");
    rest(60 * SECOND);
    TEST_ASSERT_EQUAL(axes[AXIS_X].edge, axes[AXIS_X].steps);
    clear_events();
    say("R");
    run(SECOND);
    TEST_ASSERT_EQUAL(0, event_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_at_power_up_it_centres);
    RUN_TEST(test_a_sensor_that_never_changes_is_given_up);
    RUN_TEST(test_a_move_has_its_steps_and_times);
    RUN_TEST(test_a_late_planner_loses_no_step);
    RUN_TEST(test_the_watchdog_switches_the_coils_off);
    RUN_TEST(test_all_velocities);
    RUN_TEST(test_the_slowest_moves_are_even);
    RUN_TEST(test_a_pause_begins_when_motion_is_over);
    RUN_TEST(test_sensors_are_for_centring_alone);
    RUN_TEST(test_the_processor_has_room);
    RUN_TEST(test_a_halt_takes_effect_within_an_interval);
    RUN_TEST(test_a_halt_needs_no_main_loop);
    RUN_TEST(test_the_line_is_only_listened_to);
    RUN_TEST(test_a_macro_repeats_until_it_is_halted);
    return UNITY_END();
}
