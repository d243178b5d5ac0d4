/* motion/profile: ramp lengths, truncation, velocities, refusals. The host's own part compares with motion_exact. */
#include "motion/profile.h"
#include "unity.h"

#ifdef __AVR__
#include <avr/pgmspace.h>
#define TABLE PROGMEM
#define table_u32(address) pgm_read_dword(address)
#else
#define TABLE
#define table_u32(address) (*(address))
#endif

static profile_basis_t basis;
static profile_t profile;
static motion_command_t command;

/* Factory values of the manual: 200 steps per revolution, full step, slow speed 10 RPM. */
void setUp(void)
{
    profile_basis(&basis, 200, 0, 10, 16000000);
    command = (motion_command_t){.count = 200, .velocity = 100, .accel = 100, .decel = 100};
}

void tearDown(void)
{
}

static void plan_from(uint16_t rpm)
{
    profile_plan(&profile, &basis, &command, (uint32_t)rpm * 100u << basis.factor_log2);
}

static void plan(void)
{
    profile_plan(&profile, &basis, &command, basis.v_slow);
}

static void assert_split(uint32_t accel, uint32_t cruise, uint32_t decel)
{
    TEST_ASSERT_EQUAL_UINT32(accel, profile.accel_pulses);
    TEST_ASSERT_EQUAL_UINT32(cruise, profile.cruise_pulses);
    TEST_ASSERT_EQUAL_UINT32(decel, profile.decel_pulses);
}

/* HAR-004, HAR-005, HAR-006, STA-012 */
static void test_90_rpm_at_1_per_step_take_90_steps_up_and_down(void)
{
    plan();
    assert_split(90, 20, 90);
    command.count = 1000;
    plan();
    assert_split(90, 820, 90);
}

/* HAR-007 */
static void test_half_the_acceleration_takes_twice_the_steps(void)
{
    command.count = 400;
    command.accel = 50;
    plan();
    assert_split(180, 130, 90);
}

/* HAR-008, GAP-009 */
static void test_ramp_steps_are_truncated_to_whole_ones(void)
{
    command.count = 1000;
    static const uint8_t cases[][2] = {{45, 2}, {46, 1}, {90, 1}, {91, 0}};
    for (uint8_t i = 0; i < 4; i++) {
        command.decel = (accel_code_t)(cases[i][0] * 100);
        plan();
        TEST_ASSERT_EQUAL_UINT32(cases[i][1], profile.decel_pulses);
    }
}

/* TRN-001 */
static void test_a_profile_is_truncated_when_its_ramps_need_more_steps_than_there_are(void)
{
    command.count = 180;
    plan();
    assert_split(90, 0, 90);
    command.count = 181;
    plan();
    assert_split(90, 1, 90);
    command.count = 179;
    plan();
    assert_split(89, 0, 90);
}

/* TRN-002, TRN-003 */
static void test_180_and_90_steps_in_200_become_133_and_67(void)
{
    command.accel = 50;
    plan();
    assert_split(133, 0, 67);
}

/* TRN-004 */
static void test_225_steps_up_in_200_become_200(void)
{
    command.accel = 40;
    command.decel = ACCEL_NONE;
    plan();
    assert_split(200, 0, 0);
}

/* TRN-006 */
static void test_a_single_step_down_is_lost_in_truncation(void)
{
    command.accel = 40;
    command.decel = 9000;
    plan();
    assert_split(200, 0, 0);
}

/* TRN-007 */
static void test_decel_of_accel_times_speed_leaves_one_step_down_in_truncation(void)
{
    command.accel = 40;
    command.decel = 4000;
    plan();
    assert_split(199, 0, 1);
}

/* TRN-012 */
static void test_ten_steps_at_69_rpm_are_5_up_and_5_down(void)
{
    command.count = 10;
    command.velocity = 69;
    plan();
    assert_split(5, 0, 5);
}

/* TRN-005, STP-005 */
static void test_extra_pulses_are_added_to_the_cruise_only(void)
{
    command.extra_pulses = 20;
    plan();
    assert_split(90, 40, 90);
    command.count = 50;
    plan();
    assert_split(25, 0, 25);
}

/* TRN-010 */
static void test_linear_ramps_are_truncated_in_the_same_way(void)
{
    command = (motion_command_t){.count = 1000, .velocity = 300, .accel = 500, .decel = 500, .flags = MOTION_LINEAR};
    plan();
    assert_split(500, 0, 500);
    command.decel = 1000;
    plan();
    assert_split(666, 0, 334);
}

/* TRN-008 */
static void test_no_step_is_lost_whatever_the_ramps(void)
{
    for (uint16_t count = 1; count < 300; count += 7) {
        for (uint16_t accel = 3; accel < 9000; accel = (uint16_t)(accel * 3)) {
            for (uint16_t decel = 5; decel < 9000; decel = (uint16_t)(decel * 4)) {
                command.count = count;
                command.accel = accel;
                command.decel = decel;
                plan();
                TEST_ASSERT_EQUAL_UINT32(count,
                                         profile.accel_pulses + profile.cruise_pulses + profile.decel_pulses);
            }
        }
    }
}

/* STA-011, GAP-005 */
static void test_at_its_own_speed_a_command_has_no_acceleration(void)
{
    command.accel = 40;
    command.decel = ACCEL_NONE;
    plan_from(100);
    assert_split(0, 200, 0);
}

/* HAR-014, STA-002, STA-010 */
static void test_between_two_speeds_only_their_difference_is_ramped(void)
{
    command.decel = ACCEL_NONE;
    command.velocity = 150;
    plan_from(100);
    assert_split(50, 150, 0);
    TEST_ASSERT_TRUE(profile.faster);
    command.velocity = 60;
    plan_from(100);
    assert_split(40, 160, 0);
    TEST_ASSERT_FALSE(profile.faster);
}

/* ACC-004, STA-009 */
static void test_999_means_no_ramp(void)
{
    command.accel = ACCEL_NONE;
    command.decel = ACCEL_NONE;
    plan();
    assert_split(0, 200, 0);
    TEST_ASSERT_EQUAL_UINT32(10000, profile.v_exit);
    TEST_ASSERT_EQUAL_UINT32(3000, profile.exit_cycle_us);
}

/* ACC-012 */
static void test_a_deceleration_leaves_slow_speed_in_play(void)
{
    plan();
    TEST_ASSERT_EQUAL_UINT32(1000, profile.v_exit);
}

/* TRN-011 */
static void test_a_truncated_command_leaves_the_speed_of_its_last_interval(void)
{
    command.accel = 40;
    command.decel = ACCEL_NONE;
    command.count = 100;
    plan();
    TEST_ASSERT_EQUAL_UINT32(1000 + 99 * 40, profile.v_exit);
    command.accel = 1000;
    command.flags = MOTION_LINEAR;
    command.velocity = 1000;
    plan();
    /* 100 steps at 10 rad/s^2: the last interval is 16e6 sqrt(2 alpha / 10) (10 - sqrt(99)) = 63577.8 ticks. */
    TEST_ASSERT_UINT32_WITHIN(2, 7550, profile.v_exit);
    command.count = 1;
    command.accel = ACCEL_CODE_WHOLE + 400;
    plan();
    /* A single interval of c0 = 179359 ticks. */
    TEST_ASSERT_UINT32_WITHIN(2, 2676, profile.v_exit);
}

/* SLO-003, SLO-008 */
static void test_at_and_below_slow_speed_there_are_no_ramps(void)
{
    for (uint8_t rpm = 1; rpm <= 10; rpm++) {
        command.velocity = rpm;
        plan();
        assert_split(0, 200, 0);
        plan_from(100);
        assert_split(0, 200, 0);
    }
    command.velocity = 11;
    plan();
    assert_split(1, 198, 1);
}

/* HAR-012, VEL-003, VEL-004, CLK-003, CLK-004 */
static void test_rpm_and_cycle_are_truncated_to_whole_numbers(void)
{
    static const uint16_t cycles[][2] = {{59, 5084}, {60, 5000}, {61, 4918}, {65, 4615}, {70, 4285}, {100, 3000},
                                         {101, 2970}};
    for (uint8_t i = 0; i < 7; i++) {
        command.velocity = cycles[i][0];
        TEST_ASSERT_EQUAL_UINT32(cycles[i][1], profile_cycle_us(&basis, &command));
        TEST_ASSERT_EQUAL_UINT32(cycles[i][0], profile_rpm(&basis, &command));
    }
    command.flags = MOTION_CYCLE;
    command.velocity = 42567;
    TEST_ASSERT_EQUAL_UINT32(7, profile_rpm(&basis, &command));
    command.velocity = 4567;
    TEST_ASSERT_EQUAL_UINT32(65, profile_rpm(&basis, &command));
    plan();
    assert_split(55, 90, 55);
    TEST_ASSERT_EQUAL_UINT32(4567ul * 16u, profile.cruise.chunks * PROFILE_CHUNK_TICKS + (profile.cruise.ticks_q8 >> 8));
}

/* SLO-010, VEL-010 */
static void test_a_cycle_of_any_32_bits_is_kept_exactly(void)
{
    static const uint32_t samples[] = {2, 2047, 2048, 5000000, 4294967295u};
    command.flags = MOTION_CYCLE;
    for (uint8_t i = 0; i < 5; i++) {
        command.velocity = samples[i];
        plan();
        uint64_t ticks = (uint64_t)profile.cruise.chunks * PROFILE_CHUNK_TICKS + (profile.cruise.ticks_q8 >> 8);
        TEST_ASSERT_TRUE(ticks == (uint64_t)samples[i] * 16u);
        TEST_ASSERT_EQUAL_UINT8(0, (uint8_t)profile.cruise.ticks_q8);
    }
}

/* HAR-015, LIN-010, STP-001, STP-002, STP-003 */
static void test_microsteps_multiply_all_phases(void)
{
    profile_basis(&basis, 200, 3, 10, 16000000);
    plan();
    assert_split(720, 160, 720);
    command.count = 1001;
    command.extra_pulses = 5;
    plan();
    assert_split(720, 8008 - 1440 + 5, 720);
    command = (motion_command_t){.count = 1000, .velocity = 100, .accel = 1047, .decel = ACCEL_NONE,
                                 .flags = MOTION_LINEAR};
    plan();
    assert_split(8 * 166, 8 * 834, 0);
}

/* STP-010 */
static void test_counts_in_pulses_are_not_multiplied(void)
{
    profile_basis(&basis, 200, 3, 10, 16000000);
    command.count = 2000;
    command.flags = MOTION_PULSES;
    plan();
    assert_split(720, 560, 720);
    command.count = 100;
    plan();
    assert_split(50, 0, 50);
}

/* LIN-003, LIN-004, LIN-006, LIN-007 */
static void test_linear_ramp_steps_follow_the_square_of_the_speed(void)
{
    TEST_ASSERT_EQUAL_UINT32(166, profile_ramp_steps(&basis, 0, 10000, 1047, true));
    TEST_ASSERT_EQUAL_UINT32(34, profile_ramp_steps(&basis, 0, 10000, 5000, true));
    TEST_ASSERT_EQUAL_UINT32(524, profile_ramp_steps(&basis, 10000, 20000, 1000, true));
    TEST_ASSERT_EQUAL_UINT32(524, profile_ramp_steps(&basis, 20000, 10000, 1000, true));
    /* 300 RPM in 200 steps (78.54 rad/s^2): 100 RPM after 22. 100 RPM in 200 (8.7266): 300 after 1800. */
    TEST_ASSERT_EQUAL_UINT32(199, profile_ramp_steps(&basis, 0, 30000, 7854, true));
    TEST_ASSERT_EQUAL_UINT32(22, profile_ramp_steps(&basis, 0, 10000, 7854, true));
    TEST_ASSERT_UINT32_WITHIN(2, 1800, profile_ramp_steps(&basis, 0, 30000, 873, true));
}

/* LIN-017 */
static void test_linear_steps_follow_the_steps_per_revolution(void)
{
    uint32_t at_200 = profile_ramp_steps(&basis, 0, 60000, 100, true);
    profile_basis(&basis, 400, 0, 10, 16000000);
    TEST_ASSERT_UINT32_WITHIN(1, 2 * at_200, profile_ramp_steps(&basis, 0, 60000, 100, true));
}

/* LIN-009 */
static void test_a_linear_ramp_longer_than_the_command_does_not_reach_its_speed(void)
{
    command = (motion_command_t){.count = 500, .velocity = 300, .accel = 100, .decel = ACCEL_NONE,
                                 .flags = MOTION_LINEAR};
    plan();
    assert_split(500, 0, 0);
    TEST_ASSERT_TRUE(profile.v_peak < 30000);
}

/* ACC-013 */
static void test_lower_values_make_longer_ramps(void)
{
    for (uint8_t linear = 0; linear < 2; linear++) {
        uint32_t before = UINT32_MAX;
        for (uint16_t centi = 1; centi < 20000; centi = (uint16_t)(centi + 1 + centi / 8)) {
            uint32_t steps = profile_ramp_steps(&basis, basis.v_slow, 60000, centi, linear);
            TEST_ASSERT_TRUE(steps <= before);
            before = steps;
        }
    }
}

/* ACC-002, ACC-003 */
static void test_ramp_values_have_two_decimals_below_100_and_none_above(void)
{
    TEST_ASSERT_EQUAL_UINT32(1, accel_centi(1));
    TEST_ASSERT_EQUAL_UINT32(9999, accel_centi(9999));
    TEST_ASSERT_EQUAL_UINT32(10000, accel_centi(ACCEL_CODE_WHOLE));
    TEST_ASSERT_EQUAL_UINT32(99900, accel_centi(ACCEL_NONE));
}

/* CLK-015 */
static void test_periods_below_2_us_or_the_pulse_and_1_us_are_refused(void)
{
    command.flags = MOTION_CYCLE;
    for (uint8_t pulse_us = 1; pulse_us < 40; pulse_us += 3) {
        uint8_t least = pulse_us > 1 ? (uint8_t)(pulse_us + 1) : 2;
        for (uint8_t us = 1; us < 50; us++) {
            command.velocity = us;
            TEST_ASSERT_EQUAL(us < least ? STATUS_PERIOD_TOO_SHORT : STATUS_OK,
                              profile_check(&basis, &command, pulse_us));
        }
    }
    command.flags = 0;
    command.velocity = 60000;
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
    command.velocity = 100001;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 2));
    profile_basis(&basis, 200, 7, 10, 16000000);
    command.velocity = 1171; /* 256.1 us */
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 1));
    command.velocity = 1172; /* 255.97 us */
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 1));
    command.velocity = 75; /* 4000 us for 128 pulses of 30 us and 1 us */
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 30));
    command.velocity = 76;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 30));
    command.velocity = UINT32_MAX;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 1));
    command.velocity = 0;
    TEST_ASSERT_EQUAL(STATUS_VELOCITY_ZERO, profile_check(&basis, &command, 1));
}

/* CLK-010, CLK-015: the interrupt has less time where it cannot look ahead */
static void test_with_an_external_clock_periods_below_8_us_or_the_pulse_and_6_us_are_refused(void)
{
    profile_basis(&basis, 200, 0, 10, 1000000);
    command.flags = MOTION_CYCLE;
    for (uint8_t pulse_us = 1; pulse_us < 40; pulse_us++) {
        uint8_t least = pulse_us > 2 ? (uint8_t)(pulse_us + 6) : 8;
        for (uint8_t us = 1; us < 50; us++) {
            command.velocity = us;
            TEST_ASSERT_EQUAL(us < least ? STATUS_PERIOD_TOO_SHORT : STATUS_OK,
                              profile_check(&basis, &command, pulse_us));
        }
    }
    command.flags = 0;
    command.velocity = 37500;
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
    command.velocity = 37501;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 2));
    profile_basis(&basis, 200, 7, 10, 400000);
    command.velocity = 292; /* 1027 us for 128 pulses of 8 us */
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
    command.velocity = 293;
    TEST_ASSERT_EQUAL(STATUS_PERIOD_TOO_SHORT, profile_check(&basis, &command, 2));
}

static const uint32_t clocks[] TABLE = {400000, 999999, 1000000, 1843200, 2000000, 3686400, 6400000, 16000000};
#define CLOCKS (sizeof clocks / sizeof clocks[0])

/* CLK-011, CLK-012: microseconds in ticks, rounded down to 1/256 of one */
static void test_an_interval_has_as_many_ticks_as_the_clock_makes_in_it(void)
{
    static const uint32_t lengths[] TABLE = {1,     2,     3,      8,       30,        255,       3000,
                                             32767, 32768, 65537, 1000001, 123456789, 4294967295};
    for (uint8_t c = 0; c < CLOCKS; c++) {
        uint32_t clock_hz = table_u32(&clocks[c]);
        profile_basis(&basis, 200, 0, 10, clock_hz);
        for (uint8_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
            for (uint8_t halvings = 0; halvings < 8; halvings++) {
                uint32_t us = table_u32(&lengths[i]);
                /* Ticks * 2^16 / (1000000 * 2^halvings); the product of up to 2^32 and 2^24 leaves room for 2^8. */
                uint64_t product = (uint64_t)us * clock_hz;
                uint32_t divisor = (uint32_t)1000000 << halvings;
                uint64_t ticks = product / divisor;
                uint32_t rest_q8 = (uint32_t)((product % divisor << 8) / divisor);
                profile_interval_t interval;
                profile_interval(&basis, us, halvings, &interval);
                TEST_ASSERT_EQUAL_UINT32((uint32_t)(ticks >> PROFILE_CHUNK_LOG2), interval.chunks);
                TEST_ASSERT_EQUAL_UINT32((uint32_t)(ticks & (PROFILE_CHUNK_TICKS - 1)) << 8 | rest_q8,
                                         interval.ticks_q8);
            }
        }
    }
}

/* CLK-012: a plan is one of velocities; the clock is only in the intervals */
static void test_the_clock_changes_no_count_and_no_velocity(void)
{
    for (uint8_t linear = 0; linear < 2; linear++) {
        command = (motion_command_t){.count = 900, .velocity = 333, .accel = 250, .decel = 120};
        command.flags = linear ? MOTION_LINEAR : 0;
        profile_basis(&basis, 200, 2, 10, 16000000);
        plan();
        profile_t with_internal = profile;
        TEST_ASSERT_EQUAL_UINT32(480000, basis.slow_ticks * 4);
        for (uint8_t c = 0; c < CLOCKS; c++) {
            uint32_t clock_hz = table_u32(&clocks[c]);
            profile_basis(&basis, 200, 2, 10, clock_hz);
            TEST_ASSERT_EQUAL_UINT32((uint32_t)(((uint64_t)clock_hz * 7500 + 999999) / 1000000), basis.slow_ticks);
            plan();
            assert_split(with_internal.accel_pulses, with_internal.cruise_pulses, with_internal.decel_pulses);
            TEST_ASSERT_EQUAL_UINT32(with_internal.v_start, profile.v_start);
            TEST_ASSERT_EQUAL_UINT32(with_internal.v_peak, profile.v_peak);
            TEST_ASSERT_EQUAL_UINT32(with_internal.v_exit, profile.v_exit);
        }
    }
}

/* STA-016 */
static void test_counts_reach_32_bits_and_no_further(void)
{
    command.count = UINT32_MAX;
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
    plan();
    assert_split(90, UINT32_MAX - 180, 90);
    command.extra_pulses = 1;
    TEST_ASSERT_EQUAL(STATUS_NUMBER_TOO_LARGE, profile_check(&basis, &command, 2));
    command.extra_pulses = 0;
    profile_basis(&basis, 200, 4, 10, 16000000);
    command.count = UINT32_MAX >> 4;
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
    command.count++;
    TEST_ASSERT_EQUAL(STATUS_NUMBER_TOO_LARGE, profile_check(&basis, &command, 2));
    command.flags = MOTION_PULSES;
    TEST_ASSERT_EQUAL(STATUS_OK, profile_check(&basis, &command, 2));
}

/* STO-004, NXT-002 */
static void test_a_deceleration_alone_has_the_steps_of_its_ramp(void)
{
    profile_plan_decel(&profile, &basis, 10000, 100, false);
    assert_split(0, 0, 90);
    profile_plan_decel(&profile, &basis, 10000, 1047, true);
    assert_split(0, 0, 166);
    profile_plan_decel(&profile, &basis, 1000, 100, false);
    assert_split(0, 0, 0);
    profile_plan_decel(&profile, &basis, 10000, ACCEL_NONE, false);
    assert_split(0, 0, 0);
}

/* Appendix D of the manual, lines 1017-1049: rows 1..30 rad/s^2, columns 50..600 RPM. */
static const uint32_t appendix_d[30][12] TABLE = {
    {872, 3490, 7853, 13962, 21816, 31415, 42760, 55850, 70685, 87266, 105592, 125663},
    {436, 1745, 3926, 6981, 10908, 15707, 21380, 27925, 35342, 43633, 52796, 62831},
    {290, 1163, 2617, 4654, 7272, 10471, 14253, 18616, 23561, 29088, 35197, 41887},
    {218, 872, 1963, 3490, 5454, 7853, 10690, 13962, 17671, 21816, 26398, 31415},
    {174, 698, 1570, 2792, 4363, 6283, 8552, 11170, 14137, 17453, 21118, 25132},
    {145, 581, 1308, 2327, 3636, 5235, 7126, 9308, 11780, 14544, 17598, 20943},
    {124, 498, 1121, 1994, 3116, 4487, 6108, 7978, 10097, 12466, 15084, 17951},
    {109, 436, 981, 1745, 2727, 3926, 5345, 6981, 8835, 10908, 13199, 15707},
    {96, 387, 872, 1551, 2424, 3490, 4751, 6205, 7853, 9696, 11732, 13962},
    {87, 349, 785, 1396, 2181, 3141, 4276, 5585, 7068, 8726, 10559, 12566},
    {79, 317, 713, 1269, 1983, 2855, 3887, 5077, 6425, 7933, 9599, 11423},
    {72, 290, 654, 1163, 1818, 2617, 3563, 4654, 5890, 7272, 8799, 10471},
    {67, 268, 604, 1074, 1678, 2416, 3289, 4296, 5437, 6712, 8122, 9666},
    {62, 249, 560, 997, 1558, 2243, 3054, 3989, 5048, 6233, 7542, 8975},
    {58, 232, 523, 930, 1454, 2094, 2850, 3723, 4712, 5817, 7039, 8377},
    {54, 218, 490, 872, 1363, 1963, 2672, 3490, 4417, 5454, 6599, 7853},
    {51, 205, 461, 821, 1283, 1847, 2515, 3285, 4157, 5133, 6211, 7391},
    {48, 193, 436, 775, 1212, 1745, 2375, 3102, 3926, 4848, 5866, 6981},
    {45, 183, 413, 734, 1148, 1653, 2250, 2939, 3720, 4592, 5557, 6613},
    {43, 174, 392, 698, 1090, 1570, 2138, 2792, 3534, 4363, 5279, 6283},
    {41, 166, 373, 664, 1038, 1495, 2036, 2659, 3365, 4155, 5028, 5983},
    {39, 158, 356, 634, 991, 1427, 1943, 2538, 3212, 3966, 4799, 5711},
    {37, 151, 341, 607, 948, 1365, 1859, 2428, 3073, 3794, 4590, 5463},
    {36, 145, 327, 581, 909, 1308, 1781, 2327, 2945, 3636, 4399, 5235},
    {34, 139, 314, 558, 872, 1256, 1710, 2234, 2827, 3490, 4223, 5026},
    {33, 134, 302, 537, 839, 1208, 1644, 2148, 2718, 3356, 4061, 4833},
    {32, 129, 290, 517, 808, 1163, 1583, 2068, 2617, 3232, 3910, 4654},
    {31, 124, 280, 498, 779, 1121, 1527, 1994, 2524, 3116, 3771, 4487},
    {30, 120, 270, 481, 752, 1083, 1474, 1925, 2437, 3009, 3641, 4333},
    {29, 116, 261, 465, 727, 1047, 1425, 1861, 2356, 2908, 3519, 4188},
};

/* LIN-008 */
static void test_all_360_entries_of_appendix_d_are_twice_the_formula(void)
{
    /* V^2 / (alpha a) = V^2 / (2 (alpha / 2) a): the steps of a motor with twice the steps per revolution. */
    profile_basis(&basis, 400, 0, 10, 16000000);
    for (uint8_t a = 0; a < 30; a++) {
        for (uint8_t column = 0; column < 12; column++) {
            uint32_t v = (column + 1u) * 5000u;
            TEST_ASSERT_EQUAL_UINT32(table_u32(&appendix_d[a][column]),
                                     profile_ramp_steps(&basis, 0, v, (a + 1u) * 100u, true));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_90_rpm_at_1_per_step_take_90_steps_up_and_down);
    RUN_TEST(test_half_the_acceleration_takes_twice_the_steps);
    RUN_TEST(test_ramp_steps_are_truncated_to_whole_ones);
    RUN_TEST(test_a_profile_is_truncated_when_its_ramps_need_more_steps_than_there_are);
    RUN_TEST(test_180_and_90_steps_in_200_become_133_and_67);
    RUN_TEST(test_225_steps_up_in_200_become_200);
    RUN_TEST(test_a_single_step_down_is_lost_in_truncation);
    RUN_TEST(test_decel_of_accel_times_speed_leaves_one_step_down_in_truncation);
    RUN_TEST(test_ten_steps_at_69_rpm_are_5_up_and_5_down);
    RUN_TEST(test_extra_pulses_are_added_to_the_cruise_only);
    RUN_TEST(test_linear_ramps_are_truncated_in_the_same_way);
    RUN_TEST(test_no_step_is_lost_whatever_the_ramps);
    RUN_TEST(test_at_its_own_speed_a_command_has_no_acceleration);
    RUN_TEST(test_between_two_speeds_only_their_difference_is_ramped);
    RUN_TEST(test_999_means_no_ramp);
    RUN_TEST(test_a_deceleration_leaves_slow_speed_in_play);
    RUN_TEST(test_a_truncated_command_leaves_the_speed_of_its_last_interval);
    RUN_TEST(test_at_and_below_slow_speed_there_are_no_ramps);
    RUN_TEST(test_rpm_and_cycle_are_truncated_to_whole_numbers);
    RUN_TEST(test_a_cycle_of_any_32_bits_is_kept_exactly);
    RUN_TEST(test_microsteps_multiply_all_phases);
    RUN_TEST(test_counts_in_pulses_are_not_multiplied);
    RUN_TEST(test_linear_ramp_steps_follow_the_square_of_the_speed);
    RUN_TEST(test_linear_steps_follow_the_steps_per_revolution);
    RUN_TEST(test_a_linear_ramp_longer_than_the_command_does_not_reach_its_speed);
    RUN_TEST(test_lower_values_make_longer_ramps);
    RUN_TEST(test_ramp_values_have_two_decimals_below_100_and_none_above);
    RUN_TEST(test_periods_below_2_us_or_the_pulse_and_1_us_are_refused);
    RUN_TEST(test_with_an_external_clock_periods_below_8_us_or_the_pulse_and_6_us_are_refused);
    RUN_TEST(test_an_interval_has_as_many_ticks_as_the_clock_makes_in_it);
    RUN_TEST(test_the_clock_changes_no_count_and_no_velocity);
    RUN_TEST(test_counts_reach_32_bits_and_no_further);
    RUN_TEST(test_a_deceleration_alone_has_the_steps_of_its_ramp);
    RUN_TEST(test_all_360_entries_of_appendix_d_are_twice_the_formula);
    return UNITY_END();
}
