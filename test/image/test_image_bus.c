/* NET, PIN on the whole image: the software port as the terminal, bit by bit; Tx En. */
#include "image.h"
#include "soft_peer.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static double bit;

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
    if (soft_peer_off > 8)
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

/* NET-005: the peer's clock off by 3 %, the motor at 33 kHz; every edge of S/W Tx within one tick meanwhile */
static void test_no_byte_is_wrong_while_the_motor_steps_at_33_khz(void)
{
    boot_at(38400);
    assert_answer("f1u0\r", bit, "f1u0\r\n?1 unknown command\r\nSAC>");
    assert_answer("m9000000vc30a999d999\r", bit, "m9000000vc30a999d999\r\nSAC>");
    image_run(500 * MS);
    for (int i = -12; i <= 12; i++) {
        image_run((uint64_t)(i + 13) * 37); /* another phase */
        assert_answer("Uvwxyz0123456789\r", bit * (1 + 0.0025 * i), "Uvwxyz0123456789\r\n?1 unknown command\r\nSAC>");
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_e_exchanges_the_ports_and_a_command_there_confirms_it);
    RUN_TEST(test_the_terminal_comes_back_if_nobody_types_at_the_other_port);
    RUN_TEST(test_a_typed_line_is_answered_at_each_rate);
    RUN_TEST(test_no_byte_is_wrong_while_the_motor_steps_at_33_khz);
    RUN_TEST(test_a_glitch_is_no_byte);
    RUN_TEST(test_a_break_spoils_one_line_and_does_not_repeat);
    return UNITY_END();
}
