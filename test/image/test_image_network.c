/* The network on the whole image: a master on the RS485 line, a user at the terminal of the other port.
 *
 * The exact bytes are those of docs/wire-format.md and of annex C of the requirements. Every packet that the unit sends
 * is checked against Tx En (master.c). */
#include "image.h"
#include "master.h"
#include "soft_peer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SECONDS_10 (10 * SECOND)

void setUp(void)
{
    master_boot(TERMINAL_USART, 1);
    image_take_text();
}

void tearDown(void)
{
    image_off();
}

static void ask_hex(const char *bytes)
{
    const frame_t frame = master_hex(bytes);
    master_exchange(&frame);
}

static void ask_from(uint8_t destination, uint8_t origin, const char *body)
{
    const frame_t frame = master_frame(destination, origin, body);
    master_exchange(&frame);
}

static void assert_shown(const char *expected)
{
    const char *seen = master_shown();
    if (strcmp(seen, expected) != 0)
        image_fail("expected \"%s\" at the terminal, saw \"%s\"", expected, seen);
}

/* -- commands -------------------------------------------------------------------------------------------------------- */

static pulse_t kept[20000];
static size_t kept_count;

static void keep_train(void)
{
    kept_count = train.count;
    TEST_ASSERT_LESS_THAN(sizeof kept / sizeof kept[0], kept_count);
    memcpy(kept, train.pulse, kept_count * sizeof *kept);
}

static void assert_train_is_kept(const char *what)
{
    if (train.count != kept_count)
        image_fail("%s: expected %zu pulses, saw %zu", what, kept_count, train.count);
    for (size_t i = 0; i < kept_count; i++)
        if (train.pulse[i].dir != kept[i].dir ||
            train.pulse[i].cycle - train.pulse[0].cycle != kept[i].cycle - kept[0].cycle)
            image_fail("%s: pulse %zu differs", what, i);
}

static const char *const moves[] = {"m200v150a1d1l0", "m-500v300a10d10l1", "m100vc1000a999d999l0", "m-20v600a5d0.5u7"};

/* NET-001, NET-002, NET-003, NET-007, NET-010, NET-014, NET-020: whichever port is the line, at both rates of the
 * factory: the same pulses as if typed, to the cycle, and nothing at the terminal */
static void test_a_command_from_the_line_makes_the_pulses_of_a_typed_one(void)
{
    for (size_t i = 0; i < sizeof moves / sizeof moves[0]; i++) {
        master_boot(TERMINAL_USART, 1);
        image_do(moves[i]);
        image_idle(SECONDS_10);
        TEST_ASSERT_GREATER_THAN(0, train.count);
        keep_train();
        for (unsigned terminal = TERMINAL_USART; terminal <= TERMINAL_SOFT; terminal++) {
            master_boot(terminal, 1);
            master_ask(moves[i]);
            master_assert_ack();
            image_idle(SECONDS_10);
            assert_train_is_kept(moves[i]);
            assert_shown("");
        }
    }
}

/* Single pulses */
static void test_single_pulses_come_from_the_line_too(void)
{
    master_ask("+");
    master_assert_ack();
    master_ask("-");
    image_run(10 * MS);
    image_assert_pulses(2);
    TEST_ASSERT_EQUAL(0, train.position);
}

typedef struct {
    const char *asked, *answered;
    size_t pulses;
} exchange_t;

static void assert_exchanges(const exchange_t *e, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        image_train_clear();
        ask_hex(e[i].asked);
        master_assert_heard(e[i].answered);
        image_idle(SECONDS_10);
        if (train.count != e[i].pulses)
            image_fail("%s: expected %zu pulses, saw %zu", e[i].asked, e[i].pulses, train.count);
    }
    image_take_text();
}
#define ASSERT_EXCHANGES(...)                                        \
    do {                                                             \
        const exchange_t e_[] = {__VA_ARGS__};                       \
        assert_exchanges(e_, sizeof e_ / sizeof e_[0]);              \
    } while (0)

#define ACK "02 0A 55 06 03 DD 00"
#define NAK "02 0A 55 15 03 A2 00"

/* NET-007, NET-020..NET-025, NET-028, NET-029, NET-032, and decisions 0.4.2: what is refused is answered with NAK */
static void test_manual_frames_byte_for_byte(void)
{
    for (unsigned terminal = TERMINAL_USART; terminal <= TERMINAL_SOFT; terminal++) {
        master_boot(terminal, 1);
        ASSERT_EXCHANGES({"02 55 0A 6D 33 30 30 30 61 32 64 31 03 A7 00", ACK, 3000},
                         {"02 55 0A 6D 33 30 30 30 61 32 64 31 03 A6 00", NAK, 0}, /* a wrong CRC */
                         {"02 55 0A 6D 33 30 30 31 61 32 64 31 03 A7 00", NAK, 0}, /* a wrong body */
                         {"02 55 0A 6D 32 30 30 03 00", ACK, 200},                 /* m200 without a CRC */
                         {"02 55 0A 6D 31 33 20 03 23 00", ACK, 13},               /* a CRC of 0 avoided by a space */
                         {"02 55 0A 6D 31 33 03 00 00", ACK, 13},                  /* and not: it reads as none */
                         {"02 55 0A 6D 31 33 32 03 02 00", ACK, 132},              /* CRC as STX, as ETX */
                         {"02 55 0A 6D 33 34 39 03 03 00", ACK, 349},
                         {"02 55 0A 6D 32 30 30 6B 03 00", NAK, 0}, /* m200k */
                         {"02 00 0A 6D 32 30 30 03 00", "", 200},   /* to everybody: no answer */
                         {"02 00 0A 6D 32 30 30 6B 03 00", "", 0},
                         {"02 00 0A 6D 33 30 30 31 61 32 64 31 03 A7 00", "", 0},
                         {"02 55 0A 06 03 DD 00", "", 0}, /* ACK, NAK and soft ops of others are not answered */
                         {"02 55 0A 15 03 A2 00", "", 0}, {"02 00 0A 11 03 C3 00", "", 0},
                         {"02 55 02 79 03 64 00", "02 02 55 06 03 DD 00", 0}, /* origins 2 and 3 are read by position */
                         {"02 55 03 79 03 64 00", "02 03 55 06 03 DD 00", 0});
    }
}

/* NET-026, NET-028: k = 0 sends without a CRC, and checks one that is there */
static void test_without_crc_byte_for_byte(void)
{
    master_boot(TERMINAL_USART, 0);
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", "02 0A 55 06 03 00", 200},
                     {"02 55 0A 6D 33 30 30 30 61 32 64 31 03 A7 00", "02 0A 55 06 03 00", 3000},
                     {"02 55 0A 6D 33 30 30 30 61 32 64 31 03 A6 00", "02 0A 55 15 03 00", 0},
                     {"02 55 0A 6D 32 30 30 6B 03 00", "02 0A 55 15 03 00", 0});
    /* for the session, with k = 1 */
    master_boot(TERMINAL_USART, 1);
    image_do("$H0");
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", "02 0A 55 06 03 00", 200});
    image_do("$H");
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", ACK, 200});
}

/* NET-027 */
static void test_without_acknowledgements_the_line_is_silent(void)
{
    image_do("$K0");
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", "", 200}, {"02 55 0A 6D 32 30 30 6B 03 00", "", 0},
                     {"02 55 0A 6D 33 30 30 31 61 32 64 31 03 A7 00", "", 0});
    image_do("$K1");
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", ACK, 200});
    image_off();
    image_power_on();
    IMAGE_SET(acknowledge, 0);
    master_begin(TERMINAL_USART, 1);
    image_prompt();
    ASSERT_EXCHANGES({"02 55 0A 6D 32 30 30 03 00", "", 200});
}

/* Decisions 0.4.2: the same bytes again get the same answer, and the motor moves once */
static void test_strict_frames_byte_for_byte_and_exactly_once(void)
{
    master_boot(TERMINAL_USART, 2);
    ASSERT_EXCHANGES({"02 55 01 80 03 06 00", "02 01 55 80 06 03 33 00", 0},
                     {"02 55 01 81 6D 32 30 30 76 31 35 30 03 15 00", "02 01 55 81 06 03 F7 00", 200},
                     {"02 55 01 81 6D 32 30 30 76 31 35 30 03 15 00", "02 01 55 81 06 03 F7 00", 0},
                     {"02 55 01 81 6D 32 30 30 76 31 35 30 03 15 00", "02 01 55 81 06 03 F7 00", 0},
                     {"02 55 01 82 6D 32 30 30 76 30 03 72 00",
                      "02 01 55 82 15 3F 38 20 76 65 6C 6F 63 69 74 79 20 30 03 01 00", 0},
                     {"02 55 01 82 6D 32 30 30 76 30 03 72 00",
                      "02 01 55 82 15 3F 38 20 76 65 6C 6F 63 69 74 79 20 30 03 01 00", 0},
                     {"02 55 01 82 6D 32 30 30 76 30 03 73 00", "", 0}, /* a wrong CRC */
                     {"02 55 01 6D 32 30 30 03 00", "", 0},             /* none, no sequence */
                     {"02 55 0A 6D 33 30 30 30 61 32 64 31 03 A7 00", "", 0});
    for (unsigned i = 0; i < 3; i++) { /* a broadcast may be sent several times on purpose */
        image_train_clear();
        ask_from(0, MASTER, "\x83m50v500");
        master_assert_heard("");
        image_idle(SECONDS_10);
        image_assert_pulses(i == 0 ? 50 : 0);
    }
    /* four origins are remembered: the fifth displaces the one heard longest ago */
    image_train_clear();
    for (uint8_t round = 0; round < 2; round++)
        for (uint8_t origin = 10; origin < 14; origin++)
            ask_from(UNIT, origin, "\x90m10v500");
    image_idle(SECONDS_10);
    image_assert_pulses(4 * 10);
}

/* -- Tx En ------------------------------------------------------------------------------------------------------------ */

/* PIN-016, PIN-017, NET-004, NET-008, A-NET-13: at both ports; master.c has checked each byte of each answer */
static void test_tx_en_covers_the_answers_and_no_more(void)
{
    for (unsigned terminal = TERMINAL_USART; terminal <= TERMINAL_SOFT; terminal++) {
        static const char *const answers[] = {"02 01 55 06 03 DD 00", "02 01 55 15 03 A2 00"};
        master_boot(terminal, 1);
        memset(&master_measures, 0, sizeof master_measures);
        for (unsigned i = 0; i < 60; i++) {
            image_run(i * 137); /* another phase of the clock that the silence is measured with */
            master_ask(i % 2 ? "nonsense" : "y");
            master_assert_heard(answers[i % 2]);
        }
        master_ask("m90000vc30a999d999l0"); /* the same at 33 kHz */
        for (unsigned i = 0; i < 60; i++) {
            image_run(i * 137);
            master_ask("y");
            master_assert_heard(answers[0]);
        }
        printf("%s port: Tx En rises %.0f to %.0f us before the start bit, falls up to %.1f us after the stop bit; "
               "answers begin %.0f to %.0f us after the packet\n",
               terminal == TERMINAL_USART ? "software" : "hardware", (double)master_measures.rise_min / US,
               (double)master_measures.rise_max / US, (double)master_measures.fall_max / US,
               (double)master_measures.answer_min / US, (double)master_measures.answer_max / US);
        if (master_measures.rise_max > 2 * LINE_BYTE || master_measures.answer_max > 2 * MS)
            image_fail("Tx En or the answer came too early or too late");
    }
}

/* NET-006, PIN-016, PIN-017: the ends of what n and m may be, and the motor at 33 kHz */
static void test_packets_at_every_rate(void)
{
    static const struct {
        unsigned terminal;
        uint32_t baud;
    } rates[] = {{TERMINAL_USART, 300},  {TERMINAL_USART, 9600},  {TERMINAL_USART, 19200},  {TERMINAL_SOFT, 300},
                 {TERMINAL_SOFT, 250000}, {TERMINAL_SOFT, 500000}, {TERMINAL_SOFT, 1000000}, {TERMINAL_SOFT, 2000000}};
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++) {
        image_off();
        image_power_on();
        master_begin_at(rates[i].terminal, 1, rates[i].baud);
        image_run(3 * SECOND / 2);
        image_train_clear();
        for (unsigned n = 0; n < (rates[i].baud == 300 ? 2 : 20); n++) {
            master_ask(n % 2 ? "m10vc30a999d999" : "m10vc30a999d999k");
            master_assert_heard(n % 2 ? "02 01 55 06 03 DD 00" : "02 01 55 15 03 A2 00");
        }
        image_idle(SECONDS_10);
        image_assert_pulses(rates[i].baud == 300 ? 10 : 100);
        if (rates[i].baud > 250000)
            continue;
        image_train_clear();
        master_ask("m900000vc30a999d999");
        for (unsigned n = 0; n < (rates[i].baud == 300 ? 2 : 20); n++) {
            master_ask("y");
            master_assert_ack();
        }
        image_assert_intervals(0, train.count - 1, 30 * US, 0);
    }
}

/* PIN-016, PIN-017: the longest line, longer than the port's ring, as one packet without a gap, at 33 kHz too */
static void test_the_longest_packet_goes_out_without_a_gap(void)
{
    char line[65];
    snprintf(line, sizeof line, "7 %062d", 4711);
    for (unsigned terminal = TERMINAL_USART; terminal <= TERMINAL_SOFT; terminal++) {
        master_boot(terminal, 1);
        for (unsigned i = 0; i < 2; i++) {
            const frame_t expected = master_frame(7, UNIT, line + 1);
            master_type(line);
            master_clear();
            master_type("\r");
            image_run(50 * MS);
            size_t count;
            const board_uart_byte_t *byte = master_heard(&count);
            TEST_ASSERT_EQUAL(expected.count, count);
            for (size_t k = 0; k < count; k++) {
                TEST_ASSERT_EQUAL_HEX8(expected.byte[k], byte[k].byte);
                if (k && byte[k].start_cycle > byte[k - 1].end_cycle + 100)
                    image_fail("a gap in front of byte %zu", k);
            }
            image_run(100 * MS);
            master_ask("m90000vc30a999d999l0");
        }
    }
}

/* NET-018, NET-035, MAX-006: packets of the network are answers, soft ops and what is typed: nothing else makes one */
static void test_without_a_packet_the_line_is_silent(void)
{
    master_clear();
    image_do("m100v300");
    image_do("m100v300");
    image_idle(SECONDS_10);
    image_display("q");
    image_display("cf");
    image_do("$CA8");
    image_refused("m200k", "?2 syntax");
    image_do("S");
    image_run(SECOND);
    master_assert_heard("");
    size_t edges;
    soft_peer_tx_en(&edges);
    TEST_ASSERT_EQUAL(0, edges);
}

/* -- addresses ---------------------------------------------------------------------------------------------------------- */

/* NET-012, NET-018, NET-036 */
static void test_packets_for_others_are_ignored_silently(void)
{
    static const uint8_t others[] = {1, 2, 3, 4, 84, 86, 255};
    for (size_t i = 0; i < sizeof others; i++) {
        ask_from(others[i], MASTER, "m200");
        master_assert_heard("");
        ask_from(others[i], MASTER, " hello");
        master_assert_heard("");
    }
    image_run(100 * MS);
    image_assert_pulses(0);
    assert_shown("");
}

/* NET-030: each address that d_id may have */
static void test_a_unit_answers_at_any_of_252_addresses(void)
{
    for (unsigned id = 4; id <= 255; id++) {
        IMAGE_SET(device_id, id);
        char expected[40];
        snprintf(expected, sizeof expected, "02 01 %02X 06 03 DD 00", id);
        ask_from((uint8_t)id, MASTER, "y");
        master_assert_heard(expected);
        ask_from((uint8_t)(id - 1), MASTER, "y");
        master_assert_heard("");
    }
}

/* NET-011, NET-023 */
static void test_a_general_call_is_executed_and_never_answered(void)
{
    ask_from(0, MASTER, "m200v300");
    master_assert_heard("");
    image_idle(SECONDS_10);
    image_assert_pulses(200);
}

/* SYN-003 */
static void test_y_releases_a_start_that_waits_for_sync(void)
{
    for (unsigned i = 0; i < 2; i++) {
        image_train_clear();
        image_do("m200v300s");
        image_assert_no_pulse_for(SECOND);
        ask_hex(i ? "02 00 01 79 03 64 00" : "02 55 01 79 03 64 00");
        master_assert_heard(i ? "" : "02 01 55 06 03 DD 00");
        image_idle(SECONDS_10);
        image_assert_pulses(200);
        const double after = (double)train.pulse[0].cycle - (double)master_sent_at();
        printf("first pulse %.0f us after y %s\n", after / US, i ? "to everybody" : "to the unit");
        if (after < 0 || after > (double)MS)
            image_fail("expected the first pulse within a millisecond of y");
    }
}

/* STO-007 */
static void test_s_stops_at_once_and_with_grace(void)
{
    image_do("m90000v300a1d1l0");
    image_until_pulses(1000, SECONDS_10);
    ask_hex("02 55 01 53 03 39 00");
    master_assert_ack();
    image_assert_no_pulse_for(SECOND);
    image_do("m90000v300a10d10l0");
    image_until_pulses(2000, SECONDS_10);
    image_trace(true);
    master_ask("s");
    master_assert_ack();
    image_idle(SECONDS_10);
    image_assert_states("CDP0");
    image_trace(false);
    image_do("m90000v300a1d1l0");
    image_until_pulses(train.count + 1000, SECONDS_10);
    ask_from(0, MASTER, "S");
    image_assert_no_pulse_for(SECOND);
}

/* SYS-012 */
static void test_system_commands_come_from_the_line(void)
{
    master_ask("$CA8");
    master_assert_ack();
    image_run(100 * MS);
    image_assert_holds(image_display("$E"), "A 8\r\n");
    master_ask("$O1");
    image_assert_holds(image_display("cf"), "soft_ops on");
    master_ask("$O0");
    image_assert_holds(image_display("cf"), "soft_ops off");
    master_ask("$CA99999999999");
    master_assert_heard("02 01 55 15 03 A2 00");
    /* The answer first, the restart behind it. */
    master_ask("$R");
    master_assert_ack();
    image_run(SECOND);
    TEST_ASSERT_EQUAL(8, image_peek("settings")); /* autorun is its first member */
    master_ask("y");
    master_assert_ack();
}

/* Decisions 0.4.4 */
static void test_a_system_command_to_everybody_does_nothing(void)
{
    static const char *const bodies[] = {"$CA8", "$O1", "$R", "$K0", "$"};
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        ask_from(0, MASTER, bodies[i]);
        master_assert_heard("");
    }
    image_run(100 * MS);
    image_assert_holds(image_display("$E"), "A 0\r\n");
    image_assert_holds(image_display("cf"), "soft_ops off");
    image_assert_holds(image_display("cn"), "discarded 5");
    master_ask("y");
    master_assert_ack();
}

/* NET-019, TRM-015 */
static void test_displays_asked_for_over_the_line_are_given_to_nobody(void)
{
    static const char *const bodies[] = {"q", "cf", "$C", "x", "cc", "cn", "p", "?", "vd", "xd", "$E", "q1"};
    for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; i++) {
        master_ask(bodies[i]);
        master_assert_ack();
        master_clear();
        image_run(200 * MS);
        master_assert_heard("");
        assert_shown("");
    }
}

/* BOO-004: a unit with a configuration of its own, ESC three times as such and in a packet */
static void test_the_window_after_power_on_does_not_hear_the_line(void)
{
    image_do("$CA8");
    image_run(SECOND);
    uint8_t eeprom[BOARD_EEPROM_BYTES];
    memcpy(eeprom, board_eeprom(board), sizeof eeprom);
    for (unsigned typed = 0; typed <= 1; typed++) {
        image_off();
        image_power_on_with(eeprom);
        master_begin(TERMINAL_USART, 1);
        image_run(100 * MS);
        if (typed) { /* that it would have been heard at the terminal */
            image_send("\x1B\x1B\x1B");
        } else {
            ask_hex("1B 1B 1B");
            ask_from(UNIT, MASTER, "\x1B\x1B\x1B");
            ask_from(0, MASTER, "\x1B\x1B\x1B");
            master_assert_heard("");
        }
        image_run(2 * SECOND);
        master_clear();
        image_take_text();
        image_assert_holds(image_display("$E"), typed ? "A 0\r\n" : "A 8\r\n");
    }
}

/* -- the operator ------------------------------------------------------------------------------------------------------- */

static void boot_as_10(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(device_id, 10);
    master_begin(TERMINAL_USART, 1);
    image_prompt();
    master_clear();
}

static void type(const char *line, const char *packet)
{
    master_clear();
    master_type(line);
    image_run(15 * MS);
    master_assert_heard(packet);
}

static void receive(const char *bytes)
{
    ask_hex(bytes);
    image_run(20 * MS);
}

/* NET-007, NET-009, NET-010, NET-029, TRM-006 */
static void test_a_line_with_an_address_goes_out_and_its_answer_is_shown(void)
{
    boot_as_10();
    type("85m3000a2d1\r", "02 55 0A 6D 33 30 30 30 61 32 64 31 03 A7 00");
    assert_shown("85m3000a2d1\r\nSAC>");
    receive("02 0A 55 06 03 DD 00");
    master_assert_heard("");
    assert_shown("\r\nK\r\nSAC>");
    type("85m13\r", "02 55 0A 6D 31 33 20 03 23 00");
    receive("02 0A 55 15 03 A2 00");
    assert_shown("85m13\r\nSAC>\r\nNAK\r\nSAC>");
    type("254y\r", "02 FE 0A 79 03 64 00");
    receive("02 0A 55 06 03 DD 00"); /* another node's answer */
    assert_shown("254y\r\nSAC>");
    image_run(60 * MS);
    assert_shown("\r\n?9 no answer\r\nSAC>");
    type("0y\r", "02 00 0A 79 03 64 00");
    image_run(200 * MS);
    assert_shown("0y\r\nSAC>");
    image_assert_pulses(0);
    type("10m5v500\r", ""); /* the own address */
    image_idle(SECONDS_10);
    image_assert_pulses(5);
    image_take_text();
    type("300y\r", "");
    assert_shown("300y\r\n?12 range 0..255\r\nSAC>");
}

/* NET-009: how long a silent node is waited for; the next line waits, and is sent then */
static void test_the_next_line_waits_for_the_answer_or_85_ms(void)
{
    boot_as_10();
    master_clear();
    master_type("85y\r85S\r");
    image_run(20 * MS);
    master_assert_heard("02 55 0A 79 03 64 00");
    image_run(60 * MS);
    master_assert_heard("02 55 0A 79 03 64 00");
    image_run(20 * MS);
    master_assert_heard("02 55 0A 79 03 64 00 02 55 0A 53 03 39 00");
    size_t count;
    const board_uart_byte_t *byte = master_heard(&count);
    const uint64_t waited = byte[7].start_cycle - byte[6].end_cycle;
    if (waited < 84 * MS || waited > 88 * MS)
        image_fail("the next packet came %.1f ms after the first one", (double)waited / MS);
}

/* NET-013, NET-034 and decisions 0.4.3 */
static void test_messages_go_both_ways(void)
{
    boot_as_10();
    type("85 hello\r", "02 55 0A 20 68 65 6C 6C 6F 03 A5 00");
    receive("02 0A 55 06 03 DD 00");
    assert_shown("85 hello\r\nSAC>\r\nK\r\nSAC>");
    type("85.hello\r", "02 55 0A 2E 68 65 6C 6C 6F 03 B6 00");
    receive("02 0A 55 06 03 DD 00");
    master_shown();
    ask_from(10, 85, " hello");
    master_assert_heard("02 55 0A 06 03 DD 00");
    image_run(20 * MS);
    assert_shown("\r\n85:10> hello\r\nSAC>");
    ask_from(10, 200, ".m200 \x07\x1B[2J\x7F\xFF");
    master_assert_heard("02 C8 0A 06 03 DD 00");
    image_run(20 * MS);
    assert_shown("\r\n200:10>.m200 \\x07\\x1B[2J\\x7F\\xFF\r\nSAC>");
    ask_from(0, MASTER, " S");
    master_assert_heard("");
    image_run(20 * MS);
    assert_shown("\r\n1:0> S\r\nSAC>");
    image_assert_pulses(0);
}

/* NET-020, NET-034: a message is answered when it has been shown (docs/wire-format.md) */
static void test_a_long_message_is_answered_when_it_has_been_shown(void)
{
    static const struct {
        char c;
        unsigned most_ms;
    } messages[] = {{'x', 16}, {7, 65}};
    for (size_t i = 0; i < 2; i++) {
        char body[62] = " ";
        memset(body + 1, messages[i].c, 60);
        const frame_t frame = master_frame(UNIT, MASTER, body);
        master_clear();
        master_send(&frame);
        image_run(master_sent_at() - board_cycle(board) + 100 * MS);
        master_assert_ack();
        size_t count;
        const uint64_t after = master_heard(&count)[0].start_cycle - master_sent_at();
        if (after > messages[i].most_ms * MS)
            image_fail("answered %.1f ms after the packet", (double)after / MS);
    }
}

/* NET-015, NET-016, NET-017 */
static void test_a_slash_answers_who_wrote_last(void)
{
    boot_as_10();
    type("/ hi\r", "");
    assert_shown("/ hi\r\n?21 to whom?\r\nSAC>");
    ask_from(0, 11, " to all");
    image_run(20 * MS);
    master_shown();
    type("/ hi\r", "");
    assert_shown("/ hi\r\n?21 to whom?\r\nSAC>");
    ask_from(10, 85, ".you");
    ask_from(0, 11, " to all");
    ask_from(10, 12, "y"); /* no message */
    image_run(20 * MS);
    type("/ hello\r", "02 55 0A 20 68 65 6C 6C 6F 03 A5 00");
    receive("02 0A 55 06 03 DD 00");
    type("\\m3000a2d1\r", "02 55 0A 6D 33 30 30 30 61 32 64 31 03 A7 00");
    receive("02 0A 55 06 03 DD 00");
    ask_from(10, 200, " me");
    image_run(20 * MS);
    type("/y\r", "02 C8 0A 79 03 64 00");
    image_assert_pulses(0);
}

/* NET-008: nobody is interrupted: what is typed while the master speaks waits for three characters of silence */
static void test_a_line_typed_while_the_master_speaks_waits(void)
{
    boot_as_10();
    frame_t frame = master_frame(77, MASTER, " a long message for somebody else, and for nobody here");
    master_clear();
    image_send("85y\r");
    for (unsigned i = 0; i < 5; i++)
        master_send(&frame);
    image_run(master_sent_at() - board_cycle(board));
    const uint64_t end = master_sent_at();
    master_assert_heard("");
    image_run(5 * MS);
    master_assert_heard("02 55 0A 79 03 64 00");
    size_t count;
    const uint64_t start = master_heard(&count)[0].start_cycle;
    if (start < end + 3 * LINE_BYTE || start > end + 10 * LINE_BYTE)
        image_fail("sent %.0f us after the last stop bit", ((double)start - (double)end) / US);
}

/* -- soft ops --------------------------------------------------------------------------------------------------------------- */

#define DC1 "02 00 55 11 03 C3 00 "
#define DC2 "02 00 55 12 03 21 00 "

/* GAP-010: the gap is not exceeded, the manual's warning does not apply: the second command goes on at full speed.
 * OPS-004, OPS-005, OPS-006, OPS-007, OPS-008, OPS-009 */
static void test_soft_ops_are_packets_to_everybody_and_the_motion_streams_on(void)
{
    image_do("m20vc1000a999d999");
    image_idle(SECONDS_10);
    master_assert_heard("");
    image_do("$O1");
    master_shown();
    image_train_clear();
    master_clear();
    master_type("m20vc1000a999d999\rm20\rm-20\r");
    image_idle(SECONDS_10);
    image_run(20 * MS);
    master_assert_heard(DC1 DC2 DC1 DC2 DC1 DC2);
    image_assert_pulses(60);
    image_assert_intervals(0, 39, 1000 * US, 0); /* one stream */
    char text[100] = "", ops[20] = ""; /* the terminal's bare bytes stand wherever the motion has come to */
    for (const char *seen = master_shown(); *seen != '\0'; seen++)
        strncat(*seen == 0x11 || *seen == 0x12 ? ops : text, seen, 1);
    TEST_ASSERT_EQUAL_STRING("m20vc1000a999d999\r\nSAC>m20\r\nSAC>m-20\r\nSAC>", text);
    TEST_ASSERT_EQUAL_STRING("\x11\x12\x11\x12\x11\x12", ops);
    image_do("$O0");
    master_clear();
    image_do("m20");
    image_idle(SECONDS_10);
    master_assert_heard("");
}

/* OPS-006, OPS-008: for good (i), with the strict mode's sequence; how long after the flag the packet begins */
static void test_soft_ops_follow_the_flag_at_once(void)
{
    image_off();
    image_power_on();
    IMAGE_SET(soft_ops, 1);
    master_begin(TERMINAL_USART, 2);
    image_prompt();
    master_clear();
    image_send("m20vc5000a999d999\r");
    uint64_t edge[2] = {0, 0};
    for (unsigned n = 0; n < 2; n++) {
        while (board_pin_level(board, OPSA) != (n == 0))
            image_run(50 * US);
        edge[n] = board_cycle(board);
    }
    image_run(20 * MS);
    size_t count;
    const board_uart_byte_t *byte = master_heard(&count);
    TEST_ASSERT_EQUAL(16, count);
    TEST_ASSERT_EQUAL_HEX8(0x11, byte[4].byte);
    TEST_ASSERT_EQUAL_HEX8(0x12, byte[12].byte);
    TEST_ASSERT_EQUAL_HEX8(byte[3].byte + 1, byte[11].byte);
    for (unsigned n = 0; n < 2; n++) {
        const uint64_t after = byte[8 * n].start_cycle - edge[n];
        printf("soft op %.0f us after the flag\n", (double)after / US);
        if (after > 2 * MS)
            image_fail("the packet began %.2f ms after the flag", (double)after / MS);
    }
}

/* -- what is no packet ---------------------------------------------------------------------------------------------------------- */

/* NET-031, NET-033: text, a packet within a packet, one that stops */
static void test_the_decoder_finds_the_next_packet(void)
{
    static const char *const before[] = {
        "6D 32 30 30 0D 0A 53 0D",                                           /* typed text */
        "02 55 01 6D 32",                                                    /* STX begins anew */
        "02 55 01 6D 32 00",                                                 /* NUL ends the attempt */
        "02 55 01 03",                                                       /* no body */
        "02 55 01 6D 32 30 30 03 11 11",                                     /* no NUL */
        "02 56 01 6D 32 30 30",                                              /* somebody else's */
        "02 55 01 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 "
        "61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 "
        "61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61 61"}; /* too long */
    const frame_t good = master_frame(UNIT, MASTER, "m10v500");
    for (size_t i = 0; i < sizeof before / sizeof before[0]; i++) {
        image_train_clear();
        const frame_t frame = master_hex(before[i]);
        master_send(&frame); /* back to back */
        master_exchange(&good);
        master_assert_ack();
        image_idle(SECONDS_10);
        image_assert_pulses(10);
        assert_shown("");
    }
    image_train_clear();
    ask_hex("02 55 01 6D 32");
    image_run(6 * MS); /* given up after 20 characters */
    ask_hex("30 30 03 00");
    master_assert_heard("");
    ask_hex("02 55 0A 6D 32 30 30 03 00");
    master_assert_heard(ACK);
    image_idle(SECONDS_10);
    image_assert_pulses(200);
}

/* -- several axes ----------------------------------------------------------------------------------------------------------------- */

typedef struct {
    double first_us; /* from the end of the broadcast to the first pulse */
    double last_us;
} axis_t;

/* One of several units on the line: each is loaded with its own command and released by the same broadcast. What the one
 * does cannot reach the other (nothing is sent), so that one after the other stands for both. */
static axis_t run_axis(const char *command, size_t pulses, uint64_t interval, double xclk_hz)
{
    image_off();
    image_power_on();
    if (xclk_hz > 0) {
        IMAGE_SET(internal_clock, 0);
        board_pin_clock(board, BOARD_PIN('D', 5), xclk_hz);
    }
    master_begin(TERMINAL_USART, 1);
    image_prompt();
    master_ask(command);
    master_assert_ack();
    image_run(3 * SECOND - board_cycle(board));
    ask_from(0, MASTER, "y");
    const double released = (double)master_sent_at();
    image_idle(SECONDS_10);
    master_assert_heard("");
    image_assert_pulses(pulses);
    if (interval)
        image_assert_intervals(0, pulses - 1, (double)interval, 0);
    return (axis_t){((double)train.pulse[0].cycle - released) / US, ((double)train.last_rise - released) / US};
}

/* MAX-001, MAX-002, MAX-003, MAX-006, MAX-008: the manual's figure: 10 kHz and 5/6 of it, both evenly spaced */
static void test_two_axes_run_in_step_without_a_common_step_clock(void)
{
    const axis_t x = run_axis("m6000vc100a999d999s", 6000, 100 * US, 0);
    const axis_t y = run_axis("m5000vc120a999d999s", 5000, 120 * US, 0);
    printf("first pulses %.0f and %.0f us after y\n", x.first_us, y.first_us);
    image_assert_near("first pulses, us", x.first_us, y.first_us, 100);
    image_assert_near("ends, us", x.last_us + 100, y.last_us + 120, 100);
    /* with a common external clock, half a percent fast, both are that much shorter */
    const axis_t xs = run_axis("m6000vc100a999d999s", 6000, 0, 1005000);
    const axis_t ys = run_axis("m5000vc120a999d999s", 5000, 0, 1005000);
    image_assert_near("first axis, us", (x.last_us - x.first_us) / 1.005, xs.last_us - xs.first_us, 2);
    image_assert_near("second axis, us", (y.last_us - y.first_us) / 1.005, ys.last_us - ys.first_us, 2);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_command_from_the_line_makes_the_pulses_of_a_typed_one);
    RUN_TEST(test_single_pulses_come_from_the_line_too);
    RUN_TEST(test_manual_frames_byte_for_byte);
    RUN_TEST(test_without_crc_byte_for_byte);
    RUN_TEST(test_without_acknowledgements_the_line_is_silent);
    RUN_TEST(test_strict_frames_byte_for_byte_and_exactly_once);
    RUN_TEST(test_tx_en_covers_the_answers_and_no_more);
    RUN_TEST(test_packets_at_every_rate);
    RUN_TEST(test_the_longest_packet_goes_out_without_a_gap);
    RUN_TEST(test_without_a_packet_the_line_is_silent);
    RUN_TEST(test_packets_for_others_are_ignored_silently);
    RUN_TEST(test_a_unit_answers_at_any_of_252_addresses);
    RUN_TEST(test_a_general_call_is_executed_and_never_answered);
    RUN_TEST(test_y_releases_a_start_that_waits_for_sync);
    RUN_TEST(test_s_stops_at_once_and_with_grace);
    RUN_TEST(test_system_commands_come_from_the_line);
    RUN_TEST(test_a_system_command_to_everybody_does_nothing);
    RUN_TEST(test_displays_asked_for_over_the_line_are_given_to_nobody);
    RUN_TEST(test_the_window_after_power_on_does_not_hear_the_line);
    RUN_TEST(test_a_line_with_an_address_goes_out_and_its_answer_is_shown);
    RUN_TEST(test_the_next_line_waits_for_the_answer_or_85_ms);
    RUN_TEST(test_messages_go_both_ways);
    RUN_TEST(test_a_long_message_is_answered_when_it_has_been_shown);
    RUN_TEST(test_a_slash_answers_who_wrote_last);
    RUN_TEST(test_a_line_typed_while_the_master_speaks_waits);
    RUN_TEST(test_soft_ops_are_packets_to_everybody_and_the_motion_streams_on);
    RUN_TEST(test_soft_ops_follow_the_flag_at_once);
    RUN_TEST(test_the_decoder_finds_the_next_packet);
    RUN_TEST(test_two_axes_run_in_step_without_a_common_step_clock);
    return UNITY_END();
}
