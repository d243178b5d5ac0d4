/* ninja/centre: from where, with which steps, and when it gives up. */
#include "host/fakes/head_fake.h"
#include "ninja/centre.h"
#include "ninja/drive.h"
#include "ninja/path.h"
#include "splitmix64.h"
#include "unity.h"

static const int bounds[AXES] = {NINJA_X_MAX - NINJA_X_MIN + NINJA_SEARCH_MARGIN + NINJA_BACKLASH_X,
                                 NINJA_Y_MAX - NINJA_Y_MIN + NINJA_SEARCH_MARGIN + NINJA_BACKLASH_Y};

void setUp(void)
{
    head_fake_reset();
    drive_init();
    centre_stop();
}

void tearDown(void) {}

static void poll(void)
{
    while (drive_poll() | centre_poll()) {
    }
}

/* Plays so many waits, or until it is over. */
static void play(unsigned waits)
{
    for (poll(); waits != 0 && (drive_runs() || centre_runs()); waits--) {
        TEST_ASSERT_TRUE(head_fake_play());
        poll();
    }
}

static void stand(int x, int y)
{
    setUp();
    head_edges[AXIS_X] = -x;
    head_edges[AXIS_Y] = -y;
}

/* NIN-017, NIN-018: from both sides and the edge itself, to the same step; X before Y, never both */
static void test_it_ends_at_the_edge_from_everywhere(void)
{
    uint64_t seed = 1;
    for (int i = 0; i < 200; i++) {
        const int x = i < 5 ? i - 2 : (int)(splitmix64(&seed) % 3601) - 1800;
        const int y = i < 5 ? 2 - i : (int)(splitmix64(&seed) % 1751) - 1200;
        stand(x, y);
        centre_begin();
        play(UINT32_MAX);
        TEST_ASSERT_FALSE(centre_runs());
        TEST_ASSERT_EQUAL(-x, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(-y, head_counts[AXIS_Y]);
        TEST_ASSERT_EQUAL(0, path_position(AXIS_X));
        TEST_ASSERT_EQUAL(0, path_position(AXIS_Y));
        uint8_t last = 1 << AXIS_X;
        for (unsigned e = 0; e < head_event_count; e++) {
            const uint8_t axes = head_events[e].axes;
            TEST_ASSERT_TRUE(axes == 0 || axes == 1 || axes == 2);
            TEST_ASSERT_TRUE_MESSAGE(axes == 0 || axes >= last, "X after Y");
            last = axes ? axes : last;
        }
        /* What is so already is not looked for. */
        TEST_ASSERT_EQUAL((x >= 0 ? 3 : 4) + (y >= 0 ? 3 : 4), head_moves);
        /* The last steps upwards: backlash and run-up, and the step that has left the edge; at the approach's
         * velocity. */
        const head_event_t *end = &head_events[head_event_count - 1];
        TEST_ASSERT_EQUAL(end[-2].counts[AXIS_Y] + 1, end[-1].counts[AXIS_Y]);
        TEST_ASSERT_EQUAL(STEPPER_HZ / NINJA_APPROACH_STEPS_PER_S, end[-1].ticks - end[-2].ticks);
        int up_steps = 0;
        for (const head_event_t *e = end - 1; e->step && e[-1].counts[AXIS_Y] < e->counts[AXIS_Y]; e--)
            up_steps++;
        TEST_ASSERT_EQUAL(NINJA_BACKLASH_Y + NINJA_RUN_UP + 1, up_steps);
        /* Its slack is taken up: upwards as many steps as there are units, downwards the backlash more. */
        const int16_t up[AXES] = {10, 10}, down[AXES] = {5, 5};
        drive_to(up, 2000);
        play(UINT32_MAX);
        TEST_ASSERT_EQUAL(-x + 10, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(-y + 10, head_counts[AXIS_Y]);
        drive_to(down, 2000);
        play(UINT32_MAX);
        TEST_ASSERT_EQUAL(-x + 5 - NINJA_BACKLASH_X, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(-y + 5 - NINJA_BACKLASH_Y, head_counts[AXIS_Y]);
    }
}

/* NIN-017: it ends, coils off, and the other axis is still tried */
static void test_a_stuck_sensor_is_given_up(void)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        for (int level = 0; level < 2; level++) {
            stand(100, 100);
            head_stuck[axis] = level;
            centre_begin();
            play(UINT32_MAX);
            TEST_ASSERT_FALSE(centre_runs());
            TEST_ASSERT_EQUAL(level ? bounds[axis] : -bounds[axis], head_counts[axis]);
            TEST_ASSERT_EQUAL(-100, head_counts[!axis]);
            TEST_ASSERT_EQUAL(0, path_position(axis));
            TEST_ASSERT_EQUAL(0, head_events[head_event_count - 1].axes);
        }
    }
}

/* NIN-017: one that sticks on the way, at each leg */
static void test_a_sensor_that_sticks_later_is_given_up(void)
{
    const unsigned after[] = {10, 60, 100};
    for (unsigned i = 0; i < 3; i++) {
        for (int level = 0; level < 2; level++) {
            stand(-40, 0);
            centre_begin();
            play(after[i]);
            head_stuck[AXIS_X] = level;
            play(UINT32_MAX);
            TEST_ASSERT_FALSE(centre_runs());
            TEST_ASSERT_TRUE(head_counts[AXIS_X] >= -bounds[AXIS_X] && head_counts[AXIS_X] <= 2 * bounds[AXIS_X]);
            TEST_ASSERT_EQUAL(0, head_counts[AXIS_Y]);
        }
    }
}

/* NIN-025: what is abandoned moves no more, and begins anew */
static void test_it_can_be_abandoned_and_begun_anew(void)
{
    for (unsigned waits = 0; waits < 200; waits += 7) {
        stand(30, -20);
        centre_begin();
        play(waits);
        const int x = head_counts[AXIS_X], y = head_counts[AXIS_Y];
        drive_halt();
        centre_stop();
        play(UINT32_MAX);
        TEST_ASSERT_EQUAL(x, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(y, head_counts[AXIS_Y]);
        /* And in the middle of a halt. */
        centre_begin();
        play(5);
        drive_halt();
        centre_begin();
        play(UINT32_MAX);
        TEST_ASSERT_EQUAL(-30, head_counts[AXIS_X]);
        TEST_ASSERT_EQUAL(20, head_counts[AXIS_Y]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_ends_at_the_edge_from_everywhere);
    RUN_TEST(test_a_stuck_sensor_is_given_up);
    RUN_TEST(test_a_sensor_that_sticks_later_is_given_up);
    RUN_TEST(test_it_can_be_abandoned_and_begun_anew);
    return UNITY_END();
}
