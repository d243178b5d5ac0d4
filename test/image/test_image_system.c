/* PIN, MIC, SYS, DEF, BOO, AUT, EST, ENC, PER on the whole image: a unit as its user meets it, from power-up on. */
#include "image.h"

#include <stdio.h>
#include <string.h>

#define LONG_WAIT (600 * SECOND)
#define WRITTEN (4 * SECOND) /* by then everything has been stored or erased */
#define EN_A BOARD_PIN('C', 0)
#define EN_B BOARD_PIN('C', 1)
#define RST BOARD_PIN('B', 0)

void setUp(void)
{
    image_boot();
}

void tearDown(void)
{
    image_off();
}

static void lose_power(void)
{
    board_eeprom_cut_at(board, board_cycle(board) + 1);
    image_run(2);
}

static void power_cycle(void)
{
    lose_power();
    image_boot_again();
}

/* -- PIN ----------------------------------------------------------------------------------------------------------- */

/* PIN-001, PIN-014: an image for this chip answers at the serial port that the USB connection shares */
static void test_the_image_boots_on_the_chip_and_answers(void)
{
    TEST_ASSERT_TRUE(board_cycle(board) > SECOND);
    image_assert_holds(image_ask("p"), "position 0 STANDBY faults 0\r\n");
}

/* PIN-005 */
static void test_1_mhz_comes_from_boot_on_whatever_else_happens(void)
{
    const board_pin_t pin = BOARD_PIN('B', 3);
    image_do("m5000vc100a999d999");
    image_run(MS);
    board_on_edge(board, NULL, NULL);
    board_edges_clear(board);
    board_record(board, CLK, false);
    board_record(board, DIR, false);
    board_record(board, pin, true);
    image_run(10 * MS);
    size_t count;
    const board_edge_t *edges = board_edges(board, &count);
    size_t rising = 0;
    for (size_t i = 0; i < count; i++) {
        rising += edges[i].level != 0;
        if (i > 0 && edges[i].cycle - edges[i - 1].cycle != 8)
            image_fail("expected half a period of 8 cycles, saw %llu at edge %zu",
                       (unsigned long long)(edges[i].cycle - edges[i - 1].cycle), i);
    }
    TEST_ASSERT_UINT64_WITHIN(1, 10000, rising);
    board_record(board, pin, false);
}

/* PIN-018, PIN-019, PIN-020: directions and pull-ups of all posts, as in decisions' pin map */
static void test_posts_have_their_directions_and_pull_ups(void)
{
    enum { DDRB = 0x24, PORTB, DDRC = 0x27, PORTC, DDRD = 0x2A, PORTD };
    TEST_ASSERT_EQUAL_HEX8(0x3E, board_peek8(board, DDRB) & 0x3F); /* clk, 1 MHz, MS3, dir, enable out; RST in */
    TEST_ASSERT_EQUAL_HEX8(0x3C, board_peek8(board, DDRC) & 0x3F); /* OPSB, MS1, MS2, OPSA out; EnA, EnB in */
    TEST_ASSERT_EQUAL_HEX8(0xC2, board_peek8(board, DDRD));        /* Tx En, S/W Tx, H/W Tx out */
    TEST_ASSERT_EQUAL_HEX8(0x01, board_peek8(board, PORTB) & 0x01); /* RST */
    TEST_ASSERT_EQUAL_HEX8(0x03, board_peek8(board, PORTC) & 0x03); /* EnA, EnB */
    TEST_ASSERT_EQUAL_HEX8(0x3D, board_peek8(board, PORTD) & 0x3D); /* both Rx, Estop, sync, xclk */
}

/* CLK-001, replaced by decision 0.2: mode 15 at the CPU clock, every interval to the tick */
static void test_timer1_runs_at_the_cpu_clock_in_mode_15(void)
{
    enum { TCCR1A = 0x80, TCCR1B };
    image_do("m100vc1001a999d999");
    image_run(20 * MS);
    TEST_ASSERT_EQUAL_HEX8(0x19, board_peek8(board, TCCR1B) & 0x1F);
    TEST_ASSERT_EQUAL_HEX8(0x03, board_peek8(board, TCCR1A) & 0x03);
    image_idle(LONG_WAIT);
    image_assert_intervals(0, 99, 1001 * US, 0);
}

/* -- MIC, PER -------------------------------------------------------------------------------------------------------- */

/* MIC-002 */
static void test_microsteps_divide_the_period(void)
{
    image_do("$CJ4");
    image_run(WRITTEN);
    image_do("$R");
    image_do("m100v300a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(1600);
    image_assert_intervals(0, 1599, 62.5 * US, 0);
}

/* MIC-013, PER-001: 33.3 kHz for ten seconds, by the load that the step interrupt makes (the manual's: 10.3 %) */
static void test_33_khz_at_16_microsteps_is_kept(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 4);
    image_prompt();
    train.keep = false;
    image_do("mvc480a999d999");
    image_run(SECOND);
    board_measures_clear(board);
    size_t before = train.count;
    uint64_t from = board_cycle(board);
    image_run(10 * SECOND);
    uint64_t cycles = board_cycle(board) - from;
    TEST_ASSERT_UINT64_WITHIN(2, cycles / 480, train.count - before);
    double load = 100.0 * (double)board_measures(board)->isr[13].cycles / (double)cycles;
    if (load > 10.3)
        image_fail("expected at most 10.3 %% in the step interrupt, saw %.2f %%", load);
    image_do("S");
    TEST_ASSERT_EQUAL(train.count, image_position());
}

/* PER-002 */
static void test_2400_rpm_in_full_steps(void)
{
    image_do("m8000v2400a5d5");
    image_idle(LONG_WAIT);
    image_assert_pulses(8000);
    TEST_ASSERT_EQUAL(125 * US, train.interval_min);
}

/* STA, HAR: short motions at 260 kHz that end in a steep ramp: it has to be there when the few pulses before it are out */
static void test_a_steep_end_behind_few_fast_pulses_is_planned_in_time(void)
{
    static const char *const lines[] = {"m90d545v19486a999", "m200d545v19486a999", "m90d545v15000a999", "m30d300v19486a999"};
    static const unsigned pulses[] = {360, 800, 360, 120};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        image_off();
        image_power_on();
        IMAGE_SET(ustep, 2);
        image_prompt();
        image_do(lines[i]);
        image_idle(LONG_WAIT);
        image_assert_pulses(pulses[i]);
        TEST_ASSERT_EQUAL(pulses[i], image_position()); /* and no fault */
    }
}

/* PER-004: commands stream at the port's rate while the motor moves */
static void test_commands_stream_at_38400_bd_without_a_stall(void)
{
    image_do("vc300");
    image_do("a999");
    image_do("d999");
    image_do("m2000");
    for (unsigned i = 0; i < 25; i++)
        image_send("m100\r");
    image_idle(LONG_WAIT);
    image_assert_pulses(2000 + 25 * 100);
    image_assert_intervals(0, 2000 + 25 * 100 - 1, 300 * US, 0);
}

/* -- SYS, DEF, BOO --------------------------------------------------------------------------------------------------- */

/* SYS-011, BOO-007, DEF-005, QUE-032, CFG-008, MIC-009 */
static void test_a_warm_boot_loads_what_is_configured_and_keeps_the_queue(void)
{
    image_do("q7m-123vc777a3");
    image_do("v222");
    image_do("a5");
    image_do("$P");
    image_do("g");
    image_do("$CJ1");
    image_do("$Cb2000");
    image_run(WRITTEN);
    image_do("m10pvc1000a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(10);
    image_do("$O1");
    image_do("$R");
    image_assert_holds(image_display("cf"), "v 150 cycle 2000\r\na 1.00 d 1.00 harmonic\r\nGAP on, full step, EnF\r\n"
                                            "ops 36, soft_ops off, CRC 1, ACK on\r\n");
    image_assert_row(7, "7\t123\t CCW\t386\t777\t 3.00\t1.00\t0\t  0");
    image_train_clear();
    image_do("m10vc1000a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(20); /* two microsteps each */
}

/* SYS-002, SYS-011 */
static void test_a_warm_boot_in_motion_stops_it(void)
{
    image_do("m5000v100");
    image_run(500 * MS);
    image_do("$R");
    image_assert_no_pulse_for(SECOND);
    image_do("m10");
    image_idle(LONG_WAIT);
}

/* BOO-007, TRM-008 */
static void test_a_warm_boot_ends_debug_mode(void)
{
    image_ask("b");
    image_assert_holds(image_display("q"), "\n0\t");
    image_ask("$R");
    TEST_ASSERT_NULL(strstr(image_display("q"), "\n0\t"));
}

/* What is typed behind $R, while it waits for its turn and while it is executed, is taken. BOO-007 */
static void test_nothing_typed_behind_a_warm_boot_is_lost(void)
{
    for (unsigned more = 0; more < 8; more++) {
        image_train_clear();
        char lines[60];
        snprintf(lines, sizeof lines, "$R\rm%uvc1000a999d999\r", 10 + more);
        image_send(lines);
        image_sent();
        image_run(200 * MS);
        image_assert_pulses(10 + more);
        image_run(more * 37); /* another phase */
    }
}

/* $R with another rate: the answer comes at the new one. CFG-036 */
static void test_a_warm_boot_changes_the_rate_of_the_port(void)
{
    image_do("$Cm115200");
    image_run(WRITTEN);
    image_send("$R\r");
    image_sent();
    image_run(20 * MS);
    image_take_text();
    board_uart_baud(board, 115200);
    image_assert_holds(image_ask("vd"), "10 30000\r\n");
}

/* DEF-006 */
static void test_one_shots_and_continuous_motion_leave_the_session_alone(void)
{
    char before[400];
    snprintf(before, sizeof before, "%s", image_display("cf"));
    image_do("xm20v321a7d8l1");
    image_idle(LONG_WAIT);
    image_do("m-v222a6d7");
    image_run(200 * MS);
    image_do("S");
    TEST_ASSERT_EQUAL_STRING(before, image_display("cf"));
}

/* QUE-014, QUE-016, QUE-017, QUE-018, QUE-020, BOO-008 */
static void test_the_queue_is_saved_and_restored(void)
{
    image_do("q3m-33vc900a999d999l1u2st5");
    char saved[4000];
    snprintf(saved, sizeof saved, "%s", image_display("q"));
    image_do("qs");
    image_refused("qc", "?11 busy"); /* or the cleared queue would be saved */
    image_refused("qr", "?11 busy");
    image_run(WRITTEN);
    image_do("qc");
    image_do("q4m44");
    image_do("qr");
    TEST_ASSERT_EQUAL_STRING(saved, image_display("q"));
    image_do("qc");
    power_cycle();
    TEST_ASSERT_EQUAL_STRING(saved, image_display("q"));
    image_do("q3s0");
    image_train_clear();
    image_do("x3");
    image_idle(LONG_WAIT);
    image_assert_pulses(35);
}

/* QUE-017, PER-004: all 30 entries are saved while the motor runs at 33 kHz and lines come back to back */
static void test_a_save_of_the_queue_delays_no_pulse_and_loses_no_character(void)
{
    for (unsigned n = 1; n <= 30; n++) {
        char line[40];
        snprintf(line, sizeof line, "q%um%uv%ua%ud7t%u", n, 1000 + n, 50 + n, n, n);
        image_do(line);
    }
    image_train_clear();
    train.keep = false;
    image_do("mvc30a999d999");
    image_run(50 * MS);
    image_train_clear();
    image_send("qs\r");
    for (unsigned n = 0; n < 1500; n++) { /* 2 s of lines */
        char line[16];
        snprintf(line, sizeof line, "a%u\r", 1 + n % 900);
        image_send(line);
    }
    uint64_t from = board_cycle(board);
    image_sent();
    TEST_ASSERT_TRUE(board_cycle(board) - from > SECOND);
    TEST_ASSERT_EQUAL(480, train.interval_min);
    TEST_ASSERT_UINT64_WITHIN(2, (board_cycle(board) - from) / 480, train.count); /* and none longer */
    TEST_ASSERT_EQUAL(0, board_uart_overruns(board));
    TEST_ASSERT_NULL(strchr(image_take_text(), '?'));
    image_send("S\r");
    image_run(WRITTEN);
    image_take_text();
    image_assert_holds(image_display("cf"), "a 600 d 1.00"); /* the last one: 1 + 1499 % 900 */
    char saved[4000];
    snprintf(saved, sizeof saved, "%s", image_display("q"));
    power_cycle();
    TEST_ASSERT_EQUAL_STRING(saved, image_display("q"));
}

/* QUE-018, QUE-021 */
static void test_without_a_snapshot_the_queue_is_restored_to_system_defaults(void)
{
    char factory[4000];
    snprintf(factory, sizeof factory, "%s", image_display("q"));
    image_do("v50");
    image_do("q4m44");
    image_do("qr");
    TEST_ASSERT_EQUAL_STRING(factory, image_display("q"));
    image_assert_holds(image_display("cf"), "v 50 cycle 6000");
}

/* -- AUT ------------------------------------------------------------------------------------------------------------- */

static void save_a_queue_of_two(void)
{
    image_do("q1m11vc1000a999d999");
    image_do("q2m-22vc1000a999d999");
    image_do("qs");
    image_run(WRITTEN);
}

/* AUT-001, AUT-002, AUT-004, AUT-006 */
static void test_autorun_loops_the_saved_queue_with_nobody_at_the_terminal(void)
{
    save_a_queue_of_two();
    image_do("$CA2");
    image_run(WRITTEN);
    lose_power();
    image_load_settings();
    image_train_clear();
    image_run(2 * SECOND);
    if (train.count < 200)
        image_fail("expected a loop of 33 pulses in 33 ms, saw %zu pulses", train.count);
    for (size_t k = 0; k < 200; k++)
        if (train.pulse[k].dir != (k % 33 >= 11))
            image_fail("pulse %zu turns the wrong way", k);
    image_do("S");
    image_assert_no_pulse_for(SECOND);
}

/* AUT-003, AUT-005; a queue that was never saved, or is damaged, is not run */
static void test_autorun_needs_a_whole_snapshot(void)
{
    image_do("$CA99");
    image_run(WRITTEN);
    image_assert_holds(image_display("cc"), "A autorun\t30\t");
    power_cycle();
    image_assert_no_pulse_for(SECOND);
    image_do("qs");
    image_run(500 * MS); /* in the middle of it */
    lose_power();
    image_load_settings();
    image_train_clear();
    image_run(2 * SECOND);
    image_assert_pulses(0);
    image_assert_holds(image_take_text(), "?16 snapshot damaged\r\nSAC>");
    image_refused("qr", "?16 snapshot damaged");
}

/* AUT-006: not after $R, and not after a watchdog reset */
static void test_autorun_is_for_cold_starts(void)
{
    save_a_queue_of_two();
    image_do("$CA2");
    image_run(WRITTEN);
    image_do("$R");
    image_assert_no_pulse_for(2 * SECOND);
    board_reset(board, BOARD_RESET_WATCHDOG);
    image_train_clear();
    image_run(2 * SECOND);
    image_assert_pulses(0);
}

/* -- restoring ------------------------------------------------------------------------------------------------------- */

static void assert_factory(void)
{
    image_assert_holds(image_display("cc"), "A autorun\t0\ta sprf\t\t200\r\n");
    image_assert_holds(image_display("cc"), "b cycle\t\t3000\r\n");
    image_assert_row(1, "1\t200\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
}

static void change_everything(void)
{
    save_a_queue_of_two();
    image_do("$CA3");
    image_do("$Cb2000");
    image_do("$Ca400");
    image_run(WRITTEN);
}

/* BOO-003 (decision 0.3.4: ESC three times), BOO-006, DEF-001, DEF-003 */
static void test_esc_three_times_restores_the_factory_settings_for_good(void)
{
    change_everything();
    board_reset(board, BOARD_RESET_EXTERNAL);
    image_run(500 * MS);
    image_send("\x1B\x1B\x1B");
    image_take_text();
    image_run(SECOND);
    image_send("\r");
    image_run(WRITTEN);
    image_take_text();
    assert_factory();
    image_assert_no_pulse_for(SECOND);
    power_cycle();
    assert_factory();
}

/* EST-003, EST-004, PIN-010, BOO-011: also with roles swapped, when no terminal listens */
static void test_rst_at_power_on_restores_the_factory_settings_for_good(void)
{
    change_everything();
    image_do("$CE1");
    image_run(WRITTEN);
    lose_power();
    board_pin_drive(board, RST, 0);
    image_boot_again();
    image_run(WRITTEN);
    board_pin_drive(board, RST, -1);
    assert_factory();
    image_assert_holds(image_display("cc"), "E network\t0\t");
    power_cycle();
    assert_factory();
}

/* -- OPS, DIR, SYN, SWT, ENC ------------------------------------------------------------------------------------------ */

/* OPS-003, CFG-032 */
static void test_ops_0_keeps_both_flags_idle(void)
{
    image_do("$Ch0");
    image_run(WRITTEN);
    image_do("$R");
    image_send("m20v100\r");
    for (unsigned i = 0; i < 100; i++) {
        image_run(MS);
        TEST_ASSERT_EQUAL(0, board_pin_level(board, OPSA));
        TEST_ASSERT_EQUAL(1, board_pin_level(board, OPSB));
    }
    image_idle(LONG_WAIT);
    image_do("$Ch36");
    image_run(WRITTEN);
    image_do("$R");
    image_send("m20v100\r");
    image_run(50 * MS);
    TEST_ASSERT_EQUAL(1, board_pin_level(board, OPSA));
    TEST_ASSERT_EQUAL(0, board_pin_level(board, OPSB));
    image_refused("$Ch5", "?12 range 0 or 36");
}

/* SYS-010, OPS-006, OPS-009 */
static void test_soft_ops_are_switched_for_the_session_and_for_good(void)
{
    image_do("$O1");
    image_take_text();
    image_send("m5vc1000a999d999\r");
    image_run(100 * MS);
    const char *seen = image_take_text();
    image_assert_holds(seen, "\x11");
    image_assert_holds(seen, "\x12");
    image_do("$Ci1");
    image_run(WRITTEN);
    image_do("$O0");
    image_do("m5");
    image_idle(LONG_WAIT);
    TEST_ASSERT_NULL(strpbrk(image_take_text(), "\x11\x12"));
    power_cycle();
    image_send("m5vc1000a999d999\r");
    image_run(100 * MS);
    image_assert_holds(image_take_text(), "\x12");
}

/* DIR-004 */
static void test_the_screen_shows_dir_in_words(void)
{
    image_assert_holds(image_display("cc"), "G dir\t\tCW\t");
    image_do("$CG1");
    image_run(WRITTEN);
    image_assert_holds(image_display("cc"), "G dir\t\tCCW\t");
    image_do("$R");
    image_do("m");
    image_run(100 * MS);
    image_do("S");
    TEST_ASSERT_EQUAL(1, train.pulse[0].dir);
}

/* SYN-005 */
static void test_sync_is_off_unless_it_is_named(void)
{
    image_do("m20s");
    image_do("y");
    image_idle(LONG_WAIT);
    image_do("m20");
    image_idle(LONG_WAIT);
    image_assert_pulses(40);
}

/* SWT-008 */
static void test_a_start_wait_counts_at_every_pass_of_a_loop(void)
{
    image_do("q1m5vc1000a999d999t50000");
    image_do("q2m-5vc1000a999d999");
    image_do("ln3");
    image_do("ls1");
    image_do("lf2");
    image_idle(LONG_WAIT);
    image_assert_pulses(30);
    for (size_t pass = 1; pass < 3; pass++)
        image_assert_near("the wait", 51 * 16000, (double)image_interval(10 * pass - 1), 16000);
}

static void turn(int lines)
{
    static const uint8_t code[] = {0, 1, 3, 2}; /* EnB EnA */
    static unsigned at;
    for (int quarters = lines < 0 ? -4 * lines : 4 * lines; quarters > 0; quarters--) {
        at += lines < 0 ? 3 : 1;
        board_pin_drive(board, EN_A, code[at & 3] & 1);
        board_pin_drive(board, EN_B, code[at & 3] >> 1);
        image_run(MS);
    }
}

/* CON-013, ENC-004, ENC-005, ENC-007, SYS-009 */
static void test_the_encoder_is_a_throttle_of_continuous_motion(void)
{
    image_off();
    image_power_on();
    board_pin_drive(board, EN_A, 0);
    board_pin_drive(board, EN_B, 0);
    image_prompt();
    image_do("m-v100a999d999");
    image_run(500 * MS);
    turn(20);
    image_run(500 * MS);
    image_assert_interval(train.count - 2, 2500 * US, 1); /* 120 RPM */
    turn(-70);
    image_run(SECOND);
    image_assert_interval(train.count - 2, 6000 * US, 1); /* 50 RPM */
    turn(-100);
    image_run(SECOND);
    image_assert_holds(image_ask("vd"), "1 300000\r\n"); /* never 0, never the other way */
    for (size_t k = 0; k < train.count; k++)
        TEST_ASSERT_EQUAL(1, train.pulse[k].dir);
    turn(199);
    image_run(SECOND);
    image_assert_holds(image_ask("vd"), "200 1500\r\n");
    image_do("$n"); /* stops it, as every system command does */
    image_assert_no_pulse_for(SECOND);
}

/* TRM-016: every function by what a dumb terminal can type: printable characters and CR */
static void test_a_dumb_terminal_reaches_every_function(void)
{
    static const char *const lines[] = {"m20v300", "xm20", "x1", "q", "q1", "qp", "x", "qs", "qr", "qc", "xp", "0,1", "x", "xd",
                                        "ls1", "l", "l1", "S", "y", "z", "b", "b", "g", "g", "cf", "cc", "vd", "p", "$C", "x",
                                        "$E", "$F", "$P", "$U", "$H", "$K", "$L0", "$O0", "$n", "$R"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        const char *answer = image_ask(lines[i]);
        if (answer[0] == '?' && strcmp(lines[i], "z") != 0)
            image_fail("\"%s\": %s", lines[i], answer);
        if (strcmp(lines[i], "qs") == 0)
            image_run(WRITTEN);
        image_idle(LONG_WAIT);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_image_boots_on_the_chip_and_answers);
    RUN_TEST(test_1_mhz_comes_from_boot_on_whatever_else_happens);
    RUN_TEST(test_posts_have_their_directions_and_pull_ups);
    RUN_TEST(test_timer1_runs_at_the_cpu_clock_in_mode_15);
    RUN_TEST(test_microsteps_divide_the_period);
    RUN_TEST(test_33_khz_at_16_microsteps_is_kept);
    RUN_TEST(test_2400_rpm_in_full_steps);
    RUN_TEST(test_a_steep_end_behind_few_fast_pulses_is_planned_in_time);
    RUN_TEST(test_commands_stream_at_38400_bd_without_a_stall);
    RUN_TEST(test_a_warm_boot_loads_what_is_configured_and_keeps_the_queue);
    RUN_TEST(test_a_warm_boot_in_motion_stops_it);
    RUN_TEST(test_a_warm_boot_ends_debug_mode);
    RUN_TEST(test_nothing_typed_behind_a_warm_boot_is_lost);
    RUN_TEST(test_a_warm_boot_changes_the_rate_of_the_port);
    RUN_TEST(test_one_shots_and_continuous_motion_leave_the_session_alone);
    RUN_TEST(test_the_queue_is_saved_and_restored);
    RUN_TEST(test_a_save_of_the_queue_delays_no_pulse_and_loses_no_character);
    RUN_TEST(test_without_a_snapshot_the_queue_is_restored_to_system_defaults);
    RUN_TEST(test_autorun_loops_the_saved_queue_with_nobody_at_the_terminal);
    RUN_TEST(test_autorun_needs_a_whole_snapshot);
    RUN_TEST(test_autorun_is_for_cold_starts);
    RUN_TEST(test_esc_three_times_restores_the_factory_settings_for_good);
    RUN_TEST(test_rst_at_power_on_restores_the_factory_settings_for_good);
    RUN_TEST(test_ops_0_keeps_both_flags_idle);
    RUN_TEST(test_soft_ops_are_switched_for_the_session_and_for_good);
    RUN_TEST(test_the_screen_shows_dir_in_words);
    RUN_TEST(test_sync_is_off_unless_it_is_named);
    RUN_TEST(test_a_start_wait_counts_at_every_pass_of_a_loop);
    RUN_TEST(test_the_encoder_is_a_throttle_of_continuous_motion);
    RUN_TEST(test_a_dumb_terminal_reaches_every_function);
    return UNITY_END();
}
