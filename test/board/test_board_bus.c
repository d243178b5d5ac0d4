/* The simulated RS485 line: what test/board/bus.h says of it. */
#include "bus.h"
#include "program.h"

#include <string.h>

enum { NOTHING, SEND, DRIVE_LOW, DRIVE_HIGH, RELEASE }; /* as in programs/bus_node.c */
enum { NODES = 3 };

#define BAUD 38400
#define BIT 417u
#define BYTE 4167u
#define SW_RX BOARD_PIN('D', 4)

static bus_t *bus;
static board_t *node[NODES];
static bus_peer_t *peer;

static void run_bus(uint64_t cycles)
{
    TEST_ASSERT_EQUAL(BOARD_RAN, bus_run_for(bus, cycles));
}

void setUp(void)
{
    bus = bus_new();
    for (int i = 0; i < NODES; i++) {
        start(PROGRAM("bus_node"));
        node[i] = board;
        bus_join(bus, board);
    }
    peer = bus_peer(bus, BAUD);
    run_bus(1000);
}

void tearDown(void)
{
    bus_free(bus);
    for (int i = 0; i < NODES; i++)
        board_free(node[i]);
}

static void tell(int which, uint8_t what)
{
    board = node[which];
    set("p_command", 0, what);
}

static void tell_to_send(int which, const char *text)
{
    board = node[which];
    for (unsigned i = 0; i < strlen(text); i++)
        set("p_bytes", i, (uint8_t)text[i]);
    set("p_count", 0, (uint8_t)strlen(text));
    tell(which, SEND);
}

static void assert_node_heard(int which, const char *text)
{
    board = node[which];
    TEST_ASSERT_EQUAL(strlen(text), get("r_count", 0));
    for (unsigned i = 0; i < strlen(text); i++)
        TEST_ASSERT_EQUAL_HEX8(text[i], get("r_bytes", i));
}

static void assert_heard(const bus_peer_t *p, const char *text, bool echo)
{
    size_t count;
    const bus_byte_t *byte = bus_peer_received(p, &count);
    TEST_ASSERT_EQUAL(strlen(text), count);
    for (size_t i = 0; i < count; i++) {
        TEST_ASSERT_EQUAL_HEX8(text[i], byte[i].byte);
        TEST_ASSERT_FALSE(byte[i].framing_error);
        TEST_ASSERT_EQUAL(echo, byte[i].echo);
    }
}

static void test_line_that_nobody_drives_is_high(void)
{
    run_bus(100000);
    TEST_ASSERT_EQUAL(0, bus_drivers(bus));
    TEST_ASSERT_EQUAL(1, bus_level(bus));
    for (int i = 0; i < NODES; i++)
        TEST_ASSERT_EQUAL(1, board_pin_level(node[i], SW_RX));
    assert_heard(peer, "", false);
}

static void test_one_driver_is_heard_by_all_and_by_itself(void)
{
    tell_to_send(1, "Hi5\xA5");
    run_bus(6 * BYTE);
    assert_node_heard(0, "Hi5\xA5");
    assert_node_heard(2, "Hi5\xA5");
    assert_heard(peer, "Hi5\xA5", false);
    board = node[1];
    for (unsigned i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_HEX8("Hi5\xA5"[i], get("r_echo", i));
    TEST_ASSERT_EQUAL(0, bus_contentions(bus));
    TEST_ASSERT_EQUAL(0, bus_drivers(bus));
}

static void test_an_edge_is_heard_the_delay_later_to_the_cycle(void)
{
    size_t count;
    for (int i = 0; i < NODES; i++)
        board_record(node[i], SW_RX, true);
    bus_peer_send(peer, "U", 1);
    run_bus(2 * BYTE);
    const bus_byte_t *byte = bus_peer_received(peer, &count);
    TEST_ASSERT_EQUAL(1, count);
    for (int i = 0; i < NODES; i++) {
        const board_edge_t *edge = board_edges(node[i], &count);
        TEST_ASSERT_EQUAL(10, count);
        for (unsigned n = 0; n < count; n++)
            TEST_ASSERT_EQUAL_UINT64(byte->start_cycle + BUS_DELAY + (n * 16000000ull + BAUD / 2) / BAUD,
                                     edge[n].cycle);
    }
}

static void test_line_keeps_the_width_of_a_node_s_pulse(void)
{
    size_t count, echoes;
    const board_pin_t sw_tx = BOARD_PIN('D', 6);
    board_record(node[0], sw_tx, true);
    board_record(node[1], SW_RX, true);
    tell_to_send(0, "\x55\x33");
    run_bus(4 * BYTE);
    const board_edge_t *sent = board_edges(node[0], &count);
    const board_edge_t *heard = board_edges(node[1], &echoes);
    TEST_ASSERT_GREATER_THAN(10, count);
    TEST_ASSERT_EQUAL(count, echoes);
    for (size_t i = 0; i < count; i++)
        TEST_ASSERT_EQUAL_UINT64(sent[i].cycle + BUS_DELAY,
                                 heard[i].cycle);
}

static void test_disagreeing_drivers_are_counted_and_make_the_line_low(void)
{
    tell(0, DRIVE_HIGH);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(1, bus_level(bus));
    tell(1, DRIVE_HIGH);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(2, bus_drivers(bus));
    TEST_ASSERT_EQUAL(0, bus_contentions(bus));
    tell(1, DRIVE_LOW);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(1, bus_contentions(bus));
    TEST_ASSERT_EQUAL(0, bus_level(bus));
    tell(0, RELEASE);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(0, bus_level(bus));
    tell(0, DRIVE_HIGH);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(2, bus_contentions(bus));
    board_reset(node[1], BOARD_RESET_EXTERNAL);
    run_bus(2 * BYTE);
    TEST_ASSERT_EQUAL(1, bus_level(bus));
    TEST_ASSERT_EQUAL(1, bus_drivers(bus));
}

static void test_peer_s_bytes_reach_every_node_and_come_back_as_echo(void)
{
    bus_peer_send(peer, "master", 6);
    run_bus(8 * BYTE);
    for (int i = 0; i < NODES; i++)
        assert_node_heard(i, "master");
    assert_heard(peer, "master", true);
    TEST_ASSERT_EQUAL(0, bus_drivers(bus));
}

static void test_peer_reads_at_its_own_rate_with_times(void)
{
    size_t count;
    bus_peer_t *fast = bus_peer(bus, 1000000);
    bus_peer_t *listener = bus_peer(bus, 1000000);
    bus_peer_hold(fast, -1, 500);
    uint64_t start = bus_peer_free_at(fast);
    bus_peer_send(fast, "ab", 2);
    run_bus(2000);
    const bus_byte_t *byte = bus_peer_received(listener, &count);
    TEST_ASSERT_EQUAL(2, count);
    TEST_ASSERT_EQUAL_UINT64(start, byte[0].start_cycle);
    TEST_ASSERT_EQUAL_UINT64(start + 160, byte[1].start_cycle);
    TEST_ASSERT_EQUAL_UINT64(start + 152, byte[0].end_cycle);
    assert_heard(listener, "ab", false);
}

static void test_line_held_low_is_a_framing_error_until_it_is_released(void)
{
    size_t count;
    bus_peer_t *stuck = bus_peer(bus, BAUD);
    bus_peer_hold(stuck, 0, 1000 * BYTE);
    run_bus(10 * BYTE);
    TEST_ASSERT_EQUAL(0, bus_level(bus));
    const bus_byte_t *byte = bus_peer_received(peer, &count);
    TEST_ASSERT_EQUAL(1, count);
    TEST_ASSERT_TRUE(byte[0].framing_error);
    bus_peer_stop(stuck);
    run_bus(BYTE);
    TEST_ASSERT_EQUAL(1, bus_level(bus));
    bus_peer_clear(peer);
    bus_peer_send(stuck, "ok", 2);
    run_bus(3 * BYTE);
    assert_heard(peer, "ok", false);
}

/* Bits of 200 bytes that came wrong. */
static unsigned wrong_bits(double probability, uint64_t seed)
{
    uint8_t sent[200];
    size_t count;
    unsigned wrong = 0;
    for (unsigned i = 0; i < sizeof sent; i++)
        sent[i] = 0xF0;
    bus_bit_errors(bus, probability, BAUD, seed);
    bus_peer_clear(peer);
    uint32_t before = bus_bit_errors_made(bus);
    for (unsigned i = 0; i < sizeof sent; i++) {
        bus_peer_send(peer, &sent[i], 1);
        bus_peer_hold(peer, -1, 2 * BYTE);
    }
    run_bus(sizeof sent * 3 * BYTE + BYTE);
    const bus_byte_t *byte = bus_peer_received(peer, &count);
    for (size_t i = 0; i < count; i++)
        wrong += (unsigned)__builtin_popcount(byte[i].byte ^ 0xF0u);
    TEST_ASSERT_EQUAL(probability > 0, bus_bit_errors_made(bus) > before);
    return wrong;
}

static void test_bit_errors_come_as_often_as_asked_and_the_same_for_a_seed(void)
{
    TEST_ASSERT_EQUAL(0, wrong_bits(0, 1));
    uint32_t before = bus_bit_errors_made(bus);
    unsigned first = wrong_bits(0.02, 1);
    uint32_t made = bus_bit_errors_made(bus) - before;
    TEST_ASSERT_INT_WITHIN(20, 40, (int)made); /* of 2,000 bits */
    TEST_ASSERT_GREATER_THAN(0, first);
    TEST_ASSERT_EQUAL(first, wrong_bits(0.02, 1));
    TEST_ASSERT_EQUAL(2 * made, bus_bit_errors_made(bus) - before);
    wrong_bits(0.02, 2);
    TEST_ASSERT_NOT_EQUAL(3 * made, bus_bit_errors_made(bus) - before);
}

static void test_skewed_node_sends_faster_and_its_clock_runs_ahead(void)
{
    size_t count;
    uint64_t before = board_cycle(node[0]);
    bus_skew(bus, node[0], 2);
    run_bus(1000000);
    TEST_ASSERT_INT_WITHIN(8, 1020000, (int)(board_cycle(node[0]) - before));
    TEST_ASSERT_INT_WITHIN(8, 0, (int)(board_cycle(node[0]) - bus_board_cycle(node[0], bus_cycle(bus))));
    TEST_ASSERT_EQUAL_UINT64(bus_cycle(bus) + 1000, bus_cycle_of(node[0], bus_board_cycle(node[0], bus_cycle(bus)) + 1020));
    TEST_ASSERT_EQUAL_UINT64(bus_cycle(bus) + 1000, bus_cycle_of(node[1], bus_board_cycle(node[1], bus_cycle(bus)) + 1000));
    uint64_t gap[2];
    for (int i = 0; i < 2; i++) {
        bus_peer_clear(peer);
        tell_to_send(i, "UUUUUUUU");
        run_bus(12 * BYTE);
        const bus_byte_t *byte = bus_peer_received(peer, &count);
        TEST_ASSERT_EQUAL(8, count);
        gap[i] = byte[7].start_cycle - byte[0].start_cycle;
    }
    TEST_ASSERT_INT_WITHIN(3, (int)((double)gap[1] / 1.02), (int)gap[0]);
    assert_node_heard(2, "UUUUUUUUUUUUUUUU");
}

static void test_crash_of_a_board_ends_the_run(void)
{
    start(PROGRAM("crash"));
    board_t *bad = board;
    bus_join(bus, bad);
    run_bus(1000);
    set("way", 0, 1);
    board_run_t how = bus_run_for(bus, 100000);
    bool named = bus_crashed(bus) == bad;
    bus_free(bus);
    bus = NULL;
    board_free(bad);
    TEST_ASSERT_EQUAL(BOARD_CRASHED, how);
    TEST_ASSERT_TRUE(named);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_line_that_nobody_drives_is_high);
    RUN_TEST(test_one_driver_is_heard_by_all_and_by_itself);
    RUN_TEST(test_an_edge_is_heard_the_delay_later_to_the_cycle);
    RUN_TEST(test_line_keeps_the_width_of_a_node_s_pulse);
    RUN_TEST(test_disagreeing_drivers_are_counted_and_make_the_line_low);
    RUN_TEST(test_peer_s_bytes_reach_every_node_and_come_back_as_echo);
    RUN_TEST(test_peer_reads_at_its_own_rate_with_times);
    RUN_TEST(test_line_held_low_is_a_framing_error_until_it_is_released);
    RUN_TEST(test_bit_errors_come_as_often_as_asked_and_the_same_for_a_seed);
    RUN_TEST(test_skewed_node_sends_faster_and_its_clock_runs_ahead);
    RUN_TEST(test_crash_of_a_board_ends_the_run);
    return UNITY_END();
}
