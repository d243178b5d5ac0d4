/* PIN, CLK and the golden durations on the whole image: widths, periods, drift, jitter under load, seconds. */
#include "image.h"
#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONG_WAIT (600 * SECOND)

void setUp(void)
{
    image_boot();
}

void tearDown(void)
{
    image_off();
}

static void move(const char *line)
{
    image_train_clear();
    image_do(line);
    image_idle(LONG_WAIT);
}

static void boot_with(unsigned ustep, unsigned pulse_us)
{
    image_off();
    image_power_on();
    IMAGE_SET(driver_id, 2); /* has every factor */
    IMAGE_SET(ustep, ustep);
    IMAGE_SET(pulse_us, pulse_us);
    image_prompt();
}

/* -- PIN ----------------------------------------------------------------------------------------------------------- */

/* PIN-002 */
static void test_clk_rises_once_for_each_pulse(void)
{
    move("m1v100");
    image_assert_pulses(1);
    move("m777v1200a20d30");
    image_assert_pulses(777);
    boot_with(5, 2);
    move("m100v100a5d5u3");
    image_assert_pulses(3203);
    TEST_ASSERT_EQUAL(3203, image_position());
}

/* PIN-003 */
static void test_dir_is_valid_before_the_first_edge_of_a_command(void)
{
    static const char *const lines[] = {"m-20v100a1d1", "m20v3000a999d999", "m-20vc30a999d999", "m20v5",
                                        "m-20l1v200a50d50"};
    for (size_t i = 0; i < 5; i++) {
        move(lines[i]);
        TEST_ASSERT_EQUAL(i % 2 == 0, train.pulse[0].dir);
        if (train.dir_setup_min < 5 * US)
            image_fail("%s: expected dir 5 us before clk, saw %llu ticks", lines[i],
                       (unsigned long long)train.dir_setup_min);
    }
}

/* PIN-022 */
static void test_clk_is_high_for_the_pulse_time_and_low_for_a_microsecond_at_least(void)
{
    static const struct {
        unsigned pulse_us;
        const char *line;
    } cases[] = {{1, "m20000vc2a999d999"}, {1, "m20000v150000a999d999"}, {2, "m20000vc3a999d999"},
                 {2, "m3000v2000a10d10"},  {10, "m5000vc11a999d999"},    {30, "m2000vc31a999d999"},
                 {30, "m2000v3000a50d50"}, {255, "m500vc256a999d999"},   {255, "m20v100a1d1"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        boot_with(0, cases[i].pulse_us);
        move(cases[i].line);
        uint64_t width = cases[i].pulse_us * US;
        if (train.high_min != width || train.high_max != width || train.low_min < US)
            image_fail("pulse %u, %s: expected clk %llu ticks high and at least 16 low, saw %llu to %llu and %llu",
                       cases[i].pulse_us, cases[i].line, (unsigned long long)width, (unsigned long long)train.high_min,
                       (unsigned long long)train.high_max, (unsigned long long)train.low_min);
    }
}

/* PIN-023 */
static void test_at_rest_clk_and_tx_en_are_low_and_ops_idle(void)
{
    static const char *const lines[] = {"", "m20v100a1d1", "m-20vc30a999d999", "m20v5", "m200l1v300a50d50"};
    for (size_t i = 0; i < 5; i++) {
        if (i > 0)
            move(lines[i]);
        TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, CLK), lines[i]);
        TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, TX_EN), lines[i]);
        TEST_ASSERT_EQUAL_MESSAGE(0, board_pin_level(board, OPSA), lines[i]);
        TEST_ASSERT_EQUAL_MESSAGE(1, board_pin_level(board, OPSB), lines[i]);
    }
}

/* -- CLK ----------------------------------------------------------------------------------------------------------- */

/* CLK-002 */
static void test_intervals_around_a_timers_16_bits_are_exact(void)
{
    static const uint32_t cycles[] = {2047,  2048,  2049,  4095,  4096,  4097,  6143,  6144,
                                      30000, 32767, 32768, 32769, 33333, 65535, 65536, 1000001};
    for (size_t i = 0; i < sizeof cycles / sizeof cycles[0]; i++) {
        char line[40];
        snprintf(line, sizeof line, "m5vc%ua999d999", cycles[i]);
        move(line);
        image_assert_pulses(5);
        image_assert_intervals(0, 4, (double)cycles[i] * 16, 0);
    }
    move("m5v9");
    image_assert_intervals(0, 4, 33333 * US, 0);
    move("m5v10");
    image_assert_intervals(0, 4, 30000 * US, 0);
}

/* CLK-003 */
static void test_the_cycle_is_300000_by_rpm_truncated(void)
{
    static const struct {
        uint32_t rpm, cycle;
    } table[] = {{59, 5084}, {60, 5000}, {61, 4918}, {70, 4285}, {100, 3000}, {101, 2970}, {7, 42857}, {299, 1003}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        char line[40], shown[40];
        snprintf(line, sizeof line, "m5v%ua999d999", table[i].rpm);
        move(line);
        image_assert_intervals(0, 4, (double)table[i].cycle * 16, 0);
        snprintf(shown, sizeof shown, "v %u cycle %u", table[i].rpm, table[i].cycle);
        image_assert_holds(image_display("cf"), shown);
    }
}

/* CLK-004 */
static void test_the_velocity_entered_last_is_in_force(void)
{
    image_do("v65");
    image_do("vc4567");
    image_assert_holds(image_display("cf"), "v 65 cycle 4567");
    move("m5a999d999");
    image_assert_intervals(0, 4, 4567 * US, 0);
    image_do("v65");
    image_assert_holds(image_display("cf"), "v 65 cycle 4615");
    move("m5");
    image_assert_intervals(0, 4, 4615 * US, 0);
}

/* CLK-005 */
static void test_cruise_keeps_the_cycle_not_the_rpm_and_does_not_drift(void)
{
    move("m2000vc4567a20d999");
    image_assert_intervals(100, 1899, 4567 * US, 0);
    /* Periods with a fraction of a tick: 1003 us by 128 is 125.375 ticks. */
    static const struct {
        unsigned ustep;
        const char *line;
        double period;
    } cases[] = {{7, "m20000vc1003a999d999p", 125.375}, {3, "m20000vc999a999d999p", 1998},
                 {7, "m20000vc1001a999d999p", 125.125}, {6, "m20000vc12345a999d999p", 3086.25},
                 {5, "m20000vc3001a999d999p", 1500.5},  {7, "m20000vc777a999d999p", 97.125}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        boot_with(cases[i].ustep, 1);
        move(cases[i].line);
        image_assert_pulses(20000);
        /* Two lengths of a tick's difference are mixed in runs, so single edges are off a little, but never more and more. */
        double most[2] = {0, 0};
        for (size_t k = 0; k < 20000; k++) {
            double drift = fabs((double)(train.pulse[k].cycle - train.pulse[0].cycle) - (double)k * cases[i].period);
            most[k / 10000] = fmax(most[k / 10000], drift);
        }
        if (most[1] > most[0] + 1 || most[0] > 62)
            image_fail(
                "%s: expected edges off by no more in the second half than in the first, saw %.2f ticks and %.2f",
                cases[i].line, most[1], most[0]);
        image_assert_near("mean of 1000 intervals, ticks", cases[i].period,
                          (double)(train.pulse[11000].cycle - train.pulse[10000].cycle) / 1000, 0.02);
        for (size_t k = 0; k < 19999; k++)
            image_assert_interval(k, cases[i].period, 1);
    }
}

static const char *const busy_lines[] = {
    "q\r",      "cf\r",      "m99999999999\r", "hello\r",     "vd\r",       "v100\r", "+-+-\r",  "?\r",  "a5.55\r",
    "\r\n\r\n", "k\b\b\b\r", "\x1b\x1b",       "xyzzy 123\r", "d1\r",       "p\r",    "m20v0\r", "cc\r", "vc3000\r",
    "m0x\r",    "gg\r",      "nonsense\r",     "10m200\r",    "m10a1d1k\r", "l\r"};

/* Whatever is typed by that many random lines back to back, none of which stops the motor or moves it while it runs.
 * single_pulses: + and - among them. Read in the moment after the last pulse they would rightly move it. */
static void type_lines(unsigned count, bool single_pulses)
{
    while (count > 0) {
        const char *line = busy_lines[(size_t)rand() % (sizeof busy_lines / sizeof busy_lines[0])];
        if (single_pulses || line[0] != '+') {
            image_send(line);
            count--;
        }
    }
}

/* CLK-013, CLK-005 */
static void test_a_flooded_terminal_moves_no_edge(void)
{
    static const uint32_t bauds[] = {38400, 250000};
    for (size_t i = 0; i < 2; i++) {
        image_off();
        image_power_on();
        IMAGE_SET(hw_baud, bauds[i]);
        board_uart_baud(board, bauds[i]);
        image_prompt();
        srand(5);
        image_train_clear();
        image_do("m30000vc30a999d999");
        while (board_peek8(board, 0x6F) & 1) {
            if (!board_uart_sending(board))
                type_lines(10, train.count < 28000);
            image_run(100 * US);
        }
        image_assert_pulses(30000);
        image_assert_intervals(0, 29999, 480, 0);
        if (board_uart_overruns(board) != 0)
            image_fail("at %u Bd: expected no byte lost, saw %u", bauds[i], board_uart_overruns(board));
    }
}

/* CLK-013 */
static void test_a_flooded_terminal_moves_no_edge_of_a_ramp(void)
{
    static uint64_t quiet[4000];
    move("m4000v3000a10d10");
    image_assert_pulses(4000);
    for (size_t k = 0; k < 4000; k++)
        quiet[k] = train.pulse[k].cycle - train.pulse[0].cycle;
    srand(6);
    image_train_clear();
    image_send("m4000v3000a10d10\r");
    while (train.count < 4000) {
        if (!board_uart_sending(board))
            type_lines(10, true);
        image_run(100 * US);
    }
    for (size_t k = 0; k < 4000; k++)
        if (train.pulse[k].cycle - train.pulse[0].cycle != quiet[k])
            image_fail("pulse %zu: expected %llu ticks after the first, as without typing, saw %llu", k,
                       (unsigned long long)quiet[k], (unsigned long long)(train.pulse[k].cycle - train.pulse[0].cycle));
}

/* CLK-014 */
static void test_garbage_and_wrong_baud_rates_disturb_no_pulse_and_the_next_line_is_understood(void)
{
    srand(8);
    image_off();
    image_power_on();
    IMAGE_SET(hw_baud, 40000);
    board_uart_baud(board, 40000);
    image_prompt();
    image_do("m32000vc62a999d999");
    for (unsigned round = 0; round < 8; round++) {
        /* Framing errors at the right rate, then whole bytes at wrong ones. */
        board_uart_baud(board, round < 4 ? 40000 : round % 2 ? 250000 : 20000);
        for (unsigned i = 0; i < 1000; i++) {
            uint8_t byte = (uint8_t)rand();
            if (round < 4 && i % 7 == 0)
                board_uart_send_bad(board, byte);
            else
                board_uart_send(board, &byte, 1);
            if (i % 50 == 49)
                image_sent();
        }
        image_sent();
        board_uart_baud(board, 40000);
        board_uart_send_text(board, "\x1b\r");
        image_sent();
        if (train.count < 32000 && train.count > 1 && train.interval_min != 62 * US)
            image_fail("expected intervals of %llu ticks, saw %llu", 62 * US, (unsigned long long)train.interval_min);
    }
    /* Random bytes may have spelled a command: S, N, + or -, v. The cruise is what must stand. */
    image_run(SECOND);
    image_take_text();
    image_do("S");
    image_idle(SECOND);
    image_assert_holds(image_ask("p"), "faults 0");
    image_train_clear();
    image_do("m50v100a1d1l0f");
    image_idle(LONG_WAIT);
    image_assert_pulses(50);
}

/* CLK-015 */
static void test_the_shortest_periods_are_kept_and_shorter_ones_refused(void)
{
    image_refused("m10v60000vc1", "?7 too fast");
    image_refused("m10vc2", "?7 too fast");
    image_refused("m10v100001", "?7 too fast");
    move("m10000vc3a999d999");
    image_assert_pulses(10000);
    image_assert_intervals(0, 9999, 48, 0);
    move("m10000v60000a999d999");
    image_assert_intervals(0, 9999, 80, 0);
    boot_with(0, 1);
    image_refused("m10vc1", "?7 too fast");
    image_train_clear();
    image_do("m100000vc2a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(100000);
    image_assert_intervals(0, 99999, 32, 0);
    TEST_ASSERT_EQUAL(100000, image_position());
}

/* CLK-005 */
static void test_streamed_commands_follow_without_a_tick_between_them(void)
{
    image_train_clear();
    for (unsigned i = 0; i < 20; i++)
        image_send(i % 3 == 0 ? "m150vc40a999d999\r" : i % 3 == 1 ? "m201vc40a999d999\r" : "m77vc40a999d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(7 * 150 + 7 * 201 + 6 * 77);
    TEST_ASSERT_EQUAL(train.count, image_position());
}

/* -- golden durations ------------------------------------------------------------------------------------------------ */

/* Seconds from the first pulse to the end of the last interval, which is where the pulse of a following step stands. */
static double seconds_of(const char *line)
{
    image_train_clear();
    image_send(line);
    image_send("\rm1t0\r");
    image_sent();
    image_idle(LONG_WAIT);
    return (double)(train.pulse[train.count - 1].cycle - train.pulse[0].cycle) / 16e6;
}

/* HAR-017 */
static void test_the_manuals_queue_takes_the_measured_seconds(void)
{
    static const struct {
        const char *line;
        size_t steps;
        double seconds;
    } rows[] = {{"m800v150a1d1", 800, 2.684},   {"m600v50a1d1", 600, 4.103}, {"m2000v150a1d1", 2000, 5.117},
                {"m1200v100a1d1", 1200, 4.508}, {"m200v20a1d1", 200, 3.167}, {"m2000v100a1d1t1000000", 2000, 6.880}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        double seconds = seconds_of(rows[i].line);
        image_assert_pulses(rows[i].steps + 1);
        image_assert_near(rows[i].line, rows[i].seconds, seconds, fmax(0.010, 0.015 * rows[i].seconds));
    }
}

/* LIN-019 */
static void test_the_manuals_linear_command_takes_the_measured_seconds(void)
{
    double seconds = seconds_of("m4000v160l1a5d5t3000000");
    image_assert_pulses(4001);
    image_assert_near("m4000v160l1a5d5", 10.749, seconds, 0.005 * 10.749);
}

/* HAR-006, LIN-020 */
static void test_durations_are_those_of_the_exact_intervals(void)
{
    static const struct {
        const char *line;
        request_t request;
    } cases[] = {
        {"m800v150a1d1l0", {.count = 800, .velocity = 150, .accel = 100, .decel = 100}},
        {"m2000v700a3.3d.7l0", {.count = 2000, .velocity = 700, .accel = 330, .decel = 70}},
        {"m4000v160a5d5l1", {.count = 4000, .velocity = 160, .linear = true, .accel = 500, .decel = 500}},
        {"m3000v600a50d80l1", {.count = 3000, .velocity = 600, .linear = true, .accel = 5000, .decel = 8000}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        plan_t plan = model_plan(FACTORY, cases[i].request);
        double seconds = seconds_of(cases[i].line);
        image_assert_pulses(plan.total + 1);
        image_assert_near(cases[i].line, model_sum(&plan, 0, plan.total), seconds * 16e6, 1 + plan.total / 1000.0);
    }
}

/* -- the interrupts -------------------------------------------------------------------------------------------------- */

/* The figures that every run of the firmware must keep. */
static void test_interrupts_and_masked_sections_stay_short(void)
{
    enum { TIMER1_OVF = 13 };
    srand(9);
    image_off();
    image_power_on();
    IMAGE_SET(hw_baud, 250000);
    board_uart_baud(board, 250000);
    image_prompt();
    board_measures_clear(board);
    static const char *const lines[] = {"m4000v3000a10d10\r",     "m-3000v2000l1a100d100\r", "m20000vc5a999d999\r",
                                        "m-20000vc3a999d999\r",   "m500v100a5d5\r",          "m30vc70000a999d999\r",
                                        "m5000vc30a999d999t500\r"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        image_send(lines[i]);
        type_lines(20, true);
    }
    image_send("N\rn\rs\r");
    image_sent();
    image_idle(LONG_WAIT);
    const board_measures_t *m = board_measures(board);
    printf("step interrupt: at most %u cycles, %u late; masked elsewhere: at most %u cycles (at 0x%x); "
           "other interrupts mask: at most %u (vector %u)\n",
           m->isr[TIMER1_OVF].cycles_max, m->isr[TIMER1_OVF].latency_max, m->masked_max, m->masked_max_pc,
           m->isr_masked_max, m->isr_masked_vector);
    if (m->isr[TIMER1_OVF].cycles_max > 160)
        image_fail("step interrupt: expected at most 160 cycles, saw %u", m->isr[TIMER1_OVF].cycles_max);
    if (m->masked_max > 80)
        image_fail("masked sections: expected at most 80 cycles, saw %u, ending at 0x%x", m->masked_max,
                   m->masked_max_pc);
    for (uint8_t vector = 1; vector < BOARD_VECTORS; vector++)
        if (vector != TIMER1_OVF && m->isr_masked_vector == vector && m->isr_masked_max > 80)
            image_fail("interrupt %u masks the others: expected at most 80 cycles, saw %u", vector, m->isr_masked_max);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_clk_rises_once_for_each_pulse);
    RUN_TEST(test_dir_is_valid_before_the_first_edge_of_a_command);
    RUN_TEST(test_clk_is_high_for_the_pulse_time_and_low_for_a_microsecond_at_least);
    RUN_TEST(test_at_rest_clk_and_tx_en_are_low_and_ops_idle);
    RUN_TEST(test_intervals_around_a_timers_16_bits_are_exact);
    RUN_TEST(test_the_cycle_is_300000_by_rpm_truncated);
    RUN_TEST(test_the_velocity_entered_last_is_in_force);
    RUN_TEST(test_cruise_keeps_the_cycle_not_the_rpm_and_does_not_drift);
    RUN_TEST(test_a_flooded_terminal_moves_no_edge);
    RUN_TEST(test_a_flooded_terminal_moves_no_edge_of_a_ramp);
    RUN_TEST(test_garbage_and_wrong_baud_rates_disturb_no_pulse_and_the_next_line_is_understood);
    RUN_TEST(test_the_shortest_periods_are_kept_and_shorter_ones_refused);
    RUN_TEST(test_streamed_commands_follow_without_a_tick_between_them);
    RUN_TEST(test_the_manuals_queue_takes_the_measured_seconds);
    RUN_TEST(test_the_manuals_linear_command_takes_the_measured_seconds);
    RUN_TEST(test_durations_are_those_of_the_exact_intervals);
    RUN_TEST(test_interrupts_and_masked_sections_stay_short);
    return UNITY_END();
}
