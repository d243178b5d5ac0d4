/* TRM, VEL, ACC, STP on the whole image: what is typed and answered; and every error: it is named, and nothing else
 * happens. */
#include "image.h"

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

static void boot_with_ustep(unsigned ustep)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, ustep);
    image_prompt();
}

/* What must not change with a line that is refused. */
typedef struct {
    char defaults[400];
    char queue[4000];
    int32_t position;
} standing_t;

static standing_t standing(void)
{
    static standing_t now;
    now.position = image_position();
    snprintf(now.defaults, sizeof now.defaults, "%s", image_display("cf"));
    snprintf(now.queue, sizeof now.queue, "%s", image_display("q"));
    return now;
}

static void assert_same(const char *line, const standing_t *before)
{
    standing_t after = standing();
    if (strcmp(before->defaults, after.defaults) != 0)
        image_fail("\"%s\": expected the defaults \"%s\", saw \"%s\"", line, before->defaults, after.defaults);
    if (strcmp(before->queue, after.queue) != 0) {
        size_t i = 0;
        while (before->queue[i] == after.queue[i])
            i++;
        i = i > 20 ? i - 20 : 0;
        image_fail("\"%s\": expected the queue \"%.60s\" from byte %zu on, saw \"%.60s\"", line, before->queue + i, i,
                   after.queue + i);
    }
    if (before->position != after.position)
        image_fail("\"%s\": expected position %ld, saw %ld", line, (long)before->position, (long)after.position);
}

/* The line is refused with this answer; defaults, queue and position stay, and no pulse is made. */
static void assert_refused(const char *line, const char *answer)
{
    standing_t before = standing();
    image_train_clear();
    image_refused(line, answer);
    image_assert_no_pulse_for(50 * MS);
    image_assert_pulses(0);
    assert_same(line, &before);
}

/* -- TRM ----------------------------------------------------------------------------------------------------------- */

/* TRM-001 */
static void test_the_unit_greets_with_its_version_and_the_prompt(void)
{
    image_off();
    image_power_on();
    image_run(SECOND + 200 * MS);
    const char *seen = image_take_text();
    if (strncmp(seen, "SAC ", 4) != 0 || strlen(seen) < 10 || strcmp(seen + strlen(seen) - 6, "\r\nSAC>") != 0)
        image_fail("expected \"SAC <version> <date>\\r\\nSAC>\", saw \"%s\"", seen);
}

/* TRM-002 */
static void test_without_its_end_a_line_waits(void)
{
    image_send("m20v100");
    image_sent();
    image_assert_no_pulse_for(2 * SECOND);
    image_assert_pulses(0);
    TEST_ASSERT_EQUAL_STRING("m20v100", image_take_text());
    image_send("\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    TEST_ASSERT_EQUAL_STRING("\r\nSAC>", image_take_text());
}

/* TRM-003 */
static void test_cr_lf_and_crlf_each_end_one_command(void)
{
    static const char *const ends[] = {"\r", "\n", "\r\n"};
    for (size_t i = 0; i < 3; i++) {
        image_train_clear();
        image_take_text();
        image_send("m7v2000a999d999");
        image_send(ends[i]);
        image_sent();
        image_idle(LONG_WAIT);
        image_run(10 * MS);
        image_assert_pulses(7);
        TEST_ASSERT_EQUAL_STRING("m7v2000a999d999\r\nSAC>", image_take_text());
        image_assert_holds(image_display("q"), i == 0 ? "Q is at 2\t" : i == 1 ? "Q is at 3\t" : "Q is at 4\t");
    }
    image_train_clear();
    image_send("m1v2000a999d999\r\nm2\nm4\rm8\n\rm16\n\nm32\r\r\n");
    image_sent();
    image_idle(LONG_WAIT);
    image_run(10 * MS);
    image_assert_pulses(63);
    image_assert_holds(image_display("q"), "Q is at 10\t");
}

/* TRM-004 */
static void test_most_commands_take_either_case_stop_next_and_system_ones_do_not(void)
{
    image_do("V120");
    image_do("A2.5");
    image_do("D3.5");
    image_assert_holds(image_display("CF"), "v 120 cycle 2500\r\na 2.50 d 3.50");
    image_do("VC4567");
    image_assert_holds(image_display("cF"), "v 65 cycle 4567");
    image_do("G");
    image_assert_holds(image_display("Cf"), "GAP off");
    TEST_ASSERT_EQUAL_STRING(image_display("q"), image_ask("Q"));
    TEST_ASSERT_EQUAL_STRING("position 0 STANDBY faults 0\r\n", image_ask("P"));
    image_do("$L1");
    assert_refused("$l1", "?1 unknown command");
    assert_refused("$p", "?1 unknown command");
    assert_refused("$f", "?1 unknown command");
    assert_refused("Y", "?1 unknown command");

    /* S stops at once, s with a ramp. */
    image_do("$L0");
    image_train_clear();
    image_do("m1000v100a1d1");
    image_until_pulses(120, LONG_WAIT);
    image_do("s");
    size_t at_stop = train.count;
    image_idle(LONG_WAIT);
    if (train.count < at_stop + 80)
        image_fail("s: expected a ramp of about 90 steps, saw %zu", train.count - at_stop);
}

/* TRM-005 */
static void test_a_space_ends_the_command(void)
{
    image_do("v50 junk");
    image_assert_holds(image_display("cf"), "v 50 cycle 6000");
    image_do("m20v100 v200a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    image_assert_row(1, "1\t20\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
    image_do("g please");
    image_assert_holds(image_display("cf"), "GAP off");
    image_do(" m20");
    image_assert_no_pulse_for(SECOND);
}

/* TRM-006 */
static void test_a_leading_number_is_never_a_command(void)
{
    image_send("10m200\r0m1\r"); /* to others (test_image_network.c) */
    image_assert_no_pulse_for(SECOND);
    assert_refused("1", "?2 syntax");
    assert_refused("256m1", "?12 range 0..255");
    assert_refused("/m1", "?21 to whom?");
}

/* TRM-007 */
static void test_a_motion_command_is_answered_by_echo_and_prompt_alone(void)
{
    image_send("m200v300a5d5\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_run(SECOND);
    TEST_ASSERT_EQUAL_STRING("m200v300a5d5\r\nSAC>", image_take_text());
}

/* TRM-008, TRM-009 */
static void test_debug_mode_reports_the_times_of_each_line(void)
{
    image_do("b");
    unsigned received = 0, loaded = 0;
    const char *answer = image_ask("m20v100a1d1");
    if (sscanf(answer, "received %u us, loaded %u us", &received, &loaded) != 2)
        image_fail("expected \"received <n> us, loaded <n> us\", saw \"%s\"", answer);
    /* 11 characters after the first, 10 bits of 26 us each. */
    image_assert_near("received, us", 2865, received, 150);
    if (loaded == 0 || loaded > 10000)
        image_fail("expected a load time above 0 and below 10,000 us, saw %u", loaded);
    image_idle(LONG_WAIT);
    image_ask("B");
    image_do("m1");
}

/* TRM-017 */
static void test_blank_lines_do_nothing_but_prompt(void)
{
    standing_t before = standing();
    image_train_clear();
    image_take_text();
    image_send("\r\r\n\n\r");
    image_sent();
    image_run(20 * MS);
    const char *seen = image_take_text();
    for (const char *rest = seen; *rest != '\0'; rest += 6)
        if (strncmp(rest, "\r\nSAC>", 6) != 0)
            image_fail("expected nothing but prompts, saw \"%s\"", seen);
    image_assert_pulses(0);
    assert_same("", &before);
}

/* TRM-003 */
static void test_bs_and_del_take_the_last_character_back_esc_the_line(void)
{
    image_send("m21\b0v100\x7f\x7f\x7f\x7fv150\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    image_assert_row(1, "1\t20\t CW\t150\t2000\t 1.00\t1.00\t0\t  0");
    image_train_clear();
    image_send("m999\x1bm5\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(5);
    image_send("v\b\b\b\bm3\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(8);
}

/* -- VEL ----------------------------------------------------------------------------------------------------------- */

/* VEL-001, VEL-005, CLK-004 */
static void test_v_sets_the_session_velocity_in_rpm(void)
{
    image_do("v120");
    image_assert_holds(image_display("cf"), "v 120 cycle 2500");
    move("m300");
    image_assert_interval(150, 2500 * US, 0);
    image_do("v");
    image_assert_holds(image_display("cf"), "v 100 cycle 3000");
}

/* VEL-002..VEL-004, CLK-003, CLK-004 */
static void test_vc_sets_it_as_a_cycle_and_either_gives_the_other(void)
{
    image_do("vc42567");
    image_assert_holds(image_display("cf"), "v 7 cycle 42567");
    image_do("m1");
    image_do("m1vc4567");
    image_do("m1v65");
    image_do("m1vc300001");
    image_idle(LONG_WAIT);
    const char *shown = image_display("q");
    image_assert_holds(image_row(shown, 1), "CW\t7\t42567\t");
    image_assert_holds(image_row(shown, 2), "CW\t65\t4567\t");
    image_assert_holds(image_row(shown, 3), "CW\t65\t4615\t");
    image_assert_holds(image_row(shown, 4), "CW\t0\t300001\t");
}

/* VEL-006 */
static void test_a_velocity_within_a_command_stays_for_the_next(void)
{
    move("m10v222a999d999");
    move("m10");
    image_assert_intervals(0, 9, 1351 * US, 0);
    move("m10vc7777");
    move("m10");
    image_assert_intervals(0, 9, 7777 * US, 0);
}

/* VEL-007 */
static void test_vd_shows_the_velocity_of_the_motor(void)
{
    TEST_ASSERT_EQUAL_STRING("10 30000\r\n", image_ask("vd"));
    image_do("m400vc4567a10d10");
    image_until_state(CRUISE, LONG_WAIT);
    image_do("v200");
    TEST_ASSERT_EQUAL_STRING("65 4567\r\n", image_ask("vd"));
    image_do("S");
    TEST_ASSERT_EQUAL_STRING("10 30000\r\n", image_ask("VD"));
    unsigned rpm = 0, cycle = 0;
    image_train_clear();
    image_do("m400v100a.5d1");
    image_until_pulses(100, LONG_WAIT);
    TEST_ASSERT_EQUAL(2, sscanf(image_ask("vd"), "%u %u", &rpm, &cycle));
    image_assert_near("RPM in the ramp", 60, rpm, 2);
    image_assert_near("cycle in the ramp", 5000, cycle, 150);
}

/* VEL-008 */
static void test_the_system_default_is_the_cycle_parameter(void)
{
    image_assert_holds(image_display("cf"), "v 100 cycle 3000");
    image_off();
    image_power_on();
    IMAGE_SET(cycle_us, 2000);
    image_prompt();
    image_assert_holds(image_display("cf"), "v 150 cycle 2000");
    image_assert_row(9, "9\t200\t CW\t150\t2000\t 1.00\t1.00\t0\t  0");
    move("m300");
    image_assert_interval(150, 2000 * US, 0);
}

/* VEL-009 */
static void test_a_fraction_of_an_rpm_is_dropped(void)
{
    image_do("v65.9");
    image_assert_holds(image_display("cf"), "v 65 cycle 4615");
    image_do("v120.999");
    image_assert_holds(image_display("cf"), "v 120 cycle 2500");
}

/* VEL-010 */
static void test_velocities_from_below_1_to_above_2200_rpm_run(void)
{
    move("m3vc600000");
    image_assert_intervals(0, 2, 600000 * US, 0);
    move("m2000v2400a20d20");
    image_assert_pulses(2000);
    image_assert_intervals(200, 1500, 125 * US, 0);
}

/* -- ACC ----------------------------------------------------------------------------------------------------------- */

/* ACC-001 */
static void test_a_and_d_set_the_ramps_alone_and_in_a_command(void)
{
    image_do("a1.5");
    image_do("d2");
    image_assert_holds(image_display("cf"), "a 1.50 d 2.00");
    move("m400v100A3D.75");
    image_assert_holds(image_display("cf"), "a 3.00 d 0.75");
    image_assert_interval(29, 16 * 300000.0 / 97, 1);
    image_assert_intervals(30, 250, 3000 * US, 0);
}

/* ACC-002, ACC-005 */
static void test_below_100_two_decimals_count_from_100_none(void)
{
    static const struct {
        const char *line, *shown;
    } cases[] = {{"a1.234", "a 1.23 "}, {"a150.7", "a 150 "},   {"a99.999", "a 99.99 "}, {"a100", "a 100 "},
                 {"a.8", "a 0.80 "},    {"a5.", "a 5.00 "},     {"a.05", "a 0.05 "},     {"a998.99", "a 998 "},
                 {"a07.5", "a 7.50 "},  {"a100.999", "a 100 "}, {"a0.019", "a 0.01 "}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        image_do(cases[i].line);
        image_assert_holds(image_display("cf"), cases[i].shown);
    }
}

/* ACC-003 */
static void test_values_run_from_0_01_to_999(void)
{
    image_do("a.01");
    image_assert_holds(image_display("cf"), "a 0.01 ");
    image_do("d99.99");
    image_assert_holds(image_display("cf"), "d 99.99 ");
    image_do("d999");
    image_assert_holds(image_display("cf"), "d 999 ");
    assert_refused("a1000", "?12 range 0.01..999");
    assert_refused("d1000", "?12 range 0.01..999");
    assert_refused("a.009", "?12 range 0.01..999");
    assert_refused("m20a1000", "?12 range 0.01..999");
}

/* ACC-004 */
static void test_999_means_no_ramp(void)
{
    image_train_clear();
    image_trace(true);
    image_send("m200v300a999d999\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(201);
    image_assert_intervals(0, 200, 1000 * US, 0);
    image_assert_states("0CPCP0");
}

/* ACC-006 */
static void test_without_a_number_the_system_default_of_the_present_ramp_comes_back(void)
{
    image_do("a5");
    image_do("d6");
    image_do("a");
    image_assert_holds(image_display("cf"), "a 1.00 d 6.00 harmonic");
    image_do("d");
    image_assert_holds(image_display("cf"), "a 1.00 d 1.00 harmonic");
    image_do("$L1");
    image_do("a5");
    image_do("a");
    image_assert_holds(image_display("cf"), "a 10.47 d 10.47 linear");
}

/* ACC-007 */
static void test_ad_without_numbers_does_the_same_within_a_command(void)
{
    image_do("a5");
    image_do("d7");
    image_do("m20v160ad");
    image_idle(LONG_WAIT);
    image_assert_row(1, "1\t20\t CW\t160\t1875\t 1.00\t1.00\t0\t  0");
    image_do("m20v160l1ad");
    image_idle(LONG_WAIT);
    image_assert_row(2, "2\t20\t CW\t160\t1875\t*10.47\t10.47\t0\t  0");
}

/* ACC-008 */
static void test_a_and_d_alone_leave_the_running_command_as_it_is(void)
{
    image_train_clear();
    image_do("m300v100a1d1");
    image_until_pulses(50, LONG_WAIT);
    image_do("a50");
    image_do("d50");
    image_do("v500");
    image_idle(LONG_WAIT);
    image_assert_pulses(300);
    for (size_t k = 0; k < 90; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k), 1);
    image_assert_intervals(90, 120, 3000 * US, 0);
    for (size_t k = 1; k < 90; k++)
        image_assert_interval(299 - k, 16 * 300000.0 / (10 + (double)k), 1);
}

/* ACC-009 */
static void test_values_within_a_command_act_at_once_and_stay_for_the_next(void)
{
    move("m200v100a1.2d1");
    image_assert_interval(10, 16 * 300000.0 / (10 + 1.2 * 10), 1);
    move("m200");
    image_assert_interval(10, 16 * 300000.0 / (10 + 1.2 * 10), 1);
    image_assert_row(2, "2\t200\t CW\t100\t3000\t 1.20\t1.00\t0\t  0");
}

/* ACC-010 */
static void test_the_system_defaults_are_parameters(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(accel[0], 250);
    IMAGE_SET(decel[0], 350);
    IMAGE_SET(accel[1], 450);
    IMAGE_SET(decel[1], 550);
    image_prompt();
    image_assert_holds(image_display("cf"), "a 2.50 d 3.50 harmonic");
    image_do("$L1");
    image_assert_holds(image_display("cf"), "a 4.50 d 5.50 linear");
}

/* ACC-011 */
static void test_a_reset_restores_the_system_defaults(void)
{
    image_do("a5");
    image_do("v222");
    image_do("$P");
    board_reset(board, BOARD_RESET_EXTERNAL);
    image_run(SECOND + 200 * MS);
    image_assert_holds(image_display("cf"), "v 100 cycle 3000\r\na 1.00 d 1.00 harmonic");
    image_assert_holds(image_display("cf"), "full step");
}

/* ACC-012 */
static void test_a_decel_value_ramps_down_even_if_the_next_command_is_pending(void)
{
    image_train_clear();
    image_trace(true);
    image_send("m200v100a1d1\rm200v100a1d1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_states("0ACDPACDP0");
    image_assert_intervals(199, 2, 30000 * US, 1);
}

/* ACC-013 */
static void test_lower_values_give_flatter_ramps(void)
{
    static const char *const lines[] = {"m600v100a20d999", "m600v100a5d999", "m600v100a1d999", "m600v100a.5d999",
                                        "m600v100a.2d999"};
    double before = 0;
    for (size_t i = 0; i < 5; i++) {
        move(lines[i]);
        size_t k = 0;
        while (image_interval(k) > 3000 * US)
            k++;
        double ramp = (double)(train.pulse[k].cycle - train.pulse[0].cycle);
        if (ramp <= before)
            image_fail("%s: expected a ramp of more than %.0f ticks, saw %.0f", lines[i], before, ramp);
        before = ramp;
    }
}

/* -- STP ----------------------------------------------------------------------------------------------------------- */

/* STP-001, STP-002, STP-011 */
static void test_counts_are_full_steps_of_eight_pulses_each(void)
{
    boot_with_ustep(3);
    move("m1000v300a20d20");
    image_assert_pulses(8000);
    move("m1001");
    image_assert_pulses(8008);
    TEST_ASSERT_EQUAL(0, image_position() % 8);
}

/* STP-003, STP-004 */
static void test_u_adds_so_many_pulses_to_cruise(void)
{
    boot_with_ustep(3);
    move("m1000v300a20d20U1");
    image_assert_pulses(8001);
    move("m1000u5");
    image_assert_pulses(8005);
    move("m1000u255");
    image_assert_pulses(8255);
    image_assert_intervals(15 * 8, 8255 - 30 * 8, 125 * US, 0); /* (300 - 10) / 20 = 14 steps either way */
    assert_refused("m1000u256", "?12 range 0..255");
    move("m1000");
    image_assert_pulses(8000);
}

/* STP-006..STP-008 */
static void test_the_session_counts_full_steps_or_pulses(void)
{
    boot_with_ustep(3);
    image_assert_holds(image_display("cf"), "full step");
    image_do("$P");
    image_assert_holds(image_display("cf"), "pulses");
    move("m100v100");
    image_assert_pulses(100);
    image_do("$F");
    image_assert_holds(image_display("cf"), "full step");
    move("m100");
    image_assert_pulses(800);
    image_do("$U");
    move("m100");
    image_assert_pulses(100);
    image_do("$U");
    move("m100");
    image_assert_pulses(800);
}

/* STP-009 */
static void test_the_unit_can_start_with_pulse_counts(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 3);
    IMAGE_SET(full_step, 0);
    image_prompt();
    image_assert_holds(image_display("cf"), "pulses");
    move("m100v100");
    image_assert_pulses(100);
}

/* STP-010 */
static void test_f_and_p_choose_for_a_command(void)
{
    boot_with_ustep(3);
    move("m100v100p");
    image_assert_pulses(100);
    move("m100v100f");
    image_assert_pulses(800);
    move("m-101v100p");
    image_assert_pulses(101);
    TEST_ASSERT_EQUAL(100 + 800 - 101, image_position());
}

/* -- errors: every row of status.def -------------------------------------------------------------------------------- */

/* TRM-004 */
static void test_an_unknown_command_is_named(void)
{
    assert_refused("k", "?1 unknown command");
    assert_refused("hello", "?1 unknown command");
    assert_refused("!", "?1 unknown command");
    assert_refused("*1", "?1 unknown command");
    assert_refused("\x80\x81", "?1 unknown command");
    assert_refused("$", "?1 unknown command");
    assert_refused("$X", "?1 unknown command");
    assert_refused("cx", "?1 unknown command");
}

/* MOT-002 */
static void test_wrong_syntax_is_named(void)
{
    static const char *const lines[] = {"m200k5", "m--5", "m5-",    "m20a1.2.3", "m1.5", "m20v-5", "m20l1x",
                                        "v5v6",   "a5d5", "m20fp5", "m20cv5",    "ss",   "S5",     "N1",
                                        "g1",     "$F1",  "$Lx",    "m20v5c",    "m+5",  "vx",     "m20\x80"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        assert_refused(lines[i], "?2 syntax");
}

/* MOT-002 */
static void test_a_missing_number_is_named(void)
{
    assert_refused("vc", "?3 number missing");
    assert_refused("m20vc", "?3 number missing");
    assert_refused("m20vca5", "?3 number missing");
    assert_refused("a.", "?3 number missing");
    assert_refused("m20a.d5", "?3 number missing");
}

/* MOT-002 */
static void test_a_number_too_large_is_named(void)
{
    assert_refused("m4294967296", "?4 number too large");
    assert_refused("m99999999999999999999", "?4 number too large");
    assert_refused("v4294967296", "?4 number too large");
    assert_refused("m1t4294967296", "?4 number too large");
    assert_refused("vc4294967296", "?4 number too large");
    boot_with_ustep(3);
    assert_refused("m536870912v100", "?4 number too large"); /* times 8: 2^32 */
}

static void test_a_line_of_64_characters_is_taken_of_65_refused_whole(void)
{
    image_do("m20v100a1d1                                                     ");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    standing_t before = standing();
    image_train_clear();
    image_take_text();
    image_send("m20v100a1d1                                                      \r");
    image_sent();
    image_run(100 * MS);
    image_assert_holds(image_take_text(), "\r\n?5 line too long\r\nSAC>");
    image_assert_pulses(0);
    /* Also where its end looks like a command. */
    for (unsigned i = 0; i < 300; i++)
        image_send("m");
    image_send("m20\r");
    image_sent();
    image_run(100 * MS);
    image_assert_holds(image_take_text(), "\r\n?5 line too long\r\nSAC>");
    image_assert_pulses(0);
    assert_same("a line too long", &before);
}

/* QUE-001 */
static void test_with_all_30_positions_pending_a_command_is_refused(void)
{
    /* One is executed, 30 are pending. */
    image_do("m5000v100a1d1");
    for (unsigned i = 0; i < 30; i++)
        image_do("m7v100");
    char before[4000];
    snprintf(before, sizeof before, "%s", image_display("q"));
    image_refused("m9v50", "?6 queue full");
    image_refused("m9v50", "?6 queue full");
    TEST_ASSERT_EQUAL_STRING(before, image_display("q"));
    image_assert_holds(image_display("cf"), "v 100 cycle 3000");
    image_idle(LONG_WAIT);
    image_assert_pulses(5000 + 30 * 7);
    TEST_ASSERT_EQUAL(5000 + 30 * 7, image_position());
}

/* CLK-015 */
static void test_too_fast_is_named(void)
{
    assert_refused("m10vc1", "?7 too fast");
    assert_refused("vc1", "?7 too fast");
    assert_refused("vc0", "?7 too fast");
    assert_refused("vc2", "?7 too fast"); /* the pulse is 2 us wide, and 1 us must be low */
    assert_refused("m10v300000", "?7 too fast");
    assert_refused("m10v150000", "?7 too fast");
    assert_refused("v4294967295", "?7 too fast");
    image_do("vc3");
    boot_with_ustep(3);
    assert_refused("m10v12501", "?7 too fast"); /* 23 us a full step */
    assert_refused("vc23", "?7 too fast");
    image_do("vc24");
}

/* VEL-010 */
static void test_velocity_0_is_named(void)
{
    assert_refused("v0", "?8 velocity 0");
    assert_refused("m20v0", "?8 velocity 0");
    assert_refused("v0.9", "?8 velocity 0");
}

static void test_a_damaged_line_is_refused_whole(void)
{
    standing_t before = standing();
    image_train_clear();
    image_take_text();
    image_send("m2");
    board_uart_send_bad(board, '0');
    image_send("0v100\r");
    image_sent();
    image_run(20 * MS);
    image_assert_holds(image_take_text(), "?10 reception error\r\nSAC>");
    image_assert_pulses(0);
    assert_same("a damaged line", &before);
    move("m20v100");
    image_assert_pulses(20);
}

static void test_a_value_out_of_range_is_named_with_its_range(void)
{
    assert_refused("m20l2", "?12 range 0..1");
    assert_refused("m20s5", "?12 range 0..1");
    assert_refused("m20u300", "?12 range 0..255");
    assert_refused("$L2", "?12 range 0..1");
    assert_refused("d12345", "?12 range 0.01..999");
}

static void test_too_many_displays_at_once_are_refused(void)
{
    standing_t before = standing();
    image_train_clear();
    image_take_text();
    image_send("q\rq\rq\rq\rq\rq\rq\rq\r");
    image_sent();
    image_run(5 * SECOND);
    image_assert_holds(image_take_text(), "?11 busy");
    image_assert_pulses(0);
    assert_same("q q q q q q q q", &before);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_unit_greets_with_its_version_and_the_prompt);
    RUN_TEST(test_without_its_end_a_line_waits);
    RUN_TEST(test_cr_lf_and_crlf_each_end_one_command);
    RUN_TEST(test_most_commands_take_either_case_stop_next_and_system_ones_do_not);
    RUN_TEST(test_a_space_ends_the_command);
    RUN_TEST(test_a_leading_number_is_never_a_command);
    RUN_TEST(test_a_motion_command_is_answered_by_echo_and_prompt_alone);
    RUN_TEST(test_debug_mode_reports_the_times_of_each_line);
    RUN_TEST(test_blank_lines_do_nothing_but_prompt);
    RUN_TEST(test_bs_and_del_take_the_last_character_back_esc_the_line);
    RUN_TEST(test_v_sets_the_session_velocity_in_rpm);
    RUN_TEST(test_vc_sets_it_as_a_cycle_and_either_gives_the_other);
    RUN_TEST(test_a_velocity_within_a_command_stays_for_the_next);
    RUN_TEST(test_vd_shows_the_velocity_of_the_motor);
    RUN_TEST(test_the_system_default_is_the_cycle_parameter);
    RUN_TEST(test_a_fraction_of_an_rpm_is_dropped);
    RUN_TEST(test_velocities_from_below_1_to_above_2200_rpm_run);
    RUN_TEST(test_a_and_d_set_the_ramps_alone_and_in_a_command);
    RUN_TEST(test_below_100_two_decimals_count_from_100_none);
    RUN_TEST(test_values_run_from_0_01_to_999);
    RUN_TEST(test_999_means_no_ramp);
    RUN_TEST(test_without_a_number_the_system_default_of_the_present_ramp_comes_back);
    RUN_TEST(test_ad_without_numbers_does_the_same_within_a_command);
    RUN_TEST(test_a_and_d_alone_leave_the_running_command_as_it_is);
    RUN_TEST(test_values_within_a_command_act_at_once_and_stay_for_the_next);
    RUN_TEST(test_the_system_defaults_are_parameters);
    RUN_TEST(test_a_reset_restores_the_system_defaults);
    RUN_TEST(test_a_decel_value_ramps_down_even_if_the_next_command_is_pending);
    RUN_TEST(test_lower_values_give_flatter_ramps);
    RUN_TEST(test_counts_are_full_steps_of_eight_pulses_each);
    RUN_TEST(test_u_adds_so_many_pulses_to_cruise);
    RUN_TEST(test_the_session_counts_full_steps_or_pulses);
    RUN_TEST(test_the_unit_can_start_with_pulse_counts);
    RUN_TEST(test_f_and_p_choose_for_a_command);
    RUN_TEST(test_an_unknown_command_is_named);
    RUN_TEST(test_wrong_syntax_is_named);
    RUN_TEST(test_a_missing_number_is_named);
    RUN_TEST(test_a_number_too_large_is_named);
    RUN_TEST(test_a_line_of_64_characters_is_taken_of_65_refused_whole);
    RUN_TEST(test_with_all_30_positions_pending_a_command_is_refused);
    RUN_TEST(test_too_fast_is_named);
    RUN_TEST(test_velocity_0_is_named);
    RUN_TEST(test_a_damaged_line_is_refused_whole);
    RUN_TEST(test_a_value_out_of_range_is_named_with_its_range);
    RUN_TEST(test_too_many_displays_at_once_are_refused);
    return UNITY_END();
}
