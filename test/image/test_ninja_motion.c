/* The Ninja's moves on the image: paths, ramps, velocities, and where the platform of a head with backlash ends.
 *
 * SAC_NINJA_MOVES=n: so many random moves instead of 40 on each path. */
#include "ninja.h"
#include "ninja_model.h"
#include "splitmix64.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#define MOVES 40
#define SPAN 8 /* intervals over which velocity is a mean */

static uint64_t seed;

void setUp(void)
{
    seed = 2026;
}

void tearDown(void)
{
    ninja_off();
}

static unsigned moves_wanted(void)
{
    const char *wanted = getenv("SAC_NINJA_MOVES");
    return wanted ? (unsigned)strtoul(wanted, NULL, 0) : MOVES;
}

static int between(int low, int high)
{
    return low + (int)(splitmix64(&seed) % (unsigned)(high - low + 1));
}

static double most_of(double a, double b)
{
    return a > b ? a : b;
}

/* -- one move, as it was seen -------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t on, off;         /* coils; of the axis with more steps */
    size_t steps[AXES];
    uint8_t major;
    uint64_t *cycle[AXES]; /* of each step */
} move_t;

static move_t read_move(void)
{
    move_t move = {0};
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    for (uint8_t axis = 0; axis < AXES; axis++)
        move.cycle[axis] = malloc((count + 1) * sizeof *move.cycle[axis]);
    for (size_t i = 0; i < count; i++)
        if (event[i].what == NINJA_UP || event[i].what == NINJA_DOWN)
            move.cycle[event[i].axis][move.steps[event[i].axis]++] = event[i].cycle;
    move.major = move.steps[AXIS_Y] > move.steps[AXIS_X];
    if (move.steps[move.major] != 0) {
        move.on = ninja_cycle(move.major, NINJA_ON, 0);
        move.off = ninja_cycle(move.major, NINJA_OFF, 0);
    }
    return move;
}

static void forget_move(move_t *move)
{
    free(move->cycle[AXIS_X]);
    free(move->cycle[AXIS_Y]);
}

/* Behind step k of the major axis, in seconds; the last one ends with the coils off. */
static double interval(const move_t *move, size_t k)
{
    const size_t steps = move->steps[move->major];
    const uint64_t *cycle = move->cycle[move->major];
    return (double)((k + 1 == steps ? move->off : cycle[k + 1]) - cycle[k]) / SECOND;
}

/* Steps that the other axis is away from where the straight line has it, at most. */
static double off_line(const move_t *move)
{
    const uint8_t minor = !move->major;
    const double ratio = (double)move->steps[minor] / (double)move->steps[move->major];
    double worst = 0;
    size_t there = 0;
    for (size_t k = 0; k < move->steps[move->major]; k++) {
        const uint64_t now = move->cycle[move->major][k];
        while (there < move->steps[minor] && move->cycle[minor][there] <= now + NINJA_JITTER)
            there++;
        worst = most_of(worst, fabs((double)there - ratio * (double)(k + 1)));
    }
    return worst;
}

/* Of so many steps in that time; below the start speed a motor may change it as it likes. */
static double velocity(double seconds)
{
    return most_of(SPAN / seconds, NINJA_START_STEPS_PER_S);
}

/* Largest acceleration or deceleration, from the middle of some intervals to that of the next ones: one step's few
 * microseconds of jitter are nothing then. (test_a_long_move_has_both_ramps looks at each single one.) */
static double acceleration(const move_t *move)
{
    double worst = 0;
    const size_t steps = move->steps[move->major];
    const uint64_t *cycle = move->cycle[move->major];
    for (size_t k = 0; k + 2 * SPAN < steps; k++) {
        const double first = (double)(cycle[k + SPAN] - cycle[k]) / SECOND;
        const double second = (double)(cycle[k + 2 * SPAN] - cycle[k + SPAN]) / SECOND;
        const double change = velocity(second) - velocity(first);
        worst = most_of(worst, fabs(change) / ((first + second) / 2));
    }
    return worst;
}

static double shortest(const move_t *move)
{
    double least = interval(move, 0);
    for (size_t k = 1; k < move->steps[move->major]; k++)
        least = fmin(least, interval(move, k));
    return least;
}

/* Types it and waits for its end. */
static move_t make_move(const char *text)
{
    ninja_forget();
    ninja_type(text);
    ninja_rest(300 * SECOND);
    return read_move();
}

/* -- paths --------------------------------------------------------------------------------------------------------- */

/* NIN-014, NIN-031: straight to a step, both end together, no acceleration above the constant */
static void test_random_moves_are_straight_and_smooth(void)
{
    double line = 0, together = 0, steepest = 0;
    ninja_home();
    for (unsigned i = moves_wanted(); i > 0; i--) {
        char text[40];
        const int reach = i % 4 == 0 ? 1200 : 200;
        const int up = reach < NINJA_Y_MAX ? reach : NINJA_Y_MAX;
        snprintf(text, sizeof text, "X%dY%dV%dM", between(-reach, reach), between(-reach, up), between(24, 63));
        move_t move = make_move(text);
        const size_t steps = move.steps[move.major];
        if (steps == 0)
            continue;
        line = most_of(line, off_line(&move));
        steepest = most_of(steepest, acceleration(&move));
        if (move.steps[!move.major] != 0) {
            const uint64_t last = move.cycle[move.major][steps - 1];
            const uint64_t other = move.cycle[!move.major][move.steps[!move.major] - 1];
            const double apart = fabs((double)other - (double)last) / SECOND;
            together = most_of(together, apart / interval(&move, steps - 1));
        }
        forget_move(&move);
    }
    printf("off the line %.3f steps, last steps %.6f intervals apart, acceleration %.1f steps/s^2\n", line, together,
           steepest);
    TEST_ASSERT_TRUE_MESSAGE(line <= 1, "off the straight line");
    TEST_ASSERT_TRUE_MESSAGE(together < 1, "the axes do not end together");
    TEST_ASSERT_TRUE_MESSAGE(steepest < 1.02 * NINJA_ACCELERATION, "too steep");
    TEST_ASSERT_TRUE_MESSAGE(steepest > 0.9 * NINJA_ACCELERATION, "not as steep as it may be");
}

/* -- velocities ---------------------------------------------------------------------------------------------------- */

/* NIN-012, NIN-013: from 8 to 500 steps/s in equal ratios, each V faster than the one before */
static void test_each_velocity_has_its_rate(void)
{
    double before = 1;
    ninja_home();
    for (int v = 0; v < 64; v++) {
        char text[40];
        const double rate = 8 * pow(500.0 / 8, v / 63.0);
        const int distance = (int)(rate * rate / NINJA_ACCELERATION) + 8; /* both ramps, and some steps of cruise */
        snprintf(text, sizeof text, "V%dX%dM", v, v % 2 ? distance / 2 : -(distance + 1) / 2);
        move_t move = make_move(text);
        const double least = shortest(&move);
        image_assert_near("interval in us", 1e6 / rate, least * 1e6, 6);
        TEST_ASSERT_TRUE_MESSAGE(least < before, "no faster than the V before");
        before = least;
        forget_move(&move);
    }
}

/* NIN-012: V stays, and what is outside 0..63 is 63 */
static void test_a_velocity_outside_is_the_highest(void)
{
    static const char *const outside[] = {"V63X500M",   "X0M",         "V99X500M",     "V0V-1X0M",
                                          "V0V64X500M", "V0V65535X0M", "V0V99999X500M"};
    ninja_home();
    for (size_t i = 0; i < sizeof outside / sizeof outside[0]; i++) {
        move_t move = make_move(outside[i]);
        image_assert_near("interval in us", 2000, shortest(&move) * 1e6, 6);
        forget_move(&move);
    }
}

/* NIN-015: S is as fast as V63, and M behind it as slow as before */
static void test_a_slew_is_fast_and_leaves_v(void)
{
    ninja_home();
    ninja_type("V30");
    for (int i = 0; i < 2; i++) {
        move_t slew = make_move(i ? "X-100S" : "X400S");
        image_assert_near("S: interval in us", 2000, shortest(&slew) * 1e6, 6);
        forget_move(&slew);
        move_t move = make_move(i ? "X0M" : "X300M");
        image_assert_near("M: interval in us", ninja_v_us(30), shortest(&move) * 1e6, 6);
        forget_move(&move);
    }
}

/* NIN-031: from a standstill, to the top, and back to the start speed; coils on before and after for an interval of it */
static void test_a_long_move_has_both_ramps(void)
{
    ninja_home();
    move_t move = make_move("X600S");
    const size_t steps = move.steps[AXIS_X];
    TEST_ASSERT_EQUAL(600, steps);
    image_assert_near("start interval", NINJA_START_INTERVAL, (double)(move.cycle[AXIS_X][0] - move.on), NINJA_JITTER);
    for (size_t k = 0; k < 124; k++) {
        const double law = sqrt(2 / 1002.68) * (sqrt((double)k + 1) - sqrt((double)k));
        image_assert_near("acceleration: interval in us", law * 1e6, interval(&move, k) * 1e6, 6);
        image_assert_near("deceleration: interval in us", fmin(law, 0.02) * 1e6,
                          interval(&move, steps - 1 - k) * 1e6, 6);
    }
    for (size_t k = 126; k < steps - 126; k++)
        image_assert_near("cruise: interval in us", 2000, interval(&move, k) * 1e6, 6);
    forget_move(&move);
}

/* -- positions ----------------------------------------------------------------------------------------------------- */

/* NIN-009, NIN-010: out of range, each way */
static void test_targets_saturate_at_the_limits(void)
{
    static const struct {
        const char *text;
        int x, y;
    } cases[] = {
        {"X5000Y900S", 1800, 550},    {"X-5000Y-5000S", -1800, -1200}, {"X65535Y65535S", 1800, 550},
        {"X-900Y70S", -900, 70},      {"X-32768Y-32768S", -1800, -1200}, {"X1801Y551S", 1800, 550},
        {"X99999Y-99999S", 1800, -1200}, {"XYS", 0, 0},
    };
    ninja_home();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        ninja_type(cases[i].text);
        ninja_rest(20 * SECOND);
        ninja_assert_at(cases[i].x, cases[i].y);
    }
}

/* NIN-032, NIN-033: a change of direction costs X 12 steps and Y 6, spread over the move; going on costs none */
static void test_a_change_of_direction_takes_up_the_backlash(void)
{
    static const struct {
        const char *text;
        int x, y; /* steps of the motors */
    } cases[] = {
        {"X100Y100V63M", 100, 100}, /* centring has ended in this direction */
        {"X150Y150M", 50, 50},      {"X50Y50M", -100 - 12, -100 - 6}, {"X0Y100M", -50, 50 + 6},
        {"X0Y0M", 0, -100 - 6},     {"X1M", 1 + 12, 0},               {"X0Y-1M", -1 - 12, -1},
    };
    ninja_home();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        move_t move = make_move(cases[i].text);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].x, ninja_made(AXIS_X), cases[i].text);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].y, ninja_made(AXIS_Y), cases[i].text);
        if (i == 2) /* as straight as any other */
            TEST_ASSERT_TRUE_MESSAGE(off_line(&move) <= 1, "not spread over the move");
        forget_move(&move);
    }
    ninja_assert_at(0, -1);
}

/* NIN-026, NIN-032, NIN-033: halts at any moment among them; none of a motor's steps is lost, and the platform ends where
 * it is told to */
static void test_in_a_head_with_backlash_each_move_ends_exactly(void)
{
    unsigned halts = 0;
    ninja_home();
    for (unsigned i = moves_wanted(); i > 0; i--) {
        char text[60];
        const int reach = i % 8 == 0 ? 1000 : 60;
        const int x = between(-reach, reach);
        const int y = between(-reach, reach < 550 ? reach : 550);
        ninja_forget();
        snprintf(text, sizeof text, "X%dY%dV%d%c", x, y, between(35, 63), between(0, 1) ? 'M' : 'S');
        ninja_type(text);
        if (between(0, 2) == 0) {
            image_run((unsigned)between(0, 600000) * US);
            ninja_type("\b");
            ninja_rest(SECOND);
            ninja_type(between(0, 1) ? "M" : "S");
            halts++;
        }
        ninja_rest(60 * SECOND);
        ninja_assert_at(x, y);
    }
    printf("%u halts\n", halts);
}

/* NIN-029: a sensor that changes during a move is nothing to it */
static void test_sensors_do_not_matter_in_a_move(void)
{
    static const head_sensor_t each[] = {HEAD_SENSOR_STUCK_HIGH, HEAD_SENSOR_STUCK_LOW, HEAD_SENSOR_WORKS};
    ninja_home();
    ninja_type("X200Y200V63M");
    for (size_t i = 0; i < 12; i++) {
        image_run(50 * MS);
        head_break_sensor(ninja_head, HEAD_X, each[i % 3]);
        head_break_sensor(ninja_head, HEAD_Y, each[(i + 1) % 3]);
    }
    ninja_rest(10 * SECOND);
    ninja_assert_at(200, 200);
    TEST_ASSERT_EQUAL(200, ninja_count(AXIS_X, NINJA_UP));
    TEST_ASSERT_EQUAL(200, ninja_count(AXIS_Y, NINJA_UP));
    TEST_ASSERT_EQUAL(1, ninja_count(AXIS_X, NINJA_ON));
}

/* NIN-030: two coils of an axis that moves, none of one that does not, none at rest (ninja.c looks at each pattern) */
static void test_only_what_moves_has_current(void)
{
    ninja_home();
    ninja_type("X30V63M");
    ninja_rest(SECOND);
    TEST_ASSERT_EQUAL(30, ninja_count(AXIS_X, NINJA_UP));
    TEST_ASSERT_EQUAL(0, ninja_count(AXIS_Y, NINJA_ON));
    ninja_forget();
    ninja_type("Y30M");
    ninja_rest(SECOND);
    TEST_ASSERT_EQUAL(30, ninja_count(AXIS_Y, NINJA_UP));
    TEST_ASSERT_EQUAL(0, ninja_count(AXIS_X, NINJA_ON));
    TEST_ASSERT_FALSE(ninja_current());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_moves_are_straight_and_smooth);
    RUN_TEST(test_each_velocity_has_its_rate);
    RUN_TEST(test_a_velocity_outside_is_the_highest);
    RUN_TEST(test_a_slew_is_fast_and_leaves_v);
    RUN_TEST(test_a_long_move_has_both_ramps);
    RUN_TEST(test_targets_saturate_at_the_limits);
    RUN_TEST(test_a_change_of_direction_takes_up_the_backlash);
    RUN_TEST(test_in_a_head_with_backlash_each_move_ends_exactly);
    RUN_TEST(test_sensors_do_not_matter_in_a_move);
    RUN_TEST(test_only_what_moves_has_current);
    return UNITY_END();
}
