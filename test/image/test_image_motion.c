/* STA, HAR, LIN, TRN, SLO on the whole image: what is typed, and the edges that come of it. */
#include "image.h"
#include "model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define LONG_WAIT (3600 * SECOND)

void setUp(void)
{
    image_boot();
}

void tearDown(void)
{
    image_off();
}

/* Types the line and waits until the motor stands. */
static void move(const char *line)
{
    image_train_clear();
    image_do(line);
    image_idle(LONG_WAIT);
}

/* `line` and, pending behind it, a single step: its pulse marks the end of the first command's last interval. The edges
 * must be those of the model, each within `tolerance` ticks, their sum within a tick for each 1,000 steps. */
static void assert_follows(const plan_t *plan, size_t first, double tolerance)
{
    double sum = 0;
    for (uint32_t k = 0; k < plan->total; k++) {
        double interval = model_interval(plan, k);
        image_assert_interval(first + k, interval, tolerance);
        sum += interval;
    }
    uint64_t seen = train.pulse[first + plan->total].cycle - train.pulse[first].cycle;
    image_assert_near("sum of all intervals, ticks", sum, (double)seen, 1 + plan->total / 1000.0);
}

static plan_t move_like_model(request_t request, double tolerance)
{
    char line[80];
    char both[100];
    model_line(line, sizeof line, &request, false);
    snprintf(both, sizeof both, "%s\rm1l0v10a1d1", line);
    image_train_clear();
    image_send(both);
    image_send("\r");
    image_sent();
    image_idle(LONG_WAIT);
    plan_t plan = model_plan(FACTORY, request);
    image_assert_pulses(plan.total + 1);
    assert_follows(&plan, 0, tolerance);
    return plan;
}

static request_t harmonic(uint32_t count, uint32_t rpm, uint32_t accel, uint32_t decel)
{
    return (request_t){.count = count, .velocity = rpm, .accel = accel, .decel = decel};
}

static request_t linear(uint32_t count, uint32_t rpm, uint32_t accel, uint32_t decel)
{
    return (request_t){.count = count, .velocity = rpm, .linear = true, .accel = accel, .decel = decel};
}

/* The first interval that is the cruise interval (within a tick), and how many follow each other. */
static size_t first_cruise(double ticks)
{
    size_t k = 0;
    while (k + 1 < train.count && fabs((double)image_interval(k) - ticks) > 1)
        k++;
    return k;
}

static size_t cruise_length(double ticks)
{
    size_t first = first_cruise(ticks);
    size_t k = first;
    while (k + 1 < train.count && fabs((double)image_interval(k) - ticks) <= 1)
        k++;
    return k - first;
}

/* -- STA ----------------------------------------------------------------------------------------------------------- */

/* STA-001, STA-006, STA-007 */
static void test_a_command_passes_accel_cruise_decel_stop_and_ends_in_standby(void)
{
    image_trace(true);
    move("m200v100a1d1");
    image_assert_states("0ACDP0");
    image_assert_no_pulse_for(SECOND);
    image_assert_states("0ACDP0");
}

/* STA-001, STA-012 */
static void test_states_change_at_most_one_interval_before_their_first_interval(void)
{
    image_trace(true);
    move("m200v100a1d1");
    image_assert_states("0ACDP0");
    /* CRUISE begins with pulse 90, DECEL with pulse 110. */
    const size_t begin[] = {90, 110};
    for (size_t i = 0; i < 2; i++) {
        uint64_t pulse = train.pulse[begin[i]].cycle;
        uint64_t before = train.pulse[begin[i] - 1].cycle;
        uint64_t changed = changes[2 + i].cycle;
        if (changed < before || changed > pulse + 10 * US)
            image_fail("state %u expected between cycles %llu and %llu, saw %llu", changes[2 + i].state,
                       (unsigned long long)before, (unsigned long long)pulse, (unsigned long long)changed);
    }
}

/* STA-002 */
static void test_accel_slows_down_to_a_lower_target(void)
{
    image_train_clear();
    image_trace(true);
    image_send("m300v150a1d999\rm300v50a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(600);
    image_assert_states("0ACPACP0");
    for (size_t k = 300; k < 399; k++)
        if (image_interval(k + 1) <= image_interval(k))
            image_fail("interval %zu: expected more than %llu ticks, saw %llu, at cycle %llu", k + 1,
                       (unsigned long long)image_interval(k), (unsigned long long)image_interval(k + 1),
                       (unsigned long long)train.pulse[k + 1].cycle);
    image_assert_interval(400, 6000 * US, 1);
}

/* STA-003 */
static void test_cruise_holds_the_cycle_from_the_end_of_accel_to_the_start_of_decel(void)
{
    move("m1000v120a1d1");
    image_assert_pulses(1000);
    image_assert_interval(109, 16 * 300000.0 / 119, 1);
    image_assert_intervals(110, 780, 2500 * US, 0);
    image_assert_interval(890, 16 * 300000.0 / 119, 1);
}

/* STA-004, STA-005 */
static void test_only_a_deceleration_leads_through_decel_to_stop(void)
{
    image_trace(true);
    move("m150v60a1d999");
    image_assert_states("0ACP0");
    image_trace(true);
    move("m150v60a1d1");
    image_assert_states("0ACDP0");
}

/* STA-006, STA-015 */
static void test_every_queued_command_passes_stop_in_its_turn(void)
{
    image_trace(true);
    image_train_clear();
    image_send("m20v20a1d1\rm-30v30a1d1\rm40v40a1d1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_states("0ADPADPADP0");
}

/* STA-015 */
static void test_commands_entered_during_motion_run_in_order_then_the_motor_stands(void)
{
    image_train_clear();
    image_do("m50v50a1d1");
    image_do("m-30v60a1d1");
    image_do("m20v70a1d1");
    image_do("m-10v80a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(110);
    for (size_t k = 0; k < 110; k++) {
        uint8_t dir = k < 50 ? 0 : k < 80 ? 1 : k < 100 ? 0 : 1;
        if (train.pulse[k].dir != dir)
            image_fail("pulse %zu: expected dir %u, saw %u, at cycle %llu", k, dir, train.pulse[k].dir,
                       (unsigned long long)train.pulse[k].cycle);
    }
    image_assert_no_pulse_for(SECOND);
    TEST_ASSERT_EQUAL(30, image_position());
}

/* STA-008, TRN-008 */
static void test_every_profile_has_exactly_the_pulses_commanded(void)
{
    static const char *const lines[] = {"m1v150a1d1",         "m2v150a1d1",       "m3v300a5d.5",
                                        "m17v2000a999d1",     "m500v700a.7d999",  "m333v1500l1a20d80",
                                        "m1234v2300a50d9.99", "m77v9a1d1",        "m2v65a999d999",
                                        "m999vc777a3d4",      "m4097v6000a30d60", "m259v3000l1a999d999"};
    static const size_t pulses[] = {1, 2, 3, 17, 500, 333, 1234, 77, 2, 999, 4097, 259};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        move(lines[i]);
        if (train.count != pulses[i])
            image_fail("%s: expected %zu pulses, saw %zu", lines[i], pulses[i], train.count);
    }
    image_position();
}

/* STA-009, STA-011 */
static void test_without_decel_the_last_interval_is_the_cycle_and_the_next_command_goes_on_at_it(void)
{
    image_train_clear();
    image_send("m200v100a1d999\rm200v100a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_intervals(90, 309, 3000 * US, 0);
}

/* STA-010, STA-013 */
static void test_a_climb_of_streamed_commands_never_returns_and_each_pays_for_its_own_transition(void)
{
    image_train_clear();
    image_send("m300v100a1d999\rm300v200a1d999\rm300v300a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(900);
    image_assert_intervals(90, 210, 3000 * US, 0);
    /* Command 2: 100 steps from 100 to 200 RPM, then 200 in cruise. */
    for (size_t k = 0; k < 100; k++)
        image_assert_interval(300 + k, 16 * 300000.0 / (100 + (double)k), 1);
    image_assert_intervals(400, 200, 1500 * US, 0);
    for (size_t k = 0; k < 100; k++)
        image_assert_interval(600 + k, 16 * 300000.0 / (200 + (double)k), 1);
    image_assert_intervals(700, 199, 1000 * US, 0);
}

/* STA-012 */
static void test_decel_begins_its_own_steps_before_the_end(void)
{
    move("m500v100a1d2");
    image_assert_pulses(500);
    image_assert_intervals(90, 365, 3000 * US, 0);
    /* 45 decel steps: 98, 96, ... 10 RPM. */
    for (size_t k = 0; k < 44; k++)
        image_assert_interval(455 + k, 16 * 300000.0 / (98 - 2.0 * (double)k), 1);
}

/* STA-014 */
static void test_typing_and_displays_during_a_profile_move_no_edge(void)
{
    static uint64_t quiet[3000];
    move("m3000v1500a10d10");
    image_assert_pulses(3000);
    for (size_t k = 0; k < 3000; k++)
        quiet[k] = train.pulse[k].cycle - train.pulse[0].cycle;
    image_train_clear();
    image_send("m3000v1500a10d10\rq\rcf\rvd\rm1k\rhello\r?\rp\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(3000);
    for (size_t k = 0; k < 3000; k++)
        if (train.pulse[k].cycle - train.pulse[0].cycle != quiet[k])
            image_fail("pulse %zu: expected %llu ticks after the first, as without typing, saw %llu", k,
                       (unsigned long long)quiet[k], (unsigned long long)(train.pulse[k].cycle - train.pulse[0].cycle));
}

/* STA-016 */
static void test_200000_steps_are_200000_pulses(void)
{
    train.keep = false;
    image_do("m200000v3000a20d20");
    image_idle(LONG_WAIT);
    image_assert_pulses(200000);
    TEST_ASSERT_EQUAL(200000, image_position());
}

/* -- HAR ----------------------------------------------------------------------------------------------------------- */

/* HAR-001, HAR-009 */
static void test_the_factory_ramp_is_harmonic_with_1_00_and_1_00(void)
{
    const char *defaults = image_display("cf");
    image_assert_holds(defaults, "a 1.00 d 1.00 harmonic");
    image_do("m10");
    image_idle(LONG_WAIT);
    const char *queue = image_display("q");
    TEST_ASSERT_NULL(strchr(image_row(queue, 1), '*'));
    TEST_ASSERT_NULL(strchr(image_row(queue, 30), '*'));
}

/* HAR-002, HAR-003, HAR-005, HAR-006 */
static void test_m200v100_is_300000_by_n_for_90_steps_20_in_cruise_and_90_back(void)
{
    image_train_clear();
    image_send("m200v100a1d1\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(201);
    for (size_t k = 0; k < 90; k++) {
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k), 1);
        image_assert_interval(199 - k, 16 * 300000.0 / (10 + (double)k), 1);
    }
    image_assert_intervals(90, 20, 3000 * US, 0);
}

/* HAR-003 */
static void test_velocity_rises_by_the_same_amount_each_step(void)
{
    move("m300v250a2d999");
    double before = 0;
    for (size_t k = 0; k < 120; k++) {
        double rpm = 16 * 300000.0 / (double)image_interval(k);
        if (k > 0)
            image_assert_near("RPM gained in a step", 2, rpm - before, 0.03);
        before = rpm;
    }
}

/* HAR-004, HAR-013 */
static void test_ramp_steps_are_the_change_divided_by_the_value_truncated(void)
{
    static const struct {
        const char *line;
        double rpm, accel, steps;
    } cases[] = {{"m400v100a1d999", 100, 1, 90},   {"m400v100a.7d999", 100, .7, 128},
                 {"m400v101a3d999", 101, 3, 30},   {"m400v250a7.5d999", 250, 7.5, 32},
                 {"m400v37a.33d999", 37, .33, 81}, {"m400v600a100d999", 600, 100, 5}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        move(cases[i].line);
        double cruise = 16 * floor(300000 / cases[i].rpm);
        size_t steps = (size_t)cases[i].steps;
        image_assert_interval(steps - 1, 16 * 300000 / (10 + (cases[i].steps - 1) * cases[i].accel), 1);
        double last_rpm = 16 * 300000.0 / (double)image_interval(steps - 1);
        if (last_rpm < cases[i].rpm - 2 * cases[i].accel)
            image_fail("%s: expected the ramp to end above %.2f RPM, saw %.2f", cases[i].line,
                       cases[i].rpm - 2 * cases[i].accel, last_rpm);
        image_assert_intervals(steps, 399 - steps, cruise, 0);
    }
}

/* HAR-007 */
static void test_half_the_value_takes_180_steps(void)
{
    move("m400v100a.5d999");
    for (size_t k = 0; k < 180; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k / 2), 1);
    image_assert_intervals(180, 219, 3000 * US, 0);
}

/* HAR-008 */
static void test_a_change_of_90_takes_2_1_1_0_steps_at_45_46_90_91(void)
{
    static const struct {
        const char *accel, *decel;
        size_t steps;
    } cases[] = {{"m100v100a45d999", "m100v100a999d45", 2},
                 {"m100v100a46d999", "m100v100a999d46", 1},
                 {"m100v100a90d999", "m100v100a999d90", 1},
                 {"m100v100a91d999", "m100v100a999d91", 0}};
    for (size_t i = 0; i < 4; i++) {
        move(cases[i].accel);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].steps, first_cruise(3000 * US), cases[i].accel);
        image_train_clear();
        image_do(cases[i].decel);
        image_do("m1");
        image_idle(LONG_WAIT);
        TEST_ASSERT_EQUAL_MESSAGE(100 - cases[i].steps, cruise_length(3000 * US), cases[i].decel);
    }
}

/* HAR-010, HAR-011, SLO-001, SLO-004, SLO-005 */
static void test_a_harmonic_ramp_starts_and_ends_at_slow_speed(void)
{
    image_train_clear();
    image_send("m300v100a1d1\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_interval(0, 30000 * US, 1);
    image_assert_interval(299, 30000 * US, 1);
}

/* HAR-012 */
static void test_vc4567_ramps_55_steps_and_cruises_at_its_exact_cycle(void)
{
    move("m300vc4567a1d999");
    image_assert_interval(54, 16 * 300000.0 / 64, 1);
    image_assert_intervals(55, 244, 4567 * US, 0);
}

/* HAR-014 */
static void test_a_transition_between_two_speeds_starts_from_the_first(void)
{
    image_train_clear();
    image_send("m200v100a1d999\rm200v160a2d999\rm200v40a4d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(600);
    for (size_t k = 0; k < 30; k++)
        image_assert_interval(200 + k, 16 * 300000.0 / (100 + 2 * (double)k), 1);
    image_assert_intervals(230, 170, 1875 * US, 0);
    for (size_t k = 0; k < 30; k++)
        image_assert_interval(400 + k, 16 * 300000.0 / (160 - 4 * (double)k), 1);
    image_assert_intervals(430, 169, 7500 * US, 0);
}

/* HAR-015 */
static void test_microsteps_stretch_the_ramp_over_the_same_full_steps(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 3);
    image_prompt();
    move("m200v100a1d1");
    image_assert_pulses(1600);
    for (size_t k = 0; k < 720; k++)
        image_assert_interval(k, 2 * 300000.0 / (10 + (double)k / 8), 1);
    image_assert_intervals(720, 160, 375 * US, 0);
    for (size_t k = 1; k < 720; k++)
        image_assert_interval(1599 - k, 2 * 300000.0 / (10 + (double)k / 8), 1);
}

/* HAR-016 */
static void test_1000_steps_at_100_rpm_take_3_90_seconds(void)
{
    image_train_clear();
    image_send("m1000v100a1d1\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(1001);
    image_assert_near("seconds", 3.90, (double)(train.pulse[1000].cycle - train.pulse[0].cycle) / 16e6, 0.078);
    image_assert_near("seconds of cruise", 2.46, (double)(train.pulse[910].cycle - train.pulse[90].cycle) / 16e6, 1e-6);
    image_assert_near("seconds up", 0.7, (double)(train.pulse[90].cycle - train.pulse[0].cycle) / 16e6, 0.05);
}

/* HAR-018 */
static void test_2400_rpm_is_reached_and_left_with_an_exact_count(void)
{
    move("m20000v2400a10d10");
    image_assert_pulses(20000);
    image_assert_intervals(239, 19522, 125 * US, 0);
    if (train.interval_min != 125 * US)
        image_fail("shortest interval: expected %llu ticks, saw %llu", 125 * US,
                   (unsigned long long)train.interval_min);
    TEST_ASSERT_EQUAL(20000, image_position());
}

/* HAR-019 */
static void test_values_above_and_below_1_change_rpm_by_so_much_a_step(void)
{
    move("m100v100a5d999");
    for (size_t k = 0; k < 18; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + 5 * (double)k), 1);
    move("m400v30a.1d999");
    for (size_t k = 0; k < 200; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k / 10), 1);
}

/* -- LIN ----------------------------------------------------------------------------------------------------------- */

/* LIN-001, LIN-005, LIN-020 */
static void test_linear_intervals_are_c0_times_the_difference_of_two_roots_up_and_down(void)
{
    plan_t plan = move_like_model(linear(500, 100, 1047, 1047), 1);
    TEST_ASSERT_EQUAL(166, plan.accel);
    TEST_ASSERT_EQUAL(166, plan.decel);
}

/* LIN-001 */
static void test_linear_velocity_over_time_is_a_straight_line(void)
{
    move("m2000v600l1a50d999");
    size_t steps = 1256; /* V^2 / (2 alpha a) */
    double sum_t = 0, sum_v = 0, sum_tt = 0, sum_tv = 0;
    size_t n = 0;
    for (size_t k = 3; k < steps; k++, n++) {
        double t = ((double)train.pulse[k].cycle + (double)image_interval(k) / 2 - (double)train.pulse[0].cycle) / 16e6;
        double v = 0.0314159265 * 16e6 / (double)image_interval(k); /* rad/s */
        sum_t += t, sum_v += v, sum_tt += t * t, sum_tv += t * v;
    }
    double slope = ((double)n * sum_tv - sum_t * sum_v) / ((double)n * sum_tt - sum_t * sum_t);
    image_assert_near("rad/s^2", 50, slope, 0.05);
    double offset = (sum_v - slope * sum_t) / (double)n;
    for (size_t k = 3; k < steps; k++) {
        double t = ((double)train.pulse[k].cycle + (double)image_interval(k) / 2 - (double)train.pulse[0].cycle) / 16e6;
        image_assert_near("rad/s on the line", offset + slope * t, 0.0314159265 * 16e6 / (double)image_interval(k),
                          0.15);
    }
}

/* LIN-002 */
static void test_10_47_reaches_100_rpm_in_one_second(void)
{
    move("m400v100l1a10.47d999");
    image_assert_intervals(166, 200, 3000 * US, 0);
    image_assert_near("seconds to cruise", 1.00, (double)(train.pulse[166].cycle - train.pulse[0].cycle) / 16e6, 0.03);
}

/* LIN-003 */
static void test_linear_steps_are_v_squared_by_2_alpha_a(void)
{
    move("m400v100l1a10.47d999");
    TEST_ASSERT_EQUAL(166, first_cruise(3000 * US));
    move("m400v100l1a50d999");
    TEST_ASSERT_EQUAL(34, first_cruise(3000 * US)); /* 34.9 */
}

/* LIN-004 */
static void test_linear_steps_between_two_speeds_are_the_difference_of_their_own(void)
{
    image_train_clear();
    image_send("m300v100l1a10d999\rm800v200a10d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(1100);
    size_t steps = 0;
    while (image_interval(300 + steps) > 1500 * US)
        steps++;
    TEST_ASSERT_EQUAL(698 - 174, steps);
    /* From 100 RPM on at constant acceleration: v^2 grows by 2 alpha a. */
    plan_t plan = model_plan(
        FACTORY,
        (request_t){.count = 800, .velocity = 200, .linear = true, .accel = 1000, .decel = NO_RAMP, .from = 10000});
    for (uint32_t k = 0; k < 799; k++)
        image_assert_interval(300 + k, model_interval(&plan, k), 1);
}

/* LIN-006 */
static void test_what_reaches_300_rpm_in_200_steps_passes_100_rpm_after_22(void)
{
    move("m400v300l1a78.54d999");
    size_t k = 0;
    while (image_interval(k) > 3000 * US)
        k++;
    if (k < 21 || k > 23)
        image_fail("expected 100 RPM to be passed at step 22 or 23, saw %zu", k);
    image_assert_intervals(200, 199, 1000 * US, 0);
}

/* LIN-007 */
static void test_what_reaches_100_rpm_in_a_revolution_needs_nine_to_reach_300(void)
{
    move("m300v100l1a8.73d999");
    image_assert_near("steps to 100 RPM", 200, (double)first_cruise(3000 * US), 1);
    move("m2500v300l1a8.73d999");
    image_assert_near("steps to 300 RPM", 1800, (double)first_cruise(1000 * US), 2);
}

/* LIN-009 */
static void test_a_linear_ramp_longer_than_the_command_stays_below_its_target(void)
{
    move("m500v300l1a1d999");
    image_assert_pulses(500);
    if (train.interval_min <= 1000 * US)
        image_fail("expected all intervals above 1000 us, saw %llu ticks", (unsigned long long)train.interval_min);
    for (size_t k = 0; k < 498; k++)
        if (image_interval(k + 1) > image_interval(k) + 1)
            image_fail("interval %zu: expected no more than %llu ticks, saw %llu", k + 1,
                       (unsigned long long)image_interval(k), (unsigned long long)image_interval(k + 1));
}

/* LIN-010 */
static void test_linear_steps_are_multiplied_by_the_microsteps(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 3);
    image_prompt();
    move("m400v100l1a10.47d999");
    image_assert_pulses(3200);
    TEST_ASSERT_EQUAL(166 * 8, first_cruise(375 * US));
}

/* LIN-011 */
static void test_l1_marks_the_command_and_the_session_as_linear_l0_as_harmonic(void)
{
    image_do("m40v100l1");
    image_idle(LONG_WAIT);
    image_assert_row(1, "1\t40\t CW\t100\t3000\t*10.47\t10.47\t0\t  0");
    image_assert_holds(image_display("cf"), "a 10.47 d 10.47 linear");
    image_do("m40v100l0");
    image_idle(LONG_WAIT);
    image_assert_row(2, "2\t40\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
    image_assert_holds(image_display("cf"), "a 1.00 d 1.00 harmonic");
}

/* LIN-012, LIN-013 */
static void test_the_session_ramp_switches_with_its_defaults(void)
{
    image_do("a5");
    image_do("$L1");
    image_assert_holds(image_display("cf"), "a 10.47 d 10.47 linear");
    image_do("a7");
    image_do("a");
    image_assert_holds(image_display("cf"), "a 10.47 d 10.47 linear");
    image_do("$L0");
    image_assert_holds(image_display("cf"), "a 1.00 d 1.00 harmonic");
}

/* LIN-014 */
static void test_the_linear_defaults_are_parameters_of_their_own(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(accel[1], 2000);
    IMAGE_SET(decel[1], 3000);
    image_prompt();
    image_assert_holds(image_display("cf"), "a 1.00 d 1.00 harmonic");
    image_do("$L1");
    image_assert_holds(image_display("cf"), "a 20.00 d 30.00 linear");
}

/* LIN-015 */
static void test_300_rpm_at_16_microsteps_keeps_its_count_and_its_cruise(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(ustep, 4);
    image_prompt();
    move("m1000v300l1a100d100");
    image_assert_pulses(16000);
    size_t accel = 157 * 16; /* V^2 / (2 alpha a) = 157.08 */
    image_assert_intervals(accel, 16000 - 2 * accel, 62.5 * 16, 1);
    TEST_ASSERT_EQUAL(16000, image_position());
}

/* LIN-016 */
static void test_each_queued_command_has_its_own_ramp(void)
{
    image_train_clear();
    image_send("m400v100l1a10d10\rm200v100l0a1d1\rm400v100l1a20d20\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(1000);
    plan_t first = model_plan(FACTORY, linear(400, 100, 1000, 1000));
    plan_t second = model_plan(FACTORY, harmonic(200, 100, 100, 100));
    plan_t third = model_plan(FACTORY, linear(400, 100, 2000, 2000));
    for (uint32_t k = 0; k < 400; k++)
        image_assert_interval(k, model_interval(&first, k), 1);
    for (uint32_t k = 0; k < 200; k++)
        image_assert_interval(400 + k, model_interval(&second, k), 1);
    for (uint32_t k = 0; k < 399; k++)
        image_assert_interval(600 + k, model_interval(&third, k), 1);
}

/* LIN-017 */
static void test_twice_the_steps_a_revolution_take_twice_the_ramp(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(steps_per_rev, 400);
    image_prompt();
    move("m800v100l1a10.47d999");
    TEST_ASSERT_EQUAL(333, first_cruise(1500 * US)); /* 2 * 166.67 */
}

/* LIN-018 */
static void test_velocity_and_acceleration_scaled_alike_reach_their_targets_together(void)
{
    move("m400v100l1a10.47d999");
    double fast = (double)(train.pulse[166].cycle - train.pulse[0].cycle);
    move("m400v50l1a5.235d999");
    size_t steps = first_cruise(6000 * US);
    double half = (double)(train.pulse[steps].cycle - train.pulse[0].cycle);
    image_assert_near("ramp time against that of twice the speed", 1, half / fast, 0.02);
}

/* LIN-020 */
static void test_a_linear_deceleration_takes_its_own_steps_and_ends_in_stop(void)
{
    image_trace(true);
    image_train_clear();
    image_send("m600v100l1a50d10.47\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(601);
    TEST_ASSERT_EQUAL(600 - 34 - 166, cruise_length(3000 * US));
    TEST_ASSERT_EQUAL(DECEL, changes[3].state);
    TEST_ASSERT_EQUAL(STOP, changes[4].state);
    image_assert_interval(599, 30000 * US, 1); /* c0 is longer: clamped at slow speed */
}

/* -- TRN ----------------------------------------------------------------------------------------------------------- */

/* TRN-001 */
static void test_a_profile_that_just_fits_is_not_truncated_one_step_less_is(void)
{
    plan_t plan = move_like_model(harmonic(180, 100, 100, 100), 1);
    TEST_ASSERT_FALSE(plan.truncated);
    TEST_ASSERT_EQUAL(90, plan.accel);
    image_assert_interval(90, 16 * 300000.0 / 99, 1);
    plan = move_like_model(harmonic(179, 100, 100, 100), 1);
    TEST_ASSERT_TRUE(plan.truncated);
    TEST_ASSERT_EQUAL(89, plan.accel);
    TEST_ASSERT_EQUAL(90, plan.decel);
}

/* TRN-002, TRN-003 */
static void test_180_and_90_steps_in_200_become_133_and_67(void)
{
    image_trace(true);
    plan_t plan = move_like_model(harmonic(200, 100, 50, 100), 1);
    TEST_ASSERT_EQUAL(133, plan.accel);
    TEST_ASSERT_EQUAL(67, plan.decel);
    TEST_ASSERT_EQUAL(ACCEL, changes[1].state);
    TEST_ASSERT_EQUAL(DECEL, changes[2].state);
    TEST_ASSERT_EQUAL(STOP, changes[3].state);
}

/* TRN-004 */
static void test_225_and_0_steps_in_200_become_200_of_acceleration(void)
{
    image_trace(true);
    move("m200v100a.4d999");
    image_assert_pulses(200);
    for (size_t k = 0; k < 199; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + .4 * (double)k), 1);
    image_assert_states("0AP0");
}

/* TRN-005, STP-005 */
static void test_a_truncated_command_has_no_cruise_and_takes_no_extra_pulses(void)
{
    image_trace(true);
    move("m50v100a1d1u20");
    image_assert_pulses(50);
    image_assert_states("0ADP0");
}

/* TRN-006 */
static void test_one_decel_step_becomes_none_when_truncated(void)
{
    image_trace(true);
    move("m200v100a.4d60");
    image_assert_pulses(200);
    for (size_t k = 0; k < 199; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + .4 * (double)k), 1);
    image_assert_states("0AP0");
}

/* TRN-007 */
static void test_accel_times_target_leaves_exactly_one_decel_step(void)
{
    image_trace(true);
    image_train_clear();
    image_send("m200v100a.4d40\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(201);
    for (size_t k = 0; k < 199; k++)
        image_assert_interval(k, 16 * 300000.0 / (10 + .4 * (double)k), 1);
    image_assert_interval(199, 30000 * US, 1);
}

/* TRN-009 */
static void test_a_truncated_velocity_rises_then_falls_below_its_target(void)
{
    move("m300v400a1d1");
    image_assert_pulses(300);
    size_t k = 1;
    while (k < 299 && image_interval(k) < image_interval(k - 1))
        k++;
    image_assert_near("steps up", 150, (double)k, 2);
    for (; k < 299; k++)
        if (image_interval(k) < image_interval(k - 1))
            image_fail("interval %zu: expected no less than %llu ticks on the way down, saw %llu", k,
                       (unsigned long long)image_interval(k - 1), (unsigned long long)image_interval(k));
    if (train.interval_min <= 750 * US)
        image_fail("expected all intervals above 750 us, saw %llu ticks", (unsigned long long)train.interval_min);
}

/* TRN-010 */
static void test_a_linear_profile_is_truncated_alike(void)
{
    plan_t plan = move_like_model(linear(1000, 300, 500, 500), 1);
    TEST_ASSERT_EQUAL(500, plan.accel);
    TEST_ASSERT_EQUAL(500, plan.decel);
}

/* TRN-011 */
static void test_a_truncated_command_without_decel_leaves_the_velocity_it_reached(void)
{
    image_train_clear();
    image_send("m100v100a.4d999\rm300v100a.4d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_interval(99, 16 * 300000.0 / (10 + .4 * 99), 1);
    image_assert_interval(100, (double)image_interval(99), 2);
    image_assert_interval(101, 16 * 300000.0 / (10 + .4 * 100), 1);
}

/* TRN-012 */
static void test_ten_steps_at_69_rpm_are_five_up_and_five_down(void)
{
    plan_t plan = move_like_model(harmonic(10, 69, 100, 100), 1);
    TEST_ASSERT_EQUAL(5, plan.accel);
    for (size_t k = 0; k < 5; k++) {
        image_assert_interval(k, 16 * 300000.0 / (10 + (double)k), 1);
        image_assert_interval(9 - k, 16 * 300000.0 / (10 + (double)k), 1);
    }
}

/* -- SLO ----------------------------------------------------------------------------------------------------------- */

/* SLO-002, SLO-003 */
static void test_slow_speeds_are_timed_exactly_and_without_ramps(void)
{
    move("m10v5a1d1");
    image_assert_pulses(10);
    image_assert_intervals(0, 9, 60000 * US, 0);
    move("m4v1a1d1");
    image_assert_intervals(0, 3, 300000 * US, 0);
    move("m4v10a1d1");
    image_assert_intervals(0, 3, 30000 * US, 0);
}

/* SLO-003 */
static void test_within_the_slow_range_a_change_is_immediate(void)
{
    image_train_clear();
    image_send("m5v4a1d999\rm5v9a1d999\rm5v2a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(15);
    image_assert_intervals(0, 5, 75000 * US, 0);
    image_assert_intervals(5, 5, 33333 * US, 0);
    image_assert_intervals(10, 4, 150000 * US, 0);
}

/* SLO-006, DIR-005 */
static void test_a_reversal_passes_through_slow_speed(void)
{
    image_train_clear();
    image_send("m200v100a1d1\rm-200v100a1d1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(400);
    image_assert_interval(198, 16 * 300000.0 / 11, 1);
    image_assert_intervals(199, 2, 30000 * US, 1);
    TEST_ASSERT_EQUAL(0, train.pulse[199].dir);
    TEST_ASSERT_EQUAL(1, train.pulse[200].dir);
}

/* SLO-007 */
static void test_the_slow_parameter_sets_the_speed_of_start_and_stop(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(slow_rpm, 20);
    image_prompt();
    image_train_clear();
    image_send("m200v100a1d1\rm1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(201);
    image_assert_interval(0, 15000 * US, 1);
    image_assert_interval(79, 16 * 300000.0 / 99, 1);
    image_assert_intervals(80, 40, 3000 * US, 0);
    image_assert_interval(199, 15000 * US, 1);
}

/* SLO-008 */
static void test_without_decel_a_target_below_slow_is_jumped_to(void)
{
    image_train_clear();
    image_send("m200v100a1d999\rm5v5a1d999\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(205);
    image_assert_intervals(90, 110, 3000 * US, 0);
    image_assert_intervals(200, 4, 60000 * US, 0);
}

/* SLO-009 */
static void test_with_decel_the_first_command_comes_down_to_slow_itself(void)
{
    image_train_clear();
    image_send("m200v100a1d1\rm5v5a1d1\r");
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(205);
    image_assert_interval(199, 30000 * US, 1);
    image_assert_intervals(200, 4, 60000 * US, 0);
}

/* SLO-010 */
static void test_five_seconds_between_pulses_are_exact(void)
{
    move("m3vc5000000a1d1");
    image_assert_pulses(3);
    image_assert_intervals(0, 2, 5000000 * US, 0);
}

/* SLO-011 */
static void test_stop_acts_during_a_long_interval(void)
{
    image_train_clear();
    image_do("m3vc5000000a1d1");
    image_run(SECOND);
    image_assert_pulses(1);
    image_do("S");
    image_idle(50 * MS);
    image_assert_no_pulse_for(10 * SECOND);
    TEST_ASSERT_EQUAL(1, image_position());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_command_passes_accel_cruise_decel_stop_and_ends_in_standby);
    RUN_TEST(test_states_change_at_most_one_interval_before_their_first_interval);
    RUN_TEST(test_accel_slows_down_to_a_lower_target);
    RUN_TEST(test_cruise_holds_the_cycle_from_the_end_of_accel_to_the_start_of_decel);
    RUN_TEST(test_only_a_deceleration_leads_through_decel_to_stop);
    RUN_TEST(test_every_queued_command_passes_stop_in_its_turn);
    RUN_TEST(test_commands_entered_during_motion_run_in_order_then_the_motor_stands);
    RUN_TEST(test_every_profile_has_exactly_the_pulses_commanded);
    RUN_TEST(test_without_decel_the_last_interval_is_the_cycle_and_the_next_command_goes_on_at_it);
    RUN_TEST(test_a_climb_of_streamed_commands_never_returns_and_each_pays_for_its_own_transition);
    RUN_TEST(test_decel_begins_its_own_steps_before_the_end);
    RUN_TEST(test_typing_and_displays_during_a_profile_move_no_edge);
    RUN_TEST(test_200000_steps_are_200000_pulses);
    RUN_TEST(test_the_factory_ramp_is_harmonic_with_1_00_and_1_00);
    RUN_TEST(test_m200v100_is_300000_by_n_for_90_steps_20_in_cruise_and_90_back);
    RUN_TEST(test_velocity_rises_by_the_same_amount_each_step);
    RUN_TEST(test_ramp_steps_are_the_change_divided_by_the_value_truncated);
    RUN_TEST(test_half_the_value_takes_180_steps);
    RUN_TEST(test_a_change_of_90_takes_2_1_1_0_steps_at_45_46_90_91);
    RUN_TEST(test_a_harmonic_ramp_starts_and_ends_at_slow_speed);
    RUN_TEST(test_vc4567_ramps_55_steps_and_cruises_at_its_exact_cycle);
    RUN_TEST(test_a_transition_between_two_speeds_starts_from_the_first);
    RUN_TEST(test_microsteps_stretch_the_ramp_over_the_same_full_steps);
    RUN_TEST(test_1000_steps_at_100_rpm_take_3_90_seconds);
    RUN_TEST(test_2400_rpm_is_reached_and_left_with_an_exact_count);
    RUN_TEST(test_values_above_and_below_1_change_rpm_by_so_much_a_step);
    RUN_TEST(test_linear_intervals_are_c0_times_the_difference_of_two_roots_up_and_down);
    RUN_TEST(test_linear_velocity_over_time_is_a_straight_line);
    RUN_TEST(test_10_47_reaches_100_rpm_in_one_second);
    RUN_TEST(test_linear_steps_are_v_squared_by_2_alpha_a);
    RUN_TEST(test_linear_steps_between_two_speeds_are_the_difference_of_their_own);
    RUN_TEST(test_what_reaches_300_rpm_in_200_steps_passes_100_rpm_after_22);
    RUN_TEST(test_what_reaches_100_rpm_in_a_revolution_needs_nine_to_reach_300);
    RUN_TEST(test_a_linear_ramp_longer_than_the_command_stays_below_its_target);
    RUN_TEST(test_linear_steps_are_multiplied_by_the_microsteps);
    RUN_TEST(test_l1_marks_the_command_and_the_session_as_linear_l0_as_harmonic);
    RUN_TEST(test_the_session_ramp_switches_with_its_defaults);
    RUN_TEST(test_the_linear_defaults_are_parameters_of_their_own);
    RUN_TEST(test_300_rpm_at_16_microsteps_keeps_its_count_and_its_cruise);
    RUN_TEST(test_each_queued_command_has_its_own_ramp);
    RUN_TEST(test_twice_the_steps_a_revolution_take_twice_the_ramp);
    RUN_TEST(test_velocity_and_acceleration_scaled_alike_reach_their_targets_together);
    RUN_TEST(test_a_linear_deceleration_takes_its_own_steps_and_ends_in_stop);
    RUN_TEST(test_a_profile_that_just_fits_is_not_truncated_one_step_less_is);
    RUN_TEST(test_180_and_90_steps_in_200_become_133_and_67);
    RUN_TEST(test_225_and_0_steps_in_200_become_200_of_acceleration);
    RUN_TEST(test_a_truncated_command_has_no_cruise_and_takes_no_extra_pulses);
    RUN_TEST(test_one_decel_step_becomes_none_when_truncated);
    RUN_TEST(test_accel_times_target_leaves_exactly_one_decel_step);
    RUN_TEST(test_a_truncated_velocity_rises_then_falls_below_its_target);
    RUN_TEST(test_a_linear_profile_is_truncated_alike);
    RUN_TEST(test_a_truncated_command_without_decel_leaves_the_velocity_it_reached);
    RUN_TEST(test_ten_steps_at_69_rpm_are_five_up_and_five_down);
    RUN_TEST(test_slow_speeds_are_timed_exactly_and_without_ramps);
    RUN_TEST(test_within_the_slow_range_a_change_is_immediate);
    RUN_TEST(test_a_reversal_passes_through_slow_speed);
    RUN_TEST(test_the_slow_parameter_sets_the_speed_of_start_and_stop);
    RUN_TEST(test_without_decel_a_target_below_slow_is_jumped_to);
    RUN_TEST(test_with_decel_the_first_command_comes_down_to_slow_itself);
    RUN_TEST(test_five_seconds_between_pulses_are_exact);
    RUN_TEST(test_stop_acts_during_a_long_interval);
    return UNITY_END();
}
