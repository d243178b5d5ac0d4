/* The network on the whole image where the line is full, faulty or mad, with the motor and the terminal at work.
 *
 * SAC_PACKETS in the environment sets how many packets are exchanged while the motor cruises at 33 kHz (a tenth of them
 * at 100 kHz); make test-network-long: 100,000. */
#include "fuzz/grammar.h"
#include "image.h"
#include "master.h"
#include "net/packet.h"
#include "queue/session.h"
#include "soft_peer.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void setUp(void)
{
    srand(485);
}

void tearDown(void)
{
    image_off();
}

/* -- what a packet leaves in RAM ------------------------------------------------------------------------------------ */

#define RAM_START 0x100u
#define RAM_BYTES 0x800u

/* What may differ though nothing was executed: clocks, the port's ring and receiver, the decoder, the counters. */
static const char *const counters[] = {"timebase_overflows", "wake_flag", "soft_uart", "bus_packet", "bus_counters",
                                       "since_128us", NULL};
/* And where the packet was answered with NAK: what is owed, and how it goes out. */
static const char *const answered[] = {"answers", "put", "count", "begun_128us", "text_to", NULL};

static uint8_t ram[RAM_BYTES];

static unsigned ram_end(void)
{
    uint16_t end;
    TEST_ASSERT_TRUE(board_symbol(board, "_end", &end));
    return end - RAM_START;
}

static void keep_ram(void)
{
    for (unsigned i = 0; i < ram_end(); i++)
        ram[i] = board_peek8(board, (uint16_t)(RAM_START + i));
}

/* The linker adds .lto_priv.n to some names. */
static bool is_among(const char *symbol, const char *const *names)
{
    for (; *names != NULL; names++) {
        const size_t length = strlen(*names);
        if (strncmp(symbol, *names, length) == 0 && (symbol[length] == '\0' || symbol[length] == '.'))
            return true;
    }
    return false;
}

typedef enum { FOREIGN, BROKEN, ANSWERED } packet_kind_t;

/* Of a packet for another node the body is not kept. */
static bool may_change(const char *symbol, uint16_t offset, packet_kind_t kind)
{
    if (kind == FOREIGN && strcmp(symbol, "bus_packet") == 0)
        return offset < offsetof(packet_t, body);
    return is_among(symbol, counters) || (kind == ANSWERED && is_among(symbol, answered));
}

static void assert_ram_is_kept(const char *what, packet_kind_t kind)
{
    for (unsigned i = 0; i < ram_end(); i++) {
        const uint8_t now = board_peek8(board, (uint16_t)(RAM_START + i));
        if (now == ram[i])
            continue;
        uint16_t offset;
        const char *symbol = board_symbol_at(board, (uint16_t)(RAM_START + i), &offset);
        if (!may_change(symbol, offset, kind))
            image_fail("%s: %s + %u changed from %02X to %02X", what, symbol, offset, ram[i], now);
    }
}

static bool heard_anything(void)
{
    size_t count;
    master_heard(&count);
    return count != 0;
}

/* NET-012, NET-036: none of the 254 other addresses, whatever is in the packet; and $ to everybody */
static void test_packets_for_others_leave_nothing_in_ram(void)
{
    static const char *const bodies[] = {"$CA8", "m200v150", " hello"};
    master_boot(TERMINAL_USART, 1);
    master_ask("y");
    image_run(100 * MS);
    keep_ram();
    for (unsigned to = 255; to <= 255; to--) /* everybody last */
        for (size_t i = 0; i < (to == 0 ? 1 : sizeof bodies / sizeof bodies[0]); i++) {
            if (to == UNIT)
                continue;
            const frame_t frame = master_frame((uint8_t)to, MASTER, bodies[i]);
            master_exchange(&frame);
            char what[40];
            snprintf(what, sizeof what, "%s to %u", bodies[i], to);
            assert_ram_is_kept(what, to == 0 ? BROKEN : FOREIGN);
            if (heard_anything())
                image_fail("%s was answered", what);
        }
    image_assert_pulses(0);
    TEST_ASSERT_EQUAL_STRING("", master_shown());
}

/* The bit is sent inverted; true: it was answered. */
static bool send_with_error(const frame_t *frame, size_t bit)
{
    soft_peer_flip = bit;
    master_exchange(frame);
    image_run(2 * MS); /* what is under way is given up */
    return heard_anything();
}

/* Decisions 0.4.2 and 0.4.3, NET-033: strict packets: none with one wrong bit on the line, start and stop bits
 * included, does anything or is answered; the whole one is executed then, so none of them was taken for it. */
static void test_strict_packets_with_a_wrong_bit_leave_nothing_in_ram(void)
{
    static const char *const bodies[] = {"\x80", "\x81m20v600", "\x82$CA8", "\x83 hello", "\x84+", "\x85S", "\x86q3m7"};
    unsigned packets = 0;
    master_boot(TERMINAL_USART, 2);
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        for (unsigned to_all = 0; to_all <= 1; to_all++) {
            const frame_t frame = master_frame(to_all ? 0 : UNIT, MASTER, bodies[i]);
            image_run(100 * MS);
            image_take_text();
            image_train_clear();
            keep_ram();
            for (size_t bit = 0; bit < 10 * frame.count; bit++) {
                char what[80];
                snprintf(what, sizeof what, "%s to %u, bit %zu of byte %zu", bodies[i] + 1, frame.byte[1], bit % 10,
                         bit / 10);
                if (send_with_error(&frame, bit))
                    image_fail("%s: answered", what);
                assert_ram_is_kept(what, BROKEN);
                packets++;
            }
            image_assert_pulses(0);
            TEST_ASSERT_EQUAL_STRING("", master_shown());
            if (to_all)
                continue;
            master_exchange(&frame);
            if (!heard_anything())
                image_fail("packet %zu was not answered", i);
            image_run(400 * MS);
            image_assert_pulses(i == 1 ? 20 : i == 4 ? 1 : 0);
        }
    }
    printf("%u strict packets with a wrong bit\n", packets);
}

/* NET-021, NET-024: the manual's frames: a wrong bit anywhere but in the origin, which the CRC does not cover, and in a
 * CRC that becomes 00, which reads as none */
static void test_manual_packets_with_a_wrong_bit_are_not_executed(void)
{
    static const char *const bodies[] = {"m20v600", "$CA8", " hello", "+", "S", "q3m7"};
    unsigned naks = 0, packets = 0;
    master_boot(TERMINAL_USART, 1);
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        const frame_t frame = master_frame(UNIT, MASTER, bodies[i]);
        image_run(100 * MS);
        image_take_text();
        image_train_clear();
        keep_ram();
        for (size_t bit = 0; bit < 10 * frame.count; bit++) {
            const size_t byte = bit / 10;
            const bool in_data = bit % 10 >= 1 && bit % 10 <= 8;
            if (bit % 10 == 0 || byte == 2 || /* (a wrong start bit makes other bytes of those that follow) */
                (in_data && byte == frame.count - 2 && frame.byte[byte] == 1u << (bit % 10 - 1)))
                continue;
            char what[80];
            snprintf(what, sizeof what, "%s, bit %zu of byte %zu", bodies[i], bit % 10, byte);
            const bool nak = send_with_error(&frame, bit);
            if (nak)
                master_assert_heard("02 01 55 15 03 A2 00");
            assert_ram_is_kept(what, ANSWERED);
            naks += nak;
            packets++;
        }
        image_assert_pulses(0);
        TEST_ASSERT_EQUAL_STRING("", master_shown());
    }
    printf("%u manual packets with a wrong bit, %u answered with NAK\n", packets, naks);
}

/* Lines of all kinds, whole and damaged, as packets, to the unit and to everybody: each is answered once, with ACK or
 * NAK, or not at all, shows nothing but messages, and the unit goes on. */
static void test_any_line_as_a_packet_is_answered_once(void)
{
    static fuzz_t fuzz;
    static fuzz_line_t line;
    unsigned acks = 0, naks = 0;
    master_boot(TERMINAL_USART, 1);
    master_patience = 20 * MS; /* docs/wire-format.md, where commands are planned */
    fuzz_begin(&fuzz, 7);
    fuzz.brisk = true;
    while (acks + naks < 400) {
        char body[66];
        size_t length = 0;
        fuzz_line(&fuzz, &line);
        for (unsigned i = 0; i < line.length && length < 64; i++)
            if (line.bytes[i] != 0 && line.bytes[i] != 2 && line.bytes[i] != 3)
                body[length++] = (char)line.bytes[i];
        body[length] = '\0';
        const char first = body[0];
        if (length == 0 || first == '$' || first == ' ' || first == '.' || first == 6 || first == 0x15 || first == 0x11 ||
            first == 0x12) /* a system command may change how it is answered; messages take time; these are answers */
            continue;
        const bool to_all = rand() % 8 == 0;
        const frame_t frame = master_frame(to_all ? 0 : UNIT, MASTER, body);
        master_exchange(&frame);
        size_t count;
        const board_uart_byte_t *byte = master_heard(&count);
        if (count != (to_all ? 0 : 7))
            image_fail("%s: %zu bytes", fuzz_printable(line.bytes, line.length), count);
        if (to_all)
            continue;
        acks += byte[3].byte == 6;
        naks += byte[3].byte == 0x15;
        TEST_ASSERT_EQUAL_STRING("", master_shown());
    }
    printf("%u lines accepted, %u refused\n", acks, naks);
    TEST_ASSERT_GREATER_THAN(50, acks);
    TEST_ASSERT_GREATER_THAN(50, naks);
    master_ask("x");
    master_ask("S");
    master_assert_ack();
    image_run(100 * MS);
    image_train_clear();
    master_ask("m10v600a999d999u0");
    master_assert_ack();
    image_idle(10 * SECOND);
    image_assert_pulses(10);
}

/* -- a mad line ---------------------------------------------------------------------------------------------------------- */

static uint64_t first_pulse;

/* Without a ramp: all intervals from the first one on are the cruise's. Not kept: compared by their sum. */
static void cruise(const char *line)
{
    image_train_clear();
    master_type(line);
    master_type("\r");
    image_until_pulses(1, SECOND);
    first_pulse = train.pulse[0].cycle;
    train.keep = false;
    image_run(50 * MS);
    master_shown();
}

static void assert_cruise(uint64_t interval)
{
    if (train.interval_min != interval || train.last_rise - first_pulse != (train.count - 1) * interval)
        image_fail("expected intervals of %" PRIu64 ", saw %" PRIu64 " at least and %.4f on average over %zu", interval,
                   train.interval_min, (double)(train.last_rise - first_pulse) / (double)(train.count - 1), train.count);
}

#define MADNESS (400 * MS)

static void stuck_low(uint64_t from)
{
    soft_peer_level(0, from);
    soft_peer_level(1, from + MADNESS);
}

static void noise(uint64_t from, uint64_t longest)
{
    int level = 0;
    uint64_t at = from;
    while (at < from + MADNESS) {
        soft_peer_level(level, at);
        level ^= 1;
        at += 8 + (uint64_t)rand() % longest;
    }
    soft_peer_level(1, from + MADNESS + longest);
}

/* Without a pattern: random bytes. */
static void babble(unsigned terminal, uint64_t from, const char *pattern, size_t length)
{
    static uint8_t bytes[MADNESS / LINE_BYTE];
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)(length ? pattern[i % length] : rand());
    if (terminal == TERMINAL_USART)
        soft_peer_send(bytes, sizeof bytes, from, 16e6 / BAUD);
    else
        board_uart_send(board, bytes, sizeof bytes);
}

static void framing_errors(void)
{
    for (unsigned i = 0; i < MADNESS / LINE_BYTE / 2; i++)
        board_uart_send_bad(board, (uint8_t)rand());
}

/* False: there is no more. */
static bool go_mad(unsigned terminal, unsigned how)
{
    static const char forever[] = "\x02\x55\x01m2", wrong[] = "\x02\x55\x01m200\x03\xFF", stx[] = "\x02", zero[] = "";
    const uint64_t from = board_cycle(board) + 100;
    switch (how) {
    case 0: babble(terminal, from, NULL, 0); return true;
    case 1: babble(terminal, from, forever, sizeof forever - 1); return true;
    case 2: babble(terminal, from, wrong, sizeof wrong); return true; /* its NUL is the string's */
    case 3: babble(terminal, from, stx, 1); return true;
    case 4: babble(terminal, from, zero, 1); return true;
    }
    if (terminal == TERMINAL_SOFT) {
        if (how == 5)
            framing_errors();
        return how == 5;
    }
    switch (how) {
    case 5: stuck_low(from); return true;
    case 6: noise(from, 16 * US); return true;
    case 7: noise(from, 60 * US); return true;
    case 8: noise(from, 300 * US); return true;
    case 9: noise(from, 2000 * US); return true;
    }
    return false;
}

static const char *const good_body[] = {NULL, "y", "\x80"}, *const good_answer[] = {NULL, "02 01 55 06 03 DD 00",
                                                                                   "02 01 55 80 06 03 33 00"};

static void mad_line(unsigned terminal, unsigned crc_mode)
{
    master_boot(terminal, crc_mode);
    const frame_t good = master_frame(UNIT, MASTER, good_body[crc_mode]);
    cruise("m9000000vc30a999d999");
    memset(&master_measures, 0, sizeof master_measures);
    for (unsigned how = 0; go_mad(terminal, how); how++) {
        master_clear();
        image_run(MADNESS + 3 * MS);
        heard_anything(); /* checks Tx En; a NAK may have found a silence */
        image_run(3 * MS + 20 * LINE_BYTE);
        master_shown(); /* noise may have been a message */
        master_exchange(&good);
        master_assert_heard(good_answer[crc_mode]);
        assert_cruise(30 * US);
    }
    printf("Tx En was high for %.2f ms at most\n", (double)master_measures.enabled_max / MS);
    if (master_measures.enabled_max > 72 * LINE_BYTE)
        image_fail("expected no more than the longest packet");
}

/* NET-033, PIN-016: pulses stay where they are, the line is never held longer than by the longest packet, and the first
 * packet after 20 characters of silence is taken */
static void test_a_mad_line_moves_no_pulse_and_is_forgotten_when_it_is_silent(void)
{
    mad_line(TERMINAL_USART, 1);
    mad_line(TERMINAL_USART, 2);
    mad_line(TERMINAL_SOFT, 1);
}

/* -- a full line ------------------------------------------------------------------------------------------------------------- */

static unsigned packets_wanted(void)
{
    const char *wanted = getenv("SAC_PACKETS");
    return wanted ? (unsigned)strtoul(wanted, NULL, 10) : 300;
}

/* The terminal is written and read all the time: line and answer, again and again. */
static const char *const lines[] = {"Uvwxyz0123456789", "?", "Unknown to everybody, but a line of many characters"};
enum { LINES = sizeof lines / sizeof lines[0] };
static char expected[LINES][8192];
static size_t line_typed;
static unsigned lines_answered;
static uint64_t answer_max; /* from a packet to the first byte of its answer */

static const char *ask(const char *line)
{
    master_shown();
    master_type(line);
    master_type("\r");
    image_run(SECOND);
    return master_shown();
}

static void learn_the_answers(void)
{
    for (size_t i = 0; i < LINES; i++) {
        snprintf(expected[i], sizeof expected[i], "%s", ask(lines[i]));
        image_assert_holds(expected[i], i == 1 ? "network counters" : "?1 unknown command\r\nSAC>");
    }
}

static void type_next(void)
{
    line_typed = (line_typed + 1) % LINES;
    master_shown();
    master_begin_line(lines[line_typed]);
}

static void run_with_the_terminal(uint64_t until)
{
    while (board_cycle(board) < until) {
        image_run(until - board_cycle(board) < 500 * US ? until - board_cycle(board) : 500 * US);
        const char *seen = master_text();
        if (strlen(seen) < strlen(expected[line_typed]))
            continue;
        if (strcmp(seen, expected[line_typed]) != 0)
            image_fail("expected \"%s\" at the terminal, saw \"%s\"", expected[line_typed], seen);
        lines_answered++;
        type_next();
    }
}

static void run_until_a_line_is_answered(void)
{
    const unsigned before = lines_answered;
    const uint64_t until = board_cycle(board) + 10 * SECOND;
    while (lines_answered == before) {
        if (board_cycle(board) > until)
            image_fail("\"%s\" was not answered, the terminal shows \"%s\"", lines[line_typed], master_text());
        run_with_the_terminal(board_cycle(board) + MS);
    }
}

static uint16_t address_of(const char *symbol)
{
    uint16_t address = 0;
    TEST_ASSERT_TRUE(board_symbol(board, symbol, &address));
    return address;
}

/* One to three packets back to back, the last one to the unit alone; each sets a value of its own. Its answer is waited
 * for; then three characters of silence. */
static unsigned exchange_group(void)
{
    static unsigned round;
    const unsigned count = 1 + (unsigned)rand() % 3;
    const unsigned value[3] = {1 + (unsigned)rand() % 99, 1 + (unsigned)rand() % 99, 1 + (unsigned)rand() % 10000};
    const uint16_t session_at = address_of("session"), counters_at = address_of("bus_counters");
    const uint16_t good = board_peek16(board, counters_at);
    master_clear();
    for (unsigned i = 0; i < count; i++) {
        char body[20];
        snprintf(body, sizeof body, "%c%u", "adv"[i], value[i]);
        const frame_t frame = master_frame(i + 1 < count ? 0 : UNIT, MASTER, body);
        master_send(&frame);
    }
    const uint64_t end = master_sent_at();
    run_with_the_terminal(end);
    uint64_t answered_at = 0;
    while (answered_at == 0) { /* Tx En has risen and fallen */
        run_with_the_terminal(board_cycle(board) + 100 * US);
        size_t edges;
        const board_edge_t *edge = soft_peer_tx_en(&edges);
        if (edges == 2)
            answered_at = edge[1].cycle;
        if (board_cycle(board) > end + 20 * MS)
            image_fail("packet group %u was not answered at cycle %" PRIu64, round, end);
    }
    master_assert_ack();
    size_t bytes;
    const uint64_t after = master_heard(&bytes)[0].start_cycle - end;
    if (after > answer_max)
        answer_max = after;
    TEST_ASSERT_EQUAL_UINT16(count, (uint16_t)(board_peek16(board, counters_at) - good));
    const uint16_t at[3] = {(uint16_t)(session_at + offsetof(session_t, accel)),
                            (uint16_t)(session_at + offsetof(session_t, decel)),
                            (uint16_t)(session_at + offsetof(session_t, velocity))};
    for (unsigned i = 0; i < count; i++) {
        const uint32_t seen = i < 2 ? board_peek16(board, at[i]) : board_peek32(board, at[i]);
        if (seen != (i < 2 ? 100 * value[i] : value[i]))
            image_fail("packet %u of %u in group %u set %" PRIu32 ", not %u; the terminal has shown \"%s\"", i, count, round, seen, value[i], master_text());
    }
    const uint64_t next = answered_at + 3 * LINE_BYTE;
    if (board_cycle(board) < next)
        run_with_the_terminal(next);
    round++;
    return count;
}

static void assert_nothing_was_lost(void)
{
    const char *shown = ask("cn");
    unsigned good, errors[5];
    TEST_ASSERT_EQUAL(6, sscanf(shown, "cn good %u CRC %u discarded %u repeated %u framing %u overrun %u", &good, errors,
                                errors + 1, errors + 2, errors + 3, errors + 4));
    for (unsigned i = 0; i < 5; i++)
        if (errors[i] != 0)
            image_fail("expected no error, saw %s", shown);
    TEST_ASSERT_EQUAL_UINT32(0, board_uart_overruns(board));
}

/* Until so many packets are through; then the terminal falls silent. */
static void exchange_many(unsigned wanted)
{
    unsigned packets = 0;
    lines_answered = 0;
    answer_max = 0;
    type_next();
    while (packets < wanted)
        packets += exchange_group();
    run_until_a_line_is_answered();
    image_run(SECOND); /* for the line that has been begun */
    printf("%u packets, %u lines at the terminal, answers up to %.1f ms after the packet\n", packets, lines_answered,
           (double)answer_max / MS);
}

static void cruise_with_packets(unsigned terminal, const char *line, uint64_t interval, unsigned packets)
{
    master_boot(terminal, 1);
    learn_the_answers();
    cruise(line);
    exchange_many(packets);
    assert_cruise(interval);
    assert_nothing_was_lost();
    TEST_ASSERT_EQUAL(CRUISE, image_peek("motion_state"));
}

/* NET-004, NET-020, NET-033: none lost, none wrong, and no cycle of jitter */
static void test_no_packet_is_lost_while_the_motor_cruises_at_33_khz(void)
{
    cruise_with_packets(TERMINAL_USART, "m4000000000vc30a999d999", 30 * US, packets_wanted());
}

/* NET-003: the roles exchanged */
static void test_no_packet_is_lost_at_the_hardware_port(void)
{
    cruise_with_packets(TERMINAL_SOFT, "m4000000000vc30a999d999", 30 * US, packets_wanted() / 3);
}

static void test_no_packet_is_lost_while_the_motor_cruises_at_100_khz(void)
{
    cruise_with_packets(TERMINAL_USART, "m4000000000vc10a999d999", 10 * US, packets_wanted() / 10);
}

/* How often the tests with ramps are made. */
static unsigned rounds_wanted(void)
{
    return packets_wanted() < 1000 ? 1 : packets_wanted() / 1000;
}

/* The planner at work: each group of packets is motion, executed as it comes */
static void test_no_command_is_lost_or_doubled_while_commands_are_planned(void)
{
    static const char *const moves[] = {"m37vc30a998d998l1", "m-61v600a5d7l0", "m23vc400a10d999l1"};
    static const unsigned pulses[] = {37, 61, 23};
    size_t expected_pulses = 0;
    master_boot(TERMINAL_USART, 1);
    learn_the_answers();
    image_train_clear();
    type_next();
    for (unsigned group = 0; group < 60 * rounds_wanted(); group++) {
        master_clear();
        for (unsigned i = 0; i < 3; i++) {
            const unsigned which = (unsigned)rand() % 3;
            const frame_t frame = master_frame(i < 2 ? 0 : UNIT, MASTER, moves[which]);
            master_send(&frame); /* back to back */
            expected_pulses += pulses[which];
        }
        run_with_the_terminal(master_sent_at() + 20 * MS);
        master_assert_ack();
        do /* never 30 pending */
            run_with_the_terminal(board_cycle(board) + (unsigned)rand() % 20 * MS);
        while (train.count + 400 < expected_pulses);
    }
    image_idle(60 * SECOND);
    image_run(SECOND);
    image_take_text();
    image_assert_pulses(expected_pulses);
    assert_nothing_was_lost();
}

/* Ramps to 33 kHz, linear, and to 20 kHz, harmonic: each pulse where it is on a silent line. With the harmonic ones to
 * 33 kHz the planner has no time to spare (docs/benchmark.md): a pulse may come late there, and none is lost. */
static void test_no_packet_is_lost_and_no_pulse_is_moved_in_ramps(void)
{
    static const struct {
        const char *line;
        bool to_the_cycle;
    } moves[] = {{"m40000vc30a998d998l1", true}, {"m10000vc50a10d10l0", true}, {"m10000vc30a10d10l0", false}};
    enum { MOVES = sizeof moves / sizeof moves[0] };
    static pulse_t silent[40000];
    for (size_t i = 0; i < rounds_wanted() * MOVES; i++) {
        const char *move = moves[i % MOVES].line;
        master_boot(i / MOVES % 2 ? TERMINAL_SOFT : TERMINAL_USART, 1);
        learn_the_answers();
        image_train_clear();
        master_ask(move);
        image_idle(60 * SECOND);
        TEST_ASSERT_LESS_OR_EQUAL(sizeof silent / sizeof silent[0], train.count);
        const size_t count = train.count;
        memcpy(silent, train.pulse, count * sizeof *silent);
        image_train_clear();
        master_ask(move);
        image_run(50 * MS);
        unsigned packets = 0;
        type_next();
        while (image_peek("motion_state") != STANDBY)
            packets += exchange_group();
        image_run(SECOND);
        image_take_text();
        image_assert_pulses(count);
        for (size_t k = 0; moves[i % MOVES].to_the_cycle && k < count; k++)
            if (train.pulse[k].cycle - train.pulse[0].cycle != silent[k].cycle - silent[0].cycle)
                image_fail("%s: pulse %zu was moved", move, k);
        printf("%s: %u packets\n", move, packets);
        assert_nothing_was_lost();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_packets_for_others_leave_nothing_in_ram);
    RUN_TEST(test_strict_packets_with_a_wrong_bit_leave_nothing_in_ram);
    RUN_TEST(test_manual_packets_with_a_wrong_bit_are_not_executed);
    RUN_TEST(test_any_line_as_a_packet_is_answered_once);
    RUN_TEST(test_a_mad_line_moves_no_pulse_and_is_forgotten_when_it_is_silent);
    RUN_TEST(test_no_packet_is_lost_while_the_motor_cruises_at_33_khz);
    RUN_TEST(test_no_packet_is_lost_while_the_motor_cruises_at_100_khz);
    RUN_TEST(test_no_packet_is_lost_at_the_hardware_port);
    RUN_TEST(test_no_command_is_lost_or_doubled_while_commands_are_planned);
    RUN_TEST(test_no_packet_is_lost_and_no_pulse_is_moved_in_ramps);
    return UNITY_END();
}
