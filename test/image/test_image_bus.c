/* NET, PIN on the whole image: the software port as the terminal, bit by bit; Tx En. */
#include "image.h"
#include "soft_peer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double bit;
static double most_off; /* an edge of S/W Tx, in cycles */

static void boot_at(uint32_t baud)
{
    image_off();
    image_power_on();
    IMAGE_SET(network, 1);
    IMAGE_SET(sw_baud, baud);
    bit = 16e6 / baud;
    soft_peer_begin(board, baud);
    image_run(3 * SECOND / 2 + (uint64_t)(2000 * bit));
    if (strstr(soft_peer_text(), "SAC>") == NULL)
        image_fail("expected the prompt, saw \"%s\"", soft_peer_text());
    soft_peer_clear();
}

void setUp(void)
{
    most_off = 8;
}

void tearDown(void)
{
    image_off();
}

static void type(const char *line, double cycles_a_bit)
{
    const uint64_t end = soft_peer_send(line, strlen(line), board_cycle(board) + 100, cycles_a_bit);
    image_run(end - board_cycle(board));
}

static void assert_answer(const char *line, double cycles_a_bit, const char *answer)
{
    soft_peer_clear();
    type(line, cycles_a_bit);
    image_run((uint64_t)((double)(strlen(line) + strlen(answer)) * 20 * bit) + 20 * MS);
    if (strcmp(soft_peer_text(), answer) != 0)
        image_fail("bit %.2f: expected \"%s\", saw \"%s\"", cycles_a_bit, answer, soft_peer_text());
    TEST_ASSERT_EQUAL_UINT(0, soft_peer_bad);
    size_t enabled;
    soft_peer_tx_en(&enabled);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, enabled, "edges of Tx En");
    if (soft_peer_off > most_off)
        image_fail("an edge was %.1f cycles off", soft_peer_off);
}

#define AT_REST "p\r\nposition 0 STANDBY faults 0\r\nSAC>"

/* At the USB port: the terminal goes to the software port. */
static void move_the_terminal(void)
{
    image_off();
    image_power_on();
    image_prompt();
    image_do("$CE1");
    image_run(SECOND / 2); /* it is stored */
    image_send("$R\r");
    image_run(SECOND / 2);
    image_take_text();
    bit = 16e6 / 38400;
    soft_peer_begin(board, 38400);
}

/* NET-002, NET-003 */
static void test_e_exchanges_the_ports_and_a_command_there_confirms_it(void)
{
    move_the_terminal();
    assert_answer("p\r", bit, AT_REST);
    image_run(62 * SECOND);
    TEST_ASSERT_EQUAL_STRING("", image_take_text());
    assert_answer("p\r", bit, AT_REST);
}

static void test_the_terminal_comes_back_if_nobody_types_at_the_other_port(void)
{
    move_the_terminal();
    image_run(58 * SECOND);
    TEST_ASSERT_EQUAL_STRING("", image_take_text());
    image_run(4 * SECOND);
    if (strstr(image_take_text(), "?20 E M m n taken back") == NULL)
        image_fail("expected the terminal at the USB port again");
    soft_peer_clear();
    type("p\r", bit);
    image_run(100 * MS);
    TEST_ASSERT_EQUAL_STRING("", soft_peer_text());
}

/* PIN-015, NET-006: 8N1 at any rate; the terminal never moves Tx En */
static void test_a_typed_line_is_answered_at_each_rate(void)
{
    static const uint32_t bauds[] = {38400, 19200, 9600, 300};
    for (size_t i = 0; i < sizeof bauds / sizeof bauds[0]; i++) {
        boot_at(bauds[i]);
        assert_answer("p\r", bit, AT_REST);
    }
}

static void step_at_33_khz(const char *line)
{
    char typed[40], answer[40];
    snprintf(typed, sizeof typed, "%s\r", line);
    snprintf(answer, sizeof answer, "%s\r\nSAC>", line);
    boot_at(38400);
    assert_answer("f1u0\r", bit, "f1u0\r\n?1 unknown command\r\nSAC>");
    assert_answer(typed, bit, answer);
}

/* NET-005: the peer's clock off by 3 %, the motor at 33 kHz; every edge of S/W Tx within one tick meanwhile */
static void test_no_byte_is_wrong_while_the_motor_steps_at_33_khz(void)
{
    step_at_33_khz("m9000000vc30a999d999");
    image_run(500 * MS);
    /* All phases of the step interrupt (make test-phases-long), or one for each clock. */
    const uint64_t period = 480;
    const unsigned phases = getenv("SAC_PHASES") != NULL ? (unsigned)strtoul(getenv("SAC_PHASES"), NULL, 10) : 1;
    unsigned lines = 0;
    for (int i = -12; i <= 12; i++)
        for (unsigned k = 0; k < phases; k++, lines++) {
            const uint64_t phase = (period * k / phases + (uint64_t)(i + 12) * 37) % period;
            image_run(period - board_cycle(board) % period + phase);
            assert_answer("Uvwxyz0123456789\r", bit * (1 + 0.0025 * i), "Uvwxyz0123456789\r\n?1 unknown command\r\nSAC>");
        }
    if (phases > 1)
        printf("%u lines, clocks off by -3 to 3 %%, %u phases each: all read, edges of S/W Tx off by no more than a tick\n", lines,
               phases);
}

/* Of 60 characters, back to back from a peer 3 % fast. */
static void assert_long_line_is_answered(void)
{
    static const char line[] = "UUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUUU";
    char typed[sizeof line + 1], answer[sizeof line + 40];
    snprintf(typed, sizeof typed, "%s\r", line);
    snprintf(answer, sizeof answer, "%s\r\n?1 unknown command\r\nSAC>", line);
    assert_answer(typed, bit * 0.97, answer);
}

/* A character's last sample comes late, its successor's start edge early: it is found nevertheless, in any phase. */
static void test_a_fast_peer_may_send_a_line_without_a_pause(void)
{
    step_at_33_khz("m9000000vc30a999d999");
    for (unsigned k = 0; k < 48; k++) {
        image_run(480 - board_cycle(board) % 480 + 10 * k); /* a phase of the step interrupt */
        assert_long_line_is_answered();
    }
}

/* S/W Rx, S/W Tx and the hardware port at once, and each pulse of a ramp has a segment of its own. One edge in some 10^5 is
 * made when it is found late. */
static void test_no_bit_is_lost_with_all_interrupts_at_once(void)
{
    most_off = 16e6 / 38400 / 8;
    uint8_t others[64];
    memset(others, 'U', sizeof others);
    step_at_33_khz("m300000vc30a10d10l1");
    for (unsigned k = 0; k < 60; k++) {
        board_uart_send(board, others, sizeof others);
        image_run(100 + 29 * k);
        assert_long_line_is_answered();
    }
}

/* The encoder bounces now and then, with edges so near that for a bit hardly anything else is done: an edge of S/W Tx comes
 * late, no bit is lost. */
static void test_bytes_are_sent_while_the_encoder_bounces(void)
{
    enum { BURSTS = 300, EDGES = 8, EVERY = 62 };
    boot_at(38400);
    for (unsigned i = 0; i < 10; i++) {
        const uint64_t from = board_cycle(board) + MS;
        soft_peer_clear();
        type("p\r", bit);
        for (unsigned k = 0; k < BURSTS * EDGES; k++)
            board_pin_drive_at(board, BOARD_PIN('C', 0), k & 1, from + k / EDGES * (3000 + 7 * i) + k % EDGES * EVERY);
        image_run(BURSTS * 4000);
        TEST_ASSERT_EQUAL_STRING(AT_REST, soft_peer_text());
        TEST_ASSERT_EQUAL_UINT(0, soft_peer_bad);
    }
}

static void test_a_glitch_is_no_byte(void)
{
    boot_at(38400);
    const uint64_t at = board_cycle(board) + MS;
    soft_peer_level(0, at);
    soft_peer_level(1, at + 3 * US);
    image_run(2 * MS);
    assert_answer("p\r", bit, AT_REST);
}

/* A byte 0xFF spoils its line, once, however long the line is low. */
static void test_a_break_spoils_one_line_and_does_not_repeat(void)
{
    boot_at(38400);
    uint16_t soft = 0;
    TEST_ASSERT_TRUE(board_symbol(board, "soft_uart", &soft));
    const uint64_t at = board_cycle(board) + MS;
    soft_peer_level(0, at);
    soft_peer_level(1, at + 20 * MS);
    image_run(30 * MS);
    TEST_ASSERT_EQUAL_UINT8(1, board_peek8(board, (uint16_t)(soft + 12 + 4)));
    type("\r", bit);
    image_run(30 * MS);
    assert_answer("p\r", bit, AT_REST);
}

/* -- at rates that no start edge may come at ---------------------------------------------------------------------- */

static uint32_t dice;

static uint32_t roll(uint32_t sides)
{
    dice = dice * 1664525u + 1013904223u;
    return (dice >> 8) % sides;
}

/* On S/W Rx for so long: bytes back to back, or pulses of 1 to 20 us as near as that. */
static void disturb(uint64_t cycles, bool with_bytes)
{
    const uint64_t end = board_cycle(board) + cycles;
    while (board_cycle(board) < end) {
        uint64_t at = board_cycle(board) + 10;
        for (unsigned i = 0; i < 16; i++) {
            const uint8_t byte = (uint8_t)roll(256);
            if (with_bytes) {
                at = soft_peer_send(&byte, 1, at + roll(300), 16e6 / 38400);
                continue;
            }
            soft_peer_level(0, at += 16 + roll(320));
            soft_peer_level(1, at += 16 + roll(320));
        }
        image_run(at - board_cycle(board));
    }
}

static void boot_fast(unsigned ustep, unsigned network)
{
    image_off();
    image_power_on();
    IMAGE_SET(pulse_us, 1);
    IMAGE_SET(ustep, ustep);
    IMAGE_SET(network, network);
    bit = 16e6 / 38400;
    if (network)
        image_run(2 * SECOND);
    else
        image_prompt();
    soft_peer_begin(board, 38400);
}

static void assert_counted(const char *lines, size_t pulses)
{
    if (train.count != pulses)
        image_fail("%s: expected %zu pulses, saw %zu", lines, pulses, train.count);
    TEST_ASSERT_EQUAL_INT32((int32_t)pulses, image_position());
}

/* Two steps in half the interval of one: 400 kHz is vc5, 500 kHz vc4. */
static void test_pulses_are_counted_at_500_khz_whatever_comes_at_the_software_port(void)
{
    static const struct {
        unsigned ustep;
        const char *lines;
        size_t pulses;
    } motions[] = {
        {0, "m600000vc2a999d999\r", 600000},
        {1, "m300000vc4a999d999\r", 600000},
        {0, "m300000vc3a999d999\r", 300000}, /* the shortest period that it bears */
        {1, "m200000vc5a999d999\rm100000vc4a20d999\r", 600000},
        {1, "m200000vc4a999d999\rm100000vc5a20d999\r", 600000},
        {1, "m200000vc4a40d40\r", 400000},
        {1, "m20000vc4a999d999\rm20000vc40a999d999\rm20000vc5a999d999\rm20000vc30a999d999\r", 160000},
    };
    for (size_t i = 0; i < sizeof motions / sizeof motions[0]; i++) {
        for (unsigned phase = 0; phase < 4; phase++) {
            boot_fast(motions[i].ustep, 0);
            dice = phase;
            image_run(phase * 1237);
            image_train_clear();
            train.keep = false;
            image_send(motions[i].lines);
            do
                disturb(40 * MS, phase & 1);
            while (image_peek("motion_state") != STANDBY);
            image_run(20 * MS);
            assert_counted(motions[i].lines, motions[i].pulses);
        }
    }
}

/* What has been in the port's ring goes out again and again; edges of the encoder go before step interrupts too. */
static void test_pulses_are_counted_at_500_khz_while_the_software_port_sends(void)
{
    enum { TX_HEAD = 12 + 2, TX_TAIL = 12 + 3, PLACES = 32, TIMSK0 = 0x6E, OCIE0A = 1 };
    uint16_t soft = 0;
    boot_fast(1, 1);
    TEST_ASSERT_TRUE(board_symbol(board, "soft_uart", &soft));
    image_train_clear();
    train.keep = false;
    type("m300000vc4a999d999\r", bit);
    while ((board_peek8(board, TIMSK0) & 1 << OCIE0A) == 0)
        image_run(100); /* until its echo begins */
    soft_peer_clear();
    while (train.count < 590000) {
        const uint8_t head = board_peek8(board, (uint16_t)(soft + TX_HEAD));
        board_poke8(board, (uint16_t)(soft + TX_TAIL), (uint8_t)((head + 1) % PLACES));
        const uint64_t from = board_cycle(board) + 10;
        for (unsigned k = 0; k < 20; k++)
            board_pin_drive_at(board, BOARD_PIN('C', 0), k & 1, from + 2000 * k + roll(1900));
        image_run(40100);
    }
    image_run(SECOND / 2);
    TEST_ASSERT_EQUAL_size_t(600000, train.count);
    size_t sent;
    soft_peer_bytes(&sent);
    TEST_ASSERT_GREATER_THAN(4000, sent);
    type("p\r", bit);
    image_run(20 * MS);
    if (strstr(soft_peer_text(), "position 600000 STANDBY faults 0") == NULL)
        image_fail("expected position 600000, saw \"%s\"", soft_peer_text());
}

/* The middle one of three commands is too fast. */
static void test_the_software_port_is_deaf_no_longer_than_periods_are_short(void)
{
    boot_fast(0, 1);
    type("m10000vc20a999d999\r", bit);
    image_until_pulses(1, 10 * MS);
    type("m50000vc2a999d999\r", bit);
    type("m10000vc20a999d999\r", bit);
    image_until_pulses(12000, SECOND);
    soft_peer_clear();
    type("m1\r", bit);
    image_run(20 * MS);
    TEST_ASSERT_EQUAL_STRING("", soft_peer_text());
    image_until_pulses(60000, SECOND);
    image_run(2 * MS);
    type("p\r", bit);
    image_run(20 * MS);
    if (strstr(soft_peer_text(), " CRUISE faults 0") == NULL)
        image_fail("expected an answer in the third command, saw \"%s\"", soft_peer_text());
    image_run(SECOND / 2);
    soft_peer_clear();
    assert_answer("p\r", bit, "p\r\nposition 70000 STANDBY faults 0\r\nSAC>");
    type("m100000vc2a999d999\r", bit); /* and it stops from there */
    image_run(SECOND / 2);
    assert_answer("p\r", bit, "p\r\nposition 170000 STANDBY faults 0\r\nSAC>");
}

/* Without a long period at its end. */
static void test_the_software_port_hears_after_a_stop_at_500_khz(void)
{
    enum { PCMSK2 = 0x6D };
    boot_fast(0, 0);
    image_send("m600000vc2a999d999\r");
    image_until_pulses(20000, SECOND);
    TEST_ASSERT_EQUAL_HEX8(0, board_peek8(board, PCMSK2));
    image_send("S\r");
    image_idle(SECOND);
    TEST_ASSERT_EQUAL_HEX8(1 << 4, board_peek8(board, PCMSK2));
    TEST_ASSERT_EQUAL_INT32((int32_t)train.count, image_position());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_e_exchanges_the_ports_and_a_command_there_confirms_it);
    RUN_TEST(test_the_terminal_comes_back_if_nobody_types_at_the_other_port);
    RUN_TEST(test_a_typed_line_is_answered_at_each_rate);
    RUN_TEST(test_no_byte_is_wrong_while_the_motor_steps_at_33_khz);
    RUN_TEST(test_a_fast_peer_may_send_a_line_without_a_pause);
    RUN_TEST(test_no_bit_is_lost_with_all_interrupts_at_once);
    RUN_TEST(test_bytes_are_sent_while_the_encoder_bounces);
    RUN_TEST(test_a_glitch_is_no_byte);
    RUN_TEST(test_a_break_spoils_one_line_and_does_not_repeat);
    RUN_TEST(test_pulses_are_counted_at_500_khz_whatever_comes_at_the_software_port);
    RUN_TEST(test_pulses_are_counted_at_500_khz_while_the_software_port_sends);
    RUN_TEST(test_the_software_port_is_deaf_no_longer_than_periods_are_short);
    RUN_TEST(test_the_software_port_hears_after_a_stop_at_500_khz);
    return UNITY_END();
}
