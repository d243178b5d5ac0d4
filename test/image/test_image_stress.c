/* Random commands on the whole image against exact intervals; millions of steps with the terminal busy; lines back to
 * back at full rate. SAC_STEPS in the environment sets how many steps are made (make test-long: ten million). */
#include "image.h"
#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONG_WAIT (1200 * SECOND)

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    image_off();
}

static uint32_t random_up_to(uint32_t most)
{
    return (((uint32_t)rand() << 16) ^ (uint32_t)rand()) % most + 1;
}

/* 1 to most, each magnitude as likely as the others. */
static uint32_t random_magnitude(double most)
{
    return (uint32_t)floor(exp((double)rand() / RAND_MAX * log(most)));
}

/* 0.01 to 99.99, 100 to 998, or none. */
static uint32_t random_ramp(void)
{
    uint32_t centi = random_magnitude(99900);
    if (rand() % 10 == 0)
        return NO_RAMP;
    return centi >= 10000 ? centi / 100 * 100 : centi;
}

static request_t random_request(machine_t machine)
{
    request_t r = {.cycle = rand() % 2, .linear = rand() % 2, .pulses = rand() % 4 == 0};
    r.velocity = r.cycle ? 1 + random_magnitude(1e6) : random_magnitude(65000);
    r.accel = random_ramp();
    r.decel = random_ramp();
    r.extra = rand() % 3 ? 0 : random_up_to(255);
    /* Every 25th may be long; none takes more than ten minutes. */
    double most = rand() % 25 ? 30000 : 200000;
    uint32_t factor = r.pulses ? 1 : 1u << machine.ustep;
    uint32_t rpm = model_rpm(machine, r);
    double full_steps_in_ten_minutes = rpm ? rpm * 2000.0 : 6e8 / r.velocity;
    double fits = full_steps_in_ten_minutes * (r.pulses ? 1u << machine.ustep : 1);
    most = fmin(most / factor, fits);
    r.count = most < 2 ? 1 : random_magnitude(most);
    return r;
}

static bool is_too_fast(machine_t machine, request_t r)
{
    uint32_t cycle = r.cycle ? r.velocity : 60000000u / machine.steps_per_rev / r.velocity;
    return cycle < 2u << machine.ustep;
}

/* What is wrong with the train of one command, in `what`; false if nothing is. */
static bool is_wrong(const plan_t *plan, char *what, size_t size)
{
    double cruise = model_cruise(plan);
    double longest = fmax(cruise, model_slow(plan));
    if (train.count != plan->total) {
        snprintf(what, size, "expected %u pulses (%u-%u-%u), saw %zu", plan->total, plan->accel, plan->cruise,
                 plan->decel, train.count);
        return true;
    }
    double from_zero = plan->request.linear && plan->accel && plan->target > plan->start ? model_interval(plan, 0) : 0;
    double sum = 0;
    for (uint32_t k = 0; k + 1 < plan->total; k++) {
        double seen = (double)image_interval(k);
        sum += model_interval(plan, k);
        if (seen < floor(cruise)) {
            snprintf(what, size, "interval %u: expected no less than the cruise's %.2f ticks, saw %.0f", k, cruise,
                     seen);
            return true;
        }
        if (seen > ceil(fmax(longest, from_zero)) + 1) {
            snprintf(what, size, "interval %u: expected no more than %.2f ticks, saw %.0f", k, fmax(longest, from_zero),
                     seen);
            return true;
        }
    }
    double seen = (double)(train.pulse[plan->total - 1].cycle - train.pulse[0].cycle);
    if (fabs(seen - sum) > 1 + plan->total / 1000.0) {
        snprintf(what, size, "%u-%u-%u: expected a sum of %.2f ticks, saw %.0f", plan->accel, plan->cruise, plan->decel,
                 sum, seen);
        return true;
    }
    return false;
}

/* STA-008, STA-016, TRN-002, TRN-008, HAR-002, LIN-005 */
static void test_500_random_commands_keep_count_bounds_and_sum(void)
{
    unsigned done = 0, refused = 0, wrong = 0;
    char first[400] = "";
    srand(20);
    while (done < 500) {
        machine_t machine = {200, (unsigned)rand() % 8, 10};
        image_off();
        image_power_on();
        IMAGE_SET(driver_id, 2); /* has every factor */
        IMAGE_SET(ustep, machine.ustep);
        IMAGE_SET(pulse_us, 1);
        image_prompt();
        bool faulty = false;
        for (unsigned i = 0; i < 25 && !faulty; i++, done++) {
            request_t request = random_request(machine);
            char line[80], what[300];
            model_line(line, sizeof line, &request, rand() % 2);
            if (is_too_fast(machine, request)) {
                image_train_clear();
                image_refused(line, "?7 too fast");
                image_assert_pulses(0);
                refused++;
                continue;
            }
            plan_t plan = model_plan(machine, request);
            if (plan.uncertain)
                continue;
            image_train_clear();
            image_do(line);
            image_idle(LONG_WAIT);
            const char *shown = image_ask("p");
            faulty = strstr(shown, "faults 0\r\n") == NULL;
            bool bad = is_wrong(&plan, what, sizeof what);
            if (!bad && faulty)
                snprintf(what, sizeof what, "expected no fault, saw \"%.50s\"", shown);
            if (bad || faulty) {
                if (wrong++ < 40)
                    printf("microsteps %u, %s: %s\n", 1u << machine.ustep, line, what);
                if (first[0] == '\0')
                    snprintf(first, sizeof first, "microsteps %u, %s: %s", 1u << machine.ustep, line, what);
            }
        }
    }
    printf("%u commands, %u of them refused as too fast\n", done, refused);
    if (wrong > 0)
        image_fail("%u of %u commands are wrong, first: %s", wrong, done, first);
}

static const char *const busy_lines[] = {"q\r",    "cf\r",   "vd\r",           "p\r", "hello\r", "m5v0\r",
                                         "a5.5\r", "d7.5\r", "m99999999999\r", "?\r", "\r\n\r",  "m1k\r"};

/* Motions at random, streaming and turning, displays and nonsense between them, until so many steps are made: none lost,
 * none extra, position right. Returns the faults that are left: was the planner ever late? */
static unsigned make_steps(size_t steps, uint32_t baud)
{
    enum { COMMANDS = 200000, AHEAD = 24 };
    static uint64_t made_after[COMMANDS]; /* pulses made when command i is over */
    size_t given = 0, over = 0;
    uint64_t given_pulses = 0;
    int64_t position = 0;
    image_power_on();
    IMAGE_SET(hw_baud, baud);
    board_uart_baud(board, baud);
    image_prompt();
    train.keep = false;
    while (train.count < given_pulses || given_pulses < steps) {
        while (over < given && made_after[over] <= train.count)
            over++;
        if (!board_uart_sending(board)) {
            if (given < COMMANDS && given_pulses < steps && given - over < AHEAD && rand() % 3) {
                char line[60];
                bool ccw = rand() % 2, lin = rand() % 3 == 0;
                uint32_t count = random_magnitude(20000);
                snprintf(line, sizeof line, "m%s%uv%ua%ud%ul%d\r", ccw ? "-" : "", count, 300 + random_up_to(14700),
                         lin ? 100 + random_up_to(400) : 10 + random_up_to(40),
                         rand() % 2 ? 999
                         : lin      ? 100 + random_up_to(400)
                                    : 10 + random_up_to(40),
                         lin);
                image_send(line);
                given_pulses += count;
                made_after[given++] = given_pulses;
                position += ccw ? -(int64_t)count : (int64_t)count;
            } else {
                image_send(busy_lines[(size_t)rand() % (sizeof busy_lines / sizeof busy_lines[0])]);
            }
        }
        image_run(200 * US);
        uint64_t quiet = board_cycle(board) - (train.last_rise ? train.last_rise : board_cycle(board));
        if (quiet > SECOND && over < given && !board_uart_sending(board))
            image_fail("expected pulse %zu of %llu, of command %zu of %zu; none since cycle %llu", train.count,
                       (unsigned long long)given_pulses, over, given, (unsigned long long)train.last_rise);
        if (train.count > given_pulses)
            break;
        if (given % 64 == 0)
            board_uart_clear(board);
    }
    image_sent();
    image_run(5 * SECOND); /* displays that are still printed */
    image_take_text();
    if (train.count != given_pulses)
        image_fail("expected %llu pulses of %zu commands, saw %zu", (unsigned long long)given_pulses, given,
                   train.count);
    TEST_ASSERT_EQUAL_INT64(position, train.position);
    unsigned faults;
    TEST_ASSERT_EQUAL_INT64(position, image_position_and_faults(&faults));
    if (board_uart_overruns(board) != 0)
        image_fail("expected no byte lost, saw %u", board_uart_overruns(board));
    printf("%llu steps of %zu commands at %u Bd, faults %u\n", (unsigned long long)given_pulses, given, baud, faults);
    return faults;
}

static size_t steps_asked_for(void)
{
    const char *asked = getenv("SAC_STEPS");
    return asked ? (size_t)strtoul(asked, NULL, 10) : 1000000;
}

/* STA-008, DIR-007, CLK-013, MOT-012 */
static void test_a_million_mixed_steps_with_a_busy_terminal_are_all_made(void)
{
    srand(30);
    (void)make_steps(steps_asked_for(), 38400);
}

static void test_a_million_mixed_steps_with_a_busy_terminal_are_planned_in_time(void)
{
    srand(30);
    TEST_ASSERT_EQUAL_UINT(0, make_steps(steps_asked_for(), 38400));
}

static void test_a_million_mixed_steps_with_a_busier_terminal_are_all_made(void)
{
    srand(31);
    (void)make_steps(steps_asked_for(), 250000);
}

/* 500 motions back to back, each in the other direction than the one before, so that the edges of dir show each count.
 * As many pulses as the motor makes at 33.3 kHz while the next line arrives. */
static void stream_500_lines(uint32_t baud)
{
    enum { LINES = 500 };
    static uint32_t counts[LINES];
    image_power_on();
    IMAGE_SET(hw_baud, baud);
    board_uart_baud(board, baud);
    image_prompt();
    image_train_clear();
    image_send("m-700vc30a999d999\r");
    double line_us = 17 * 10e6 / baud;
    uint32_t mean = (uint32_t)(line_us / 30);
    size_t total = 0;
    for (unsigned i = 0; i < LINES; i++) {
        char line[40];
        counts[i] = mean - mean / 8 + (uint32_t)rand() % (mean / 4 + 1);
        total += counts[i];
        snprintf(line, sizeof line, "m%s%uvc30a999d999\r", i % 2 ? "-" : "", counts[i]);
        image_send(line);
    }
    image_sent();
    image_idle(LONG_WAIT);
    image_assert_pulses(700 + total);
    size_t k = 700;
    for (unsigned i = 0; i < LINES; i++) {
        size_t run = 0;
        while (k + run < train.count && train.pulse[k + run].dir == i % 2)
            run++;
        if (run != counts[i])
            image_fail("line %u at %u Bd: expected %u pulses, saw %zu, at cycle %llu", i, baud, counts[i], run,
                       (unsigned long long)train.pulse[k].cycle);
        k += run;
    }
    if (board_uart_overruns(board) != 0)
        image_fail("at %u Bd: expected no byte lost, saw %u", baud, board_uart_overruns(board));
    image_run(SECOND);
    image_take_text();
    TEST_ASSERT_EQUAL(train.position, image_position());
}

/* CLK-013, MOT-012 */
static void test_500_lines_back_to_back_at_38400_bd_are_all_executed_as_sent(void)
{
    srand(40);
    stream_500_lines(38400);
}

/* CLK-013, MOT-012 */
static void test_500_lines_back_to_back_at_250000_bd_are_all_executed_as_sent(void)
{
    srand(41);
    stream_500_lines(250000);
}

/* Session values back to back while the motor cruises at 33.3 kHz: in bursts, after each of which they are looked at, then
 * all at once. A line that was lost or damaged would leave an error. No edge moves. */
static void set_500_values(uint32_t baud)
{
    image_power_on();
    IMAGE_SET(hw_baud, baud);
    board_uart_baud(board, baud);
    image_prompt();
    image_train_clear();
    image_do("m1000000vc30a999d999");
    for (unsigned i = 0; i < 26; i++) {
        char shown[40];
        uint32_t v = 0, a = 0;
        for (unsigned n = 0; n < (i < 25 ? 10 : 250); n++) {
            char line[40];
            v = random_up_to(5000);
            a = 1 + random_up_to(98);
            snprintf(line, sizeof line, "v%u\ra%u.5\r", v, a);
            image_send(line);
        }
        image_sent();
        image_run(20 * MS);
        snprintf(shown, sizeof shown, "v %u cycle %u\r\na %u.50 ", v, 300000 / v, a);
        const char *error = strchr(image_take_text(), '?');
        if (error)
            image_fail("%u Bd, burst %u: expected no error, saw \"%.30s\"", baud, i, error);
        image_assert_holds(image_display("cf"), shown);
    }
    if (board_uart_overruns(board) != 0)
        image_fail("at %u Bd: expected no byte lost, saw %u", baud, board_uart_overruns(board));
    if (train.interval_min != 480)
        image_fail("expected intervals of 480 ticks, saw %llu", (unsigned long long)train.interval_min);
    image_assert_intervals(0, train.count - 1, 480, 0);
}

/* CLK-013 */
static void test_500_values_at_38400_bd_are_all_taken_while_the_motor_runs_at_33_khz(void)
{
    srand(42);
    set_500_values(38400);
}

/* CLK-013, PER-005: a thousand lines, two to a value */
static void test_500_values_at_250000_bd_are_all_taken_while_the_motor_runs_at_33_khz(void)
{
    srand(43);
    set_500_values(250000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_500_random_commands_keep_count_bounds_and_sum);
    RUN_TEST(test_a_million_mixed_steps_with_a_busy_terminal_are_all_made);
    if (getenv("SAC_KNOWN_FAILURES")) /* fails in this version: docs/design.md, known failures */
        RUN_TEST(test_a_million_mixed_steps_with_a_busy_terminal_are_planned_in_time);
    if (getenv("SAC_KNOWN_FAILURES")) /* fails in this version: docs/design.md, known failures */
        RUN_TEST(test_a_million_mixed_steps_with_a_busier_terminal_are_all_made);
    RUN_TEST(test_500_lines_back_to_back_at_38400_bd_are_all_executed_as_sent);
    if (getenv("SAC_KNOWN_FAILURES")) /* fails in this version: docs/design.md, known failures */
        RUN_TEST(test_500_lines_back_to_back_at_250000_bd_are_all_executed_as_sent);
    RUN_TEST(test_500_values_at_38400_bd_are_all_taken_while_the_motor_runs_at_33_khz);
    RUN_TEST(test_500_values_at_250000_bd_are_all_taken_while_the_motor_runs_at_33_khz);
    return UNITY_END();
}
