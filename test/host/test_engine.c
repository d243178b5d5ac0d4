/* motion/engine on a player of the segment ring: the cycle of every edge, in every phase of a motion. */
#include <stdlib.h>
#include <math.h>
#include <stdio.h>
#include "host/fakes/step_player.h"
#include "motion/engine.h"
#include "settings.h"
#include "unity.h"

#define US 16u
#define SLOW_TICKS 480000u
#define WAIT_TOLERANCE_TICKS 160u /* +- 10 us */

static int32_t position_before;
static uint8_t ended_before;
static uint8_t offers; /* modulo 256 */
static uint32_t planner_ticks; /* what a poll that did some work takes */

void setUp(void)
{
    engine_stop();
    settings.steps_per_rev = 200;
    settings.ustep = 0;
    settings.slow_rpm = 10;
    settings.pulse_us = 2;
    settings.cw_level = 0;
    step_player_reset();
    engine_init();
    engine_set_gap(true);
    position_before = engine_position();
    ended_before = engine_commands_ended();
    offers = engine_commands_begun();
    planner_ticks = 0;
}

/* What must hold after every test. */
void tearDown(void)
{
    const player_harm_t *harm = step_player_harm();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, harm->cut_pulses, "cut pulses");
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, harm->lost_counts, "lost counts");
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, harm->dir_in_pulse, "dir changed in a pulse");
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, harm->bad_segments, "segments that the timer cannot play");
}

/* -- helpers --------------------------------------------------------------------------------------------------------- */

/* The engine reads the settings when it is begun. */
static void set_pulse_us(uint8_t pulse_us)
{
    settings.pulse_us = pulse_us;
    engine_init();
}

/* steps < 0: counter-clockwise. Harmonic ramps, values as on the terminal. */
static motion_command_t move(int32_t steps, uint32_t rpm, double accel, double decel)
{
    motion_command_t c = {.count = (uint32_t)(steps < 0 ? -steps : steps), .velocity = rpm};
    c.accel = (accel_code_t)(accel < 100 ? lround(accel * 100) : lround(accel) - 100 + (long)ACCEL_CODE_WHOLE);
    c.decel = (accel_code_t)(decel < 100 ? lround(decel * 100) : lround(decel) - 100 + (long)ACCEL_CODE_WHOLE);
    if (steps < 0)
        c.flags = MOTION_CCW;
    return c;
}

static motion_command_t linear_move(int32_t steps, uint32_t rpm, double accel, double decel)
{
    motion_command_t c = move(steps, rpm, accel, decel);
    c.flags |= MOTION_LINEAR;
    return c;
}

static motion_command_t cycle_move(int32_t steps, uint32_t cycle_us, double accel, double decel)
{
    motion_command_t c = move(steps, cycle_us, accel, decel);
    c.flags |= MOTION_CYCLE;
    return c;
}

/* Nothing is offered that has not begun. */
static bool can_offer(void)
{
    return engine_commands_begun() == offers;
}

static void submit(motion_command_t c)
{
    static motion_command_t offered; /* the engine takes its values later */
    TEST_ASSERT_EQUAL(STATUS_OK, engine_check(&c));
    TEST_ASSERT_TRUE(can_offer());
    offers++;
    offered = c;
    engine_offer(&offered);
}

/* One round of the main loop. The engine may say for ever that it is at work while it waits for the moment to join a
 * command: some time passes then. False if it had nothing to do. */
static bool poll(void)
{
    static unsigned rounds;
    if (!engine_poll()) {
        rounds = 0;
        return false;
    }
    step_player_advance(planner_ticks);
    if (++rounds % 64 == 0) {
        if ((uint8_t)(step_head - step_tail) > 2 * SEGMENT_BYTES)
            step_player_to_next_load();
        else
            step_player_advance(2000);
    }
    return true;
}

/* The main loop for a while: polls, and lets time pass when there is nothing to do. */
static void run_until(uint64_t time)
{
    while (step_player_now() < time) {
        if (poll())
            continue;
        if (step_player_stopped()) {
            step_player_advance_to(time);
        } else {
            uint64_t before = step_player_now();
            step_player_advance(time - before > 2000 ? 2000 : time - before);
        }
    }
}

static void run_for(uint64_t ticks)
{
    run_until(step_player_now() + ticks);
}

/* Until the timer stands still and the engine has nothing left to do. */
static void run_to_end(void)
{
    for (;;) {
        if (!poll() && !step_player_to_next_load())
            break;
    }
}

static void run_to_state(motion_state_t state)
{
    while (engine_state() != state) {
        TEST_ASSERT_FALSE_MESSAGE(step_player_stopped() && !engine_poll(), "the state was never reached");
        if (!engine_poll())
            step_player_advance(500);
    }
}

/* Submits them as the queue does: each as soon as there is a place for it. */
static void run_all(const motion_command_t *commands, size_t count)
{
    size_t next = 0;
    for (;;) {
        if (next < count && can_offer())
            submit(commands[next++]);
        if (!poll() && !step_player_to_next_load() && next == count)
            break;
    }
}

static int32_t moved(void)
{
    return engine_position() - position_before;
}

static uint8_t ended(void)
{
    return (uint8_t)(engine_commands_ended() - ended_before);
}

static void assert_ended_at(int32_t position)
{
    TEST_ASSERT_EQUAL_INT32(position, moved());
    TEST_ASSERT_EQUAL_INT64(position, step_player_position(settings.cw_level != 0));
    TEST_ASSERT_EQUAL(MOTION_STANDBY, engine_state());
    TEST_ASSERT_TRUE(step_player_stopped());
}

static void assert_intervals(uint64_t from, uint64_t count, uint64_t ticks)
{
    for (uint64_t i = from; i < from + count; i++)
        TEST_ASSERT_EQUAL_UINT64(ticks, step_player_interval(i));
}

/* ticks of a pulse at so many RPM */
static double interval_at(double rpm)
{
    return 960e6 / (200.0 * rpm);
}

static bool seen_state(motion_state_t state)
{
    for (size_t i = 0; i < step_player_states(); i++) {
        if (step_player_state(i)->value == state)
            return true;
    }
    return false;
}

/* -- one command ------------------------------------------------------------------------------------------------------- */

/* HAR-002, HAR-003, HAR-005, HAR-006, HAR-010, HAR-011, HAR-013, SLO-004, SLO-005, CLK-005 */
static void test_every_interval_of_m200_v100_is_where_the_arithmetic_says(void)
{
    motion_command_t both[] = {move(200, 100, 1, 1), cycle_move(1, 50000, 999, 999)};
    run_all(both, 2);
    TEST_ASSERT_EQUAL_UINT64(201, step_player_edges());
    double expected = 0;
    uint64_t start = step_player_edge(0);
    for (unsigned k = 0; k < 200; k++) {
        expected += interval_at(k < 90 ? 10.0 + k : k < 110 ? 100.0 : 209.0 - k);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, expected, (double)(step_player_edge(k + 1) - start));
    }
    assert_intervals(90, 20, 3000 * US);
}

/* HAR-016 */
static void test_1000_steps_at_100_rpm_take_3_9_seconds(void)
{
    motion_command_t both[] = {move(1000, 100, 1, 1), cycle_move(1, 50000, 999, 999)};
    run_all(both, 2);
    double seconds = (double)(step_player_edge(1000) - step_player_edge(0)) / 16e6;
    TEST_ASSERT_DOUBLE_WITHIN(0.078, 3.90, seconds);
}

/* HAR-017, LIN-019, ACC-012 */
static void test_the_manuals_own_queue_takes_the_time_that_was_measured(void)
{
    static const struct {
        int32_t steps;
        uint32_t rpm;
        bool linear;
        double ramp, seconds;
    } rows[] = {{800, 150, false, 1, 2.684}, {600, 50, false, 1, 4.103},  {2000, 150, false, 1, 5.117},
                {1200, 100, false, 1, 4.508}, {200, 20, false, 1, 3.167}, {2000, 100, false, 1, 6.880},
                {4000, 160, true, 5, 10.749}};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        setUp();
        motion_command_t c = rows[i].linear ? linear_move(rows[i].steps, rows[i].rpm, rows[i].ramp, rows[i].ramp)
                                            : move(rows[i].steps, rows[i].rpm, rows[i].ramp, rows[i].ramp);
        motion_command_t both[] = {c, cycle_move(1, 50000, 999, 999)};
        run_all(both, 2);
        uint64_t ticks = step_player_edge((uint64_t)rows[i].steps) - step_player_edge(0);
        double seconds = (double)ticks / 16e6;
        double allowed = rows[i].linear ? 0.005 * rows[i].seconds : fmax(0.015 * rows[i].seconds, 0.010);
        TEST_ASSERT_DOUBLE_WITHIN(allowed, rows[i].seconds, seconds);
    }
}

/* LIN-002 */
static void test_a_linear_ramp_at_10_47_reaches_100_rpm_in_a_second(void)
{
    submit(linear_move(1000, 100, 10.47, 10.47));
    run_to_end();
    assert_ended_at(1000);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, (double)(step_player_edge(166) - step_player_edge(0)) / 16e6);
    assert_intervals(166, 1000 - 2 * 166, 3000 * US);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(998));
}

/* STA-001, STA-003, STA-005, STA-006, STA-007 */
static void test_a_command_passes_through_accel_cruise_decel_stop_and_standby(void)
{
    submit(move(200, 100, 1, 1));
    run_to_end();
    static const motion_state_t expected[] = {MOTION_ACCEL, MOTION_CRUISE, MOTION_DECEL, MOTION_STOP, MOTION_STANDBY};
    size_t first = step_player_state(0)->value == MOTION_STANDBY; /* the lead may belong to no phase */
    TEST_ASSERT_EQUAL_UINT(5 + first, step_player_states());
    for (size_t i = 0; i < 5; i++)
        TEST_ASSERT_EQUAL_UINT8(expected[i], step_player_state(first + i)->value);
    assert_ended_at(200);
    TEST_ASSERT_EQUAL_UINT8(1, ended());
}

/* STA-004, STA-005, STA-009 */
static void test_without_deceleration_there_is_no_decel_state(void)
{
    submit(move(200, 100, 1, 999));
    run_to_end();
    TEST_ASSERT_FALSE(seen_state(MOTION_DECEL));
    TEST_ASSERT_TRUE(seen_state(MOTION_STOP));
    assert_intervals(90, 109, 3000 * US);
    assert_ended_at(200);
}

/* TRN-005, TRN-009, TRN-012 */
static void test_a_truncated_command_has_no_cruise(void)
{
    submit(move(10, 69, 1, 1));
    run_to_end();
    TEST_ASSERT_FALSE(seen_state(MOTION_CRUISE));
    assert_ended_at(10);
    for (unsigned k = 0; k < 9; k++)
        TEST_ASSERT_DOUBLE_WITHIN(1.0, interval_at(k < 5 ? 10 + k : 19 - k), (double)step_player_interval(k));
}

/* ACC-004 */
static void test_with_999_twice_all_intervals_are_the_cycle(void)
{
    submit(move(200, 100, 999, 999));
    run_to_end();
    assert_intervals(0, 199, 3000 * US);
    assert_ended_at(200);
}

/* STA-008, STA-016 */
static void test_counts_are_exact_from_one_to_200000(void)
{
    static const int32_t counts[] = {1, 2, 3, 4, 5, 7, 10, 33, 100, 179, 180, 181, 255, 256, 257, 1000, 65535, 65536, 65537,
                                     200000};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        setUp();
        submit(move(counts[i], 2400, 10, 10));
        run_to_end();
        assert_ended_at(counts[i]);
        setUp();
        submit(linear_move(-counts[i], 1500, 100, 200));
        run_to_end();
        assert_ended_at(-counts[i]);
        TEST_ASSERT_EQUAL_UINT8(1, ended());
    }
}

/* HAR-018 */
static void test_2400_rpm_at_full_step_are_reached(void)
{
    submit(move(20000, 2400, 10, 10));
    run_to_end();
    assert_ended_at(20000);
    assert_intervals(239, 20000 - 2 * 239, 125 * US);
}

/* CLK-005 */
static void test_a_cycle_with_a_fraction_of_a_tick_does_not_drift(void)
{
    settings.driver_id = 2;
    settings.ustep = 7;
    engine_init();
    motion_command_t c = cycle_move(20000, 3001, 999, 999); /* 375.125 ticks a pulse */
    c.flags |= MOTION_PULSES;
    submit(c);
    run_to_end();
    assert_ended_at(20000);
    for (uint64_t k = 1000; k < 20000; k += 999)
        TEST_ASSERT_DOUBLE_WITHIN(64.0, 375.125 * (double)k, (double)(step_player_edge(k) - step_player_edge(0)));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 375.125 * 16384, (double)(step_player_edge(16384) - step_player_edge(0)));
}

/* CLK-015, STA-008 */
static void test_500_khz_are_played_without_a_gap(void)
{
    set_pulse_us(1);
    motion_command_t both[] = {cycle_move(5000, 2, 999, 999), cycle_move(5000, 2, 999, 999)};
    run_all(both, 2);
    assert_ended_at(10000);
    assert_intervals(0, 9999, 32);
    TEST_ASSERT_EQUAL_UINT8(2, ended());
}

/* SLO-001, SLO-002, SLO-003, CLK-002 */
static void test_at_slow_speed_and_below_all_intervals_are_the_cycle(void)
{
    static const uint32_t rpm[] = {1, 3, 5, 9, 10};
    for (size_t i = 0; i < 5; i++) {
        setUp();
        submit(move(10, rpm[i], 1, 1));
        run_to_end();
        assert_intervals(0, 9, 300000 / rpm[i] * US);
        assert_ended_at(10);
    }
}

/* SLO-010, VEL-010 */
static void test_periods_reach_32_bits_of_microseconds(void)
{
    static const uint32_t cycles[] = {4095, 4096, 4097, 6143, 600000, 5000000, 4294967295u};
    for (size_t i = 0; i < sizeof cycles / sizeof cycles[0]; i++) {
        setUp();
        submit(cycle_move(4, cycles[i], 999, 999));
        run_to_end();
        assert_intervals(0, 3, (uint64_t)cycles[i] * US);
        assert_ended_at(4);
    }
}

/* STP-001, STP-002, STP-003, STP-005, STP-010, STP-011, HAR-015 */
static void test_microsteps_multiply_steps_and_not_pulses(void)
{
    settings.ustep = 3;
    engine_init();
    submit(move(1001, 100, 1, 1));
    run_to_end();
    assert_ended_at(8008);
    setUp();
    settings.ustep = 3;
    engine_init();
    motion_command_t c = move(1000, 100, 1, 1);
    c.extra_pulses = 255;
    submit(c);
    run_to_end();
    assert_ended_at(8255);
    assert_intervals(720, 160, 375 * US);
    setUp();
    settings.ustep = 3;
    engine_init();
    c = move(100, 100, 1, 1);
    c.extra_pulses = 20;
    c.flags |= MOTION_PULSES;
    submit(c);
    run_to_end();
    assert_ended_at(100); /* truncated: no cruise to be added to */
}

/* -- direction --------------------------------------------------------------------------------------------------------- */

/* DIR-001, DIR-002 */
static void test_dir_shows_the_direction_as_cw_says(void)
{
    for (uint8_t cw_level = 0; cw_level < 2; cw_level++) {
        setUp();
        settings.cw_level = cw_level;
        submit(move(5, 100, 999, 999));
        TEST_ASSERT_EQUAL(cw_level, step_player_dir_level());
        run_to_end();
        submit(move(-5, 100, 999, 999));
        run_to_end();
        TEST_ASSERT_EQUAL(!cw_level, step_player_dir_level());
        assert_ended_at(0);
        TEST_ASSERT_EQUAL_UINT64(10, step_player_edges());
    }
}

/* DIR-006, DIR-007 */
static void test_after_999_a_reversal_takes_one_cycle(void)
{
    motion_command_t both[] = {move(200, 100, 999, 999), move(-300, 100, 999, 999)};
    run_all(both, 2);
    assert_ended_at(-100);
    assert_intervals(0, 499, 3000 * US);
    uint64_t turned = step_player_dir(step_player_dirs() - 1)->time;
    TEST_ASSERT_TRUE(turned > step_player_edge(199));
    TEST_ASSERT_TRUE(turned + 80 <= step_player_edge(200));
}

/* SLO-006, DIR-005 */
static void test_after_a_deceleration_a_reversal_passes_through_slow_speed(void)
{
    motion_command_t both[] = {move(200, 100, 1, 1), move(-200, 100, 1, 1)};
    run_all(both, 2);
    assert_ended_at(0);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(199));
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(200));
}

/* DIR-007 */
static void test_reversals_at_high_speed_lose_no_pulse(void)
{
    set_pulse_us(1);
    motion_command_t moves[8];
    for (unsigned i = 0; i < 8; i++)
        moves[i] = cycle_move(i & 1 ? -(int32_t)(3 + i) : (int32_t)(50 + i), i & 2 ? 20 : 4, 999, 999);
    run_all(moves, 8);
    assert_ended_at(50 + 52 + 54 + 56 - 4 - 6 - 8 - 10);
    TEST_ASSERT_EQUAL_UINT8(8, ended());
}

/* -- one after the other ------------------------------------------------------------------------------------------------- */

/* STA-011, STA-013, GAP-005, CLK-016 */
static void test_equal_commands_without_deceleration_are_one_motion(void)
{
    motion_command_t three[] = {move(200, 100, 1, 999), move(200, 100, 1, 999), move(200, 100, 1, 1)};
    run_all(three, 3);
    assert_ended_at(600);
    TEST_ASSERT_EQUAL_UINT8(3, ended());
    assert_intervals(90, 600 - 180, 3000 * US);
}

/* STA-002, STA-010, STA-013, HAR-014 */
static void test_a_climb_in_three_commands_does_not_return_to_slow(void)
{
    motion_command_t three[] = {move(200, 100, 1, 999), move(200, 200, 1, 999), move(300, 300, 1, 1)};
    run_all(three, 3);
    assert_ended_at(700);
    for (unsigned k = 200; k < 300; k++)
        TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(100 + k - 200), (double)step_player_interval(k));
    assert_intervals(301, 98, 1500 * US);
    TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(200), (double)step_player_interval(400));
}

/* STA-002 */
static void test_slowing_down_is_an_acceleration_of_the_next_command(void)
{
    motion_command_t both[] = {move(400, 150, 1, 999), move(300, 50, 1, 999)};
    run_all(both, 2);
    assert_ended_at(700);
    TEST_ASSERT_FALSE(seen_state(MOTION_DECEL));
    for (unsigned k = 400; k < 500; k++)
        TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(150 - (k - 400)), (double)step_player_interval(k));
    assert_intervals(501, 198, 6000 * US);
}

/* TRN-011 */
static void test_a_truncated_command_is_continued_at_the_speed_it_reached(void)
{
    motion_command_t both[] = {move(50, 100, 1, 999), move(200, 100, 1, 1)};
    run_all(both, 2);
    assert_ended_at(250);
    TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(59), (double)step_player_interval(49));
    TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(59), (double)step_player_interval(50));
    TEST_ASSERT_DOUBLE_WITHIN(1.01, interval_at(60), (double)step_player_interval(51));
}

/* SLO-008 */
static void test_a_command_below_slow_is_jumped_to(void)
{
    motion_command_t both[] = {move(200, 100, 1, 999), move(5, 5, 1, 1)};
    run_all(both, 2);
    assert_ended_at(205);
    assert_intervals(90, 110, 3000 * US);
    assert_intervals(200, 4, 60000 * US);
}

/* SLO-009 */
static void test_a_deceleration_leads_to_a_command_below_slow(void)
{
    motion_command_t both[] = {move(200, 100, 1, 1), move(5, 5, 1, 1)};
    run_all(both, 2);
    assert_ended_at(205);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(199));
    assert_intervals(200, 4, 60000 * US);
}

/* STA-015 */
static void test_short_commands_in_a_row_are_all_executed(void)
{
    for (int32_t count = 1; count < 5; count++) {
        setUp();
        motion_command_t many[100];
        for (unsigned i = 0; i < 100; i++)
            many[i] = cycle_move(count, 200, 999, 999);
        run_all(many, 100);
        assert_ended_at(100 * count);
        TEST_ASSERT_EQUAL_UINT8(100, ended());
        assert_intervals(0, (uint64_t)(100 * count) - 1, 200 * US);
    }
}

/* -- GAP ----------------------------------------------------------------------------------------------------------------- */

/* A command without deceleration, then another one so many ticks after the end of its last interval. */
static void two_with_a_pause(bool gap, int64_t pause_ticks)
{
    engine_set_gap(gap);
    submit(move(200, 100, 1, 999));
    while (step_player_edges() < 200)
        run_for(1000);
    run_until((uint64_t)((int64_t)step_player_edge(199) + 3000 * (int64_t)US + pause_ticks));
    submit(move(200, 100, 1, 1));
    run_to_end();
    assert_ended_at(400);
}

/* GAP-004, GAP-005 */
static void test_a_command_within_the_gap_continues_at_the_velocity_in_play(void)
{
    two_with_a_pause(true, 20000);
    assert_intervals(200, 100, 3000 * US);
    setUp();
    two_with_a_pause(true, -30000);
    assert_intervals(199, 101, 3000 * US); /* joined: not a tick more */
}

/* GAP-004, GAP-006, GAP-007 */
static void test_a_command_after_the_gap_starts_from_slow_speed(void)
{
    two_with_a_pause(true, 2 * 3000 * US);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(200));
    uint32_t rpm, cycle_us;
    engine_velocity(&rpm, &cycle_us);
    TEST_ASSERT_EQUAL_UINT32(10, rpm);
    TEST_ASSERT_EQUAL_UINT32(30000, cycle_us);
}

/* GAP-008 */
static void test_without_gap_testing_the_velocity_stays_in_play_for_ever(void)
{
    two_with_a_pause(false, 5 * 16000000);
    assert_intervals(200, 100, 3000 * US);
}

/* GAP-009 */
static void test_one_step_of_deceleration_returns_to_slow_speed(void)
{
    motion_command_t both[] = {move(200, 100, 1, 60), move(200, 100, 1, 1)};
    run_all(both, 2);
    assert_ended_at(400);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(199));
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(200));
}

/* GAP-006, SWT-001 */
static void test_a_start_wait_longer_than_the_gap_is_a_start_from_slow_speed(void)
{
    motion_command_t both[] = {move(200, 100, 1, 999), move(200, 100, 1, 1)};
    both[1].start_wait_us = 100000;
    run_all(both, 2);
    assert_ended_at(400);
    TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(200));
    TEST_ASSERT_UINT64_WITHIN(WAIT_TOLERANCE_TICKS, 103000 * US, step_player_interval(199));
}

/* -- start wait ------------------------------------------------------------------------------------------------------------ */

/* SWT-001, SWT-003 */
static void test_the_start_wait_counts_from_the_start_in_microseconds(void)
{
    static const uint32_t waits[] = {0, 1, 7, 100, 2047, 2048, 3000, 4096, 50000, 1000000, 4294967295u};
    for (size_t i = 0; i < sizeof waits / sizeof waits[0]; i++) {
        setUp();
        motion_command_t c = move(10, 100, 1, 1);
        c.start_wait_us = waits[i];
        submit(c);
        run_to_end();
        assert_ended_at(10);
        TEST_ASSERT_UINT64_WITHIN(WAIT_TOLERANCE_TICKS, (uint64_t)waits[i] * US, step_player_edge(0));
        TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(0));
    }
}

/* Of a wait that fits one period the pulse is in the ring one step earlier than of others. */
static void test_no_pulse_is_lost_behind_a_start_wait_of_any_length(void)
{
    for (uint32_t us = 2900; us < 9000; us += 100) {
        setUp();
        motion_command_t c = cycle_move(4, 1800, 999, 999);
        c.start_wait_us = us;
        submit(c);
        run_to_end();
        assert_ended_at(4);
    }
}

/* SWT-001, SWT-006 */
static void test_the_start_wait_counts_from_the_end_of_the_command_before(void)
{
    static const uint32_t waits[] = {1, 5, 7, 8, 9, 20, 100, 2047, 2048, 3000, 1000000, 4294967295u};
    for (size_t i = 0; i < sizeof waits / sizeof waits[0]; i++) {
        setUp();
        motion_command_t both[] = {move(200, 100, 1, 1), move(-10, 100, 1, 1)};
        both[1].start_wait_us = waits[i];
        run_all(both, 2);
        assert_ended_at(190);
        TEST_ASSERT_UINT64_WITHIN(WAIT_TOLERANCE_TICKS, (30000 + (uint64_t)waits[i]) * US, step_player_interval(199));
        TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(200));
    }
}

/* SWT-007, SLO-011 */
static void test_a_stop_ends_a_wait_and_a_long_interval_at_once(void)
{
    motion_command_t c = move(10, 100, 1, 1);
    c.start_wait_us = 60000000;
    submit(c);
    run_for(16000000);
    engine_stop();
    assert_ended_at(0);
    setUp();
    submit(cycle_move(10, 5000000, 999, 999));
    run_for(16000000);
    engine_stop();
    assert_ended_at(1);
    run_for(160000000);
    TEST_ASSERT_EQUAL_UINT64(1, step_player_edges());
}

/* -- stop and next --------------------------------------------------------------------------------------------------------- */

static const uint64_t moments[] = {0,       50,      100,     200,     5000,     100000,   600000,   3000000,  7000000,
                                   11200000, 11300000, 11900000, 12150000, 12200000, 15000000, 22000000, 23100000,
                                   23450000, 23480000, 23500000, 23600000, 24000000};
#define MOMENTS (sizeof moments / sizeof moments[0])

/* STO-001, STO-005 */
static void test_a_stop_is_followed_by_no_edge_and_loses_none(void)
{
    for (size_t i = 0; i < MOMENTS; i++) {
        for (uint64_t odd = 0; odd < 4; odd++) {
            setUp();
            submit(move(200, 100, 1, 1));
            run_for(moments[i] + odd * 11);
            engine_stop();
            uint64_t edges = step_player_edges();
            run_for(2000000);
            TEST_ASSERT_EQUAL_UINT64(edges, step_player_edges());
            assert_ended_at((int32_t)edges);
            TEST_ASSERT_EQUAL_UINT8(1, ended());
            submit(move(20, 100, 1, 1));
            run_to_end();
            assert_ended_at((int32_t)edges + 20);
            TEST_ASSERT_EQUAL_UINT64(SLOW_TICKS, step_player_interval(edges));
        }
    }
}

/* STO-001 */
static void test_a_stop_at_high_speed_leaves_the_position_right(void)
{
    set_pulse_us(1);
    for (uint32_t cycle_us = 2; cycle_us < 40; cycle_us += cycle_us < 8 ? 1 : 7) {
        for (uint64_t odd = 0; odd < 130; odd += 3) {
            setUp();
            set_pulse_us(1);
            submit(cycle_move(-5000, cycle_us, 999, 999));
            run_until(9000 + odd);
            engine_stop();
            uint64_t edges = step_player_edges();
            run_for(200000);
            TEST_ASSERT_EQUAL_UINT64(edges, step_player_edges());
            assert_ended_at(-(int32_t)edges);
        }
    }
}

/* STO-004, ACC-012 */
static void test_a_graceful_stop_ramps_down_to_slow_with_the_given_deceleration(void)
{
    for (uint64_t at = 12500000; at < 30000000; at += 1234567) {
        setUp();
        submit(move(5000, 100, 1, 1));
        run_for(at);
        uint64_t edges = step_player_edges();
        engine_stop_graceful(200, false);
        run_to_end();
        assert_ended_at((int32_t)step_player_edges());
        TEST_ASSERT_EQUAL_UINT8(1, ended());
        uint64_t after = step_player_edges() - edges;
        /* 45 steps of ramp, after a few that had been planned already */
        TEST_ASSERT_TRUE(after >= 44 && after <= 52);
        uint64_t last = step_player_edges() - 1;
        for (unsigned k = 0; k < 44; k++)
            TEST_ASSERT_DOUBLE_WITHIN(2.0, interval_at(12.0 + 2.0 * k), (double)step_player_interval(last - 1 - k));
    }
}

/* STO-004, NXT-002, NXT-003 */
static void test_graceful_ends_in_any_phase_never_jump_and_lose_no_pulse(void)
{
    for (unsigned kind = 0; kind < 4; kind++) {
        for (uint64_t at = 0; at < 24000000; at += kind & 1 ? 777777 : 611111) {
            setUp();
            submit(kind & 2 ? linear_move(2000, 300, 20, 30) : move(200, 100, 1, 1));
            run_for(at);
            bool running = engine_state() != MOTION_STANDBY || !step_player_stopped();
            if (kind & 1)
                engine_next(true);
            else
                engine_stop_graceful(100, false);
            run_to_end();
            assert_ended_at((int32_t)step_player_edges());
            TEST_ASSERT_EQUAL_UINT8(1, ended());
            if (!running || step_player_edges() < 3)
                continue;
            /* Speed rises, then falls: no interval is shorter than the one before once one has been longer. */
            bool falling = false;
            for (uint64_t k = 1; k + 1 < step_player_edges(); k++) {
                double before = (double)step_player_interval(k - 1), now = (double)step_player_interval(k);
                if (now > before * 1.0005 + 2)
                    falling = true;
                else if (falling && now < before * 0.9995 - 2) {
                    char text[120];
                    snprintf(text, sizeof text, "kind %u at %llu: interval %llu: %.0f after %.0f", kind,
                             (unsigned long long)at, (unsigned long long)k, now, before);
                    TEST_FAIL_MESSAGE(text);
                }
            }
        }
    }
}

/* NXT-001, NXT-005 */
static void test_next_ends_the_command_and_goes_on_with_the_queued_one(void)
{
    for (uint64_t at = 200; at < 23000000; at += 1111111) {
        setUp();
        submit(move(200, 100, 1, 1));
        submit(move(-100, 100, 1, 1));
        run_for(at);
        uint64_t edges = step_player_edges();
        engine_next(false);
        run_to_end();
        /* What had been handed to the timer may still be made; then exactly 100 backwards. */
        int64_t first = (int64_t)step_player_edges() - 100;
        if(!(first >= (int64_t)edges && first <= (int64_t)edges + 8)) {char t[99]; snprintf(t,99,"at %llu edges %llu first %lld",(unsigned long long)at,(unsigned long long)edges,(long long)first); TEST_FAIL_MESSAGE(t);}
        assert_ended_at((int32_t)(first - 100));
        TEST_ASSERT_EQUAL_UINT8(2, ended());
    }
}

/* NXT-002, NXT-005 */
static void test_graceful_next_goes_on_with_the_queued_command(void)
{
    for (uint64_t at = 200; at < 23000000; at += 1111111) {
        setUp();
        submit(move(200, 100, 1, 1));
        submit(move(-100, 100, 1, 1));
        run_for(at);
        engine_next(true);
        run_to_end();
        assert_ended_at((int32_t)step_player_edges() - 200);
        TEST_ASSERT_EQUAL_UINT8(2, ended());
    }
}

/* NXT-006 */
static void test_graceful_next_without_deceleration_leaves_the_velocity_in_play(void)
{
    submit(move(20000, 100, 1, 999));
    submit(move(300, 100, 1, 1));
    run_for(20000000);
    engine_next(true);
    run_to_end();
    assert_ended_at((int32_t)step_player_edges());
    TEST_ASSERT_EQUAL_UINT8(2, ended());
    uint64_t last = step_player_edges() - 1;
    for (uint64_t k = 90; k < last - 90; k++)
        TEST_ASSERT_UINT64_WITHIN(10, 3000 * US, step_player_interval(k)); /* speed in hundredths of an RPM */
}

/* NXT-001, SYN-001: also where it is so short that what follows would be joined to it. */
static void test_nothing_is_begun_before_a_held_command_has_been_released(void)
{
    motion_command_t held = cycle_move(3, 1400, 999, 999);
    held.flags |= MOTION_SYNC;
    submit(held);
    const motion_command_t next = move(-100, 100, 1, 1);
    engine_offer(&next);
    run_for(1000000);
    TEST_ASSERT_TRUE(can_offer());
    TEST_ASSERT_TRUE(engine_next(true));
    engine_offer(&next); /* as the queue does it all the time */
    run_to_end();
    assert_ended_at(-100);
}

/* What is in the ring has not been played because the timer has nothing to do. */
static void test_a_command_has_not_ended_where_the_planner_was_late(void)
{
    settings.slow_rpm = 200;
    engine_init();
    submit(move(7, 250, 50, 50));
    step_player_advance(16000000);
    TEST_ASSERT_TRUE(step_idle);
    while (step_idle)
        engine_poll();
    TEST_ASSERT_EQUAL_UINT8(0, ended());
    run_to_end();
    assert_ended_at(7);
    TEST_ASSERT_EQUAL_UINT8(1, ended());
}

/* NXT-003 */
static void test_next_with_nothing_queued_ends_in_standby(void)
{
    submit(move(200, 100, 1, 1));
    run_for(12000000);
    engine_next(false);
    run_to_end();
    assert_ended_at((int32_t)step_player_edges());
    TEST_ASSERT_TRUE(step_player_edges() < 200);
    engine_next(false);
    engine_next(true);
    run_to_end();
    TEST_ASSERT_EQUAL_UINT8(1, ended());
}

/* -- single pulses ---------------------------------------------------------------------------------------------------------- */

/* PUL-001, PUL-002, PUL-005 */
static void test_single_pulses_are_stacked_in_both_directions(void)
{
    static const bool ccw[] = {false, false, true, false, true, true, true, false};
    int32_t expected = 0;
    for (size_t i = 0; i < sizeof ccw / sizeof ccw[0]; i++) {
        engine_single_pulse(ccw[i]);
        expected += ccw[i] ? -1 : 1;
    }
    run_to_end();
    TEST_ASSERT_EQUAL_UINT64(8, step_player_edges());
    assert_ended_at(expected);
    size_t run = 0;
    uint64_t in_run = 0;
    for (size_t i = 0; i < sizeof ccw / sizeof ccw[0]; i++) {
        TEST_ASSERT_EQUAL(ccw[i], step_player_run(run)->dir); /* cw_level 0 */
        if (++in_run == step_player_run(run)->count) {
            run++;
            in_run = 0;
        }
    }
    TEST_ASSERT_EQUAL_UINT8(0, ended());
}

/* PUL-003 */
static void test_a_single_pulse_is_one_edge_whatever_the_microsteps(void)
{
    settings.ustep = 4;
    engine_init();
    engine_single_pulse(true);
    run_to_end();
    assert_ended_at(-1);
}

/* PUL-004 */
static void test_single_pulses_are_ignored_while_a_command_runs(void)
{
    submit(move(200, 100, 1, 1));
    run_for(5000000);
    engine_single_pulse(false);
    engine_single_pulse(true);
    run_to_end();
    assert_ended_at(200);
}

/* PUL-002, PUL-005 */
static void test_single_pulses_are_made_in_the_gap_after_a_command(void)
{
    for (unsigned polls = 0; polls < 8; polls++) {
        setUp();
        submit(move(50, 100, 1, 999));
        run_to_state(MOTION_STOP);
        run_to_state(MOTION_STANDBY);
        run_for(7000 * polls);
        engine_single_pulse(true);
        engine_single_pulse(true);
        run_to_end();
        assert_ended_at(48);
    }
}

static void test_a_command_after_single_pulses_is_exact(void)
{
    for (unsigned polls = 0; polls < 12; polls++) {
        setUp();
        engine_single_pulse(false);
        engine_single_pulse(false);
        for (unsigned i = 0; i < polls; i++) {
            engine_poll();
            step_player_advance(60);
        }
        submit(move(-50, 100, 1, 1));
        run_to_end();
        uint64_t singles = step_player_edges() - 50;
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(2, singles);
        assert_ended_at((int32_t)singles - 50);
    }
}

/* -- what others see ---------------------------------------------------------------------------------------------------------- */

static void assert_position_is_right(void)
{
    TEST_ASSERT_EQUAL_INT64(step_player_position(false), moved());
}

/* DIR-007 */
static void test_the_position_equals_the_edges_at_every_moment(void)
{
    static const uint16_t strides[] = {7, 13, 61, 333, 4999};
    for (size_t i = 0; i < sizeof strides / sizeof strides[0]; i++) {
        setUp();
        set_pulse_us(1);
        submit(cycle_move(300, 3 + (uint32_t)i * 10, 999, 999));
        submit(cycle_move(-200, 4 + (uint32_t)i * 11, 999, 999));
        for (unsigned k = 0; k < 20000 && !step_player_stopped(); k++) {
            engine_poll();
            assert_position_is_right();
            step_player_advance(strides[i]);
            assert_position_is_right();
        }
        run_to_end();
        assert_ended_at(100);
    }
}

static void test_the_position_counts_a_pulse_whose_interrupt_is_held_off(void)
{
    submit(cycle_move(300, 40, 999, 999));
    run_for(3000);
    for (unsigned k = 0; k < 500; k++) {
        step_player_hold_interrupt(true);
        step_player_advance(9 + k % 31);
        assert_position_is_right();
        step_player_hold_interrupt(false);
        assert_position_is_right();
        engine_poll();
        step_player_advance(600);
        assert_position_is_right();
    }
    run_to_end();
    assert_ended_at(300);
}

/* VEL-007 */
static void test_the_velocity_is_that_of_the_interval_being_played(void)
{
    uint32_t rpm, cycle_us;
    submit(cycle_move(400, 2871, 1, 999));
    run_to_state(MOTION_CRUISE);
    run_for(1000000);
    engine_velocity(&rpm, &cycle_us);
    TEST_ASSERT_EQUAL_UINT32(104, rpm);
    TEST_ASSERT_EQUAL_UINT32(2871, cycle_us);
    run_to_end();
    engine_velocity(&rpm, &cycle_us);
    TEST_ASSERT_EQUAL_UINT32(10, rpm);
    TEST_ASSERT_EQUAL_UINT32(30000, cycle_us);
    setUp();
    engine_set_gap(false); /* it stays in play, to the microsecond */
    submit(cycle_move(400, 2871, 1, 999));
    run_to_end();
    engine_velocity(&rpm, &cycle_us);
    TEST_ASSERT_EQUAL_UINT32(104, rpm);
    TEST_ASSERT_EQUAL_UINT32(2871, cycle_us);
    setUp();
    submit(move(200, 100, 1, 1));
    while (step_player_edges() < 41)
        run_for(500);
    run_for(3000);
    engine_velocity(&rpm, &cycle_us);
    TEST_ASSERT_EQUAL_UINT32(50, rpm); /* the 41st interval is that of 50 RPM */
    TEST_ASSERT_UINT32_WITHIN(1, 6000, cycle_us);
}

static void test_commands_that_cannot_be_kept_are_refused(void)
{
    motion_command_t c = cycle_move(10, 2, 999, 999);
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, engine_check(&c)); /* pulse 2 us */
    set_pulse_us(1);
    TEST_ASSERT_EQUAL(STATUS_OK, engine_check(&c));
    c.velocity = 1;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, engine_check(&c));
}

/* -- a slow planner ------------------------------------------------------------------------------------------------------------ */

static void test_a_planner_of_usual_speed_keeps_the_ring_filled(void)
{
    static const uint32_t costs[] = {500, 1500, 3000};
    for (size_t i = 0; i < 3; i++) {
        setUp();
        planner_ticks = costs[i];
        submit(move(2000, 300, 1, 1));
        run_to_end();
        assert_ended_at(2000);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, interval_at(10), (double)step_player_interval(0));
        assert_intervals(290, 2000 - 580, 1000 * US);
        setUp();
        planner_ticks = costs[i];
        submit(linear_move(2000, 300, 20, 20));
        run_to_end();
        assert_ended_at(2000);
    }
    TEST_ASSERT_EQUAL_UINT8(0, engine_faults());
}

/* LIN-009, STA-008 */
static void test_a_steep_linear_ramp_from_standstill_speeds_up_and_slows_down(void)
{
    submit(linear_move(5000, 2000, 500, 500));
    run_to_end();
    assert_ended_at(5000);
    TEST_ASSERT_TRUE(seen_state(MOTION_CRUISE));
    TEST_ASSERT_TRUE(seen_state(MOTION_DECEL));
    TEST_ASSERT_EQUAL_UINT64(150 * US, step_player_interval(2500));
    TEST_ASSERT_TRUE(step_player_interval(4998) > 50000);
    TEST_ASSERT_EQUAL_UINT8(0, engine_faults());
}

/* STO-001 */
static void test_a_stop_counts_what_was_repeated(void)
{
    unsigned repeated = 0;
    for (uint32_t late = 100000; late < 5000000; late += 30011) {
        setUp();
        submit(move(4000, 3000, 10, 10));
        run_for(8000000);
        step_player_advance(late); /* nobody plans meanwhile */
        repeated += step_held != 0;
        engine_stop();
        assert_position_is_right();
    }
    TEST_ASSERT_TRUE(repeated > 0);
}

static void test_no_motion_so_far_has_starved(void)
{
    TEST_ASSERT_EQUAL_UINT8(0, engine_faults());
}

/* The last ones: a fault stays until reset. CLK-014 */
static void test_a_planner_that_is_too_slow_neither_adds_nor_loses_a_pulse(void)
{
    static const uint32_t costs[] = {5000, 12000, 40000, 150000, 700000, 3000000};
    for (unsigned kind = 0; kind < 5; kind++) {
        for (size_t i = 0; i < sizeof costs / sizeof costs[0]; i++) {
            setUp();
            planner_ticks = costs[i];
            motion_command_t c = kind == 0   ? move(3000, 600, 1, 1)
                                 : kind == 1 ? linear_move(5000, 2000, 500, 500)
                                 : kind == 2 ? move(300, 100, 0.4, 1)
                                 : kind == 3 ? linear_move(60, 300, 5, 5)
                                             : cycle_move(3000, 10, 999, 999);
            motion_command_t both[] = {c, move(-30, 50, 2, 2)};
            run_all(both, 2);
            char text[60];
            snprintf(text, sizeof text, "kind %u, %u ticks", kind, costs[i]);
            TEST_ASSERT_EQUAL_INT64_MESSAGE((int64_t)c.count - 30, step_player_position(false), text);
            assert_ended_at((int32_t)c.count - 30);
            TEST_ASSERT_EQUAL_UINT64_MESSAGE(c.count + 30, step_player_edges(), text);
            TEST_ASSERT_EQUAL_UINT8(2, ended());
        }
    }
    TEST_ASSERT_TRUE(engine_faults() & ENGINE_FAULT_STARVED);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_interval_of_m200_v100_is_where_the_arithmetic_says);
    RUN_TEST(test_1000_steps_at_100_rpm_take_3_9_seconds);
    RUN_TEST(test_the_manuals_own_queue_takes_the_time_that_was_measured);
    RUN_TEST(test_a_linear_ramp_at_10_47_reaches_100_rpm_in_a_second);
    RUN_TEST(test_a_command_passes_through_accel_cruise_decel_stop_and_standby);
    RUN_TEST(test_without_deceleration_there_is_no_decel_state);
    RUN_TEST(test_a_truncated_command_has_no_cruise);
    RUN_TEST(test_with_999_twice_all_intervals_are_the_cycle);
    RUN_TEST(test_counts_are_exact_from_one_to_200000);
    RUN_TEST(test_2400_rpm_at_full_step_are_reached);
    RUN_TEST(test_a_cycle_with_a_fraction_of_a_tick_does_not_drift);
    RUN_TEST(test_500_khz_are_played_without_a_gap);
    RUN_TEST(test_at_slow_speed_and_below_all_intervals_are_the_cycle);
    RUN_TEST(test_periods_reach_32_bits_of_microseconds);
    RUN_TEST(test_microsteps_multiply_steps_and_not_pulses);
    RUN_TEST(test_dir_shows_the_direction_as_cw_says);
    RUN_TEST(test_after_999_a_reversal_takes_one_cycle);
    RUN_TEST(test_after_a_deceleration_a_reversal_passes_through_slow_speed);
    RUN_TEST(test_reversals_at_high_speed_lose_no_pulse);
    RUN_TEST(test_equal_commands_without_deceleration_are_one_motion);
    RUN_TEST(test_a_climb_in_three_commands_does_not_return_to_slow);
    RUN_TEST(test_slowing_down_is_an_acceleration_of_the_next_command);
    RUN_TEST(test_a_truncated_command_is_continued_at_the_speed_it_reached);
    RUN_TEST(test_a_command_below_slow_is_jumped_to);
    RUN_TEST(test_a_deceleration_leads_to_a_command_below_slow);
    RUN_TEST(test_short_commands_in_a_row_are_all_executed);
    RUN_TEST(test_a_command_within_the_gap_continues_at_the_velocity_in_play);
    RUN_TEST(test_a_command_after_the_gap_starts_from_slow_speed);
    RUN_TEST(test_without_gap_testing_the_velocity_stays_in_play_for_ever);
    RUN_TEST(test_one_step_of_deceleration_returns_to_slow_speed);
    RUN_TEST(test_a_start_wait_longer_than_the_gap_is_a_start_from_slow_speed);
    RUN_TEST(test_the_start_wait_counts_from_the_start_in_microseconds);
    RUN_TEST(test_no_pulse_is_lost_behind_a_start_wait_of_any_length);
    RUN_TEST(test_the_start_wait_counts_from_the_end_of_the_command_before);
    RUN_TEST(test_a_stop_ends_a_wait_and_a_long_interval_at_once);
    RUN_TEST(test_a_stop_is_followed_by_no_edge_and_loses_none);
    RUN_TEST(test_a_stop_at_high_speed_leaves_the_position_right);
    RUN_TEST(test_a_graceful_stop_ramps_down_to_slow_with_the_given_deceleration);
    RUN_TEST(test_graceful_ends_in_any_phase_never_jump_and_lose_no_pulse);
    RUN_TEST(test_next_ends_the_command_and_goes_on_with_the_queued_one);
    RUN_TEST(test_graceful_next_goes_on_with_the_queued_command);
    RUN_TEST(test_graceful_next_without_deceleration_leaves_the_velocity_in_play);
    RUN_TEST(test_nothing_is_begun_before_a_held_command_has_been_released);
    RUN_TEST(test_next_with_nothing_queued_ends_in_standby);
    RUN_TEST(test_single_pulses_are_stacked_in_both_directions);
    RUN_TEST(test_a_single_pulse_is_one_edge_whatever_the_microsteps);
    RUN_TEST(test_single_pulses_are_ignored_while_a_command_runs);
    RUN_TEST(test_single_pulses_are_made_in_the_gap_after_a_command);
    RUN_TEST(test_a_command_after_single_pulses_is_exact);
    RUN_TEST(test_the_position_equals_the_edges_at_every_moment);
    RUN_TEST(test_the_position_counts_a_pulse_whose_interrupt_is_held_off);
    RUN_TEST(test_the_velocity_is_that_of_the_interval_being_played);
    RUN_TEST(test_commands_that_cannot_be_kept_are_refused);
    RUN_TEST(test_a_planner_of_usual_speed_keeps_the_ring_filled);
    RUN_TEST(test_a_steep_linear_ramp_from_standstill_speeds_up_and_slows_down);
    RUN_TEST(test_no_motion_so_far_has_starved);
    RUN_TEST(test_a_stop_counts_what_was_repeated);
    RUN_TEST(test_a_planner_that_is_too_slow_neither_adds_nor_loses_a_pulse);
    RUN_TEST(test_a_command_has_not_ended_where_the_planner_was_late);
    return UNITY_END();
}
