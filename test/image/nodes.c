#include "nodes.h"
#include "crc8.h"

#include <stdio.h>
#include <string.h>

enum { STX = 2, ETX = 3, MASTER = 1, MOST_BYTES = 80 };
#define CHARACTER (10 * BOARD_CPU_HZ / BAUD)
#define ANSWER (10 * MS) /* docs/wire-format.md, "What a master does" */

bus_t *bus;
node_t node[MOST_NODES];
unsigned node_count;

static bus_peer_t *master, *jammer;

static void on_edge(void *ctx, board_edge_t edge)
{
    node_t *its = ctx;
    if (!edge.level)
        return;
    if (its->pulses++ == 0)
        its->first_pulse = bus_cycle_of(its->board, edge.cycle);
    its->moving = true;
}

void nodes_begin(void)
{
    bus = bus_new();
    node_count = 0;
    master = jammer = NULL;
}

void nodes_end(void)
{
    bus_free(bus);
    bus = NULL;
    board = NULL;
    while (node_count > 0)
        board_free(node[--node_count].board);
}

/* After a brown-out, so that it does not wait for ESC; each at another moment of its time base. */
void nodes_add(uint8_t address, uint8_t crc_mode, double ppm)
{
    node_t *its = &node[node_count];
    TEST_ASSERT_LESS_THAN(MOST_NODES, node_count++);
    *its = (node_t){.board = board_new(SAC_ELF, NULL)};
    TEST_ASSERT_NOT_NULL_MESSAGE(its->board, SAC_ELF);
    board = its->board;
    board_reset(board, BOARD_RESET_BROWN_OUT);
    image_load_settings();
    IMAGE_SET(device_id, address);
    IMAGE_SET(crc_mode, crc_mode);
    image_prompt();
    image_run(node_count * 3011);
    board_record(board, CLK, true);
    board_on_edge(board, on_edge, its);
    bus_join(bus, board);
    bus_skew(bus, board, ppm / 10000);
    board_pin_drive(board, BOARD_PIN('D', 3), 1);
}

void nodes_run(uint64_t cycles)
{
    if (bus_run_for(bus, cycles) == BOARD_CRASHED)
        image_fail("crashed: %s", board_crash(bus_crashed(bus)));
}

void nodes_run_until_still(uint64_t most_cycles)
{
    const uint64_t end = bus_cycle(bus) + most_cycles;
    for (bool moving = true; moving;) {
        if (bus_cycle(bus) > end)
            image_fail("expected the motors to stand");
        nodes_run(50 * MS);
        moving = false;
        for (unsigned i = 0; i < node_count; i++) {
            moving = moving || node[i].moving;
            node[i].moving = false;
        }
    }
}

void nodes_clear_pulses(void)
{
    for (unsigned i = 0; i < node_count; i++)
        node[i].pulses = 0;
}

/* -- terminals ------------------------------------------------------------------------------------------------------- */

const char *node_says(unsigned which, const char *line, const char *ends)
{
    static char text[4096];
    board_t *its = node[which].board;
    const uint64_t end = bus_cycle(bus) + SECOND;
    board_uart_send_text(its, line);
    board_uart_send_text(its, "\r");
    for (;;) {
        nodes_run(MS);
        const char *seen = board_uart_text(its);
        const size_t length = strlen(seen), tail = strlen(ends);
        if (length >= tail && strcmp(seen + length - tail, ends) == 0) {
            snprintf(text, sizeof text, "%s", seen);
            board_uart_clear(its);
            return text;
        }
        if (bus_cycle(bus) > end)
            image_fail("\"%s\" at node %u: expected \"%s\", saw \"%s\"", line, which, ends, seen);
    }
}

void node_text_is(unsigned which, const char *expected)
{
    const char *seen = board_uart_text(node[which].board);
    if (strcmp(seen, expected) != 0)
        image_fail("node %u: expected \"%s\", saw \"%s\"", which, expected, seen);
    board_uart_clear(node[which].board);
}

/* -- the master ------------------------------------------------------------------------------------------------------ */

void master_begin(void)
{
    master = bus_peer(bus, BAUD);
    jammer = bus_peer(bus, BAUD);
}

size_t master_packet(uint8_t *bytes, uint8_t destination, uint8_t sequence, const char *text)
{
    size_t count = 0;
    bytes[count++] = STX;
    bytes[count++] = destination;
    bytes[count++] = MASTER;
    bytes[count++] = sequence;
    while (*text != '\0')
        bytes[count++] = (uint8_t)*text++;
    const uint8_t crc = crc8(bytes + 1, count - 1);
    bytes[count++] = ETX;
    bytes[count++] = crc;
    bytes[count++] = '\0';
    return count;
}

static void send(uint8_t destination, uint8_t sequence, const char *text)
{
    uint8_t bytes[MOST_BYTES];
    const size_t count = master_packet(bytes, destination, sequence, text);
    bus_peer_clear(master);
    bus_peer_send(master, bytes, count);
    nodes_run(count * CHARACTER);
}

/* Bytes that are not the master's own, as far as they have come. */
static size_t answered(uint8_t *bytes)
{
    size_t heard, count = 0;
    const bus_byte_t *byte = bus_peer_received(master, &heard);
    for (size_t i = 0; i < heard && count < MOST_BYTES; i++)
        if (!byte[i].echo)
            bytes[count++] = byte[i].byte;
    return count;
}

uint8_t master_sends(uint8_t destination, uint8_t sequence, const char *text)
{
    uint8_t bytes[MOST_BYTES];
    send(destination, sequence, text);
    const uint64_t end = bus_cycle(bus) + ANSWER;
    size_t count = 0, before = 0;
    while (destination != 0 && (count = answered(bytes)) == 0 && bus_cycle(bus) < end)
        nodes_run(CHARACTER / 2);
    do { /* it is over when three characters of silence have followed */
        before = count;
        nodes_run(3 * CHARACTER);
        count = answered(bytes);
    } while (count != before);
    const bool right = count >= 8 && bytes[0] == STX && bytes[1] == MASTER && bytes[2] == destination && bytes[3] == sequence &&
                       bytes[count - 3] == ETX && bytes[count - 2] == crc8(bytes + 1, count - 4) && bytes[count - 1] == '\0';
    if (!right)
        nodes_run(ANSWER); /* whatever was on the line is over */
    return right ? bytes[4] : 0;
}

void master_jams(uint64_t after_cycles, uint64_t cycles)
{
    bus_peer_hold(jammer, -1, after_cycles);
    bus_peer_hold(jammer, 0, cycles);
}
