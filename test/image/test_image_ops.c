/* OPS on the whole image: the flags OPSA and OPSB, and soft ops at the terminal. */
#include "image.h"

#include <stdio.h>
#include <string.h>

#define LONG_WAIT (600 * SECOND)
#define MOST_EVENTS 4096

static struct {
    uint64_t cycle;
    bool up;
    size_t pulses; /* made until then */
} event[MOST_EVENTS];
static size_t events;

void setUp(void)
{
    image_boot();
    events = 0;
}

void tearDown(void)
{
    image_off();
}

/* Looked at every 8 cycles: the board's edges belong to the oscilloscope. */
static void run_watching(uint64_t cycles)
{
    uint64_t end = board_cycle(board) + cycles;
    static int before;
    if (events == 0)
        before = 0;
    while (board_cycle(board) < end) {
        image_run(8);
        int a = board_pin_level(board, OPSA);
        if (a != before && events < MOST_EVENTS) {
            event[events].cycle = board_cycle(board);
            event[events].up = a;
            event[events++].pulses = train.count;
        }
        before = a;
    }
    TEST_ASSERT_EQUAL_MESSAGE(!board_pin_level(board, OPSA), board_pin_level(board, OPSB), "OPSB is the inverse");
}

static void assert_pairs(size_t expected)
{
    if (events != 2 * expected)
        image_fail("expected %zu pairs, saw %zu edges", expected, events);
    for (size_t i = 0; i < events; i++)
        TEST_ASSERT_EQUAL(i % 2 == 0, event[i].up);
}

/* OPS-001, PIN-012, PIN-013, PIN-023, SWT-006 */
static void test_the_flag_brackets_each_command_within_a_millisecond(void)
{
    static const char *const lines[] = {"m100v100a1d1", "m100v600a999d999", "m50vc1000a999d999t20000", "m-100v300a10d10l1", "m1"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        events = 0;
        image_train_clear();
        image_send(lines[i]);
        image_send("\r");
        run_watching(3 * SECOND);
        assert_pairs(1);
        int64_t rise = (int64_t)event[0].cycle - (int64_t)train.pulse[0].cycle;
        printf("OPSA of %s: up %lld us after the first pulse, down %lld us after the last\n", lines[i], (long long)rise / 16,
               (long long)(event[1].cycle - train.last_rise) / 16);
        if (rise < -10 * (int64_t)US || rise > (int64_t)MS)
            image_fail("%s: up %lld cycles after the first pulse", lines[i], (long long)rise);
        if (event[1].pulses != train.count)
            image_fail("%s: down after %zu of %zu pulses", lines[i], event[1].pulses, train.count);
    }
    TEST_ASSERT_EQUAL(0, board_pin_level(board, OPSA));
    TEST_ASSERT_EQUAL(1, board_pin_level(board, OPSB));
}

/* OPS-001 */
static void test_streamed_and_very_short_commands_have_a_pair_each(void)
{
    for (unsigned i = 0; i < 10; i++)
        image_send("m20vc100a999d999\r");
    run_watching(SECOND);
    image_assert_pulses(200);
    assert_pairs(10);
    events = 0;
    for (unsigned i = 0; i < 20; i++)
        image_send(i % 2 ? "m-1vc20a999d999\r" : "m2vc5a999d999\r");
    run_watching(SECOND);
    image_assert_pulses(230);
    assert_pairs(20);
}

/* OPS-001 */
static void test_single_pulses_and_cancelled_waits_have_none(void)
{
    image_send("++-");
    run_watching(10 * MS);
    assert_pairs(0);
    image_send("m100t1000000\r");
    run_watching(100 * MS);
    image_send("S\r");
    run_watching(100 * MS);
    assert_pairs(0);
}

/* OPS-001, STO-006 */
static void test_a_stop_ends_the_flag(void)
{
    image_send("m1000v100a1d1\r");
    run_watching(SECOND);
    TEST_ASSERT_EQUAL(1, board_pin_level(board, OPSA));
    image_send("S\r");
    run_watching(10 * MS);
    assert_pairs(1);
    image_send("m1000v100a1d1\r");
    run_watching(SECOND);
    board_pin_drive(board, BOARD_PIN('D', 2), 0);
    run_watching(MS);
    assert_pairs(2);
}

/* OPS-004, OPS-005, OPS-006, OPS-008, OPS-009 */
static void test_soft_ops_are_bare_bytes_at_the_terminal(void)
{
    image_assert_holds(image_display("cf"), "soft_ops off");
    image_do("$O1");
    image_assert_holds(image_display("cf"), "soft_ops on");
    board_uart_clear(board);
    image_send("m20vc1000a999d999\rm20vc1000a999d999\r");
    run_watching(200 * MS);
    size_t count, seen = 0;
    const board_uart_byte_t *bytes = board_uart_received(board, &count);
    for (size_t i = 0; i < count; i++) {
        if (bytes[i].byte != 0x11 && bytes[i].byte != 0x12)
            continue;
        TEST_ASSERT_EQUAL_HEX8(seen % 2 ? 0x12 : 0x11, bytes[i].byte);
        if (bytes[i].start_cycle > event[seen].cycle + 10 * MS)
            image_fail("byte %zu: at %llu, the flag at %llu", seen, (unsigned long long)bytes[i].start_cycle,
                       (unsigned long long)event[seen].cycle);
        seen++;
    }
    TEST_ASSERT_EQUAL(4, seen);
    image_do("$O0");
    board_uart_clear(board);
    image_send("m20vc1000a999d999\r");
    run_watching(200 * MS);
    TEST_ASSERT_NULL(strchr(board_uart_text(board), 0x11));
    image_refused("$O2", "?12 range 0..1");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_flag_brackets_each_command_within_a_millisecond);
    RUN_TEST(test_streamed_and_very_short_commands_have_a_pair_each);
    RUN_TEST(test_single_pulses_and_cancelled_waits_have_none);
    RUN_TEST(test_a_stop_ends_the_flag);
    RUN_TEST(test_soft_ops_are_bare_bytes_at_the_terminal);
    return UNITY_END();
}
