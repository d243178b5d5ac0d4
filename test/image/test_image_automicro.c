/* Auto-micro on the whole image: what clk, dir and MS1 to MS3 do, pulse by pulse.
 * A driver of its own reads the pins: what a step is worth is what they say when clk rises. SAC_AUTOMICRO_SEED in the
 * environment makes other random programs, SAC_AUTOMICRO_PROGRAMS more or fewer. */
#include "image.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MS1 BOARD_PIN('C', 3)
#define MS2 BOARD_PIN('C', 4)
#define MS3 BOARD_PIN('B', 4)
#define SYNC BOARD_PIN('D', 3)
#define ESTOP BOARD_PIN('D', 2)
#define LONG_WAIT (300 * SECOND)
#define WINDOW_TICKS 1600.0 /* 100 us */

enum { A4988, DRV8825, MAPPED };

/* -- the driver ---------------------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t cycle; /* rising edge of clk */
    int64_t before; /* position in the smallest steps, without this pulse */
    uint8_t gear;   /* the pulse is 2^gear of them */
} step_t;

static struct {
    unsigned driver, ustep; /* as set; ustep that of the driver, not more than it has */
    uint8_t map[8];
    int level[3];
    bool clk, ccw;
    int64_t position;
    step_t *step;
    size_t count, capacity;
    uint64_t last_fall, last_change;
    uint64_t setup_min, hold_min; /* of MS1 to MS3 */
    unsigned within_step;         /* changes to the smallest steps that were not at a full step ... */
    bool within_step_allowed;     /* ... are no fault: pulses are counted from a place within a step */
    unsigned changes;             /* steps of another gear than the one before */
    char fault[200];              /* the first one: edges are no place to fail at */
} watch;

static uint32_t baud;
static bool late_allowed; /* commands so short that their planning may take longer (docs/design.md): the count is exact */

static int pins_of(unsigned ustep)
{
    if (watch.driver == MAPPED)
        return watch.map[ustep];
    return watch.driver == A4988 && ustep == 4 ? 7 : (int)ustep;
}

static unsigned smallest_in_full_step(void)
{
    return 1u << watch.ustep;
}

static void blame(uint64_t cycle, const char *what)
{
    if (watch.fault[0] == '\0')
        snprintf(watch.fault, sizeof watch.fault, "%s, at cycle %" PRIu64 ", position %" PRId64 ", pulse %zu", what, cycle,
                 watch.position, watch.count);
}

static void on_rise(uint64_t cycle)
{
    int pins = watch.level[0] | watch.level[1] << 1 | watch.level[2] << 2;
    unsigned ustep = 0;
    while (ustep <= watch.ustep && pins_of(ustep) != pins)
        ustep++;
    if (ustep > watch.ustep) {
        blame(cycle, "MS1 to MS3 say nothing that is in use");
        ustep = 0;
    }
    uint8_t gear = (uint8_t)(watch.ustep - ustep);
    int64_t weight = (int64_t)1 << gear;
    bool changed = watch.count && watch.step[watch.count - 1].gear != gear;
    if (changed && watch.position % smallest_in_full_step() != 0) {
        watch.within_step++;
        if (!watch.within_step_allowed || gear)
            blame(cycle, "another gear within a full step");
    }
    if (watch.position % weight != 0)
        blame(cycle, "a step that begins beside its own grid");
    watch.changes += changed;
    if (watch.last_change && cycle - watch.last_change < watch.setup_min)
        watch.setup_min = cycle - watch.last_change;
    if (watch.count == watch.capacity) {
        watch.capacity = watch.capacity ? 2 * watch.capacity : 4096;
        watch.step = realloc(watch.step, watch.capacity * sizeof *watch.step);
    }
    watch.step[watch.count++] = (step_t){cycle, watch.position, gear};
    watch.position += watch.ccw ? -weight : weight;
    train.count = watch.count; /* image_until_pulses() looks at it */
}

static void on_edge(void *ctx, board_edge_t edge)
{
    (void)ctx;
    if (edge.pin == CLK) {
        watch.clk = edge.level;
        if (edge.level)
            on_rise(edge.cycle);
        else
            watch.last_fall = edge.cycle;
        return;
    }
    if (watch.clk)
        blame(edge.cycle, "dir or MS1 to MS3 change in a pulse");
    if (edge.pin == DIR) {
        watch.ccw = edge.level;
        return;
    }
    watch.level[edge.pin == MS1 ? 0 : edge.pin == MS2 ? 1 : 2] = edge.level;
    watch.last_change = edge.cycle;
    if (watch.last_fall && edge.cycle - watch.last_fall < watch.hold_min)
        watch.hold_min = edge.cycle - watch.last_fall;
}

/* What was seen is forgotten, the position is not. */
static void forget(void)
{
    image_train_clear();
    watch.count = 0;
    watch.changes = 0;
}

static void power_on(bool automicro, unsigned driver, unsigned ustep)
{
    static const unsigned most[] = {4, 5, 7};
    step_t *step = watch.step;
    size_t capacity = watch.capacity;
    image_off();
    memset(&watch, 0, sizeof watch);
    watch.step = step;
    watch.capacity = capacity;
    watch.driver = driver;
    watch.ustep = ustep < most[driver] ? ustep : most[driver];
    watch.setup_min = watch.hold_min = UINT64_MAX;
    image_power_on();
    IMAGE_SET(hw_baud, baud);
    board_uart_baud(board, baud);
    IMAGE_SET(auto_microstep, automicro);
    IMAGE_SET(driver_id, driver);
    IMAGE_SET(ustep, ustep);
    for (unsigned i = 0; i < 8; i++) {
        watch.map[i] = (uint8_t)((i * 3 + 2) % 8); /* no two alike, and none its own number */
        if (driver == MAPPED)
            IMAGE_SET(driver_map[i], watch.map[i]);
    }
    static const board_pin_t ms[] = {MS1, MS2, MS3};
    for (unsigned i = 0; i < 3; i++)
        board_record(board, ms[i], true);
    board_on_edge(board, on_edge, NULL);
    image_prompt();
    for (unsigned i = 0; i < 3; i++)
        watch.level[i] = board_pin_level(board, ms[i]);
    watch.last_change = watch.last_fall = 0;
}

static void assert_no_blame(const char *what)
{
    if (watch.fault[0])
        image_fail("%s: %s", what, watch.fault);
}

/* The motor stands: what the driver has counted is what was commanded and what `p` shows. */
static void assert_position(int64_t expected, const char *what)
{
    assert_no_blame(what);
    if (watch.position != expected)
        image_fail("%s: expected position %" PRId64 ", the driver has counted %" PRId64, what, expected, watch.position);
    unsigned faults = 0;
    int32_t shown = image_position_and_faults(&faults);
    if (faults && !late_allowed)
        image_fail("%s: expected faults 0, saw %u", what, faults);
    if (shown != expected)
        image_fail("%s: expected position %" PRId64 " (as the driver has counted), `p` shows %" PRId32, what, expected, shown);
}

static void run(const char *lines)
{
    forget();
    image_send(lines);
    image_sent();
    image_idle(LONG_WAIT);
}


/* Types the lines and waits: no fault, position as expected. */
static void run_to(const char *lines, int64_t full_steps)
{
    run(lines);
    assert_position(full_steps * smallest_in_full_step(), lines);
}

/* -- what a train must look like ----------------------------------------------------------------------------------- */

/* The mean interval of the smallest steps that such a pulse makes. */
static double smallest_interval(size_t k)
{
    return (double)(watch.step[k + 1].cycle - watch.step[k].cycle) / (double)(1u << watch.step[k].gear);
}

/* Pulses are not nearer than 100 us where larger steps can help it, nor farther than 200 us where smaller ones could: but
 * for what the interval changes in one group of the planner (an eighth of the velocity, between its middle and the end of
 * the next one three sixteenths), and in a full step, which a change has to wait for. (The last interval of a train, and
 * those that are longer than the first of a start from slow speed, are no part of this.) */
static void assert_window(const char *what)
{
    unsigned most = watch.ustep;
    double nearest = 1e9, farthest = 0;
    for (size_t k = 0; k + 1 < watch.count; k++) {
        uint8_t gear = watch.step[k].gear;
        double ticks = smallest_interval(k) * (1u << gear);
        /* How much the interval grows or shrinks in two full steps around here. */
        size_t span = (size_t)2 << most >> gear;
        size_t from = k > span ? k - span : 0;
        size_t to = k + span + 1 < watch.count ? k + span : watch.count - 2;
        double low = ticks, high = ticks;
        for (size_t i = from; i <= to; i++) {
            double other = smallest_interval(i) * (1u << gear);
            low = fmin(low, other);
            high = fmax(high, other);
        }
        double slack = WINDOW_TICKS * 3 / 16;
        if (gear < most && high < WINDOW_TICKS - slack)
            image_fail("%s: pulse %zu of gear %u: expected an interval of %.0f ticks or more, saw %.0f", what, k, gear,
                       WINDOW_TICKS - slack, ticks);
        if (gear > 0 && low > 2 * (WINDOW_TICKS + slack))
            image_fail("%s: pulse %zu of gear %u: expected an interval of %.0f ticks or less, saw %.0f", what, k, gear,
                       2 * (WINDOW_TICKS + slack), ticks);
        if (gear < most)
            nearest = fmin(nearest, ticks);
        if (gear > 0)
            farthest = fmax(farthest, ticks);
    }
    printf("%.*s: %u changes of ratio, pulses not nearer than %.1f us, not farther than %.1f us\n", (int)strcspn(what, "\r"),
           what, watch.changes, nearest / US, farthest / US);
}

static unsigned highest_gear(void)
{
    unsigned highest = 0;
    for (size_t k = 0; k < watch.count; k++)
        if (watch.step[k].gear > highest)
            highest = watch.step[k].gear;
    return highest;
}

/* One after the other, up and down again. */
static void assert_each_gear_is_passed(unsigned highest, const char *what)
{
    uint8_t gear = 0;
    bool down = false;
    for (size_t k = 0; k < watch.count; k++) {
        uint8_t seen = watch.step[k].gear;
        if (seen == gear)
            continue;
        down = down || seen < gear;
        if (seen != (down ? gear - 1 : gear + 1))
            image_fail("%s: pulse %zu: gear %u follows gear %u", what, k, seen, gear);
        gear = seen;
    }
    if (down != (highest > 0) || gear != 0 || highest_gear() != highest)
        image_fail("%s: expected gears 0 to %u and back, saw up to %u, and %u at the end", what, highest, highest_gear(), gear);
}

/* Runs the lines without auto-micro, then with it. Each pulse must come when the first of the smallest steps that it makes
 * comes without, counted from the first of all: within a tick for each smallest step of it and of the full step before
 * (either may be off by as much), and a tick for each 1,000 pulses. */
static void assert_same_times(unsigned driver, unsigned ustep, const char *lines)
{
    power_on(false, driver, ustep);
    run(lines);
    assert_no_blame(lines);
    size_t count = watch.count;
    int64_t position = watch.position;
    uint64_t *cycle = malloc((count + 1) * sizeof *cycle);
    for (size_t k = 0; k < count; k++) {
        cycle[k] = watch.step[k].cycle;
        if (watch.step[k].gear != 0)
            image_fail("%s: without auto-micro pulse %zu is of gear %u", lines, k, watch.step[k].gear);
    }
    power_on(true, driver, ustep);
    run(lines);
    static char fault[200];
    fault[0] = '\0';
    size_t path = 0, last_full = 0;
    double worst = 0, worst_step = 0, last_late = 0;
    for (size_t k = 0; k < watch.count && path < count; k++) {
        double late = (double)(watch.step[k].cycle - watch.step[0].cycle) - (double)(cycle[path] - cycle[0]);
        double step_ticks = (double)(watch.step[k].cycle - watch.step[last_full].cycle);
        double each = 2.0 + 2.0 * smallest_in_full_step() + step_ticks * 0.0006;
        if (fabs(late) > each + (double)path / 500.0 && fault[0] == '\0')
            snprintf(fault, sizeof fault, "pulse %zu, smallest step %zu: %.0f ticks late", k, path, late);
        worst = fmax(worst, fabs(late));
        if (path % smallest_in_full_step() == 0) {
            if (fabs(late - last_late) > each && fault[0] == '\0')
                snprintf(fault, sizeof fault, "pulse %zu, smallest step %zu: the full step before is %.0f ticks longer", k,
                         path, late - last_late);
            worst_step = fmax(worst_step, fabs(late - last_late));
            last_full = k;
            last_late = late;
        }
        path += (size_t)1 << watch.step[k].gear;
    }
    free(cycle);
    if (fault[0])
        image_fail("%s: %s", lines, fault);
    if (path != count)
        image_fail("%s: expected a way of %zu smallest steps, saw %zu", lines, count, path);
    printf("%.*s: %zu pulses instead of %zu, times differ by %.0f ticks at most, those of full steps by %.0f\n",
           (int)strcspn(lines, "\r"), lines, watch.count, count, worst, worst_step);
    assert_position(position, lines);
}

void setUp(void)
{
    baud = BAUD;
    late_allowed = false;
}

void tearDown(void)
{
    image_off();
}


/* -- one command --------------------------------------------------------------------------------------------------- */

/* MIC-011, MIC-012 */
static void test_from_10_to_1200_rpm_and_back_the_ratio_goes_like_a_gearbox(void)
{
    static const char *const lines[] = {"m2000v1200a10d10l0\r",   "m-4000v1200a1d1l0\r",    "m2000v1200a30d30l0\r",
                                        "m4000v1200a500d500l1\r", "m4000v1200a100d100l1\r", "m-4000v1200a900d900l1\r"};
    static const int steps[] = {2000, -4000, 2000, 4000, 4000, -4000};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        power_on(true, A4988, 4);
        run_to(lines[i], steps[i]);
        assert_each_gear_is_passed(3, lines[i]);
        assert_window(lines[i]);
    }
    printf("MS1 to MS3: %.2f us or more before the next rising edge, %.2f us or more behind the falling one\n",
           (double)watch.setup_min / US, (double)watch.hold_min / US);
    TEST_ASSERT_TRUE(watch.setup_min >= 5 * US); /* as dir; a DRV8825 wants 0.65 us, an A4988 0.2 */
    TEST_ASSERT_TRUE(watch.hold_min >= 2 * US);
}

/* MIC-011 */
static void test_the_speed_is_that_of_the_same_command_without_auto_micro(void)
{
    assert_same_times(A4988, 4, "m2000v1200a10d10l0\r");
    assert_same_times(A4988, 4, "m4000v1200a1d1l0\r");
    assert_same_times(A4988, 4, "m-2000v1200a30d30l0\r");
    assert_same_times(A4988, 4, "m4000v1200a500d500l1\r");
    assert_same_times(A4988, 4, "m-4000v1200a100d100l1\r");
    assert_same_times(A4988, 3, "m600v3000a30d30l0\r");
    assert_same_times(A4988, 1, "m3000v6000a30d30l0\r");
    assert_same_times(DRV8825, 5, "m3000v1777a20d20l0\r");
    assert_same_times(MAPPED, 6, "m500v600a7d13l0\r");
    assert_same_times(MAPPED, 7, "m700v777a20d20l0\r");
    assert_same_times(A4988, 4, "m1v1200a10d10l0\rm3v1200\rm30v1200a30d30\rm-7v40\r");
}

/* MIC-003..MIC-006, MIC-011, MIC-012 */
static void test_every_driver_at_every_ratio_is_told_what_its_pulses_are(void)
{
    uint64_t setup_min = UINT64_MAX, hold_min = UINT64_MAX;
    for (unsigned driver = A4988; driver <= MAPPED; driver++) {
        for (unsigned ustep = 1; ustep <= 7; ustep++) {
            char what[80];
            power_on(true, driver, ustep);
            run_to("m400v700a5d5l0\r", 400);
            /* 428 us a full step: the largest steps that are 100 us or more apart */
            unsigned highest = 0;
            while (highest < watch.ustep && 428u >> (watch.ustep - highest) < 100)
                highest++;
            snprintf(what, sizeof what, "driver %u, ustep %u", driver, ustep);
            assert_each_gear_is_passed(highest, what);
            assert_window(what);
            run_to("m-600v777a200d200l1\r", -200);
            if (watch.setup_min < setup_min)
                setup_min = watch.setup_min;
            if (watch.hold_min < hold_min)
                hold_min = watch.hold_min;
        }
    }
    TEST_ASSERT_TRUE(setup_min >= 5 * US);
    TEST_ASSERT_TRUE(hold_min >= 2 * US);
}

/* MIC-011, MIC-012 */
static void test_a_start_at_full_speed_begins_in_its_gear(void)
{
    power_on(true, A4988, 4);
    run_to("m3000v1200a999d999l0\r", 3000);
    TEST_ASSERT_EQUAL_UINT(6000, watch.count);
    TEST_ASSERT_EQUAL_UINT(0, watch.changes);
    for (size_t k = 0; k + 1 < watch.count; k++)
        if (watch.step[k + 1].cycle - watch.step[k].cycle != 125 * US)
            image_fail("interval %zu: expected 125 us, saw %" PRIu64 " ticks", k, watch.step[k + 1].cycle - watch.step[k].cycle);
    run_to("m1v3000\r", 3001);
    TEST_ASSERT_EQUAL_UINT(1, watch.count);
    run_to("m-3001v100a999d999\r", 0); /* 187.5 us a pulse */
    TEST_ASSERT_EQUAL_UINT(3001 * 16, watch.count);
    run_to("m100v1200a999d5\r", 100);
    run_to("m-100v1200a5d999\r", 0);
    run_to("m100v6000a999d999\r", 100); /* there is nothing larger than full steps */
    TEST_ASSERT_EQUAL_UINT(100, watch.count);
}

/* MIC-011, MIC-012 */
static void test_slow_motion_keeps_the_smallest_steps(void)
{
    power_on(true, A4988, 4);
    run_to("m100v180a10d10\r", 100);
    TEST_ASSERT_EQUAL_UINT(1600, watch.count);
    TEST_ASSERT_EQUAL_UINT(0, watch.changes);
    TEST_ASSERT_TRUE(watch.last_change == 0);
}

/* -- many commands ------------------------------------------------------------------------------------------------- */

/* MIC-011, MIC-012 */
static void test_commands_that_follow_at_speed_are_joined_in_their_gears(void)
{
    assert_same_times(A4988, 4,
                      "m400v1200a20d999l0\rm300a999v1200\rm200a20v400\rm50v800a999d999\rm333v1500a20d999\rm500v300a20d20\r");
    assert_same_times(A4988, 4, "m400v1200a20d999l0\rm-100a999d999v1200\rm200a999v1200\rm-300v50a20d999\rm100a20d20v900\r");
    assert_same_times(A4988, 4, "m400v1200a20d999l0\rm100a999d999v1200t100\rm200v1200t200000\rm-300v1200a30d20t5\rm-30v70t3\r");
    assert_same_times(DRV8825, 5, "m200v900a30d999l0\rm77v901\rm123v177a20\rm211v1999a30d999\rm50v500a30\rm-100v500d30\r");
    assert_same_times(A4988, 2, "m900v1500a300d999l1\rm400v600d999\rm800v2500\rm300d300\r");
}

/* MIC-011, MIC-012, DIR-007 */
static void test_a_thousand_short_commands_streamed_are_all_made(void)
{
    late_allowed = true;
    power_on(true, A4988, 4);
    forget();
    srand(7);
    image_do("v1200");
    image_do("a20");
    image_do("d999");
    int64_t position = 0;
    for (unsigned i = 0; i < 40; i++) {
        char lines[600] = "";
        for (unsigned n = 0; n < 25; n++) {
            char line[32];
            int count = 1 + rand() % 40;
            bool ccw = rand() % 3 == 0;
            snprintf(line, sizeof line, "m%s%dv%d\r", ccw ? "-" : "", count, 100 * (1 + rand() % 16));
            strcat(lines, line);
            position += ccw ? -count : count;
        }
        image_send(lines);
        image_sent();
        image_idle(LONG_WAIT);
        assert_position(position * 16, lines);
        forget();
    }
    assert_position(position * 16, "1,000 streamed commands");
}

/* MIC-011, MIC-012 */
static void test_continuous_motion_changes_gear_with_its_velocity(void)
{
    static const struct {
        const char *line;
        uint8_t gear;
    } live[] = {{"m", 0}, {"v400", 2}, {"v1500", 3}, {"v1200", 3}, {"v60", 0}, {"v2500", 4}, {"v12", 0}, {"v380", 2}};
    power_on(true, A4988, 4);
    image_do("a20");
    image_do("d20");
    image_do("v100");
    forget();
    for (size_t i = 0; i < sizeof live / sizeof live[0]; i++) {
        image_do(live[i].line);
        image_run(3 * SECOND);
        uint8_t gear = watch.step[watch.count - 1].gear;
        if (gear != live[i].gear)
            image_fail("%s: expected gear %u, saw %u", live[i].line, live[i].gear, gear);
        assert_no_blame(live[i].line);
    }
    image_do("s");
    image_idle(LONG_WAIT);
    assert_window("continuous motion");
    assert_position(watch.position, "continuous motion");
    TEST_ASSERT_EQUAL_INT64(0, watch.position % 16);
    run_to("m-10\r", watch.position / 16 - 10);
}

/* MIC-012, SYN-001 */
static void test_what_is_held_begins_in_its_gear_a_fixed_time_after_sync(void)
{
    static const char *const lines[] = {"m300v1200a999d999s\r", "m300v50a999d999s\r", "m-300v1200a20d20s\r",
                                        "m300v1200a20d20s\r"};
    power_on(true, A4988, 4);
    int64_t expected = 0;
    uint64_t first_min = UINT64_MAX, first_max = 0;
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        forget();
        image_send(lines[i]);
        image_sent();
        image_run(100 * MS);
        TEST_ASSERT_EQUAL_UINT(0, watch.count);
        uint64_t edge = board_cycle(board);
        board_pin_drive(board, SYNC, 0);
        image_run(MS);
        board_pin_drive(board, SYNC, -1);
        image_idle(LONG_WAIT);
        uint64_t first = watch.step[0].cycle - edge;
        first_min = first < first_min ? first : first_min;
        first_max = first > first_max ? first : first_max;
        expected += i == 2 ? -300 : 300;
        assert_position(expected * 16, lines[i]);
    }
    if (first_min < 6 * US || first_max > 8 * US)
        image_fail("first pulses: expected 7 us after sync, saw %" PRIu64 " to %" PRIu64 " ticks", first_min, first_max);
}

/* MIC-012 */
static void test_loops_and_the_array_repeat_exactly(void)
{
    power_on(true, A4988, 4);
    static const char *const program[] = {"q1m300v1200a20d999l0", "q2m-200v1200a999d20", "q3m77v700a30d30", "q4m-177v90"};
    for (size_t i = 0; i < 4; i++)
        image_do(program[i]);
    run_to("ln7\rls1\rlf4\r", 0);
    image_send("xp\r0,1\r1,3\r2,3\r3,4\r4,0\rx\r");
    image_sent();
    run_to("l3\r", 3 * (300 + 77 + 77 - 177));
    run_to("x2\r", 3 * 277 - 200);
}

/* MIC-012, CLK-013 */
static void test_a_flood_at_250000_bd_moves_nothing(void)
{
    static const char *const noise[] = {"q\r", "cf\r", "vd\r", "p\r", "hello\r", "m5v0\r", "?\r", "a5.5\r", "m1k\r"};
    static const char *const lines[] = {"m3000v1200a10d10l0", "m-3000v1200a300d300l1", "m2000v2999a30d30l0"};
    static const int steps[] = {3000, -3000, 2000};
    int64_t expected = 0;
    baud = 250000;
    power_on(true, A4988, 4);
    srand(9);
    for (size_t i = 0; i < 3; i++) {
        forget();
        image_take_text();
        image_do(lines[i]);
        while (watch.count < 200 || !image_idles(0)) {
            if (watch.count && board_cycle(board) > watch.step[watch.count - 1].cycle + SECOND)
                break;
            if (!board_uart_sending(board))
                image_send(noise[(size_t)rand() % (sizeof noise / sizeof noise[0])]);
            image_run(100 * US);
            board_uart_clear(board);
        }
        image_sent();
        image_run(5 * SECOND);
        image_take_text();
        expected += steps[i];
        assert_position(expected * 16, lines[i]);
        assert_each_gear_is_passed(i == 2 ? 4 : 3, lines[i]);
        assert_window(lines[i]);
    }
}

/* -- stops --------------------------------------------------------------------------------------------------------- */

static unsigned random_to(unsigned most)
{
    return (unsigned)rand() % (most + 1);
}

/* A motion is begun and goes on for a while. */
static void begin_motion(void)
{
    char line[60];
    bool linear = random_to(1);
    bool ccw = random_to(1);
    unsigned count = 3000 + random_to(3000);
    unsigned v = 30 + random_to(1500);
    unsigned accel = linear ? 200 + random_to(500) : 5 + random_to(60);
    unsigned decel = linear ? 200 + random_to(500) : 5 + random_to(60);
    snprintf(line, sizeof line, "m%s%uv%ua%ud%ul%u\r", ccw ? "-" : "", count, v, accel, decel, linear);
    forget();
    image_send(line);
    image_sent();
    image_run((uint64_t)random_to(1200000) * US);
}

/* Two moves to see that all is well, then position and ratios again. */
static void go_on(const char *what)
{
    int64_t position = watch.position;
    assert_position(position, what);
    image_do("m11v900a30d30l0");
    image_do("m-200v1200");
    image_idle(LONG_WAIT);
    assert_position(position - 189 * 16, what);
}

/* MIC-012 */
static void test_n_and_s_end_at_a_full_step(void)
{
    static const char *const stops[] = {"n\r", "s\r", "N\r", "nm100v800\r", "N\rm50v1200a999\r", "xm400v900\r"};
    late_allowed = true; /* one-shots in steep ramps, at speed */
    power_on(true, A4988, 4);
    srand(11);
    for (unsigned i = 0; i < 90; i++) {
        const char *stop = stops[i % 6];
        begin_motion();
        image_send(stop);
        image_sent();
        image_idle(LONG_WAIT);
        if (watch.position % 16 != 0)
            image_fail("%u, %s: expected a full step, saw position %" PRId64, i, stop, watch.position);
        go_on(stop);
    }
}

/* MIC-012 */
static void test_stops_anywhere_leave_the_position_exact(void)
{
    unsigned within = 0;
    power_on(true, A4988, 4);
    srand(12);
    for (unsigned i = 0; i < 100; i++) {
        begin_motion();
        image_send("S\r");
        image_sent();
        image_run(10 * MS);
        within += watch.position % 16 != 0;
        go_on("S");
    }
    for (unsigned i = 0; i < 100; i++) {
        begin_motion();
        board_pin_drive(board, ESTOP, 0);
        image_run(10 * MS);
        board_pin_drive(board, ESTOP, -1);
        image_run(10 * MS);
        within += watch.position % 16 != 0;
        image_sent();
        image_run(100 * MS);
        image_take_text();
        go_on("Estop");
    }
    printf("%u of 200 stops within a full step\n", within);
    TEST_ASSERT_TRUE(within > 50);
}

/* -- pulses -------------------------------------------------------------------------------------------------------- */

/* MIC-012: of the smallest steps, as position is */
static void test_counts_in_pulses_are_of_the_smallest_steps(void)
{
    power_on(true, A4988, 4);
    run("m16p\r");
    assert_position(16, "m16p");
    TEST_ASSERT_EQUAL_UINT(16, watch.count);
    run("m1000v1200a999d999p\r");
    assert_position(1016, "m1000p"); /* 62 full steps, and 8 smallest ones: one pulse */
    TEST_ASSERT_EQUAL_UINT(125, watch.count);
    watch.within_step_allowed = true; /* the exception: pulses counted from a place within a step */
    run("m1003v1200p\r");
    assert_position(2019, "m1003p");
    run("m-2019p\r");
    assert_position(0, "m-2019p");
    watch.within_step_allowed = false;
    run("m200v1200a20d20u5f\r");
    assert_position(3205, "m200u5f");
    run("m-200f\r"); /* from there by full steps: no other ratio but at full steps */
    assert_position(5, "m-200f");
    run("$U\rm-5\r");
    assert_position(0, "m-5 with $U");
    run("$P\rm3200v1200\rm-3200\r");
    assert_position(0, "pulses there and back");
}

/* MIC-012 */
static void test_pulses_are_not_joined_to_larger_steps(void)
{
    late_allowed = true;
    power_on(true, A4988, 4);
    run("m300v1200a999d999f\rm37v1200p\rm-37v1200p\rm300v1200f\rm5v1200u7\rm-5v1200u7\r");
    assert_position(600 * 16, "pulses behind full steps");
    run("m300v1200a20d20f\rm16v1200p\rm1600v1200p\r");
    assert_position(1001 * 16, "pulses behind full steps");
}

/* MIC-012 */
static void test_single_pulses_are_of_the_smallest_steps_at_a_full_step(void)
{
    power_on(true, A4988, 4);
    run("+++++-");
    assert_position(4, "+++++-");
    run("----");
    assert_position(0, "----");
    run_to("m300v1200a20d20\r", 300);
    run("+");
    assert_position(4801, "+");
    run_to("-m-300\r", 0);
    image_do("m3000v1200a999"); /* pulses of 8 */
    image_until_pulses(6, SECOND);
    while (watch.position % 16 != 8)
        image_run(10 * US);
    image_send("S\r");
    image_sent();
    int64_t position = watch.position;
    run("+++");
    /* As large as the last ones, to the full step, and from there on the smallest. */
    assert_position(position + (position % 16 == 0 ? 3 : 8 + 2), "+++ behind a stop");
}

/* MIC-012: where the motor stands then is a full step, whatever the position says */
static void test_another_ratio_begins_at_a_full_step(void)
{
    power_on(true, A4988, 0);
    run_to("m7v100\r", 7);
    image_send("$CD1\r$CJ4\r$R\r");
    image_sent();
    image_run(SECOND);
    (void)image_take_text();
    watch.ustep = 4;
    watch.position = 0;
    run("m200v1200a20d20\r");
    assert_no_blame("after $R");
    TEST_ASSERT_EQUAL(3200, watch.position);
    TEST_ASSERT_TRUE(watch.changes > 0);
    TEST_ASSERT_EQUAL(7 + 3200, image_position());
}

/* MIC-011 */
static void test_without_auto_micro_nothing_changes(void)
{
    power_on(false, A4988, 4);
    run_to("m2000v1200a10d10l0\rm-500v3000a999d20\r", 1500);
    TEST_ASSERT_EQUAL_UINT(2500 * 16, watch.count);
    TEST_ASSERT_TRUE(watch.last_change == 0);
    power_on(true, A4988, 0); /* full steps: there is nothing to change */
    run_to("m2000v1200a10d10l0\rm-500v3000a999d20\r", 1500);
    TEST_ASSERT_EQUAL_UINT(2500, watch.count);
    TEST_ASSERT_TRUE(watch.last_change == 0);
}

/* -- at random ----------------------------------------------------------------------------------------------------- */

static unsigned setting(const char *name, unsigned otherwise)
{
    const char *value = getenv(name);
    return value ? (unsigned)strtoul(value, NULL, 10) : otherwise;
}

/* One line of a program, and how far it goes; *cut: that cannot be said. */
static int64_t random_line(char *line, size_t size, bool pulses, unsigned *fastest, bool *cut)
{
    static const char *const cuts[] = {"n", "N", "s", "S", "m", "xm20v500"};
    static const char *const ramps[] = {"a999d999l0", "a20d20l0", "a5d999l0", "a999d30l0", "a300d300l1", "a998d998l0",
                                        "a998d998l1", "a120d7l0", "a50d999l1"};
    unsigned kind = random_to(11);
    if (kind == 0 || (kind == 1 && *cut)) {
        unsigned which = random_to(5);
        snprintf(line, size, "%s", cuts[which]);
        if (which == 5 && *fastest < 500)
            *fastest = 500;
        *cut = true;
        return 0;
    }
    if (kind == 2 && pulses) {
        unsigned keys = 1 + random_to(8);
        snprintf(line, size, "%.*s", (int)keys, random_to(1) == 0 ? "++++++++" : "--------");
        *cut = true; /* they are not made in motion */
        return 0;
    }
    bool ccw = random_to(3) == 0;
    bool in_pulses = pulses && random_to(1);
    unsigned count = 1 + random_to(random_to(2) ? 30 : 150);
    unsigned extra = pulses && random_to(3) == 0 ? random_to(40) : 0;
    unsigned v = 10 + random_to(random_to(1) ? 200 : 1400);
    if (v > *fastest)
        *fastest = v;
    int64_t way = in_pulses ? count : (int64_t)count << watch.ustep;
    const char *ramp = ramps[random_to(8)];
    snprintf(line, size, "m%s%uv%u%s%s", ccw ? "-" : "", count, v, ramp, in_pulses ? "p" : "f");
    if (extra) {
        snprintf(line + strlen(line), size - strlen(line), "u%u", extra);
        *cut = true; /* truncated ramps have none */
    }
    if (random_to(5) == 0)
        snprintf(line + strlen(line), size - strlen(line), "t%u", random_to(20000));
    return ccw ? -way : way;
}

static void run_program(unsigned number)
{
    char program[600] = "";
    bool pulses = random_to(2) == 0;
    bool cut = false;
    unsigned lines = 1 + random_to(4);
    static unsigned fastest; /* of all so far: velocities are kept */
    int64_t expected = watch.position;
    watch.within_step_allowed = pulses;
    forget();
    for (unsigned i = 0; i < lines; i++) {
        char line[80];
        expected += random_line(line, sizeof line, pulses, &fastest, &cut);
        strcat(program, line);
        strcat(program, "\r");
        image_send(line);
        image_send("\r");
        if (random_to(1)) {
            image_sent();
            image_run((uint64_t)random_to(60000) * US);
        }
        if (random_to(40) == 0) {
            board_pin_drive(board, ESTOP, 0);
            image_run(MS);
            board_pin_drive(board, ESTOP, -1);
            strcat(program, "Estop ");
            cut = true;
        }
    }
    image_sent();
    image_run(20 * MS); /* planning */
    if (cut && !image_idles(300 * MS)) {
        image_send("s\r"); /* it may be continuous motion */
        image_sent();
    }
    image_idle(LONG_WAIT);
    char what[900];
    snprintf(what, sizeof what, "program %u, ustep %u: %s, answered %.200s", number, watch.ustep, program, image_take_text());
    assert_position(cut ? watch.position : expected, what);
    uint64_t cruise = (uint64_t)(300000 / (fastest < 100 ? 100 : fastest)) * US; /* 100 RPM: that of a bare m */
    for (size_t k = 0; k + 1 < watch.count; k++) {
        uint64_t ticks = watch.step[k + 1].cycle - watch.step[k].cycle;
        if (ticks + 2 < cruise << watch.step[k].gear >> watch.ustep)
            image_fail("%s: pulse %zu of gear %u: an interval of %" PRIu64 " ticks is shorter than the fastest command's", what, k,
                       watch.step[k].gear, ticks);
    }
}

/* MIC-011, MIC-012 */
static void test_random_programs_keep_the_position(void)
{
    unsigned seed = setting("SAC_AUTOMICRO_SEED", 1), programs = setting("SAC_AUTOMICRO_PROGRAMS", 300);
    printf("seed %u, %u programs\n", seed, programs);
    srand(seed);
    late_allowed = true;
    for (unsigned i = 0; i < programs; i++) {
        if (i % 12 == 0) {
            unsigned driver = random_to(2);
            power_on(true, driver, 1 + random_to(4));
        }
        run_program(i);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_from_10_to_1200_rpm_and_back_the_ratio_goes_like_a_gearbox);
    RUN_TEST(test_the_speed_is_that_of_the_same_command_without_auto_micro);
    RUN_TEST(test_every_driver_at_every_ratio_is_told_what_its_pulses_are);
    RUN_TEST(test_a_start_at_full_speed_begins_in_its_gear);
    RUN_TEST(test_slow_motion_keeps_the_smallest_steps);
    RUN_TEST(test_commands_that_follow_at_speed_are_joined_in_their_gears);
    RUN_TEST(test_a_thousand_short_commands_streamed_are_all_made);
    RUN_TEST(test_continuous_motion_changes_gear_with_its_velocity);
    RUN_TEST(test_what_is_held_begins_in_its_gear_a_fixed_time_after_sync);
    RUN_TEST(test_loops_and_the_array_repeat_exactly);
    RUN_TEST(test_a_flood_at_250000_bd_moves_nothing);
    RUN_TEST(test_n_and_s_end_at_a_full_step);
    RUN_TEST(test_stops_anywhere_leave_the_position_exact);
    RUN_TEST(test_counts_in_pulses_are_of_the_smallest_steps);
    RUN_TEST(test_pulses_are_not_joined_to_larger_steps);
    RUN_TEST(test_single_pulses_are_of_the_smallest_steps_at_a_full_step);
    RUN_TEST(test_another_ratio_begins_at_a_full_step);
    RUN_TEST(test_without_auto_micro_nothing_changes);
    RUN_TEST(test_random_programs_keep_the_position);
    return UNITY_END();
}
