/* ninja/path, ninja/drive: steps and times of a move, backlash, and what a halt leaves. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "host/fakes/head_fake.h"
#include "ninja/drive.h"
#include "ninja/path.h"
#include "splitmix64.h"
#include "unity.h"

#define ACCELERATION 1002.68 /* 105 rad/s^2, next to the constant */

static uint64_t seed = 1;

void setUp(void)
{
    head_fake_reset();
    drive_init();
}

void tearDown(void) {}

static int between(int least, int most)
{
    return least + (int)(splitmix64(&seed) % (uint64_t)(most - least + 1));
}

static void go(int x, int y, uint32_t step_us)
{
    const int16_t target[AXES] = {(int16_t)x, (int16_t)y};
    drive_to(target, step_us);
}

/* Plays so many steps, or all; the drive is halted after them. What follows each step is done behind it. */
static void play_and(unsigned steps, void (*after_step)(void))
{
    while (drive_runs()) {
        while (drive_poll()) {
        }
        if (!drive_runs())
            break;
        if (steps == 0)
            drive_halt();
        else
            steps--;
        head_fake_play();
        if (after_step)
            after_step();
    }
}

static void play(unsigned steps)
{
    play_and(steps, NULL);
}

static double ms_between(unsigned event, unsigned later)
{
    return (double)(head_events[later].ticks - head_events[event].ticks) * 1000 / STEPPER_HZ;
}

/* -- times --------------------------------------------------------------------------------------------------------- */

/* NIN-014, NIN-030, NIN-031: start interval, a ramp from standstill, cruise, a ramp to the start velocity, closing
 * interval */
static void test_a_move_follows_the_law(void)
{
    go(700, 0, PATH_CYCLE_US(500));
    play(UINT32_MAX);
    TEST_ASSERT_EQUAL(700 + 2, head_event_count);
    TEST_ASSERT_EQUAL(1 << AXIS_X, head_events[0].axes);
    TEST_ASSERT_EQUAL(0, head_events[701].axes);
    TEST_ASSERT_EQUAL_DOUBLE(20, ms_between(0, 1));
    const unsigned ramp = 124; /* floor(500^2 / (2 a)) */
    for (unsigned k = 1; k <= ramp; k++)
        TEST_ASSERT_DOUBLE_WITHIN(0.002, 1000 * sqrt(2 * k / ACCELERATION), ms_between(1, 1 + k));
    for (unsigned k = ramp + 1; k <= 700 - ramp; k++)
        TEST_ASSERT_DOUBLE_WITHIN(0.002, 2, ms_between(k, k + 1));
    for (unsigned k = ramp + 3; k <= 700 - ramp - 2; k++)
        TEST_ASSERT_EQUAL_DOUBLE(2, ms_between(k, k + 1));
    for (unsigned k = 1; k <= ramp; k++) {
        double interval = 1000 * (sqrt(2 * k / ACCELERATION) - sqrt(2 * (k - 1) / ACCELERATION));
        TEST_ASSERT_DOUBLE_WITHIN(0.002, interval < 20 ? interval : 20, ms_between(701 - k, 702 - k));
    }
}

/* NIN-012, NIN-013: without a ramp, exact to a tick */
static void test_slow_moves_are_even(void)
{
    const unsigned speeds[] = {8, 13, 25, 50};
    for (unsigned i = 0; i < 4; i++) {
        setUp();
        go(0, -30, PATH_CYCLE_US(speeds[i]));
        play(UINT32_MAX);
        TEST_ASSERT_EQUAL(30 + NINJA_BACKLASH_Y + 2, head_event_count);
        TEST_ASSERT_EQUAL_DOUBLE(20, ms_between(0, 1));
        for (unsigned e = 1; e + 1 < head_event_count; e++)
            TEST_ASSERT_EQUAL_DOUBLE(PATH_CYCLE_US(speeds[i]) / 1000., ms_between(e, e + 1));
    }
}

static double square(double x)
{
    return x * x;
}

/* NIN-031: also of moves too short for the velocity. Of v^2, 2 a a step at most, from each interval to the next ones;
 * the mean velocity of the first one is half of what it ends with, and 0.5 us are up to 0.06 of a step. */
static void test_no_acceleration_exceeds_the_constant(void)
{
    for (int i = 0; i < 300; i++) {
        setUp();
        go(between(-600, 600), 0, PATH_CYCLE_US(between(51, 500)));
        play(UINT32_MAX);
        for (unsigned later = 1; later < 100; later = 2 * later + 1) {
            for (unsigned e = 1; e + later + 1 < head_event_count; e++) {
                const double v2 = square(1000 / ms_between(e, e + 1));
                const double change = square(1000 / ms_between(e + later, e + later + 1)) - v2;
                TEST_ASSERT_TRUE(fabs(change) < 2 * 1.02 * NINJA_ACCELERATION * (later + 0.25));
            }
        }
    }
}

/* -- the line ------------------------------------------------------------------------------------------------------ */

/* NIN-014: never a step beside the straight line, the last steps together */
static void test_paths_are_straight(void)
{
    for (int i = 0; i < 500; i++) {
        int x0 = head_counts[AXIS_X], y0 = head_counts[AXIS_Y];
        head_fake_forget();
        go(between(NINJA_X_MIN, NINJA_X_MAX), between(NINJA_Y_MIN, NINJA_Y_MAX), 2000);
        play(UINT32_MAX);
        const int x = head_counts[AXIS_X] - x0, y = head_counts[AXIS_Y] - y0;
        const unsigned steps = (unsigned)(abs(x) > abs(y) ? abs(x) : abs(y));
        TEST_ASSERT_EQUAL(steps + 2, head_event_count);
        for (unsigned k = 0; k <= steps; k++) {
            const int done_x = abs(head_events[k].counts[AXIS_X] - x0);
            const int done_y = abs(head_events[k].counts[AXIS_Y] - y0);
            TEST_ASSERT_EQUAL(k * (unsigned)abs(x) / steps, done_x);
            TEST_ASSERT_EQUAL(k * (unsigned)abs(y) / steps, done_y);
        }
        if (x && y) {
            TEST_ASSERT_NOT_EQUAL(head_events[steps - 1].counts[AXIS_X], head_events[steps].counts[AXIS_X]);
            TEST_ASSERT_NOT_EQUAL(head_events[steps - 1].counts[AXIS_Y], head_events[steps].counts[AXIS_Y]);
        }
    }
}

/* NIN-014: what has no way to go makes no step and gets no current */
static void test_an_axis_at_its_target_stays_off(void)
{
    go(0, 0, 2000);
    TEST_ASSERT_FALSE(drive_runs());
    go(0, 5, 2000);
    TEST_ASSERT_EQUAL(1 << AXIS_Y, head_events[0].axes);
    play(UINT32_MAX);
    TEST_ASSERT_EQUAL(0, head_counts[AXIS_X]);
}

/* -- backlash ------------------------------------------------------------------------------------------------------ */

/* The mechanism: the motor carries the platform along between two stops, as far apart as the backlash. */
static struct {
    int motor, platform;
} linkage[AXES];

static const int backlash[AXES] = {NINJA_BACKLASH_X, NINJA_BACKLASH_Y};

static void follow(void)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const int motor = linkage[axis].motor = head_counts[axis];
        if (linkage[axis].platform > motor)
            linkage[axis].platform = motor;
        if (linkage[axis].platform < motor - backlash[axis])
            linkage[axis].platform = motor - backlash[axis];
    }
}

/* From where path_init() says that it stands: slack taken up in the positive direction. */
static void begin_linkage(void)
{
    for (uint8_t axis = 0; axis < AXES; axis++)
        linkage[axis].platform = -backlash[axis];
}

static int platform(uint8_t axis)
{
    return linkage[axis].platform + backlash[axis];
}

/* NIN-026, NIN-032, NIN-033: random moves, one in three halted somewhere: where the platform is, is what the firmware
 * says */
static void test_the_platform_stands_where_it_was_sent(void)
{
    begin_linkage();
    for (int i = 0; i < 3000; i++) {
        const int span = i % 2 ? 20 : 1800;
        int x = path_position(AXIS_X) + between(-span, span), y = path_position(AXIS_Y) + between(-span, span);
        x = x < NINJA_X_MIN ? NINJA_X_MIN : x > NINJA_X_MAX ? NINJA_X_MAX : x;
        y = y < NINJA_Y_MIN ? NINJA_Y_MIN : y > NINJA_Y_MAX ? NINJA_Y_MAX : y;
        go(x, y, 2000);
        const bool halted = i % 3 == 0;
        unsigned steps = halted ? (unsigned)between(0, 2 * span) : UINT32_MAX;
        play_and(steps, follow);
        TEST_ASSERT_EQUAL(platform(AXIS_X), path_position(AXIS_X));
        TEST_ASSERT_EQUAL(platform(AXIS_Y), path_position(AXIS_Y));
        if (!halted) {
            TEST_ASSERT_EQUAL(x, platform(AXIS_X));
            TEST_ASSERT_EQUAL(y, platform(AXIS_Y));
        }
    }
}

/* NIN-032, NIN-033 */
static void test_a_reversal_takes_the_backlash_more(void)
{
    go(100, 100, 2000);
    play(UINT32_MAX);
    TEST_ASSERT_EQUAL(100, head_counts[AXIS_X]);
    go(90, 90, 2000);
    play(UINT32_MAX);
    TEST_ASSERT_EQUAL(100 - 10 - NINJA_BACKLASH_X, head_counts[AXIS_X]);
    TEST_ASSERT_EQUAL(100 - 10 - NINJA_BACKLASH_Y, head_counts[AXIS_Y]);
    go(80, 90, 2000);
    play(UINT32_MAX);
    TEST_ASSERT_EQUAL(100 - 20 - NINJA_BACKLASH_X, head_counts[AXIS_X]);
    TEST_ASSERT_EQUAL(100 - 10 - NINJA_BACKLASH_Y, head_counts[AXIS_Y]);
}

/* NIN-025: from each moment of a move on there is no further step */
static void test_a_halt_is_at_the_next_step(void)
{
    for (unsigned steps = 0; steps < 40; steps++) {
        setUp();
        go(30, -20, 2000);
        play(steps);
        TEST_ASSERT_EQUAL(steps < 30 ? steps : 30, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(head_counts[AXIS_X], path_position(AXIS_X));
        TEST_ASSERT_EQUAL(0, head_events[head_event_count - 1].axes);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_move_follows_the_law);
    RUN_TEST(test_slow_moves_are_even);
    RUN_TEST(test_no_acceleration_exceeds_the_constant);
    RUN_TEST(test_paths_are_straight);
    RUN_TEST(test_an_axis_at_its_target_stays_off);
    RUN_TEST(test_the_platform_stands_where_it_was_sent);
    RUN_TEST(test_a_reversal_takes_the_backlash_more);
    RUN_TEST(test_a_halt_is_at_the_next_step);
    return UNITY_END();
}
