/* EST, SYN on the whole image: the Estop pin at every cycle of a period, in every state of motion; the sync pin.
 *
 * Each figure comes from one board per cycle: the process is forked where the state begins, and each child pulls the pin
 * one cycle later than the one before it. */
#include "image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#define ESTOP BOARD_PIN('D', 2)
#define SYNC BOARD_PIN('D', 3)
#define SW_RX BOARD_PIN('D', 4)
#define LONG_WAIT (600 * SECOND)
#define MOST_CYCLES 48 /* 3 us */

void setUp(void) {}

void tearDown(void)
{
    image_off();
}

static void boot(unsigned baud, unsigned ustep, unsigned pulse_us)
{
    image_power_on();
    IMAGE_SET(hw_baud, baud);
    IMAGE_SET(ustep, ustep);
    IMAGE_SET(pulse_us, pulse_us);
    board_uart_baud(board, baud);
    image_prompt();
}

/* What a child has seen. */
typedef struct {
    bool done;
    uint64_t longest;  /* pulse */
    int64_t last_rise; /* after the edge, cycles; negative: before it */
    char wrong[200];
} seen_t;

enum { WITH_POSITION = 1, HELD = 2 };

static void watch(seen_t *seen, uint64_t phase, unsigned how, uint64_t width)
{
    uint64_t edge = board_cycle(board) + phase;
    board_pin_drive_at(board, ESTOP, 0, edge);
    board_pin_drive_at(board, ESTOP, 1, edge + (how & HELD ? 1500 * US : US));
    image_run(phase + 2 * width + 600);
    seen->last_rise = (int64_t)train.last_rise - (int64_t)edge;
    size_t made = train.count;
    image_run(2 * MS);
    /* The wait for a rise that comes too late. */
    if (train.count != made)
        seen->last_rise = (int64_t)train.last_rise - (int64_t)edge;
    seen->longest = train.high_max;
    if (board_pin_level(board, CLK))
        snprintf(seen->wrong, sizeof seen->wrong, "clk stays high");
    if (made && (train.high_min < width || train.high_max > width + 12 * US)) /* longer by what the books take */
        snprintf(seen->wrong, sizeof seen->wrong, "pulses of %llu to %llu cycles", (unsigned long long)train.high_min,
                 (unsigned long long)train.high_max);
    if ((how & WITH_POSITION) && phase % 4 == 0) {
        unsigned faults;
        int32_t shown = image_position_and_faults(&faults);
        if (shown != train.position || faults)
            snprintf(seen->wrong, sizeof seen->wrong, "position %ld, faults %u; the edges say %lld", (long)shown, faults,
                     (long long)train.position);
    }
    seen->done = true;
}

/* The worst of so many phases from here on; printed. */
static int64_t worst_of(const char *name, unsigned phases, unsigned how, uint64_t width)
{
    seen_t *seen = mmap(NULL, phases * sizeof *seen, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    TEST_ASSERT_TRUE(seen != MAP_FAILED);
    fflush(NULL);
    for (unsigned i = 0; i < phases; i++) {
        pid_t pid = fork();
        TEST_ASSERT_TRUE(pid >= 0);
        if (pid == 0) {
            if (TEST_PROTECT())
                watch(&seen[i], i, how, width);
            fflush(stdout);
            _exit(0);
        }
        waitpid(pid, NULL, 0);
    }
    int64_t worst = INT64_MIN;
    unsigned at = 0;
    uint64_t longest = 0;
    for (unsigned i = 0; i < phases; i++) {
        if (!seen[i].done || seen[i].wrong[0])
            image_fail("%s, phase %u: %s", name, i, seen[i].done ? seen[i].wrong : "failed");
        if (seen[i].longest > longest)
            longest = seen[i].longest;
        if (seen[i].last_rise > worst) {
            worst = seen[i].last_rise;
            at = i;
        }
    }
    munmap(seen, phases * sizeof *seen);
    printf("Estop to last rise, %s: \t%lld cycles (phase %u of %u); longest pulse %llu of %llu\n", name,
           (long long)worst, at, phases, (unsigned long long)longest, (unsigned long long)width);
    return worst;
}

static unsigned over; /* states that take too long */

static void measure(const char *name, unsigned phases, unsigned how, uint64_t width)
{
    over += worst_of(name, phases, how, width) > MOST_CYCLES;
}

/* -- EST ----------------------------------------------------------------------------------------------------------- */

/* 250,000 Bd: lines that do nothing, for so many milliseconds. */
static void flood(unsigned ms)
{
    for (unsigned i = 0; i < 25 * ms; i += 10)
        image_send(" nothing \r");
}

static void begin(unsigned ustep, unsigned pulse_us, const char *line)
{
    image_off();
    boot(250000, ustep, pulse_us);
    if (line)
        image_do(line);
}

/* EST-001, PIN-011 */
static void test_no_pulse_begins_3_us_after_estop_in_cruise(void)
{
    over = 0;
    begin(0, 2, "m2000v600a999d999");
    image_until_pulses(20, LONG_WAIT);
    image_run(8000 - 700); /* periods of 8,000: around the next rise */
    measure("CRUISE 2 kHz", 1300, WITH_POSITION, 2 * US);
    static const struct {
        const char *name, *line;
        unsigned ustep, pulse_us, phases;
    } rows[] = {
        {"CRUISE 33 kHz", "m1000000vc30a999d999", 0, 2, 960},
        {"CRUISE 33 kHz, pulse 28 us", "m1000000vc30a999d999", 0, 28, 960},
        {"CRUISE 33 kHz, pulse 15 us", "m1000000vc30a999d999", 0, 15, 960},
        {"CRUISE 100 kHz", "m1000000vc10a999d999", 0, 2, 480},
        {"CRUISE 100 kHz, pulse 8 us", "m1000000vc10a999d999", 0, 8, 480},
        {"CRUISE 200 kHz", "m10000000vc5a999d999", 0, 2, 480},
        {"CRUISE 333 kHz", "m10000000vc3a999d999", 0, 1, 480},
        {"CRUISE 400 kHz", "m10000000vc5a999d999", 1, 1, 480},
        {"CRUISE 500 kHz", "m10000000vc2a999d999", 0, 1, 480},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        begin(rows[i].ustep, rows[i].pulse_us, rows[i].line);
        image_until_pulses(5000, LONG_WAIT);
        measure(rows[i].name, rows[i].phases, WITH_POSITION, rows[i].pulse_us * US);
    }
    TEST_ASSERT_EQUAL_MESSAGE(0, over, "states that take longer than 3 us");
}

/* EST-001, PIN-011 */
static void test_no_pulse_begins_3_us_after_estop_in_ramps(void)
{
    static const struct {
        const char *line;
        unsigned ustep, pulse_us;
        uint8_t state;
        unsigned pulses; /* before */
    } rows[] = {
        {"m20000v3000a20d20", 0, 2, ACCEL, 20},   {"m20000v3000a20d20", 0, 2, DECEL, 0},
        {"m20000vc30a10d10", 0, 2, ACCEL, 900},   {"m20000vc10a10d10", 0, 2, ACCEL, 2000},
        {"m20000vc10a10d10", 0, 2, DECEL, 0},     {"m20000vc10a10d10", 0, 8, ACCEL, 2500},
        {"m40000vc5a10d10", 0, 2, ACCEL, 5500},   {"m40000vc5a10d10", 0, 2, DECEL, 0},
        {"m40000vc4a10d10", 0, 2, ACCEL, 7000},   {"m40000vc4a10d10", 0, 2, DECEL, 0},
        {"m60000vc3a10d10", 0, 1, ACCEL, 9500},   {"m60000vc3a10d10", 0, 1, DECEL, 0},
        {"m60000vc5a10d10", 1, 1, ACCEL, 11000},  {"m60000vc5a10d10", 1, 1, DECEL, 0},
        {"m60000vc10a10d10", 2, 1, DECEL, 0},     {"m60000vc5a500d500l1", 0, 2, ACCEL, 3000},
    };
    over = 0;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        begin(rows[i].ustep, rows[i].pulse_us, rows[i].line);
        image_until_pulses(rows[i].pulses, LONG_WAIT);
        image_until_state(rows[i].state, LONG_WAIT);
        char name[100];
        snprintf(name, sizeof name, "%s %s, microsteps %u, pulse %u us", rows[i].state == ACCEL ? "ACCEL" : "DECEL",
                 rows[i].line, 1u << rows[i].ustep, rows[i].pulse_us);
        measure(name, 1500, WITH_POSITION, rows[i].pulse_us * US);
    }
    TEST_ASSERT_EQUAL_MESSAGE(0, over, "states that take longer than 3 us");
}

/* EST-001, EST-002 */
static void test_no_pulse_begins_3_us_after_estop_with_terminal_or_eeprom_busy(void)
{
    static const struct {
        const char *name, *line;
        unsigned ustep, pulse_us;
        const char *typed; /* NULL: lines back to back */
    } rows[] = {
        {"flood, 33 kHz", "m1000000vc30a999d999", 0, 2, NULL},
        {"flood, 33 kHz, pulse 28 us", "m1000000vc30a999d999", 0, 28, NULL},
        {"flood, 100 kHz", "m1000000vc10a999d999", 0, 2, NULL},
        {"flood, 200 kHz", "m10000000vc5a999d999", 0, 2, NULL},
        {"flood, 400 kHz", "m10000000vc5a999d999", 1, 1, NULL},
        {"display, 33 kHz", "m1000000vc30a999d999", 0, 2, "q\r"},
        {"display, 100 kHz", "m1000000vc10a999d999", 0, 2, "q\r"},
        {"save, 33 kHz", "m1000000vc30a999d999", 0, 2, "qs\r"},
        {"save, 200 kHz", "m10000000vc5a999d999", 0, 2, "qs\r"},
        {"display, 200 kHz", "m10000000vc5a999d999", 0, 2, "q\r"},
    };
    over = 0;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        begin(rows[i].ustep, rows[i].pulse_us, rows[i].line);
        image_until_pulses(5000, LONG_WAIT);
        if (rows[i].typed)
            image_send(rows[i].typed);
        else
            flood(12);
        image_run(5 * MS);
        measure(rows[i].name, 1500, 0, rows[i].pulse_us * US);
    }
    TEST_ASSERT_EQUAL_MESSAGE(0, over, "states that take longer than 3 us");
}

/* EST-001 */
static void test_no_pulse_begins_3_us_after_estop_at_starts_joins_and_stops(void)
{
    static const struct {
        const char *name, *first, *then;
    } rows[] = {
        {"start", NULL, "m1000vc100a999d999"},
        {"start of a ramp", NULL, "m1000v3000a1d1"},
        {"single pulse", NULL, "+"},
        {"S at 100 kHz", "m1000000vc10a999d999", "S"},
        {"S at 200 kHz", "m10000000vc5a999d999", "S"},
        {"N at 100 kHz", "m1000000vc10a999d999", "N"},
    };
    over = 0;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        begin(0, 2, rows[i].first);
        image_run(5 * MS);
        image_send(rows[i].then);
        if (rows[i].then[0] != '+')
            image_send("\r");
        image_run((strlen(rows[i].then) + (rows[i].then[0] != '+')) * 640 + 40);
        measure(rows[i].name, 3000, WITH_POSITION | (rows[i].first ? 0 : HELD), 2 * US);
    }
    static const char *const joined[] = {"vc100", "vc30", "vc10", "vc5", "vc2"};
    for (size_t i = 0; i < sizeof joined / sizeof joined[0]; i++) {
        char line[80];
        unsigned width = i == 4 ? 1 : 2;
        begin(0, width, NULL);
        snprintf(line, sizeof line, "m8000%sa999d999\rm8000%sa999d999\r", joined[i], joined[i]);
        image_send(line);
        image_until_pulses(7900, LONG_WAIT);
        while (train.count < 7990)
            image_run(20);
        snprintf(line, sizeof line, "join, %s", joined[i]);
        if (i == 0)
            image_run(9 * 1600);
        measure(line, i < 2 ? 3600 : 1800, WITH_POSITION, width * US);
    }
    TEST_ASSERT_EQUAL_MESSAGE(0, over, "states that take longer than 3 us");
}

/* -- holding, refusing ------------------------------------------------------------------------------------------- */

/* EST-001, EST-002, PIN-011 */
static void test_while_estop_is_low_motion_is_refused_and_nothing_restarts_afterwards(void)
{
    boot(38400, 0, 2);
    image_do("m2000v100a1d1");
    image_do("m300");
    image_run(SECOND);
    image_send("m10"); /* in the middle of a line */
    board_pin_drive(board, ESTOP, 0);
    image_run(50 * MS);
    TEST_ASSERT_EQUAL(STANDBY, image_peek("motion_state"));
    image_assert_no_pulse_for(SECOND);
    image_send("\r");
    image_run(50 * MS);
    image_assert_holds(image_take_text(), "?19 Estop");
    image_refused("m100v100", "?19 Estop");
    image_send("++-");
    image_do("v200"); /* what is no motion is accepted */
    image_do("N");
    image_do("y");
    image_assert_no_pulse_for(SECOND);
    image_assert_row(1, "1\t2000\t CW\t100\t3000\t 1.00\t1.00\t0\t  0");
    board_pin_drive(board, ESTOP, 1);
    image_assert_no_pulse_for(5 * SECOND);
    TEST_ASSERT_EQUAL(train.position, image_position());
    image_train_clear();
    image_do("m100v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(100);
}

/* EST-001 */
static void test_estop_that_is_low_at_boot_is_active(void)
{
    image_power_on();
    board_pin_drive(board, ESTOP, 0);
    image_prompt();
    image_refused("m100v100", "?19 Estop");
    board_pin_drive(board, ESTOP, 1);
    image_do("m10v100a1d1");
    image_idle(LONG_WAIT);
    image_assert_pulses(10);
}

/* EST-001, SWT-007 */
static void test_estop_ends_a_start_wait_and_a_sync_hold(void)
{
    static const char *const lines[] = {"m100t500000v100", "m100sv100"};
    boot(38400, 0, 2);
    for (size_t i = 0; i < 2; i++) {
        image_do(lines[i]);
        image_run(100 * MS);
        board_pin_drive(board, ESTOP, 0);
        image_run(US);
        board_pin_drive(board, ESTOP, 1);
        image_run(MS);
        board_pin_drive(board, SYNC, 0);
        image_run(MS);
        board_pin_drive(board, SYNC, 1);
        image_do("y");
        image_assert_no_pulse_for(SECOND);
        TEST_ASSERT_EQUAL(0, image_position());
    }
}

/* -- SYN ----------------------------------------------------------------------------------------------------------- */

/* From the falling edge of sync to the first pulse, over 1,000 random phases. */
static void spread(const char *name, const char *line, bool receiving, uint64_t wait)
{
    boot(250000, 0, 2);
    uint64_t least = UINT64_MAX, most = 0;
    srand(1);
    for (unsigned i = 0; i < 1000; i++) {
        image_do(line);
        image_train_clear();
        if (receiving)
            flood(2);
        uint64_t edge = board_cycle(board) + 5000 + (unsigned)rand() % 5000;
        board_pin_drive_at(board, SYNC, 0, edge);
        board_pin_drive_at(board, SYNC, 1, edge + 10 * US);
        image_run(10000 + 100 * US + wait);
        if (train.count == 0)
            image_fail("%s, round %u: no pulse", name, i);
        uint64_t delay = train.pulse[0].cycle - edge;
        least = delay < least ? delay : least;
        most = delay > most ? delay : most;
        image_sent();
        image_send("S\r");
        image_sent();
        image_run(3 * MS);
    }
    printf("sync to first pulse, %s: %llu to %llu cycles\n", name, (unsigned long long)least, (unsigned long long)most);
    if (most - least > US)
        image_fail("%s: expected a spread of 16 cycles at most, saw %llu", name, (unsigned long long)(most - least));
    image_assert_near("the shortest", 115 + (double)wait, (double)least, 10);
}

/* SYN-004, SYN-010, PIN-008 */
static void test_sync_starts_within_a_microsecond_of_a_fixed_time(void)
{
    spread("idle", "m10svc1000a999d999", false, 0);
    image_off();
    spread("receiving", "m10svc1000a999d999", true, 0);
}

static uint16_t receive_head; /* of USART0's ring */

static bool head_is_not(board_t *b, void *head)
{
    return board_peek8(b, receive_head) != *(uint8_t *)head;
}

/* From board_uart_send() to the end of its interrupt's work, about. */
static uint64_t reception(void)
{
    TEST_ASSERT_TRUE(board_symbol(board, "usart_port", &receive_head));
    uint8_t head = board_peek8(board, receive_head);
    uint64_t from = board_cycle(board);
    image_send("v");
    TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_until(board, head_is_not, &head, 5 * MS));
    uint64_t took = board_cycle(board) - from;
    image_send("\r");
    image_run(10 * MS);
    return took;
}

/* At each cycle around the moment when another interrupt is due: the time base's; a byte is there; a start edge comes. */
static void test_sync_that_coincides_with_another_interrupt_is_a_microsecond_late_at_most(void)
{
    enum { OVERFLOW, BYTE, START_EDGE, THINGS };
    enum { TCNT0 = 0x46 };
    uint64_t least = UINT64_MAX, most = 0;
    boot(38400, 0, 2);
    uint64_t took = reception();
    for (unsigned thing = OVERFLOW; thing < THINGS; thing++) {
        for (unsigned k = 0; k < 200; k++) {
            image_do("m10svc1000a999d999");
            image_train_clear();
            image_run(2 * MS);
            uint64_t due = 8 * (256u - board_peek8(board, TCNT0)); /* the time base's, within 8 cycles */
            uint64_t edge = board_cycle(board) + (thing == BYTE ? took - 90 : due + 2048 - 30) + k;
            if (thing == BYTE) {
                image_send("v");
            } else if (thing == START_EDGE) {
                board_pin_drive_at(board, SW_RX, 0, edge + 50 - k);
                board_pin_drive_at(board, SW_RX, 1, edge + 100 * US);
            }
            board_pin_drive_at(board, SYNC, 0, edge);
            board_pin_drive_at(board, SYNC, 1, edge + 10 * US);
            image_run(edge - board_cycle(board) + 500 * US);
            if (train.count == 0)
                image_fail("thing %u, cycle %u: no pulse", thing, k);
            uint64_t delay = train.pulse[0].cycle - edge;
            least = delay < least ? delay : least;
            most = delay > most ? delay : most;
            image_send("\r");
            image_idle(LONG_WAIT);
        }
        printf("sync to first pulse, with %s: %llu to %llu cycles\n",
               thing == OVERFLOW ? "the time base"
               : thing == BYTE   ? "a byte received at USART0"
                                 : "a start edge at the software port",
               (unsigned long long)least, (unsigned long long)most);
    }
    if (most - least > US)
        image_fail("expected a spread of 16 cycles at most, saw %llu", (unsigned long long)(most - least));
}

/* SWT-001, SWT-002 */
static void test_the_start_wait_counts_from_sync(void)
{
    spread("idle, wait 1,000 us", "m10svc1000t1000a999d999", false, 1000 * US);
    image_off();
    spread("receiving, wait 5,000 us", "m10svc1000t5000a999d999", true, 5000 * US);
}

/* SYN-001, SYN-002, SYN-008, SYN-009 */
static void test_y_releases_what_is_held_and_nothing_else(void)
{
    boot(38400, 0, 2);
    image_do("y");
    board_pin_drive(board, SYNC, 0);
    image_run(MS);
    image_do("m20sv100a1d1");
    image_assert_no_pulse_for(SECOND);
    board_pin_drive(board, SYNC, 1);
    image_assert_no_pulse_for(SECOND);
    image_refused("Y", "?1 unknown command");
    image_assert_no_pulse_for(SECOND);
    image_do("y");
    image_idle(LONG_WAIT);
    image_assert_pulses(20);
    image_do("m20sv100a1d1");
    image_assert_no_pulse_for(SECOND);
    image_do("S");
    image_do("y");
    image_assert_no_pulse_for(SECOND);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_pulse_begins_3_us_after_estop_in_cruise);
    RUN_TEST(test_no_pulse_begins_3_us_after_estop_in_ramps);
    RUN_TEST(test_no_pulse_begins_3_us_after_estop_with_terminal_or_eeprom_busy);
    RUN_TEST(test_no_pulse_begins_3_us_after_estop_at_starts_joins_and_stops);
    RUN_TEST(test_while_estop_is_low_motion_is_refused_and_nothing_restarts_afterwards);
    RUN_TEST(test_estop_that_is_low_at_boot_is_active);
    RUN_TEST(test_estop_ends_a_start_wait_and_a_sync_hold);
    RUN_TEST(test_sync_starts_within_a_microsecond_of_a_fixed_time);
    RUN_TEST(test_sync_that_coincides_with_another_interrupt_is_a_microsecond_late_at_most);
    RUN_TEST(test_the_start_wait_counts_from_sync);
    RUN_TEST(test_y_releases_what_is_held_and_nothing_else);
    return UNITY_END();
}
