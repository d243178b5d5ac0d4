/* ninja/path with other build constants (Makefile): no backlash at all, a slow acceleration, other velocities. */
#include <math.h>
#include "ninja/path.h"
#include "unity.h"

void setUp(void)
{
    path_init();
}

void tearDown(void) {}

/* NIN-032: 0 is allowed: as many steps as units, also after a reversal */
static void test_without_backlash_steps_are_units(void)
{
    const int16_t targets[][AXES] = {{5, 9}, {-5, 3}, {0, 0}, {1, -1}};
    for (unsigned i = 0; i < 4; i++) {
        int16_t sum[AXES] = {0, 0};
        stepper_wait_t wait;
        TEST_ASSERT_NOT_EQUAL(0, path_to(targets[i], 5000));
        while (path_next(&wait))
            for (uint8_t axis = 0; axis < AXES; axis++)
                if (wait.action & STEPPER_STEP << 2 * axis)
                    sum[axis] = (int16_t)(sum[axis] + (wait.action & STEPPER_NEGATIVE << 2 * axis ? -1 : 1));
        for (uint8_t axis = 0; axis < AXES; axis++) {
            TEST_ASSERT_EQUAL(targets[i][axis] - path_position(axis), sum[axis]);
            path_made(axis, sum[axis]);
            TEST_ASSERT_EQUAL(targets[i][axis], path_position(axis));
        }
    }
}

/* NIN-031: the constants are what the ramp follows */
static void test_the_ramp_follows_the_constants(void)
{
    const int16_t target[AXES] = {400, 0};
    stepper_wait_t wait;
    path_to(target, PATH_CYCLE_US(NINJA_TOP_STEPS_PER_S));
    TEST_ASSERT_TRUE(path_next(&wait));
    TEST_ASSERT_EQUAL(STEPPER_HZ / NINJA_START_STEPS_PER_S, wait.ticks);
    double ticks = 0;
    for (unsigned k = 1; k <= 112; k++) { /* 300^2 / (2 * 400) */
        TEST_ASSERT_TRUE(path_next(&wait));
        ticks += wait.ticks;
        TEST_ASSERT_DOUBLE_WITHIN(0.0005, sqrt(2. * k / NINJA_ACCELERATION), ticks / STEPPER_HZ);
    }
    for (unsigned k = 0; k < 3; k++) /* what the ramp may lack, and on */
        TEST_ASSERT_TRUE(path_next(&wait));
    TEST_ASSERT_EQUAL(2 * PATH_CYCLE_US(NINJA_TOP_STEPS_PER_S), wait.ticks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_backlash_steps_are_units);
    RUN_TEST(test_the_ramp_follows_the_constants);
    return UNITY_END();
}
