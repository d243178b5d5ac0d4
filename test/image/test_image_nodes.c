/* NET, MAX on several whole images that share one RS485 line (test/board/bus.h).
 * SAC_NODE_COMMANDS: how many commands go over the bad line; SAC_NODE_LOSS: of how many one is lost, each way;
 * SAC_NODE_SEED (make test-nodes-long: 10^4). */
#include "nodes.h"
#include "splitmix64.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ACK = 6, NAK = 0x15 };
#define SYNC BOARD_PIN('D', 3)
#define CHARACTER (10 * BOARD_CPU_HZ / BAUD)

void setUp(void)
{
    nodes_begin();
}

void tearDown(void)
{
    nodes_end();
}

static uint64_t number(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? strtoull(text, NULL, 10) : otherwise;
}

static uint64_t state;

static uint32_t below(uint32_t limit)
{
    return (uint32_t)((splitmix64(&state) >> 32) * limit >> 32);
}

static void assert_pulses(unsigned which, size_t expected)
{
    if (node[which].pulses != expected)
        image_fail("node %u: expected %zu pulses, saw %zu", which, expected, node[which].pulses);
}

/* -- a line that loses packets ----------------------------------------------------------------------------------------- */

/* Decisions 0.4.2: single bits are wrong all the time, and whole packets lost on top, commands and answers alike. */
static void test_on_a_bad_line_each_command_is_executed_once(void)
{
    enum { NODES = 3, FIRST = 10, ATTEMPTS = 20 };
    const uint64_t commands = number("SAC_NODE_COMMANDS", 400);
    const uint32_t one_in = (uint32_t)number("SAC_NODE_LOSS", 20);
    state = number("SAC_NODE_SEED", 1);
    uint64_t lost = 0, retries = 0, refused = 0, expected[NODES] = {0};
    uint8_t sequence[NODES];
    for (unsigned i = 0; i < NODES; i++) {
        nodes_add((uint8_t)(FIRST + i), 2, 50.0 * ((int)i - 1));
        sequence[i] = (uint8_t)(0x80 + below(0x80));
    }
    master_begin();
    for (unsigned i = 0; i < NODES; i++)
        TEST_ASSERT_EQUAL_HEX8(ACK, master_sends((uint8_t)(FIRST + i), sequence[i], ""));
    nodes_clear_pulses();
    bus_bit_errors(bus, 0.1 / one_in / 100, BAUD, state);
    for (uint64_t i = 0; i < commands; i++) {
        const unsigned which = below(NODES);
        const unsigned steps = 1 + below(40);
        const bool bad = below(10) == 0;
        char text[40];
        snprintf(text, sizeof text, bad ? "m%uv0" : "m%uvc100a999d999", steps);
        const uint64_t packet = (strlen(text) + 7) * CHARACTER;
        sequence[which] = (uint8_t)((sequence[which] + 1) | 0x80);
        uint8_t answer = 0;
        for (unsigned attempt = 0; answer == 0; attempt++) {
            if (attempt == ATTEMPTS)
                image_fail("command %" PRIu64 ", \"%s\" to %u: no answer", i, text, FIRST + which);
            retries += attempt > 0;
            if (below(one_in) == 0) { /* from somewhere in it to its end */
                const uint64_t from = below((uint32_t)packet);
                master_jams(from, packet - from);
                lost++;
            } else if (below(one_in) == 0) { /* the answer */
                master_jams(packet + 2 * CHARACTER, 9 * CHARACTER);
                lost++;
            }
            answer = master_sends((uint8_t)(FIRST + which), sequence[which], text);
        }
        TEST_ASSERT_EQUAL_HEX8(bad ? NAK : ACK, answer);
        refused += bad;
        expected[which] += bad ? 0 : steps;
    }
    bus_bit_errors(bus, 0, BAUD, 0);
    nodes_run_until_still(SECOND);
    printf("%" PRIu64 " commands to %d images, %" PRIu64 " refused; %" PRIu64 " packets or answers lost, %u wrong bits, %" PRIu64
           " retries; motors %" PRIu64 " %" PRIu64 " %" PRIu64 " pulses\n",
           commands, NODES, refused, lost, bus_bit_errors_made(bus), retries, expected[0], expected[1], expected[2]);
    for (unsigned i = 0; i < NODES; i++)
        assert_pulses(i, expected[i]);
    TEST_ASSERT_GREATER_THAN(0, retries);
    TEST_ASSERT_LESS_OR_EQUAL_UINT64_MESSAGE(lost + bus_bit_errors_made(bus), retries, "nothing is lost without a cause");
}

/* -- one node's terminal as the master ----------------------------------------------------------------------------------- */

/* NET-009, NET-014, NET-020: a command; its answer on the screen; what is refused. Both kinds of packets. */
static void test_a_line_typed_at_one_node_turns_the_motor_of_another(void)
{
    for (uint8_t crc_mode = 1; crc_mode <= 2; crc_mode++) {
        nodes_add((uint8_t)(85 + 10 * crc_mode), crc_mode, 30);
        nodes_add((uint8_t)(10 + crc_mode), crc_mode, -30);
    }
    nodes_clear_pulses();
    TEST_ASSERT_EQUAL_STRING("11m300v60\r\nSAC>\r\nK\r\nSAC>", node_says(0, "11m300v60", "K\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("12m200v600\r\nSAC>\r\nK\r\nSAC>", node_says(2, "12m200v600", "K\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("11m300v0\r\nSAC>\r\nNAK\r\nSAC>", node_says(0, "11m300v0", "NAK\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("12m300v0\r\nSAC>\r\nNAK ?8 velocity 0\r\nSAC>",
                             node_says(2, "12m300v0", "velocity 0\r\nSAC>"));
    TEST_ASSERT_EQUAL_STRING("13m1\r\nSAC>\r\n?9 no answer\r\nSAC>", node_says(0, "13m1", "answer\r\nSAC>"));
    nodes_run_until_still(5 * SECOND);
    assert_pulses(0, 0);
    assert_pulses(1, 300);
    assert_pulses(2, 0);
    assert_pulses(3, 200);
    node_text_is(1, "");
    node_text_is(3, "");
}

/* NET-013, NET-015, NET-034 */
static void test_messages_go_there_and_back(void)
{
    nodes_add(85, 1, 30);
    nodes_add(10, 1, -30);
    TEST_ASSERT_EQUAL_STRING("10 hello\r\nSAC>\r\nK\r\nSAC>", node_says(0, "10 hello", "K\r\nSAC>"));
    node_text_is(1, "\r\n85:10> hello\r\nSAC>");
    TEST_ASSERT_EQUAL_STRING("/ hi\r\nSAC>\r\nK\r\nSAC>", node_says(1, "/ hi", "K\r\nSAC>"));
    node_text_is(0, "\r\n10:85> hi\r\nSAC>");
    (void)node_says(1, "0.all", "0.all\r\nSAC>");
    nodes_run(50 * MS);
    node_text_is(0, "\r\n10:0>.all\r\nSAC>");
    node_text_is(1, "");
}

/* SYN-003, NET-011, NET-023: commands are loaded, held, and released together. */
static void test_a_y_to_everybody_releases_what_is_held(void)
{
    nodes_add(85, 2, 30);
    for (uint8_t i = 0; i < 3; i++)
        nodes_add((uint8_t)(10 + i), 2, -30.0 * i);
    nodes_clear_pulses();
    (void)node_says(0, "10m100svc200a999d999", "K\r\nSAC>");
    (void)node_says(0, "11m200svc200a999d999", "K\r\nSAC>");
    (void)node_says(0, "12m300svc200a999d999", "K\r\nSAC>");
    nodes_run(50 * MS);
    for (unsigned i = 0; i < 4; i++)
        assert_pulses(i, 0);
    (void)node_says(0, "0y", "y\r\nSAC>");
    nodes_run_until_still(SECOND);
    assert_pulses(0, 0);
    for (unsigned i = 1; i < 4; i++)
        assert_pulses(i, 100 * i);
}

/* -- together ------------------------------------------------------------------------------------------------------------ */

enum { AXES = 12 };

static void add_axes(void)
{
    for (unsigned i = 0; i < AXES; i++)
        nodes_add((uint8_t)(10 + i), 2, 100.0 * i / (AXES - 1) - 50);
}

static void hold_all(void)
{
    for (unsigned i = 0; i < AXES; i++)
        board_uart_send_text(node[i].board, "m20svc200a999d999\r");
    nodes_run(50 * MS);
    nodes_clear_pulses();
}

/* From the first of the first pulses to the last of them; from `since` to the first. */
static uint64_t skew(uint64_t since, uint64_t *after)
{
    uint64_t first = UINT64_MAX, last = 0;
    for (unsigned i = 0; i < AXES; i++) {
        assert_pulses(i, 20);
        first = node[i].first_pulse < first ? node[i].first_pulse : first;
        last = node[i].first_pulse > last ? node[i].first_pulse : last;
    }
    *after = first - since;
    return last - first;
}

/* SYN-004, SYN-010, PIN-008, MAX-003: one wire to the sync pins of twelve units, clocks up to 50 ppm off, other phases of their time
 * bases; at rest, and with packets for somebody else on the line. */
static void test_twelve_units_start_within_a_microsecond_at_a_sync_edge(void)
{
    enum { ROUNDS = 20 };
    state = 1;
    add_axes();
    master_begin();
    for (unsigned busy = 0; busy < 2; busy++) {
        uint64_t most = 0, after = 0;
        for (unsigned round = 0; round < ROUNDS; round++) {
            hold_all();
            const uint64_t at = bus_cycle(bus) + 20000 + below(20000);
            for (unsigned i = 0; i < AXES; i++) {
                board_pin_drive_at(node[i].board, SYNC, 0, bus_board_cycle(node[i].board, at));
                board_pin_drive_at(node[i].board, SYNC, 1, bus_board_cycle(node[i].board, at + MS));
            }
            if (busy)
                (void)master_sends(200, 0x80, "m1234567v1234a1.5d2.5");
            nodes_run(10 * MS);
            const uint64_t now = skew(at, &after);
            most = now > most ? now : most;
        }
        printf("twelve units at a sync edge, %s: first pulses %" PRIu64 " cycles apart at most, %" PRIu64 " after the edge\n",
               busy ? "packets on the line" : "at rest", most, after);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(US, most);
    }
}

/* SYN-010, SYN-003, MAX-003, NET-011: the same by one packet. */
static void test_twelve_units_start_together_at_a_y_to_everybody(void)
{
    enum { ROUNDS = 20 };
    uint64_t most = 0, latest = 0;
    state = 1;
    add_axes();
    master_begin();
    for (unsigned round = 0; round < ROUNDS; round++) {
        hold_all();
        nodes_run(below(10000));
        const uint64_t end = bus_cycle(bus) + 8 * CHARACTER;
        (void)master_sends(0, (uint8_t)(0x80 | round), "y");
        nodes_run(10 * MS);
        uint64_t after;
        const uint64_t now = skew(end, &after);
        most = now > most ? now : most;
        latest = after + now > latest ? after + now : latest;
    }
    printf("twelve units at a y to everybody: first pulses %.1f us apart at most, the last one %.1f us after the packet\n",
           (double)most / US, (double)latest / US);
    TEST_ASSERT_LESS_THAN_UINT64(100 * US, most);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_on_a_bad_line_each_command_is_executed_once);
    RUN_TEST(test_a_line_typed_at_one_node_turns_the_motor_of_another);
    RUN_TEST(test_messages_go_there_and_back);
    RUN_TEST(test_a_y_to_everybody_releases_what_is_held);
    RUN_TEST(test_twelve_units_start_together_at_a_y_to_everybody);
    RUN_TEST(test_twelve_units_start_within_a_microsecond_at_a_sync_edge);
    return UNITY_END();
}
