/* Centring of the Ninja's image, in a head that stands anywhere, with sensors that work or do not. Each step is compared
 * with the model's (ninja_model.h) besides.
 *
 * SAC_NINJA_STARTS=n: from so many places instead of 12. */
#include "ninja_play.h"
#include "splitmix64.h"

#include <stdlib.h>

#define STARTS 12
/* Longest search: the whole travel, a margin and the backlash at 200 steps/s, with a ramp at each end; X and Y. */
#define BOUND (32 * SECOND)

static uint64_t seed;

void setUp(void)
{
    seed = 128;
}

void tearDown(void)
{
    ninja_off();
}

static unsigned starts_wanted(void)
{
    const char *wanted = getenv("SAC_NINJA_STARTS");
    return wanted ? (unsigned)strtoul(wanted, NULL, 0) : STARTS;
}

static int between(int low, int high)
{
    return low + (int)(splitmix64(&seed) % (unsigned)(high - low + 1));
}

/* X before Y, never both, and nothing of X after Y has begun. */
static void assert_one_after_the_other(void)
{
    size_t count;
    bool y = false;
    const ninja_event_t *event = ninja_events(&count);
    for (size_t i = 0; i < count; i++) {
        y |= event[i].axis == AXIS_Y;
        TEST_ASSERT_TRUE_MESSAGE(!y || event[i].axis == AXIS_Y, "X is at work while it is Y's turn");
    }
}

/* The last step of each axis: upwards, slowly, onto the sensor's edge. */
static void assert_approached(void)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const size_t ups = ninja_count(axis, NINJA_UP);
        const double last = (double)(ninja_cycle(axis, NINJA_UP, ups - 1) - ninja_cycle(axis, NINJA_UP, ups - 2));
        image_assert_near("last interval of the approach in ms", 1000.0 / NINJA_APPROACH_STEPS_PER_S, last / MS, 0.1);
        TEST_ASSERT_TRUE(ninja_last(axis, NINJA_DOWN) < ninja_last(axis, NINJA_UP));
    }
    const head_state_t *x = head_state(ninja_head, HEAD_X);
    const head_state_t *y = head_state(ninja_head, HEAD_Y);
    ninja_assert_at(0, 0);
    TEST_ASSERT_EQUAL_MESSAGE(NINJA_BACKLASH_X, x->slack, "X: backlash taken up");
    TEST_ASSERT_EQUAL_MESSAGE(NINJA_BACKLASH_Y, y->slack, "Y: backlash taken up");
}

/* NIN-017, NIN-018: at power-up, from anywhere the head may stand */
static void test_power_up_centres_at_the_same_step(void)
{
    double longest = 0;
    for (unsigned i = 0; i < starts_wanted(); i++) {
        head_options_t head = head_defaults;
        const bool near = i % 2;
        head.axis[HEAD_X].start = near ? between(-30, 30) : between(NINJA_X_MIN, NINJA_X_MAX);
        head.axis[HEAD_Y].start = near ? between(-30, 30) : between(NINJA_Y_MIN, NINJA_Y_MAX);
        play_power_on(&head);
        play_rest(2 * BOUND);
        const double took = (double)ninja_last(AXIS_Y, NINJA_OFF) / SECOND;
        longest = took > longest ? took : longest;
        assert_one_after_the_other();
        assert_approached();
        ninja_off();
    }
    printf("%.1f s at most\n", longest);
}

/* NIN-017, NIN-018, NIN-028: by C, a reset from outside, and Ctrl-R; X and Y stay with C alone */
static void test_centring_is_the_same_whatever_asks_for_it(void)
{
    play_home();
    for (int i = 0; i < 3; i++) {
        char text[40];
        snprintf(text, sizeof text, "V63X%dY%dS", between(-400, 400), between(-400, 400));
        play_type(text);
        play_rest(10 * SECOND);
        play_type(i % 2 ? "\022" : "C");
        play_rest(BOUND);
        assert_approached();
        play_type("V63M ");
        play_rest(10 * SECOND);
        TEST_ASSERT_EQUAL(i % 2 != 0, ninja_platform(AXIS_X) == 0);
    }
}

/* NIN-018: the reset button */
static void test_a_reset_from_outside_centres(void)
{
    ninja_home();
    ninja_type("V63X-200Y100M");
    ninja_rest(10 * SECOND);
    ninja_type("X0S");
    image_run(300 * MS);
    ninja_reset();
    ninja_rest(BOUND);
    assert_one_after_the_other();
    assert_approached();
}

/* NIN-017: stuck either way, of either axis or both: it ends in time, without current, and the other axis is centred */
static void test_a_sensor_that_is_stuck_is_given_up(void)
{
    double longest = 0;
    for (int stuck = 1; stuck < 9; stuck++) {
        head_options_t head = head_defaults;
        head.axis[HEAD_X].sensor = (head_sensor_t)(stuck % 3);
        head.axis[HEAD_Y].sensor = (head_sensor_t)(stuck / 3);
        ninja_power_on(&head);
        image_run(SECOND);
        ninja_rest(BOUND);
        size_t count;
        assert_one_after_the_other();
        const double took = (double)(ninja_events(&count)[count - 1].cycle) / SECOND;
        longest = took > longest ? took : longest;
        static const size_t most[AXES] = {3812, 1956};
        for (uint8_t axis = 0; axis < AXES; axis++) {
            const head_sensor_t sensor = head.axis[axis == AXIS_X ? HEAD_X : HEAD_Y].sensor;
            TEST_ASSERT_GREATER_THAN_MESSAGE(0, ninja_count(axis, NINJA_ON), "it is tried");
            if (sensor == HEAD_SENSOR_WORKS) {
                TEST_ASSERT_EQUAL(0, head_state(ninja_head, axis == AXIS_X ? HEAD_X : HEAD_Y)->platform);
            } else {
                TEST_ASSERT_EQUAL(sensor == HEAD_SENSOR_STUCK_HIGH ? most[axis] : 0, ninja_count(axis, NINJA_UP));
                TEST_ASSERT_EQUAL(sensor == HEAD_SENSOR_STUCK_LOW ? most[axis] : 0, ninja_count(axis, NINJA_DOWN));
            }
        }
        ninja_off();
    }
    printf("%.1f s at most\n", longest);
}

/* NIN-017: the last leg is the slowest, but its sensor is near: it is given up after run-up, backlash and margin */
static void test_a_sensor_that_fails_in_the_approach_is_given_up(void)
{
    ninja_power_on(&head_defaults);
    ninja_await(AXIS_Y, NINJA_ON, 3, 10 * SECOND); /* its third leg: the other two were downwards */
    head_break_sensor(ninja_head, HEAD_Y, HEAD_SENSOR_STUCK_HIGH);
    ninja_rest(15 * SECOND);
    TEST_ASSERT_EQUAL(6 + 20 + 200, ninja_count(AXIS_Y, NINJA_UP));
    TEST_ASSERT_FALSE(ninja_current());
    ninja_type("X20V63M"); /* it goes on */
    ninja_rest(SECOND);
    TEST_ASSERT_EQUAL(20, head_state(ninja_head, HEAD_X)->platform);
}

/* NIN-017, NIN-025: halted in the middle, it knows where it is; once more, and it ends as always */
static void test_a_halted_centring_leaves_the_position(void)
{
    play_home();
    for (unsigned i = 0; i < 8; i++) {
        play_type("V63X-100Y60S");
        play_rest(10 * SECOND);
        play_type("C");
        play_run((300 + 700 * i) * MS);
        play_type("\b");
        play_rest(SECOND);
        play_type("X11Y-11S");
        play_rest(10 * SECOND);
        ninja_assert_at(11, -11);
    }
    play_type("C");
    play_rest(BOUND);
    assert_approached();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_power_up_centres_at_the_same_step);
    RUN_TEST(test_centring_is_the_same_whatever_asks_for_it);
    RUN_TEST(test_a_reset_from_outside_centres);
    RUN_TEST(test_a_sensor_that_is_stuck_is_given_up);
    RUN_TEST(test_a_sensor_that_fails_in_the_approach_is_given_up);
    RUN_TEST(test_a_halted_centring_leaves_the_position);
    return UNITY_END();
}
