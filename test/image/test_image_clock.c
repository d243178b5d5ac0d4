/* CLK, PIN on the whole image: the external clock on xclk, and ihd and xclk, which change each interval.
 *
 * What a motion looks like with an external clock is compared with what it looks like with the internal one: the same
 * lines, typed at a board of its own, times from the first pulse on. */
#include "image.h"
#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONG_WAIT (600 * SECOND)
#define XCLK BOARD_PIN('D', 5)
#define ONE_MHZ BOARD_PIN('B', 3)
#define ESTOP BOARD_PIN('D', 2)
#define SYNC BOARD_PIN('D', 3)

enum { TCCR1B = 0x81, CS_BITS = 7, CS_CPU = 1, CS_T1_RISING = 7 };

void setUp(void) {}

void tearDown(void)
{
    image_off();
}

/* -- boards -------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t xclk_hz; /* as it is configured; 0: internal clock */
    double hz;        /* driven on xclk; 0: nothing */
    bool own;         /* the unit's own 1 MHz is looped to it instead */
    board_tov_t tov;  /* firmware must bear both */
    unsigned ustep, pulse_us, slow_rpm, ihd, xclk;
} unit_t;

#define OWN_CLOCK {.xclk_hz = 1000000, .own = true}

static void boot(unit_t unit)
{
    image_off();
    image_power_on();
    board_fast_pwm_tov(board, unit.tov);
    if (unit.xclk_hz) {
        IMAGE_SET(internal_clock, 0);
        IMAGE_SET(xclk_hz, unit.xclk_hz);
    }
    IMAGE_SET(driver_id, 2); /* has every factor */
    IMAGE_SET(ustep, unit.ustep);
    IMAGE_SET(ihd_counts, unit.ihd);
    IMAGE_SET(xclk_counts, unit.xclk);
    if (unit.pulse_us)
        IMAGE_SET(pulse_us, unit.pulse_us);
    if (unit.slow_rpm)
        IMAGE_SET(slow_rpm, unit.slow_rpm);
    image_prompt();
    if (unit.own)
        board_pin_wire(board, ONE_MHZ, XCLK);
    else if (unit.hz > 0)
        board_pin_clock(board, XCLK, unit.hz);
}

/* CPU cycles of a tick. */
static double tick_of(unit_t unit)
{
    return unit.xclk_hz ? 16e6 / unit.xclk_hz : 1;
}

static void assert_position_is_what_was_made(void)
{
    int32_t shown = image_position();
    if (shown != train.position)
        image_fail("expected position %lld as the edges say, saw %ld", (long long)train.position, (long)shown);
}

/* Whole ticks, at least as long as was asked for; dir long enough before. */
static void assert_pulses_are_sound(unit_t unit)
{
    double tick = tick_of(unit);
    double width = (unit.pulse_us ? unit.pulse_us : 2) * 16;
    double most = ceil(width / tick) * tick;
    if ((double)train.high_min < width - 1 || (double)train.high_max > most + 1 || train.low_min < US)
        image_fail("expected clk %.1f to %.1f cycles high and at least 16 low, saw %llu to %llu and %llu", width, most,
                   (unsigned long long)train.high_min, (unsigned long long)train.high_max,
                   (unsigned long long)train.low_min);
    if (train.dir_setup_min < 5 * US)
        image_fail("expected dir 5 us before clk, saw %llu cycles", (unsigned long long)train.dir_setup_min);
}

/* -- the same motion with both clocks -------------------------------------------------------------------------------- */

#define MOST_PULSES 20000
static pulse_t internal[MOST_PULSES];
static size_t internal_count;

static void play(unit_t unit, const char *lines)
{
    boot(unit);
    image_train_clear();
    image_send(lines);
    image_sent();
    image_idle(LONG_WAIT);
    assert_position_is_what_was_made();
    assert_pulses_are_sound(unit);
}

static void play_internal(unit_t unit, const char *lines)
{
    play(unit, lines);
    internal_count = train.count;
    TEST_ASSERT_TRUE(internal_count <= MOST_PULSES);
    memcpy(internal, train.pulse, internal_count * sizeof *internal);
}

/* Each interval within a microsecond, or a tick of the external clock if that is longer, and half as much that the law
 * changes within a run; from first to last pulse within 2 us, or two ticks. A frequency that is no multiple of 1 MHz: the
 * interval of a cruise is rounded down to 1/256 of a tick. */
static void compare(unit_t unit, const char *lines)
{
    play(unit, lines);
    size_t count = internal_count;
    double tick = tick_of(unit);
    double least = fmax(tick, US);
    double drift = unit.xclk_hz % 1000000 ? (double)count * tick / 256 : 0;
    image_assert_pulses(count);
    for (size_t k = 0; k < count; k++) {
        TEST_ASSERT_EQUAL(internal[k].dir, train.pulse[k].dir);
        if (k + 1 < count)
            image_assert_interval(k, (double)(internal[k + 1].cycle - internal[k].cycle), 1.5 * least + 1);
    }
    image_assert_near("cycles from first to last pulse", (double)(internal[count - 1].cycle - internal[0].cycle),
                      (double)(train.pulse[count - 1].cycle - train.pulse[0].cycle), 2 * least + drift);
}

static const struct {
    unsigned ustep, pulse_us, slow_rpm;
    const char *lines;
} motions[] = {
    {0, 0, 0, "m1v100\r"},
    {0, 0, 0, "m800v150a1d1\r"},
    {0, 0, 0, "m2000v3000a10d10\r"},
    {0, 0, 0, "m-2000v700a3.3d.7\r"},
    {0, 0, 0, "m4000v160l1a5d5\r"},
    {0, 0, 0, "m-3000v600l1a50d80\r"},
    {0, 0, 0, "m5000vc30a999d999\r"},
    {0, 0, 0, "m5000vc8a999d999\r"},
    {0, 1, 0, "m5000vc8a999d999\r"},
    {0, 0, 0, "m5v9\r"},
    {0, 0, 0, "m3vc1000001\r"},
    {0, 0, 0, "m100v100a5d5t500000\r"},
    {0, 0, 0, "m100vc1234a999d999t7\r"},
    {0, 0, 0, "m20v300a20d20t1\r"},
    {0, 0, 0, "m200v100a1d999\rm200v200a1d999\rm100v20a5d1\r"},
    {0, 0, 0, "m150vc40a999d999\rm201vc40a999d999\rm77vc40a999d999\rm1vc40a999d999\rm90vc40a999d999\r"},
    {0, 0, 0, "m200v200a5d5\rm-200v200a5d5\rm200v300a5d5t20\r"},
    {0, 0, 0, "m200vc100a999d999\rm-200vc100a999d999\rm200vc100a999d999\r"},
    {3, 0, 0, "m500v300a5d5\r"},
    {7, 0, 0, "m60vc3001a999d999\r"},
    {5, 10, 30, "m-100v200l1a100d50u5\r"},
    {0, 30, 100, "m1000v1500a20d20\r"},
};

/* CLK-010, CLK-011, CLK-012, PIN-006, PIN-007 */
static void test_the_external_clock_gives_the_internal_ones_timing(void)
{
    static const unit_t clocks[] = {OWN_CLOCK,
                                    {.xclk_hz = 1000000, .hz = 1000000, .tov = BOARD_TOV_LEAVING_TOP},
                                    {.xclk_hz = 2000000, .hz = 2000000},
                                    {.xclk_hz = 1843200, .hz = 1843200},
                                    {.xclk_hz = 400000, .hz = 400000},
                                    {.xclk_hz = 6400000, .hz = 6400000}};
    for (size_t i = 0; i < sizeof motions / sizeof motions[0]; i++) {
        unit_t unit = {.ustep = motions[i].ustep, .pulse_us = motions[i].pulse_us, .slow_rpm = motions[i].slow_rpm};
        play_internal(unit, motions[i].lines);
        uint64_t cycles = internal[internal_count - 1].cycle - internal[0].cycle;
        for (size_t c = 0; c < sizeof clocks / sizeof clocks[0]; c++) {
            unit.xclk_hz = clocks[c].xclk_hz;
            unit.hz = clocks[c].hz;
            unit.own = clocks[c].own;
            unit.tov = clocks[c].tov;
            if (unit.xclk_hz < 6400000 || cycles < SECOND) /* (it takes the board long) */
                compare(unit, motions[i].lines);
        }
    }
}

/* CLK-010, CLK-011, PIN-006: the parameters as they are typed, and the timer's clock */
static void test_the_clock_is_chosen_by_the_parameter_at_the_next_restart(void)
{
    boot((unit_t){0});
    board_pin_wire(board, ONE_MHZ, XCLK);
    static const struct {
        const char *line;
        unsigned cs, interval;
    } steps[] = {{"p", CS_CPU, 3000 * US},         {"$CC0", CS_CPU, 3000 * US},  {"$R", CS_T1_RISING, 3000 * US},
                 {"$Cc500000", CS_T1_RISING, 3000 * US}, {"$R", CS_T1_RISING, 1500 * US}, {"$CC1", CS_T1_RISING, 1500 * US},
                 {"$R", CS_CPU, 3000 * US}};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        image_ask(steps[i].line);
        image_train_clear();
        image_do("m20vc3000a999d999");
        image_until_pulses(5, SECOND);
        if ((board_peek8(board, TCCR1B) & CS_BITS) != steps[i].cs)
            image_fail("after %s: expected the clock %u, saw %u", steps[i].line, steps[i].cs,
                       board_peek8(board, TCCR1B) & CS_BITS);
        image_idle(LONG_WAIT);
        image_assert_pulses(20);
        image_assert_intervals(0, 19, steps[i].interval, 0);
    }
}

/* CLK-011, CLK-012: so many edges of xclk from pulse to pulse */
static void test_an_interval_has_so_many_edges_of_xclk_whatever_their_rate(void)
{
    static const struct {
        uint32_t configured;
        double driven;
        unsigned edges;
    } cases[] = {{1000000, 1000000, 3000}, {1000000, 800000, 3000},   {2000000, 2000000, 6000},
                 {2000000, 1700000, 6000}, {1843200, 1843200, 5529}, {6400000, 6400000, 19200}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        boot((unit_t){.xclk_hz = cases[i].configured, .hz = cases[i].driven});
        image_do("m50vc3000a999d999");
        image_idle(LONG_WAIT);
        image_assert_pulses(50);
        image_assert_intervals(0, 49, cases[i].edges * 16e6 / cases[i].driven, 16e6 / cases[i].configured + 1);
    }
}

/* -- decelerations --------------------------------------------------------------------------------------------------- */

/* CLK-011, CLK-012 */
static void test_stops_and_nexts_ramp_down_as_with_the_internal_clock(void)
{
    static const uint32_t hz[] = {1000000, 2000000, 400000}; /* 3000 us are whole ticks, 100 RPM exactly */
    for (size_t i = 0; i < 3; i++) {
        unit_t unit = {.xclk_hz = hz[i], .hz = hz[i]};
        double tolerance = 1.5 * fmax(tick_of(unit), US);
        boot(unit);
        image_do("m2000v100a1d3");
        image_do("m-100v100a1d1");
        image_until_pulses(200, LONG_WAIT);
        image_do("n");
        image_idle(LONG_WAIT);
        size_t turn = 0;
        while (train.pulse[turn].dir == 0)
            turn++;
        for (size_t k = 1; k <= 30; k++)
            image_assert_interval(turn - k, 16 * 300000.0 / (10 + 3 * ((double)k - 1)), tolerance);
        image_assert_interval(turn - 31, 3000 * US, tolerance);
        image_assert_pulses(turn + 100);
        assert_position_is_what_was_made();

        image_do("m2000v100a1d1");
        image_do("d2");
        image_until_pulses(turn + 400, LONG_WAIT);
        image_do("s");
        image_idle(LONG_WAIT);
        for (size_t k = 1; k < 45; k++)
            image_assert_interval(train.count - 1 - k, 16 * 300000.0 / (10 + 2 * (double)k), tolerance);
        assert_position_is_what_was_made();

        image_do("m2000v1000a10d10");
        image_do("m500v300a5d5");
        image_until_pulses(train.count + 500, LONG_WAIT);
        size_t before = train.count;
        image_do("N");
        image_idle(LONG_WAIT);
        if (train.count < before + 500 || train.count > before + 530)
            image_fail("expected N to end the command after 0 to 30 pulses, saw %zu more with the next one's 500",
                       train.count - before);
        assert_position_is_what_was_made();
    }
}

/* -- stops at any moment --------------------------------------------------------------------------------------------- */

/* A pulse that S or Estop meets is completed; the clock that is looked away from meanwhile makes it longer. */
static void assert_widths(unit_t unit, double longer)
{
    double tick = tick_of(unit);
    double width = (unit.pulse_us ? unit.pulse_us : 2) * 16;
    if ((double)train.high_min < width - 1 || (double)train.high_max > ceil(width / tick) * tick + longer + 1)
        image_fail("expected pulses of %.1f cycles, at most %.1f more, saw %llu to %llu", width, longer,
                   (unsigned long long)train.high_min, (unsigned long long)train.high_max);
}

static const unit_t units[] = {
    {.xclk_hz = 1000000, .own = true},
    {.xclk_hz = 2000000, .hz = 2000000, .pulse_us = 1},
    {.xclk_hz = 1843200, .hz = 1843200, .pulse_us = 10},
    {.xclk_hz = 400000, .hz = 400000},
    {.xclk_hz = 6400000, .hz = 6400000, .pulse_us = 3},
    {.xclk_hz = 1000000, .hz = 1000000, .ihd = 5, .tov = BOARD_TOV_LEAVING_TOP},
};
#define UNITS (sizeof units / sizeof units[0])

static const char *const endless[] = {"m1000000vc30a999d999", "m-1000000vc16a999d999", "m1000000v3000a50d5",
                                      "m-1000000v2000a10d10l1", "m500000vc1000a999d999"};

/* STO-001, PIN-007 */
static void test_s_at_random_moments_keeps_count_and_pulse_width(void)
{
    srand(11);
    for (size_t u = 0; u < UNITS; u++) {
        boot(units[u]);
        int64_t made = 0;
        for (unsigned i = 0; i < 60; i++) {
            image_train_clear();
            image_do(endless[i % 5]);
            image_run(20 * MS + (unsigned)rand() % (30 * MS));
            image_do("S");
            image_run(MS);
            TEST_ASSERT_EQUAL(STANDBY, image_peek("motion_state"));
            assert_widths(units[u], 2 * tick_of(units[u]));
            made += train.position;
            image_train_clear();
            image_assert_no_pulse_for(10 * MS);
            int32_t shown = image_position();
            if (shown != made)
                image_fail("unit %zu, round %u: expected position %lld as the edges say, saw %ld", u, i,
                           (long long)made, (long)shown);
        }
    }
}

/* EST-001, PIN-007 */
static void test_estop_at_random_moments_keeps_count_and_pulse_width(void)
{
    srand(12);
    for (size_t u = 0; u < UNITS; u++) {
        boot(units[u]);
        int64_t made = 0;
        for (unsigned i = 0; i < 60; i++) {
            image_train_clear();
            image_do(endless[i % 5]);
            uint64_t edge = board_cycle(board) + 20 * MS + (unsigned)rand() % (30 * MS);
            board_pin_drive_at(board, ESTOP, 0, edge);
            board_pin_drive_at(board, ESTOP, 1, edge + 2 * MS);
            image_run(edge + 5 * MS - board_cycle(board));
            if (train.last_rise > edge + 3 * US + (uint64_t)tick_of(units[u]))
                image_fail("unit %zu, round %u: expected no rise 3 us after Estop, saw one after %llu cycles", u, i,
                           (unsigned long long)(train.last_rise - edge));
            assert_widths(units[u], 12 * US + tick_of(units[u]));
            made += train.position;
            image_train_clear();
            image_assert_no_pulse_for(10 * MS);
            image_take_text();
            int32_t shown = image_position();
            if (shown != made)
                image_fail("unit %zu, round %u: expected position %lld as the edges say, saw %ld", u, i,
                           (long long)made, (long)shown);
        }
    }
}

/* -- without clock --------------------------------------------------------------------------------------------------- */

/* The main loop runs: no reset, and lines are answered. */
static void assert_alive(const char *after)
{
    const char *shown = image_ask("p");
    if (strncmp(shown, "position ", 9) != 0)
        image_fail("after \"%s\": expected the answer of p, saw \"%s\"", after, shown);
}

/* CLK-010, PIN-007 */
static void test_without_edges_on_xclk_nothing_moves_and_everything_answers(void)
{
    static const char *const begun[] = {"m200v100a1d1", "m200vc30a999d999", "m-200v300l1a50d50", "m200t1000", "m200t3",
                                        "m0v100a1d1", "m200v100a1d1s", "m1"};
    static const char *const words[] = {"S", "s", "n", "N", "y", "+", "-"};
    for (size_t i = 0; i < sizeof begun / sizeof begun[0]; i++) {
        boot((unit_t){.xclk_hz = 1000000});
        for (size_t w = 0; w < sizeof words / sizeof words[0]; w++) {
            char both[60];
            snprintf(both, sizeof both, "%s %s", begun[i], words[w]);
            image_do(begun[i]);
            image_assert_no_pulse_for(300 * MS);
            assert_alive(both);
            image_send(words[w]);
            if (words[w][0] != '+' && words[w][0] != '-')
                image_send("\r");
            image_assert_no_pulse_for(300 * MS);
            assert_alive(both);
            image_do("S");
            image_assert_no_pulse_for(20 * MS);
            TEST_ASSERT_EQUAL(0, image_position());
        }
        image_do(begun[i]);
        image_do("m100");
        board_pin_drive(board, ESTOP, 0);
        image_run(300 * MS);
        board_pin_drive(board, ESTOP, 1);
        image_run(10 * MS);
        image_take_text();
        TEST_ASSERT_EQUAL(0, image_position());
        image_do(begun[i]);
        image_run(10 * MS);
        image_do("$R");
        TEST_ASSERT_EQUAL(0, image_position());
        /* A single pulse has the internal clock. */
        image_train_clear();
        image_send("++-");
        image_sent();
        image_assert_pulses(3);
        assert_pulses_are_sound((unit_t){0});
        TEST_ASSERT_EQUAL(1, image_position());
        image_assert_no_pulse_for(3 * SECOND);
        image_do("$CC1");
        image_do("$R");
        image_train_clear();
        image_do("m20v100a1d1");
        image_idle(LONG_WAIT);
        image_assert_pulses(20);
        TEST_ASSERT_EQUAL(21, image_position());
    }
}

/* CLK-010 */
static void test_a_motion_waits_for_its_clock(void)
{
    static const char *const lines[] = {"m200v100a1d1", "m200vc30a999d999", "m-200v300l1a50d50", "m200t1000"};
    for (size_t i = 0; i < 4; i++) {
        unit_t unit = {.xclk_hz = 1000000};
        boot(unit);
        image_do(lines[i]);
        image_assert_no_pulse_for(SECOND);
        board_pin_wire(board, ONE_MHZ, XCLK);
        image_idle(LONG_WAIT);
        image_assert_pulses(200);
        assert_position_is_what_was_made();
        assert_pulses_are_sound(unit);
    }
}

/* CLK-010: in the middle of a motion, also with clk high */
static void test_a_clock_that_stops_stops_the_motion_and_takes_it_up_again(void)
{
    srand(13);
    for (unsigned i = 0; i < 60; i++) {
        unit_t unit = {.xclk_hz = 1000000, .hz = 1000000, .pulse_us = i % 3 == 0 ? 20 : 2};
        boot(unit);
        image_do(i % 2 ? "m2000vc40a999d999" : "m-2000vc100a999d999");
        image_until_pulses(100 + (unsigned)rand() % 1000, LONG_WAIT);
        image_run((unsigned)rand() % (100 * US));
        board_pin_clock(board, XCLK, 0);
        image_run(4 * US);
        image_assert_no_pulse_for(300 * MS);
        assert_alive("clock off");
        board_pin_clock(board, XCLK, 1000000);
        image_idle(LONG_WAIT);
        image_assert_pulses(2000);
        assert_position_is_what_was_made();
    }
}

/* STO-001: what has been made is counted, also a pulse that is completed without its clock */
static void test_s_and_estop_end_a_motion_whose_clock_has_stopped(void)
{
    srand(14);
    for (size_t u = 0; u < UNITS; u++) {
        unit_t unit = units[u];
        unit.own = false;
        unit.hz = unit.xclk_hz;
        boot(unit);
        int64_t made = 0;
        for (unsigned i = 0; i < 40; i++) {
            board_pin_clock(board, XCLK, unit.hz);
            image_train_clear();
            image_do(endless[i % 2]);
            image_run(20 * MS + (unsigned)rand() % MS);
            board_pin_clock(board, XCLK, 0);
            image_run(10 * MS);
            if (i % 3 == 0) {
                board_pin_drive(board, ESTOP, 0);
                image_run(MS);
                board_pin_drive(board, ESTOP, 1);
            } else {
                image_send(i % 3 == 1 ? "S\r" : "$R\r");
            }
            image_run(200 * MS);
            TEST_ASSERT_EQUAL(0, board_pin_level(board, CLK));
            TEST_ASSERT_EQUAL(STANDBY, image_peek("motion_state"));
            made += train.position;
            board_pin_clock(board, XCLK, unit.hz);
            image_train_clear();
            image_assert_no_pulse_for(100 * MS);
            image_take_text();
            int32_t shown = image_position();
            if (shown != made)
                image_fail("unit %zu, round %u: expected position %lld as the edges say, saw %ld", u, i,
                           (long long)made, (long)shown);
        }
    }
}

/* PIN-007: far below what is configured: pulses come as slowly, and everything answers */
static void test_a_very_slow_clock_hangs_nothing(void)
{
    static const double hz[] = {100, 1000, 20000};
    for (size_t i = 0; i < 3; i++) {
        boot((unit_t){.xclk_hz = 1000000, .hz = hz[i]});
        image_do("m1000vc20a999d999");
        image_run(2 * SECOND);
        size_t expected = (size_t)(hz[i] / 10);
        if (train.count + 3 < expected && train.count + 3 < 1000)
            image_fail("%.0f Hz: expected about %zu pulses, saw %zu", hz[i], expected, train.count);
        assert_alive("m");
        image_do("S");
        image_run(100 * MS);
        TEST_ASSERT_EQUAL(STANDBY, image_peek("motion_state"));
        TEST_ASSERT_EQUAL(0, board_pin_level(board, CLK));
        image_assert_no_pulse_for(SECOND);
        image_do("$CC1");
        image_do("$R");
        image_train_clear();
        image_do("m20vc3000a999d999");
        image_idle(LONG_WAIT);
        image_assert_pulses(20);
        image_assert_intervals(0, 19, 3000 * US, 0);
    }
}

/* CLK-010, CLK-015 */
static void test_periods_too_short_for_the_external_clock_are_refused(void)
{
    static const struct {
        unit_t unit;
        const char *refused, *taken;
        unsigned us; /* of the shortest */
    } cases[] = {
        {{.xclk_hz = 1000000, .own = true}, "m10vc7", "m1000vc8a999d999", 8},
        {{.xclk_hz = 1000000, .own = true, .pulse_us = 1}, "m10vc7", "m1000vc8a999d999", 8},
        {{.xclk_hz = 1000000, .own = true, .pulse_us = 3}, "m10vc8", "m1000vc9a999d999", 9},
        {{.xclk_hz = 1000000, .own = true, .pulse_us = 30}, "m10v8334", "m1000vc36a999d999", 36},
        {{.xclk_hz = 1000000, .own = true}, "m10v37501", "m1000v37500a999d999", 8},
        {{.xclk_hz = 1000000, .own = true, .ustep = 4}, "m10vc127", "m100vc128a999d999", 8},
        {{.xclk_hz = 2000000, .hz = 2000000}, "m10vc7", "m1000vc8a999d999", 8},
        {{.xclk_hz = 6400000, .hz = 6400000}, "m10vc7", "m1000vc8a999d999", 8},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        boot(cases[i].unit);
        image_refused(cases[i].refused, "?7 too fast");
        image_assert_no_pulse_for(100 * MS);
        image_do(cases[i].taken);
        image_idle(LONG_WAIT);
        TEST_ASSERT_TRUE(train.count >= 1000);
        image_assert_intervals(0, train.count - 1, cases[i].us * US, tick_of(cases[i].unit));
        assert_position_is_what_was_made();
        assert_pulses_are_sound(cases[i].unit);
    }
}

/* CLK-010: started by the sync pin, or y */
static void test_a_held_command_is_released_with_the_external_clock(void)
{
    boot((unit_t)OWN_CLOCK);
    for (unsigned i = 0; i < 4; i++) {
        image_train_clear();
        image_do("m100v200a5d5s");
        image_assert_no_pulse_for(100 * MS);
        uint64_t edge = board_cycle(board) + 1000 + i * 5;
        if (i == 3)
            image_do("y");
        else
            board_pin_drive_at(board, SYNC, 0, edge);
        image_run(2 * MS);
        board_pin_drive(board, SYNC, 1);
        image_idle(LONG_WAIT);
        image_assert_pulses(100);
        if (i < 3 && train.pulse[0].cycle - edge > 40 * US)
            image_fail("expected the first pulse within 40 us of the edge, saw it after %llu cycles",
                       (unsigned long long)(train.pulse[0].cycle - edge));
    }
    TEST_ASSERT_EQUAL(400, image_position());
}

/* -- ihd and xclk ---------------------------------------------------------------------------------------------------- */

/* Each interval of a motion is longer by so many cycles than it was with 0/0: to a tick, and as much that the law changes
 * within a run; in sum to two ticks, and what the cruise's is rounded down. */
static void assert_adjusted(unit_t unit, const char *lines)
{
    double change = 8.0 * ((double)unit.xclk - (double)unit.ihd);
    play(unit, lines);
    size_t count = internal_count;
    image_assert_pulses(count);
    double tick = tick_of(unit);
    for (size_t k = 0; k + 1 < count; k++)
        image_assert_interval(k, (double)(internal[k + 1].cycle - internal[k].cycle) + change,
                              unit.xclk_hz ? 2 * fmax(tick, US) : 2);
    image_assert_near(lines, (double)(internal[count - 1].cycle - internal[0].cycle) + (double)(count - 1) * change,
                      (double)(train.pulse[count - 1].cycle - train.pulse[0].cycle),
                      2 * fmax(tick, unit.xclk_hz ? US : 1) + (double)count / 256 * tick);
}

/* CLK-006, CLK-007, CLK-008, CLK-009 */
static void test_ihd_and_xclk_change_each_interval_by_half_microseconds(void)
{
    static const struct {
        unsigned ihd, xclk;
    } counts[] = {{8, 0}, {0, 8}, {20, 20}, {1, 0}, {0, 3}, {255, 0}, {0, 255}, {255, 255}, {100, 37}};
    static const char *const lines[] = {"m150v60a1d1l0\r",
                                        "m-100v60l1a5d5\r",
                                        "m50v60a999d999\r",
                                        "m5v9a1d1\r",
                                        "m300v400a20d20l0\r",
                                        "m150vc400a999d999\rm201vc400a999d999\rm77vc400a999d999\r",
                                        "m80v100a2d999\rm100v200a1d999\rm50v20a5d1\r",
                                        "m100v200a5d5\rm-100v200a5d5\r"};
    static const uint32_t hz[] = {0, 1000000, 1843200};
    enum { ALL_CLOCKS = 4 };
    for (size_t l = 0; l < sizeof lines / sizeof lines[0]; l++) {
        play_internal((unit_t){0}, lines[l]);
        for (size_t h = 0; h < (l == ALL_CLOCKS ? 3 : 2); h++)
            for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++)
                assert_adjusted((unit_t){.xclk_hz = hz[h], .hz = hz[h], .ihd = counts[c].ihd, .xclk = counts[c].xclk},
                                lines[l]);
    }
}

/* CLK-006, CLK-007: as they are typed */
static void test_ihd_and_xclk_take_effect_at_the_next_restart(void)
{
    boot((unit_t){0});
    static const struct {
        const char *line;
        unsigned interval;
    } steps[] = {{"$CH8", 3000 * US}, {"$R", 2996 * US}, {"$CI8", 2996 * US}, {"$R", 3000 * US},
                 {"$CH0", 3000 * US}, {"$R", 3004 * US}, {"$CI255", 3004 * US}, {"$R", 3127 * US + 8}};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        image_do(steps[i].line);
        image_train_clear();
        image_do("m20vc3000a999d999");
        image_idle(LONG_WAIT);
        image_assert_pulses(20);
        image_assert_intervals(0, 19, steps[i].interval, 0);
    }
}

/* CLK-006, CLK-015 */
static void test_what_ihd_makes_too_short_is_refused(void)
{
    static const struct {
        unit_t unit;
        const char *refused, *taken;
        double us;
    } cases[] = {
        {{.ihd = 8}, "m10vc6", "m1000vc7a999d999", 3},
        {{.ihd = 9}, "m10vc7", "m1000vc8a999d999", 3.5},
        {{.ihd = 255}, "m10vc130", "m1000vc131a999d999", 3.5},
        {{.ihd = 255, .xclk = 255}, "m10vc2", "m1000vc3a999d999", 3},
        {{.xclk = 8}, "m10vc2", "m1000vc3a999d999", 7},
        {{.ihd = 8, .xclk_hz = 1000000, .own = true}, "m10vc11", "m1000vc12a999d999", 8},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        boot(cases[i].unit);
        image_refused(cases[i].refused, "?7 too fast");
        image_assert_no_pulse_for(100 * MS);
        image_do(cases[i].taken);
        image_idle(LONG_WAIT);
        image_assert_pulses(1000);
        image_assert_intervals(0, 999, cases[i].us * US, tick_of(cases[i].unit) - 1);
        assert_position_is_what_was_made();
    }
}

/* CFG-029 */
static void test_the_frequency_has_limits(void)
{
    boot((unit_t){0});
    image_refused("$Cc399999", "?12 range 400000..6400000");
    image_refused("$Cc6400001", "?12 range 400000..6400000");
    image_do("$Cc400000");
    image_do("$Cc6400000");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_external_clock_gives_the_internal_ones_timing);
    RUN_TEST(test_the_clock_is_chosen_by_the_parameter_at_the_next_restart);
    RUN_TEST(test_an_interval_has_so_many_edges_of_xclk_whatever_their_rate);
    RUN_TEST(test_stops_and_nexts_ramp_down_as_with_the_internal_clock);
    RUN_TEST(test_s_at_random_moments_keeps_count_and_pulse_width);
    RUN_TEST(test_estop_at_random_moments_keeps_count_and_pulse_width);
    RUN_TEST(test_without_edges_on_xclk_nothing_moves_and_everything_answers);
    RUN_TEST(test_a_motion_waits_for_its_clock);
    RUN_TEST(test_a_clock_that_stops_stops_the_motion_and_takes_it_up_again);
    RUN_TEST(test_s_and_estop_end_a_motion_whose_clock_has_stopped);
    RUN_TEST(test_a_very_slow_clock_hangs_nothing);
    RUN_TEST(test_periods_too_short_for_the_external_clock_are_refused);
    RUN_TEST(test_a_held_command_is_released_with_the_external_clock);
    RUN_TEST(test_ihd_and_xclk_change_each_interval_by_half_microseconds);
    RUN_TEST(test_ihd_and_xclk_take_effect_at_the_next_restart);
    RUN_TEST(test_what_ihd_makes_too_short_is_refused);
    RUN_TEST(test_the_frequency_has_limits);
    return UNITY_END();
}
