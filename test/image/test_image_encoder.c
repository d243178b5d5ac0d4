/* ENC on the whole image: quadrature on EnA and EnB, pulses on clk. */
#include "image.h"

#include <stdio.h>
#include <string.h>

#define EN_A BOARD_PIN('C', 0)
#define EN_B BOARD_PIN('C', 1)
#define LONG_WAIT (60 * SECOND)
#define PCINT1_VECTOR 4
#define MOST_ISR_CYCLES 60

enum { CW = 1, CCW = -1 };

static unsigned at; /* quarters of a line: EnA goes first where they grow */

/* EnA and EnB of a quarter: 00, 10, 11, 01. */
static void drive(uint64_t cycle)
{
    board_pin_drive_at(board, EN_A, (at + 1) >> 1 & 1, cycle);
    board_pin_drive_at(board, EN_B, at >> 1 & 1, cycle);
}

static void stand_at(unsigned quarter)
{
    at = quarter;
    drive(board_cycle(board) + 1);
}

void setUp(void)
{
    image_power_on();
    stand_at(0);
    image_prompt();
}

void tearDown(void)
{
    image_off();
}

/* So many quarters, one each `cycles`. */
static void turn(int direction, unsigned quarters, uint64_t cycles)
{
    for (unsigned i = 0; i < quarters; i++) {
        at = (at + (unsigned)direction) & 3;
        drive(board_cycle(board) + 1);
        image_run(cycles);
    }
}

static void assert_made(size_t pulses, int64_t position)
{
    image_run(MS);
    image_assert_pulses(pulses);
    if (train.position != position)
        image_fail("expected position %lld, saw %lld", (long long)position, (long long)train.position);
}

/* -- follow -------------------------------------------------------------------------------------------------------- */

/* PIN-009, ENC-001, ENC-007 */
static void test_each_line_is_a_pulse_in_the_direction_of_rotation(void)
{
    turn(CW, 4, MS);
    assert_made(1, 1);
    turn(CW, 36, MS);
    assert_made(10, 10);
    turn(CCW, 12, MS);
    assert_made(13, 7);
    turn(CCW, 48, MS);
    assert_made(25, -5);
    TEST_ASSERT_EQUAL_INT32(-5, image_position());
}

/* ENC-003: two turns of 100 lines are one of 200 steps */
static void test_two_turns_of_100_lines_are_200_pulses(void)
{
    turn(CW, 2 * 400, 200 * US);
    assert_made(200, 200);
}

static void test_it_counts_from_wherever_it_stands_at_power_on(void)
{
    for (unsigned quarter = 0; quarter < 4; quarter++) {
        for (int direction = CCW; direction <= CW; direction += 2) {
            image_off();
            image_power_on();
            stand_at(quarter);
            image_prompt();
            turn(direction, 3, MS);
            assert_made(0, 0);
            turn(direction, 1, MS);
            assert_made(1, direction);
        }
    }
}

/* A contact that bounces is an edge there and back, and a hand that trembles is one, too. */
static void test_edges_there_and_back_are_no_pulses(void)
{
    for (unsigned quarter = 0; quarter < 4; quarter++) {
        for (unsigned i = 0; i < 50; i++) {
            turn(CW, 1, 20 * US);
            turn(CCW, 1, 20 * US);
        }
        turn(CW, 1, MS);
    }
    assert_made(1, 1);
    for (unsigned i = 0; i < 20; i++) {
        turn(CW, 3, MS);
        turn(CCW, 3, MS);
    }
    assert_made(1, 1);
    turn(CCW, 4, MS);
    assert_made(2, 0);
}

/* Over before the interrupt looks, both edges one flag: not even where one edge is missing to a line. */
static void test_a_spike_is_no_edge(void)
{
    turn(CW, 3, MS);
    for (unsigned i = 0; i < 20; i++) {
        board_pin_t pin = i & 1 ? EN_A : EN_B;
        int level = board_pin_level(board, pin);
        board_pin_drive(board, pin, !level);
        image_run(2);
        board_pin_drive(board, pin, level);
        image_run(MS);
    }
    assert_made(0, 0);
    turn(CW, 1, MS);
    assert_made(1, 1);
}

static void test_both_edges_at_once_are_no_pulse(void)
{
    for (unsigned i = 0; i < 40; i++) {
        at = (at + 2) & 3;
        drive(board_cycle(board) + 1);
        image_run(MS);
    }
    assert_made(0, 0);
    turn(CW, 4, MS);
    assert_made(1, 1);
}

/* 10,000 lines a second. */
static void test_a_fast_encoder_loses_no_line(void)
{
    for (unsigned i = 0; i < 50; i++)
        turn(CW, 40, 25 * US);
    assert_made(500, 500);
    for (unsigned i = 0; i < 50; i++)
        turn(CCW, 44, 25 * US);
    assert_made(1050, -50);
}

/* ENC-002 */
static void test_in_motion_lines_make_no_pulses(void)
{
    image_send("m-500v100a1d1t100000\r");
    image_sent();
    turn(CW, 400, MS);
    image_idle(LONG_WAIT);
    assert_made(500, -500);
    turn(CW, 4, MS);
    assert_made(501, -499);
}

/* ENC-006, ENC-008 */
static void test_dollar_n_in_standby_keeps_the_motor_still(void)
{
    image_do("$n");
    image_assert_holds(image_display("cf"), "EnT");
    turn(CW, 40, MS);
    assert_made(0, 0);
    image_do("$n");
    image_assert_holds(image_display("cf"), "EnF");
    turn(CW, 40, MS);
    assert_made(10, 10);
}

/* ENC-008: until motion begins or ends */
static void test_dollar_n_holds_until_the_next_change_of_state(void)
{
    image_do("$n");
    image_do("m10v100");
    image_idle(LONG_WAIT);
    image_assert_holds(image_display("cf"), "EnF");
    turn(CW, 40, MS);
    assert_made(20, 20);
}

/* ENC-009 */
static void test_cf_shows_throttle_in_motion_and_follow_in_standby(void)
{
    image_assert_holds(image_display("cf"), "EnF");
    image_do("m1000v100");
    image_until_state(CRUISE, SECOND);
    image_assert_holds(image_display("cf"), "EnT");
    image_do("S");
    image_assert_holds(image_display("cf"), "EnF");
}

/* -- what it costs ------------------------------------------------------------------------------------------------- */

/* Both directions, a new speed each time, for so long. */
static void turn_for(uint64_t cycles, uint64_t shortest)
{
    uint64_t end = board_cycle(board) + cycles;
    for (unsigned i = 0; board_cycle(board) < end; i++)
        turn(i % 5 < 3 ? CW : CCW, 60, shortest + i * 7 % 53);
}

/* ENC-010 */
static void test_no_pulse_is_moved_by_a_turning_encoder(void)
{
    static const struct {
        const char *line;
        unsigned cycle_us;
        uint64_t edges;
    } cases[] = {{"m30000vc30a999d999", 30, 20 * US}, {"m100000vc10a999d999", 10, 20 * US}, {"m400000vc2a999d999", 2, 100 * US + 1}} /* at all phases of its period */;
    image_off();
    image_power_on();
    IMAGE_SET(pulse_us, 1);
    image_prompt();
    for (unsigned i = 0; i < 3; i++) {
        image_train_clear();
        image_send(cases[i].line);
        image_send("\r");
        image_sent();
        turn_for(600 * MS, cases[i].edges);
        image_idle(LONG_WAIT);
        size_t pulses = cases[i].cycle_us == 30 ? 30000 : cases[i].cycle_us == 10 ? 100000 : 400000;
        image_assert_pulses(pulses);
        image_assert_intervals(0, pulses - 1, (double)(cases[i].cycle_us * US), 0);
    }
    (void)image_position(); /* no fault */
    image_assert_no_pulse_for(100 * MS);
}

/* ENC-010 */
static void test_its_interrupt_takes_60_cycles_at_most(void)
{
    image_do("$n"); /* no pulses: the step interrupt, which is longer, rests */
    board_measures_clear(board);
    turn_for(100 * MS, 20 * US);
    const board_isr_t *isr = &board_measures(board)->isr[PCINT1_VECTOR];
    TEST_ASSERT_GREATER_THAN_UINT64(1000, isr->count);
    if (isr->cycles_max > MOST_ISR_CYCLES)
        image_fail("expected %d cycles at most, saw %u", MOST_ISR_CYCLES, isr->cycles_max);
    if (board_measures(board)->isr_masked_max > 28)
        image_fail("expected 28 cycles masked at most, saw %u", board_measures(board)->isr_masked_max);
}

/* Noise of 100 kHz on an open wire: lines are still executed, and no pulse is moved. */
static void test_noise_on_a_pin_stops_nothing(void)
{
    board_pin_clock(board, EN_A, 100000);
    image_do("m10000vc30a999d999");
    image_idle(LONG_WAIT);
    image_assert_pulses(10000);
    image_assert_intervals(0, 9999, (double)(30 * US), 0);
    TEST_ASSERT_EQUAL_INT32(10000, image_position());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_line_is_a_pulse_in_the_direction_of_rotation);
    RUN_TEST(test_two_turns_of_100_lines_are_200_pulses);
    RUN_TEST(test_it_counts_from_wherever_it_stands_at_power_on);
    RUN_TEST(test_edges_there_and_back_are_no_pulses);
    RUN_TEST(test_a_spike_is_no_edge);
    RUN_TEST(test_both_edges_at_once_are_no_pulse);
    RUN_TEST(test_a_fast_encoder_loses_no_line);
    RUN_TEST(test_in_motion_lines_make_no_pulses);
    RUN_TEST(test_dollar_n_in_standby_keeps_the_motor_still);
    RUN_TEST(test_dollar_n_holds_until_the_next_change_of_state);
    RUN_TEST(test_cf_shows_throttle_in_motion_and_follow_in_standby);
    RUN_TEST(test_no_pulse_is_moved_by_a_turning_encoder);
    RUN_TEST(test_its_interrupt_takes_60_cycles_at_most);
    RUN_TEST(test_noise_on_a_pin_stops_nothing);
    return UNITY_END();
}
