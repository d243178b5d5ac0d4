/* The network from the bytes of one line to those of the other: cli/network, net/bus, commands_execute_remote(), and what the
 * terminal shows of them. This node is 85 unless a test says otherwise. Where a packet is built, its CRC comes from a sum of
 * the test's own. */
#include "host/network_start.h"
#include <stdio.h>
#include <string.h>
#include "queue/ops.h"
#include "queue/session.h"
#include "crc8.h"
#include "unity.h"

enum { OWN = 85, OTHER = 10, ANSWER_MS = 90 };

static uint8_t ops_played; /* since the program began: ops.c goes on from there */

static void poll_all(void)
{
    terminal_poll();
    network_poll();
    queue_poll();
    ops_poll();
    store_poll();
}

/* In rounds of 50 us, as the main loop has them. */
static void run_ms(unsigned ms)
{
    for (unsigned i = 0; i < 20 * ms; i++) {
        poll_all();
        timebase_fake_us += 50;
    }
}

static void begin(uint8_t own, uint8_t crc_mode)
{
    timebase_fake_us += 1000000;
    network_start(own, crc_mode);
    engine_fake.played = ops_played;
    run_ms(5);
    terminal_port_fake_clear();
}

void setUp(void)
{
    begin(OWN, 1);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT(0, bus_port_fake.clashes); /* NET-008 */
}

typedef struct {
    uint8_t bytes[80];
    size_t count;
} frame_t;

static frame_t frame(uint8_t destination, uint8_t origin, const char *body)
{
    const size_t length = strlen(body);
    frame_t made = {.bytes = {2, destination, origin}, .count = length + 6};
    memcpy(made.bytes + 3, body, length);
    made.bytes[3 + length] = 3;
    made.bytes[4 + length] = settings.crc_mode == 2 ? crc8(made.bytes + 1, length + 2) : crc8(made.bytes + 3, length);
    return made;
}

static void receive(uint8_t destination, uint8_t origin, const char *body)
{
    const frame_t made = frame(destination, origin, body);
    bus_port_fake_clear();
    bus_port_fake_receive(made.bytes, made.count);
    run_ms(40);
}

static void type(const char *text)
{
    bus_port_fake_clear();
    terminal_port_fake_clear();
    terminal_port_fake_type(text);
    run_ms(30);
}

static void assert_sent_bytes(const void *expected, size_t expected_count)
{
    size_t count;
    const uint8_t *sent = bus_port_fake_sent(&count);
    TEST_ASSERT_EQUAL_UINT(expected_count, count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, sent, count);
}

static void assert_sent(uint8_t destination, const char *body)
{
    const frame_t made = frame(destination, settings.device_id, body);
    assert_sent_bytes(made.bytes, made.count);
}

static void assert_silent(void)
{
    size_t count;
    (void)bus_port_fake_sent(&count);
    TEST_ASSERT_EQUAL_UINT(0, count);
}

static void assert_shown(const char *expected)
{
    TEST_ASSERT_EQUAL_STRING(expected, terminal_port_fake_text());
    terminal_port_fake_clear();
}

/* -- from the network -------------------------------------------------------------------------------------------------- */

/* NET-007, NET-014, NET-020, NET-025, NET-029 */
static void test_a_command_is_executed_and_answered_with_ack(void)
{
    static const uint8_t bytes[] = {2, 0x55, 0x0A, 0x6D, 0x33, 0x30, 0x30, 0x30, 0x61, 0x32, 0x64, 0x31, 3, 0xA7, 0};
    bus_port_fake_receive(bytes, sizeof bytes);
    run_ms(40);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(3000, engine_fake.submitted[0].count);
    assert_sent_bytes("\x02\x0A\x55\x06\x03\xDD\x00", 7);
    assert_shown("");
}

/* Decisions 0.4.2 */
static void test_a_command_that_is_refused_is_answered_with_nak(void)
{
    static const char *const lines[] = {"m200k", "hello", "m200u300", "vc", "86m200", "85m200", "/m200", "m0x"};
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        receive(OWN, OTHER, lines[i]);
        assert_sent_bytes("\x02\x0A\x55\x15\x03\xA2\x00", 7);
    }
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    assert_shown("");
}

/* NET-021, NET-024 */
static void test_a_packet_with_a_wrong_crc_is_answered_with_nak_and_not_executed(void)
{
    frame_t made = frame(OWN, OTHER, "m200");
    made.bytes[4] ^= 1;
    bus_port_fake_receive(made.bytes, made.count);
    run_ms(300);
    assert_sent(OTHER, "\x15");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    made = frame(0, OTHER, "m200");
    made.bytes[4] ^= 1;
    bus_port_fake_clear();
    bus_port_fake_receive(made.bytes, made.count);
    run_ms(40);
    assert_silent();
    TEST_ASSERT_EQUAL_UINT(2, bus_counters.wrong);
}

/* NET-022, NET-028, NET-032 */
static void test_a_packet_without_a_crc_is_executed_and_answered(void)
{
    bus_port_fake_receive("\x02\x55\x0Am200\x03", 9); /* its NUL is that of the string */
    run_ms(40);
    assert_sent(OTHER, "\x06");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
}

/* NET-011, NET-023 */
static void test_a_broadcast_is_executed_and_never_answered(void)
{
    receive(0, OTHER, "m200");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    receive(0, OTHER, "m200k");
    run_ms(200);
    assert_silent();
}

/* Decisions 0.4.4 */
static void test_a_broadcast_with_a_dollar_is_not_accepted(void)
{
    receive(OWN, OTHER, "m200");
    const unsigned stops = engine_fake.stops;
    receive(0, OTHER, "$L1");
    receive(0, OTHER, "$R");
    assert_silent();
    TEST_ASSERT_EQUAL_UINT(stops, engine_fake.stops);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.restarts);
    TEST_ASSERT_FALSE(session.flags & MOTION_LINEAR);
    TEST_ASSERT_EQUAL_UINT(2, bus_counters.discarded);
}

/* NET-012, NET-031, NET-036 */
static void test_what_is_for_others_and_what_is_no_packet_is_ignored(void)
{
    receive(86, OTHER, "m200");
    receive(86, OTHER, " hello");
    bus_port_fake_receive("m200\r\nS\r\n", 9);
    run_ms(100);
    assert_silent();
    assert_shown("");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT(0, bus_counters.good + bus_counters.wrong + bus_counters.discarded);
}

/* NET-018, NET-019, A-NET-16 */
static void test_displays_asked_for_remotely_show_nothing(void)
{
    static const char *const lines[] = {"q", "cf", "$C", "x", "cc", "cn", "p", "?", "vd", "xd", "$E", "q1"};
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        receive(OWN, OTHER, lines[i]);
        assert_sent(OTHER, "\x06");
        run_ms(100);
        assert_shown("");
    }
}

/* A program mode entered from the network is the network's own. */
static void test_the_network_has_a_mode_of_its_own(void)
{
    receive(OWN, OTHER, "qp");
    receive(OWN, OTHER, "1m777");
    type("m5\r");
    assert_shown("m5\r\nSAC>");
    receive(OWN, OTHER, "x");
    TEST_ASSERT_EQUAL_UINT32(5, engine_fake.submitted[0].count);
    TEST_ASSERT_FALSE(commands_remote());
}

/* What is being typed meanwhile is not touched. */
static void test_a_command_from_the_network_leaves_what_is_being_typed(void)
{
    type("m12");
    receive(OWN, OTHER, "m700v50");
    type("34\r");
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT32(700, engine_fake.submitted[0].count);
    TEST_ASSERT_EQUAL_UINT32(1234, engine_fake.submitted[1].count);
}

/* A-NET-13 */
static void test_the_answer_comes_a_character_after_the_packet_at_least(void)
{
    const frame_t made = frame(OWN, OTHER, "y");
    for (unsigned phase = 0; phase < 128; phase++) {
        timebase_fake_us += 1000 + phase;
        const unsigned begins = bus_port_fake.begins;
        bus_port_fake_receive(made.bytes, made.count);
        while (begins == bus_port_fake.begins) {
            poll_all();
            timebase_fake_us += 1;
        }
        const uint32_t after_us = bus_port_fake.begun_us - bus_port_fake.arrived_us;
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(BUS_PORT_FAKE_CHARACTER_US, after_us);
        TEST_ASSERT_LESS_THAN_UINT32(3 * BUS_PORT_FAKE_CHARACTER_US, after_us);
        run_ms(10);
    }
}

/* NET-008: one's own echo is nothing. */
static void test_the_echo_of_what_is_sent_is_dropped(void)
{
    bus_port_fake.echo = true;
    type("0m200\r");
    run_ms(100);
    assert_sent(0, "m200");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT(0, bus_counters.good);
}

/* The main loop may be planning when the answer's last bit leaves, and for some milliseconds more. */
static void test_a_packet_that_comes_before_the_end_of_the_answer_is_noticed_is_taken(void)
{
    for (unsigned echo = 0; echo < 2; echo++) {
        begin(OWN, 1);
        bus_port_fake.echo = echo;
        const frame_t made = frame(OWN, OTHER, "m200");
        bus_port_fake_receive(made.bytes, made.count);
        size_t sent = 0;
        while (sent != 7) {
            poll_all();
            timebase_fake_us += 50;
            (void)bus_port_fake_sent(&sent);
        }
        poll_all();
        timebase_fake_us = bus_port_fake.left_us + 3 * BUS_PORT_FAKE_CHARACTER_US;
        bus_port_fake_receive(made.bytes, made.count);
        timebase_fake_us = bus_port_fake.arrived_us + 1;
        run_ms(40);
        TEST_ASSERT_EQUAL_UINT(2, engine_fake.submitted_count);
        assert_sent_bytes("\x02\x0A\x55\x06\x03\xDD\x00\x02\x0A\x55\x06\x03\xDD\x00", 14);
        TEST_ASSERT_EQUAL_UINT(2, bus_counters.good);
    }
}

/* NET-033, A-NET-14 */
static void test_a_packet_that_stops_is_given_up_after_20_characters(void)
{
    bus_port_fake_receive("\x02\x55\x0Am2", 5);
    const uint32_t given_up_us = bus_port_fake.arrived_us + 20 * BUS_PORT_FAKE_CHARACTER_US;
    while (given_up_us - timebase_fake_us > 50) {
        poll_all();
        timebase_fake_us += 50;
    }
    TEST_ASSERT_EQUAL_UINT(0, bus_counters.discarded);
    run_ms(1);
    TEST_ASSERT_EQUAL_UINT(1, bus_counters.discarded);
    assert_silent();
    receive(OWN, OTHER, "m200");
    assert_sent(OTHER, "\x06");
}

/* NET-027, SYS-013 */
static void test_without_acknowledgements_nothing_is_answered(void)
{
    type("$K0\r");
    receive(OWN, OTHER, "m200");
    receive(OWN, OTHER, "m200k");
    assert_silent();
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    type("$K1\r");
    receive(OWN, OTHER, "m200");
    assert_sent(OTHER, "\x06");
}

/* NET-026, SYS-006 */
static void test_without_crc_none_is_sent(void)
{
    type("$H0\r");
    receive(OWN, OTHER, "m200");
    assert_sent_bytes("\x02\x0A\x55\x06\x03\x00", 6);
    type("10m5\r");
    assert_sent_bytes("\x02\x0A\x55m5\x03\x00", 7);
}

/* $R from the network: the answer goes out first. */
static void test_a_restart_is_answered_before_it_happens(void)
{
    const frame_t made = frame(OWN, OTHER, "$R");
    bus_port_fake_receive(made.bytes, made.count);
    for (unsigned i = 0; i < 2000 && engine_fake.restarts == 0; i++) {
        poll_all();
        timebase_fake_us += 50;
    }
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.restarts);
    assert_sent(OTHER, "\x06");
    TEST_ASSERT_FALSE(bus_sending());
    TEST_ASSERT_GREATER_THAN_UINT32(bus_port_fake.left_us, timebase_fake_us);
    run_ms(100);
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.restarts);
}

/* Decisions 0.3.7: a packet that is executed confirms a path on trial, one that is refused does not. */
static void test_a_command_from_the_network_confirms_a_path_on_trial(void)
{
    trial_begin(true);
    (void)trial_failed();
    receive(OWN, OTHER, "k");
    receive(86, OTHER, "p");
    TEST_ASSERT_TRUE(trial_on());
    receive(OWN, OTHER, "p");
    TEST_ASSERT_FALSE(trial_on());
}

/* -- messages ------------------------------------------------------------------------------------------------------------ */

/* NET-013, NET-034, A-NET-10; decisions 0.4.3 */
static void test_messages_are_shown_with_their_origin_and_escaped(void)
{
    receive(OWN, OTHER, " hello");
    assert_shown("\r\n10:85> hello\r\nSAC>");
    assert_sent(OTHER, "\x06");
    receive(OWN, OTHER, ".hello");
    assert_shown("\r\n10:85>.hello\r\nSAC>");
    receive(0, OTHER, " S all");
    assert_shown("\r\n10:0> S all\r\nSAC>");
    assert_silent();
    receive(OWN, 200, " \x1B[2J\r\n\x7F\xFF");
    assert_shown("\r\n200:85> \\x1B[2J\\x0D\\x0A\\x7F\\xFF\r\nSAC>");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.stops);
}

static void test_the_longest_message_of_escapes_is_shown_whole(void)
{
    char body[PACKET_BODY_BYTES + 1] = " ";
    char expected[400] = "\r\n10:85> ";
    for (unsigned i = 1; i < PACKET_BODY_BYTES; i++) {
        body[i] = '\x07';
        strcat(expected, "\\x07");
    }
    receive(OWN, OTHER, body);
    run_ms(100);
    assert_shown(strcat(expected, "\r\nSAC>"));
}

/* NET-015, NET-016, NET-017, A-NET-01, A-NET-11 */
static void test_a_slash_answers_the_origin_of_the_last_message(void)
{
    type("/m200\r");
    assert_shown("/m200\r\n?21 to whom?\r\nSAC>");
    receive(0, 11, " to all");
    TEST_ASSERT_EQUAL_UINT8(0, network_last_origin());
    receive(OWN, OTHER, " hello");
    receive(0, 11, " to all");
    receive(OWN, 12, "m200"); /* no message */
    type("/m200\r");
    assert_sent(OTHER, "m200");
    receive(OWN, OTHER, "\x06");
    type("\\ hi\r");
    assert_sent(OTHER, " hi");
    receive(OWN, OTHER, "\x06");
    receive(OWN, 200, ".you");
    type("/.me\r");
    assert_sent(200, ".me");
}

/* -- from the terminal ----------------------------------------------------------------------------------------------------- */

/* NET-007, NET-009, NET-029 */
static void test_a_line_with_an_address_goes_out_as_a_packet(void)
{
    begin(OTHER, 1);
    type("85m3000a2d1\r");
    assert_sent_bytes("\x02\x55\x0A\x6D\x33\x30\x30\x30\x61\x32\x64\x31\x03\xA7\x00", 15);
    assert_shown("85m3000a2d1\r\nSAC>");
    receive(OTHER, 85, "\x06");
    assert_shown("\r\nK\r\nSAC>");
    assert_silent(); /* A-OPS-03: an answer is not answered */
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    type("254 hello\r");
    assert_sent(254, " hello");
    receive(OTHER, 254, "\x15");
    assert_shown("254 hello\r\nSAC>\r\nNAK\r\nSAC>");
    /* A CRC of 0 */
    type("85m13\r");
    assert_sent(85, "m13 ");
}

/* A-NET-06: as it was sent by the manual's sketch */
static void test_an_answer_of_the_short_form_is_taken(void)
{
    type("10m200\r");
    terminal_port_fake_clear();
    bus_port_fake_receive("\x02\x55\x0A\x06", 4);
    run_ms(20);
    assert_shown("\r\nK\r\nSAC>");
}

static void test_no_answer_is_told_and_none_of_another_node_is_taken(void)
{
    type("10m200\r");
    terminal_port_fake_clear();
    receive(OWN, 11, "\x06");
    assert_shown("");
    run_ms(ANSWER_MS);
    assert_shown("\r\n?9 no answer\r\nSAC>");
    receive(OWN, OTHER, "\x06");
    assert_shown("");
}

/* One at a time */
static void test_the_next_line_waits_for_the_answer(void)
{
    type("10m200\r10m300\rm5\r");
    assert_sent(OTHER, "m200");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    receive(OWN, OTHER, "\x06");
    assert_sent(OTHER, "m300");
    TEST_ASSERT_EQUAL_UINT32(5, engine_fake.submitted[0].count);
}

/* NET-009, NET-011 */
static void test_a_broadcast_waits_for_no_answer(void)
{
    type("0m200\r");
    assert_sent(0, "m200");
    run_ms(ANSWER_MS);
    assert_shown("0m200\r\nSAC>");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
}

/* NET-010, A-NET-08 */
static void test_the_own_address_is_executed_here(void)
{
    type("85m300\r");
    assert_silent();
    TEST_ASSERT_EQUAL_UINT32(300, engine_fake.submitted[0].count);
    type("256m1\r");
    assert_silent();
    assert_shown("256m1\r\n?12 range 0..255\r\nSAC>");
}

/* -- soft ops ------------------------------------------------------------------------------------------------------------- */

/* OPS-004, OPS-005, OPS-006, OPS-007 */
static void test_soft_ops_are_broadcasts(void)
{
    engine_fake.played = ++ops_played;
    run_ms(20);
    assert_silent();
    type("$O1\r");
    engine_fake.played = ++ops_played;
    run_ms(20);
    assert_sent_bytes("\x02\x00\x55\x11\x03\xC3\x00\x02\x00\x55\x12\x03\x21\x00", 14);
    /* Nobody answers one, or does anything. */
    receive(0, OTHER, "\x11");
    receive(OWN, OTHER, "\x12");
    run_ms(40);
    assert_silent();
}

/* -- counters ------------------------------------------------------------------------------------------------------------- */

static void test_the_counters_are_shown_and_cleared(void)
{
    receive(OWN, OTHER, "y");
    receive(OWN, OTHER, "y");
    receive(0, OTHER, "$R");
    bus_port_fake_receive("\x02\x55\x0Ay\x03\x65\x00", 7);
    run_ms(40);
    bus_port_fake.framing_errors = 4;
    bus_port_fake.overruns = 5;
    type("cn\r");
    assert_shown("cn\r\ngood 2 CRC 1 discarded 1 repeated 0 framing 4 overrun 5\r\nSAC>");
    type("cz\r");
    type("cn\r");
    assert_shown("cn\r\ngood 0 CRC 0 discarded 0 repeated 0 framing 0 overrun 0\r\nSAC>");
}

/* -- strict packets: decisions 0.4.2 ----------------------------------------------------------------------------------------- */

static void test_a_strict_command_that_comes_again_is_answered_again_and_executed_once(void)
{
    begin(OWN, 2);
    for (unsigned i = 0; i < 3; i++) {
        receive(OWN, OTHER, "\x90m200");
        assert_sent(OTHER, "\x90\x06");
        TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    }
    TEST_ASSERT_EQUAL_UINT(2, bus_counters.resent);
    receive(OWN, OTHER, "\x91m200");
    assert_sent(OTHER, "\x91\x06");
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.submitted_count);
}

static void test_a_strict_nak_tells_the_error_again_too(void)
{
    begin(OWN, 2);
    for (unsigned i = 0; i < 2; i++) {
        receive(OWN, OTHER, "\x90m200u300");
        assert_sent(OTHER, "\x90\x15?12 range 0..255");
        receive(OWN, 11, "\x90nonsense");
        assert_sent(11, "\x90\x15?2 syntax");
    }
}

static void test_the_sequences_of_four_origins_are_remembered(void)
{
    begin(OWN, 2);
    for (unsigned round = 0; round < 3; round++) {
        for (uint8_t origin = 10; origin < 14; origin++) {
            receive(OWN, origin, "\x90m200");
            assert_sent(origin, "\x90\x06");
        }
        TEST_ASSERT_EQUAL_UINT(4, engine_fake.submitted_count);
    }
    receive(OWN, 14, "\x90m200"); /* a fifth: the one heard longest ago is forgotten */
    receive(OWN, 13, "\x90m200");
    receive(OWN, 11, "\x90m200");
    TEST_ASSERT_EQUAL_UINT(5, engine_fake.submitted_count);
    receive(OWN, 10, "\x90m200");
    TEST_ASSERT_EQUAL_UINT(6, engine_fake.submitted_count);
}

static void test_a_sequence_alone_executes_nothing_and_is_remembered(void)
{
    begin(OWN, 2);
    receive(OWN, OTHER, "\x90");
    assert_sent(OTHER, "\x90\x06");
    receive(OWN, OTHER, "\x90m200");
    assert_sent(OTHER, "\x90\x06");
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    receive(OWN, OTHER, "\x91m200");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
}

static void test_a_strict_packet_without_sequence_or_with_a_wrong_crc_is_not_answered(void)
{
    begin(OWN, 2);
    receive(OWN, OTHER, "m200");
    frame_t made = frame(OWN, OTHER, "\x90m200");
    made.bytes[5] ^= 1;
    bus_port_fake_receive(made.bytes, made.count);
    run_ms(40);
    assert_silent();
    TEST_ASSERT_EQUAL_UINT(1, bus_counters.discarded);
    TEST_ASSERT_EQUAL_UINT(1, bus_counters.wrong);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    receive(0, OTHER, "\x90m200");
    receive(0, OTHER, "\x90m200"); /* a broadcast that was sent twice on purpose */
    assert_silent();
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.submitted_count);
    receive(OWN, OTHER, "\x91 hello");
    assert_shown("\r\n10:85> hello\r\nSAC>");
}

/* A sequence alone first, whenever another node is spoken to; then every command has the next one. */
static void test_another_node_is_greeted(void)
{
    begin(OWN, 2);
    type("10m200\r");
    assert_sent(10, "\x81");
    receive(OWN, 10, "\x81\x06");
    assert_sent(10, "\x82m200");
    receive(OWN, 10, "\x82\x06");
    assert_shown("10m200\r\nSAC>\r\nK\r\nSAC>");
    type("10m300u300\r");
    assert_sent(10, "\x83m300u300");
    receive(OWN, 10, "\x82\x06"); /* the answer to the one before: not to this */
    terminal_port_fake_clear();
    receive(OWN, 10, "\x83\x15?12 range 0..255");
    assert_shown("\r\nNAK ?12 range 0..255\r\nSAC>");
    type("11m200\r");
    assert_sent(11, "\x84");
    terminal_port_fake_clear();
    run_ms(ANSWER_MS);
    assert_shown("\r\n?9 no answer\r\nSAC>");
    size_t count;
    (void)bus_port_fake_sent(&count);
    TEST_ASSERT_EQUAL_UINT(7, count); /* the line itself was not sent */
}

/* OPS-004, OPS-007 */
static void test_strict_soft_ops_have_a_sequence(void)
{
    begin(OWN, 2);
    type("$O1\r");
    engine_fake.played = ++ops_played;
    run_ms(20);
    size_t count;
    const uint8_t *sent = bus_port_fake_sent(&count);
    TEST_ASSERT_EQUAL_UINT(16, count);
    TEST_ASSERT_EQUAL_HEX8(0x11, sent[4]);
    TEST_ASSERT_EQUAL_HEX8(0x12, sent[12]);
    TEST_ASSERT_EQUAL_HEX8((uint8_t)(sent[3] + 1), sent[11]);
}

/* A broadcast of its own comes between a command and its answer, with a sequence of its own. */
static void test_a_soft_op_before_the_answer_does_not_hide_it(void)
{
    begin(OWN, 2);
    type("$O1\r");
    type("10m200\r");
    receive(OWN, 10, "\x81\x06");
    assert_sent(10, "\x82m200");
    engine_fake.played = ++ops_played;
    run_ms(20);
    terminal_port_fake_clear();
    receive(OWN, 10, "\x82\x06");
    assert_shown("\r\nK\r\nSAC>");
}

static void test_a_message_does_not_take_the_place_of_an_answer_still_to_be_printed(void)
{
    begin(OWN, 1);
    type("10m200\r");
    assert_sent(10, "m200");
    terminal_port_fake_hold(1);
    type("as long as it is"); /* the port has no room for what is owed */
    terminal_port_fake_clear();
    receive(OWN, 10, "\x06");
    receive(OWN, 10, " hello");
    assert_sent(10, "\x15");
    terminal_port_fake_hold(0);
    terminal_port_fake_drain(31);
    run_ms(5);
    assert_shown("\r\nK\r\nSAC>as long as it is");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_command_is_executed_and_answered_with_ack);
    RUN_TEST(test_a_command_that_is_refused_is_answered_with_nak);
    RUN_TEST(test_a_packet_with_a_wrong_crc_is_answered_with_nak_and_not_executed);
    RUN_TEST(test_a_packet_without_a_crc_is_executed_and_answered);
    RUN_TEST(test_a_broadcast_is_executed_and_never_answered);
    RUN_TEST(test_a_broadcast_with_a_dollar_is_not_accepted);
    RUN_TEST(test_what_is_for_others_and_what_is_no_packet_is_ignored);
    RUN_TEST(test_displays_asked_for_remotely_show_nothing);
    RUN_TEST(test_the_network_has_a_mode_of_its_own);
    RUN_TEST(test_a_command_from_the_network_leaves_what_is_being_typed);
    RUN_TEST(test_the_answer_comes_a_character_after_the_packet_at_least);
    RUN_TEST(test_the_echo_of_what_is_sent_is_dropped);
    RUN_TEST(test_a_packet_that_comes_before_the_end_of_the_answer_is_noticed_is_taken);
    RUN_TEST(test_a_packet_that_stops_is_given_up_after_20_characters);
    RUN_TEST(test_without_acknowledgements_nothing_is_answered);
    RUN_TEST(test_without_crc_none_is_sent);
    RUN_TEST(test_a_restart_is_answered_before_it_happens);
    RUN_TEST(test_a_command_from_the_network_confirms_a_path_on_trial);
    RUN_TEST(test_messages_are_shown_with_their_origin_and_escaped);
    RUN_TEST(test_the_longest_message_of_escapes_is_shown_whole);
    RUN_TEST(test_a_slash_answers_the_origin_of_the_last_message);
    RUN_TEST(test_a_line_with_an_address_goes_out_as_a_packet);
    RUN_TEST(test_an_answer_of_the_short_form_is_taken);
    RUN_TEST(test_no_answer_is_told_and_none_of_another_node_is_taken);
    RUN_TEST(test_the_next_line_waits_for_the_answer);
    RUN_TEST(test_a_broadcast_waits_for_no_answer);
    RUN_TEST(test_the_own_address_is_executed_here);
    RUN_TEST(test_soft_ops_are_broadcasts);
    RUN_TEST(test_the_counters_are_shown_and_cleared);
    RUN_TEST(test_a_strict_command_that_comes_again_is_answered_again_and_executed_once);
    RUN_TEST(test_a_strict_nak_tells_the_error_again_too);
    RUN_TEST(test_the_sequences_of_four_origins_are_remembered);
    RUN_TEST(test_a_sequence_alone_executes_nothing_and_is_remembered);
    RUN_TEST(test_a_strict_packet_without_sequence_or_with_a_wrong_crc_is_not_answered);
    RUN_TEST(test_another_node_is_greeted);
    RUN_TEST(test_strict_soft_ops_have_a_sequence);
    RUN_TEST(test_a_soft_op_before_the_answer_does_not_hide_it);
    RUN_TEST(test_a_message_does_not_take_the_place_of_an_answer_still_to_be_printed);
    return UNITY_END();
}
