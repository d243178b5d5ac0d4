/* The simulated head: what test/board/head.h says of it. The test writes the coils' port registers itself. */
#include "head.h"
#include "remote.h"

#define PINB 0x23
#define PORTB 0x25
#define DDRC 0x27
#define PORTC 0x28
#define DDRD 0x2A
#define PORTD 0x2B
#define CYCLES_AT(steps_per_second) (BOARD_CPU_HZ / (steps_per_second))
#define SLOW CYCLES_AT(100) /* from standstill no motor minds */

static head_t *head;
static int phase[HEAD_AXES]; /* of the pattern that was put on last */
static uint64_t due;         /* cycle of the next step */

static const uint8_t pair[4] = {0x3, 0x6, 0xC, 0x9};

void setUp(void)
{
    start_remote();
    write(DDRD, 0xF0);
    write(DDRC, 0x0F);
    head = head_new(board, &head_defaults);
    phase[HEAD_X] = phase[HEAD_Y] = 0;
}

void tearDown(void)
{
    head_free(head);
    board_free(board);
}

static void put(head_axis_t axis, uint8_t coils)
{
    if (axis == HEAD_X)
        write(PORTD, (uint8_t)(coils << 4));
    else
        write(PORTC, coils);
}

static const head_state_t *state(head_axis_t axis)
{
    return head_state(head, axis);
}

static int rotor(head_axis_t axis)
{
    return state(axis)->platform + state(axis)->slack;
}

static void current_on(head_axis_t axis)
{
    put(axis, pair[phase[axis]]);
    due = board_cycle(board) + SLOW;
}

static void current_off(head_axis_t axis)
{
    board_run_to(board, due);
    put(axis, 0);
}

/* One step at its cycle; the next one is due so many cycles later. */
static void step_motor(head_axis_t axis, int direction, uint64_t interval)
{
    phase[axis] = (phase[axis] + direction) & 3;
    board_run_to(board, due);
    put(axis, pair[phase[axis]]);
    due += interval;
}

static void steps_at(head_axis_t axis, int steps, uint64_t interval)
{
    for (int i = 0; i < abs(steps); i++)
        step_motor(axis, steps > 0 ? 1 : -1, interval);
}

/* A whole move from rest to rest, slowly. */
static void move(head_axis_t axis, int steps)
{
    current_on(axis);
    steps_at(axis, steps, SLOW);
    current_off(axis);
}

static void assert_in_order(head_axis_t axis)
{
    TEST_ASSERT_EQUAL_UINT64(0, state(axis)->lost_steps);
    TEST_ASSERT_EQUAL_UINT64(0, state(axis)->wrong_patterns);
}

static void test_each_axis_follows_its_own_coils(void)
{
    move(HEAD_X, -20);
    move(HEAD_Y, -9);
    TEST_ASSERT_EQUAL(-20, state(HEAD_X)->platform);
    TEST_ASSERT_EQUAL(-9, state(HEAD_Y)->platform);
    TEST_ASSERT_EQUAL_UINT64(20, state(HEAD_X)->steps);
    TEST_ASSERT_EQUAL_UINT64(9, state(HEAD_Y)->steps);
    assert_in_order(HEAD_X);
    assert_in_order(HEAD_Y);
}

static void test_motor_turns_through_the_backlash_before_the_platform_moves(void)
{
    static const int backlash[HEAD_AXES] = {12, 6};
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        for (int steps = 1; steps <= 16; steps++) {
            move(axis, 1);
            TEST_ASSERT_EQUAL(steps > backlash[axis] ? steps - backlash[axis] : 0, state(axis)->platform);
            TEST_ASSERT_EQUAL(steps < backlash[axis] ? steps : backlash[axis], state(axis)->slack);
        }
        move(axis, -backlash[axis]);
        TEST_ASSERT_EQUAL(16 - backlash[axis], state(axis)->platform);
        TEST_ASSERT_EQUAL(0, state(axis)->slack);
        move(axis, -5);
        TEST_ASSERT_EQUAL(11 - backlash[axis], state(axis)->platform);
        assert_in_order(axis);
    }
}

static void test_options_set_backlash_and_start(void)
{
    head_options_t options = {.axis = {{.start = 100, .backlash = 0}, {.start = -9999, .backlash = 3}}};
    head_free(head);
    head = head_new(board, &options);
    TEST_ASSERT_EQUAL(100, state(HEAD_X)->platform);
    TEST_ASSERT_EQUAL(-1200 - HEAD_STOP_MARGIN, state(HEAD_Y)->platform);
    move(HEAD_X, 8);
    TEST_ASSERT_EQUAL(108, state(HEAD_X)->platform);
}

static void test_rotor_out_of_phase_is_aligned_by_the_first_current(void)
{
    static const int aligned[4] = {40, 40, 44, 44}; /* the nearest multiple of 4; from the middle, up */
    for (int i = 0; i < 4; i++) {
        head_place(head, HEAD_X, 28 + i, 12);
        put(HEAD_X, 0x3);
        TEST_ASSERT_EQUAL(aligned[i], rotor(HEAD_X));
        put(HEAD_X, 0);
    }
    assert_in_order(HEAD_X);
}

static void test_one_coil_or_none_moves_nothing(void)
{
    current_on(HEAD_X);
    steps_at(HEAD_X, -2, SLOW);
    for (int i = 0; i < 4; i++) {
        run(SLOW);
        put(HEAD_X, (uint8_t)(1u << i));
        TEST_ASSERT_EQUAL(-2, state(HEAD_X)->platform);
    }
    put(HEAD_X, 0);
    TEST_ASSERT_EQUAL(-2, state(HEAD_X)->platform);
    TEST_ASSERT_EQUAL_HEX8(0, state(HEAD_X)->coils);
    assert_in_order(HEAD_X);
}

static void test_wrong_patterns_are_counted_and_move_nothing(void)
{
    static const uint8_t wrong[] = {0x5, 0xA, 0x7, 0xB, 0xD, 0xE, 0xF, 0xC}; /* the last one: opposite to the one held */
    current_on(HEAD_X);
    for (unsigned i = 0; i < sizeof wrong; i++) {
        run(SLOW);
        put(HEAD_X, wrong[i]);
        TEST_ASSERT_EQUAL_UINT64(i + 1, state(HEAD_X)->wrong_patterns);
        TEST_ASSERT_EQUAL(0, state(HEAD_X)->platform);
        TEST_ASSERT_EQUAL(0, state(HEAD_X)->slack);
        put(HEAD_X, 0x3);
    }
    TEST_ASSERT_EQUAL_UINT64(0, state(HEAD_X)->lost_steps);
}

static void test_motor_starts_and_stops_at_150_steps_a_second(void)
{
    for (int direction = -1; direction <= 1; direction += 2) {
        head_place(head, HEAD_X, 0, 0);
        phase[HEAD_X] = 0;
        current_on(HEAD_X);
        steps_at(HEAD_X, 100 * direction, CYCLES_AT(150));
        run(BOARD_CPU_HZ / 5);
        assert_in_order(HEAD_X);
        current_off(HEAD_X);
        TEST_ASSERT_EQUAL(direction > 0 ? 88 : -100, state(HEAD_X)->platform);
    }
}

static void test_too_fast_a_start_loses_whole_cycles(void)
{
    current_on(HEAD_X);
    steps_at(HEAD_X, -6, CYCLES_AT(200));
    TEST_ASSERT_EQUAL_UINT64(0, state(HEAD_X)->lost_steps);
    steps_at(HEAD_X, -2, CYCLES_AT(200));
    TEST_ASSERT_EQUAL_UINT64(4, state(HEAD_X)->lost_steps);
    TEST_ASSERT_EQUAL(-4, rotor(HEAD_X));
    current_off(HEAD_X);
    move(HEAD_X, -4); /* in phase as before */
    TEST_ASSERT_EQUAL(-8, state(HEAD_X)->platform);
    TEST_ASSERT_EQUAL_UINT64(0, state(HEAD_X)->wrong_patterns);
}

/* A ramp from 50 to 500 steps/s; the cycle error of an interval does not matter here. */
static void ramp(int direction, double acceleration)
{
    double rate = 50;
    current_on(HEAD_X);
    while (rate < 500) {
        step_motor(HEAD_X, direction, (uint64_t)((double)BOARD_CPU_HZ / rate));
        rate += acceleration / rate;
    }
}

static void test_ramp_of_2000_is_followed_and_one_of_5000_is_not(void)
{
    ramp(-1, 2000);
    steps_at(HEAD_X, -100, CYCLES_AT(500));
    assert_in_order(HEAD_X);
    current_off(HEAD_X);
    ramp(-1, 5000);
    TEST_ASSERT_GREATER_THAN_UINT64(0, state(HEAD_X)->lost_steps);
    TEST_ASSERT_EQUAL_UINT64(0, state(HEAD_X)->lost_steps % 4);
}

static void test_sudden_stop_under_current_runs_on_by_a_cycle(void)
{
    ramp(-1, 1000);
    int64_t steps = (int64_t)state(HEAD_X)->steps;
    run(BOARD_CPU_HZ / 10);
    TEST_ASSERT_EQUAL_UINT64(4, state(HEAD_X)->lost_steps);
    TEST_ASSERT_EQUAL(-steps - 4, state(HEAD_X)->platform);
}

/* A-NIN-13 */
static void test_halt_by_coils_off_stops_at_the_step(void)
{
    ramp(-1, 1000);
    int64_t steps = (int64_t)state(HEAD_X)->steps;
    current_off(HEAD_X);
    run(BOARD_CPU_HZ / 10);
    TEST_ASSERT_EQUAL(-steps, state(HEAD_X)->platform);
    assert_in_order(HEAD_X);
}

static void test_two_steps_closer_than_any_rotor_can_lose_a_cycle(void)
{
    current_on(HEAD_X);
    steps_at(HEAD_X, -1, CYCLES_AT(740));
    steps_at(HEAD_X, -1, CYCLES_AT(760));
    assert_in_order(HEAD_X);
    steps_at(HEAD_X, -1, SLOW);
    TEST_ASSERT_EQUAL_UINT64(4, state(HEAD_X)->lost_steps);
    TEST_ASSERT_EQUAL(1, rotor(HEAD_X));
}

static void test_step_whose_current_ends_at_once_is_not_made(void)
{
    current_on(HEAD_X);
    steps_at(HEAD_X, -3, SLOW);
    put(HEAD_X, 0);
    TEST_ASSERT_EQUAL(-2, rotor(HEAD_X));
    current_on(HEAD_X); /* it is made now */
    TEST_ASSERT_EQUAL(-3, rotor(HEAD_X));
    assert_in_order(HEAD_X);
}

static void test_rotor_slips_at_the_stops(void)
{
    static const struct {
        head_axis_t axis;
        int direction, limit;
    } stop[] = {{HEAD_X, 1, 1800}, {HEAD_X, -1, -1800}, {HEAD_Y, 1, 550}, {HEAD_Y, -1, -1200}};
    for (unsigned i = 0; i < sizeof stop / sizeof stop[0]; i++) {
        head_axis_t axis = stop[i].axis;
        int slack = stop[i].direction > 0 ? state(axis)->backlash : 0;
        int end = stop[i].limit + stop[i].direction * HEAD_STOP_MARGIN;
        uint64_t lost = state(axis)->lost_steps;

        head_place(head, axis, end - 3 * stop[i].direction, slack);
        phase[axis] = (end - 3 * stop[i].direction + slack) & 3;
        move(axis, 3 * stop[i].direction);
        TEST_ASSERT_EQUAL(end, state(axis)->platform);
        TEST_ASSERT_EQUAL_UINT64(lost, state(axis)->lost_steps);
        current_on(axis);
        steps_at(axis, 2 * stop[i].direction, SLOW);
        TEST_ASSERT_EQUAL_UINT64(lost, state(axis)->lost_steps);
        steps_at(axis, 1 * stop[i].direction, SLOW);
        TEST_ASSERT_EQUAL_UINT64(lost + 4, state(axis)->lost_steps);
        steps_at(axis, 41 * stop[i].direction, SLOW);
        TEST_ASSERT_EQUAL_UINT64(lost + 44, state(axis)->lost_steps);
        TEST_ASSERT_EQUAL(end, state(axis)->platform);
        steps_at(axis, -40 * stop[i].direction, SLOW);
        current_off(axis);
        TEST_ASSERT_EQUAL(end - (40 - state(axis)->backlash) * stop[i].direction, state(axis)->platform);
        TEST_ASSERT_EQUAL_UINT64(0, state(axis)->wrong_patterns);
    }
}

static void test_sensor_is_low_at_the_centre_and_beyond_on_the_positive_side(void)
{
    write(PORTB, 0x03);
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        uint8_t bit = (uint8_t)(1u << axis);
        TEST_ASSERT_EQUAL_HEX8(0, read(PINB) & bit);
        move(axis, -1);
        TEST_ASSERT_EQUAL_HEX8(bit, read(PINB) & bit);
        TEST_ASSERT_FALSE(state(axis)->sensor_low);
        move(axis, state(axis)->backlash);
        TEST_ASSERT_EQUAL_HEX8(bit, read(PINB) & bit);
        move(axis, 1);
        TEST_ASSERT_EQUAL_HEX8(0, read(PINB) & bit);
        TEST_ASSERT_TRUE(state(axis)->sensor_low);
        head_place(head, axis, 300, 0);
        TEST_ASSERT_EQUAL_HEX8(0, read(PINB) & bit);
        head_place(head, axis, -300, 0);
        TEST_ASSERT_EQUAL_HEX8(bit, read(PINB) & bit);
    }
}

static void test_sensor_high_is_left_to_the_pull_up(void)
{
    head_place(head, HEAD_X, -1, 0);
    TEST_ASSERT_EQUAL(0, board_pin_level(board, BOARD_PIN('B', 0)));
    write(PORTB, 0x01);
    TEST_ASSERT_EQUAL(1, board_pin_level(board, BOARD_PIN('B', 0)));
}

static void test_broken_sensor_stays_as_it_is(void)
{
    write(PORTB, 0x03);
    head_break_sensor(head, HEAD_X, HEAD_SENSOR_STUCK_HIGH);
    head_break_sensor(head, HEAD_Y, HEAD_SENSOR_STUCK_LOW);
    for (int platform = -100; platform <= 100; platform += 200) {
        head_place(head, HEAD_X, platform, 0);
        head_place(head, HEAD_Y, platform, 0);
        TEST_ASSERT_EQUAL_HEX8(0x01, read(PINB) & 0x03);
    }
    head_break_sensor(head, HEAD_X, HEAD_SENSOR_WORKS);
    TEST_ASSERT_EQUAL_HEX8(0x00, read(PINB) & 0x03);
}

static head_step_t told[8];
static unsigned told_count;

static void listen(void *ctx, head_step_t s)
{
    TEST_ASSERT_EQUAL_PTR(&told_count, ctx);
    told[told_count++ & 7] = s;
}

static void test_steps_are_told_with_their_cycle_and_the_recorder_stays_free(void)
{
    size_t edges;
    const board_edge_t *edge;

    told_count = 0;
    head_on_step(head, listen, &told_count);
    board_record(board, BOARD_PIN('C', 2), true); /* C comes on with the first step from A+B */
    current_on(HEAD_Y);
    step_motor(HEAD_Y, 1, SLOW);
    step_motor(HEAD_Y, 1, SLOW);
    step_motor(HEAD_Y, -1, SLOW);
    TEST_ASSERT_EQUAL(3, told_count);
    TEST_ASSERT_EQUAL(HEAD_Y, told[0].axis);
    TEST_ASSERT_EQUAL(1, told[0].direction);
    TEST_ASSERT_EQUAL(1, told[0].rotor);
    TEST_ASSERT_EQUAL(0, told[0].platform);
    TEST_ASSERT_EQUAL(-1, told[2].direction);
    TEST_ASSERT_EQUAL(1, told[2].rotor);
    edge = board_edges(board, &edges);
    TEST_ASSERT_EQUAL_UINT64(edge[0].cycle, told[0].cycle);
}

static void test_rate_is_a_mean_and_falls_when_no_step_comes(void)
{
    current_on(HEAD_X);
    TEST_ASSERT_EQUAL_DOUBLE(0, head_rate(head, HEAD_X));
    steps_at(HEAD_X, 3, CYCLES_AT(8));
    state(HEAD_X); /* the rotor stands between two such steps */
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 8, head_rate(head, HEAD_X));
    for (int i = 0; i < 8; i++)
        step_motor(HEAD_X, -1, CYCLES_AT(i & 1 ? 75 : 150));
    step_motor(HEAD_X, -1, SLOW);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, -100, head_rate(head, HEAD_X));
    TEST_ASSERT_DOUBLE_WITHIN(0.1, -100, head_rate(head, HEAD_X));
    run(BOARD_CPU_HZ / 50);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, -50, head_rate(head, HEAD_X));
    put(HEAD_X, 0);
    TEST_ASSERT_EQUAL_DOUBLE(0, head_rate(head, HEAD_X));
}

static void test_reset_takes_the_current_and_leaves_the_head(void)
{
    current_on(HEAD_X);
    steps_at(HEAD_X, -5, SLOW);
    board_run_to(board, due);
    board_reset(board, BOARD_RESET_EXTERNAL);
    TEST_ASSERT_EQUAL_HEX8(0, state(HEAD_X)->coils);
    TEST_ASSERT_EQUAL(-5, state(HEAD_X)->platform);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_axis_follows_its_own_coils);
    RUN_TEST(test_motor_turns_through_the_backlash_before_the_platform_moves);
    RUN_TEST(test_options_set_backlash_and_start);
    RUN_TEST(test_rotor_out_of_phase_is_aligned_by_the_first_current);
    RUN_TEST(test_one_coil_or_none_moves_nothing);
    RUN_TEST(test_wrong_patterns_are_counted_and_move_nothing);
    RUN_TEST(test_motor_starts_and_stops_at_150_steps_a_second);
    RUN_TEST(test_too_fast_a_start_loses_whole_cycles);
    RUN_TEST(test_ramp_of_2000_is_followed_and_one_of_5000_is_not);
    RUN_TEST(test_sudden_stop_under_current_runs_on_by_a_cycle);
    RUN_TEST(test_halt_by_coils_off_stops_at_the_step);
    RUN_TEST(test_two_steps_closer_than_any_rotor_can_lose_a_cycle);
    RUN_TEST(test_step_whose_current_ends_at_once_is_not_made);
    RUN_TEST(test_rotor_slips_at_the_stops);
    RUN_TEST(test_sensor_is_low_at_the_centre_and_beyond_on_the_positive_side);
    RUN_TEST(test_sensor_high_is_left_to_the_pull_up);
    RUN_TEST(test_broken_sensor_stays_as_it_is);
    RUN_TEST(test_steps_are_told_with_their_cycle_and_the_recorder_stays_free);
    RUN_TEST(test_rate_is_a_mean_and_falls_when_no_step_comes);
    RUN_TEST(test_reset_takes_the_current_and_leaves_the_head);
    return UNITY_END();
}
