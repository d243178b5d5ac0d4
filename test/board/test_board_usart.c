/* USART0 against DS40002061 chapter 20: what the datasheet dictates for the programs usart_*. */
#include "program.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Bits of the registers as the datasheet names them. */
enum { MPCM = 0x01, U2X = 0x02, UPE = 0x04, DOR = 0x08, FE = 0x10, UDRE = 0x20, TXC = 0x40, RXC = 0x80 };
enum { FORMAT_8N1 = 0x06, FORMAT_5N1 = 0x00, FORMAT_7E1 = 0x24, FORMAT_7O1 = 0x34, FORMAT_8E2 = 0x2E };
enum { UCSZ2 = 0x04, TXB8 = 0x01, RXB8 = 0x02 };

#define UBRR_38400 25 /* 38,462 Bd; 416 cycles a bit, 4,160 a byte */
#define BIT 416u
#define BYTE 4160u
#define TXD BOARD_PIN('D', 1)

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    board_free(board);
}

/* -- transmitter ------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t ucsra, ucsrb, ucsrc;
    uint8_t order; /* of writing UCSR0A, see usart_send.c */
} setting_t;

static void send_from_board(uint16_t ubrr, setting_t setting, const void *bytes, uint8_t count)
{
    start(PROGRAM("usart_send"));
    set16("p_ubrr", ubrr);
    set("p_ucsra", 0, setting.ucsra);
    set("p_ucsrb", 0, setting.ucsrb);
    set("p_ucsrc", 0, setting.ucsrc);
    set("p_order", 0, setting.order);
    set("p_count", 0, count);
    for (unsigned i = 0; i < count; i++)
        set("p_bytes", i, ((const uint8_t *)bytes)[i]);
    board_record(board, TXD, true);
    run_until("r_done", 1, 10000000);
}

/* Checks the recorded edges of TXD against levels, one character a bit time ('0', '1'; others are skipped). The line is
 * high before and after. */
static void assert_line(const char *levels, uint64_t bit)
{
    size_t count;
    const board_edge_t *edge = board_edges(board, &count);
    size_t seen = 0;
    int level = 1;
    uint64_t time = 0;
    uint64_t first = 0;

    while (seen < count && edge[seen].level == 1)
        seen++; /* the transmitter takes over the floating pin */
    for (const char *c = levels; *c; c++) {
        if (*c != '0' && *c != '1')
            continue;
        if (*c - '0' != level) {
            level = *c - '0';
            TEST_ASSERT_LESS_THAN_MESSAGE(count, seen, levels);
            if (time == 0)
                first = edge[seen].cycle;
            TEST_ASSERT_EQUAL_MESSAGE(level, edge[seen].level, levels);
            TEST_ASSERT_EQUAL_UINT64_MESSAGE(time, edge[seen].cycle - first, levels);
            seen++;
        }
        time += bit;
    }
    TEST_ASSERT_EQUAL_MESSAGE(count, seen, levels);
}

static void test_registers_hold_their_initial_values_after_reset(void)
{
    send_from_board(UBRR_38400, (setting_t){0, 0, FORMAT_8N1, 0}, "x", 1);
    TEST_ASSERT_EQUAL_HEX8(UDRE, get("r_at_reset", 0));
    TEST_ASSERT_EQUAL_HEX8(0x00, get("r_at_reset", 1));
    TEST_ASSERT_EQUAL_HEX8(FORMAT_8N1, get("r_at_reset", 2));
    TEST_ASSERT_EQUAL_HEX8(0x00, get("r_at_reset", 3));
    TEST_ASSERT_EQUAL_HEX8(0x00, get("r_at_reset", 4));
}

static void test_byte_lasts_ten_bits_of_16_prescaler_periods(void)
{
    send_from_board(UBRR_38400, (setting_t){0, 0, FORMAT_8N1, 0}, "\xA5\x0F", 2);
    assert_line("0 10100101 1  0 11110000 1", BIT);
}

static void test_double_speed_halves_the_bit_in_any_order_of_writing(void)
{
    for (uint8_t order = 0; order < 3; order++) {
        send_from_board(51, (setting_t){U2X, 0, FORMAT_8N1, order}, "\xA5\x0F", 2);
        assert_line("0 10100101 1  0 11110000 1", BIT);
        board_free(board);
    }
    send_from_board(0, (setting_t){U2X, 0, FORMAT_8N1, 0}, "U", 1); /* 2 MBd */
    assert_line("0 10101010 1", 8);
    board_free(board);
    send_from_board(4095, (setting_t){0, 0, FORMAT_8N1, 0}, "U", 1); /* UBRR0H counts too */
    assert_line("0 10101010 1", 65536);
}

static void test_frame_formats_have_their_own_lengths(void)
{
    send_from_board(7, (setting_t){0, 0, FORMAT_5N1, 0}, "\x12\x12", 2);
    assert_line("0 01001 1  0 01001 1", 128);
    board_free(board);
    send_from_board(7, (setting_t){0, 0, FORMAT_7E1, 0}, "\x41\x43", 2);
    assert_line("0 1000001 0 1  0 1100001 1 1", 128);
    board_free(board);
    send_from_board(7, (setting_t){0, 0, FORMAT_7O1, 0}, "\x41\x43", 2);
    assert_line("0 1000001 1 1  0 1100001 0 1", 128);
    board_free(board);
    send_from_board(7, (setting_t){0, 0, FORMAT_8E2, 0}, "\x07\x03", 2);
    assert_line("0 11100000 1 11  0 11000000 0 11", 128);
    board_free(board);
    send_from_board(7, (setting_t){0, UCSZ2 | TXB8, FORMAT_8N1, 0}, "\x00\x01", 2);
    assert_line("0 000000001 1  0 100000001 1", 128);
}

static void test_bytes_follow_each_other_without_a_gap(void)
{
    size_t count;
    send_from_board(UBRR_38400, (setting_t){0, 0, FORMAT_8N1, 0}, "abcdefghijklmnopqrst", 20);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_EQUAL(20, count);
    for (size_t i = 0; i < count; i++) {
        TEST_ASSERT_EQUAL_UINT64(byte[0].start_cycle + i * BYTE, byte[i].start_cycle);
        TEST_ASSERT_EQUAL_UINT64(byte[i].start_cycle + BYTE, byte[i].end_cycle);
    }
    TEST_ASSERT_EQUAL_STRING("abcdefghijklmnopqrst", board_uart_text(board));
}

static void test_txc_is_set_with_the_last_stop_bit_and_cleared_by_writing_one(void)
{
    size_t count;
    send_from_board(UBRR_38400, (setting_t){0, 0, FORMAT_8N1, 0}, "ab", 2);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    uint64_t since = board_cycle(board) - byte[1].end_cycle;
    TEST_ASSERT_LESS_THAN(40, since); /* the polling loop and the lines after it */
    TEST_ASSERT_EQUAL_HEX8(TXC | UDRE, get("r_complete", 0));
    TEST_ASSERT_EQUAL_HEX8(TXC | UDRE, get("r_zero_written", 0));
    TEST_ASSERT_EQUAL_HEX8(UDRE, get("r_one_written", 0));
}

static void test_transmitter_has_one_buffer_and_the_shift_register(void)
{
    start(PROGRAM("usart_buffer"));
    run_until("r_done", 1, 1000000);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(UDRE, get("r_after_first", 0), "moves to the shift register at once");
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0, get("r_after_second", 0), "fills the buffer");
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0, get("r_after_third", 0), "is lost");
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(UDRE, get("r_between", 0), "no TXC while a byte follows");
    TEST_ASSERT_EQUAL_STRING("ABDE", board_uart_text(board));
}

static void test_disabling_the_transmitter_waits_for_pending_bytes(void)
{
    size_t count, edges;
    start(PROGRAM("usart_buffer"));
    board_record(board, TXD, true);
    run_until("r_done", 1, 1000000);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_EQUAL(4, count);
    const board_edge_t *edge = board_edges(board, &edges);
    size_t first = 0;
    while (first < edges && edge[first].cycle <= byte[1].end_cycle)
        first++;
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(byte[2].start_cycle, edge[first].cycle, "high until the third byte starts");
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(byte[3].end_cycle, edge[edges - 1].cycle, "then the pin is the port's");
    TEST_ASSERT_EQUAL(0, edge[edges - 1].level);
}

static void test_start_bits_keep_to_the_free_running_shift_clock(void)
{
    size_t count;
    start(PROGRAM("usart_buffer"));
    run_until("r_done", 1, 1000000);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_EQUAL(4, count);
    TEST_ASSERT_GREATER_THAN(byte[1].end_cycle, byte[2].start_cycle);
    TEST_ASSERT_EQUAL_UINT64(0, (byte[2].start_cycle - byte[0].start_cycle) % BIT);
}

static void test_peer_at_another_rate_reads_rubbish(void)
{
    size_t count;
    start(PROGRAM("usart_buffer"));
    board_uart_baud(board, 9600);
    run_until("r_done", 1, 1000000);
    run(100000);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_GREATER_OR_EQUAL(1, count);
    TEST_ASSERT_NOT_EQUAL('A', byte[0].byte);
}

/* -- receiver -------------------------------------------------------------------------------------------------------------- */

static void receive_on_board(uint16_t ubrr, setting_t setting, bool hold)
{
    start(PROGRAM("usart_receive"));
    set16("p_ubrr", ubrr);
    set("p_ucsra", 0, setting.ucsra);
    set("p_ucsrb", 0, setting.ucsrb);
    set("p_ucsrc", 0, setting.ucsrc);
    set("p_hold", 0, hold);
    run_until("r_ready", 1, 10000);
}

static const setting_t plain = {0, 0, FORMAT_8N1, 0};

/* Lets everything arrive that the peer has to send. */
static void settle(void)
{
    if (board_uart_sending(board))
        run(board_uart_last_sent(board) - board_cycle(board));
    run(20000);
}

static void test_receiver_gets_every_byte_value_back_to_back(void)
{
    uint8_t bytes[255];
    receive_on_board(UBRR_38400, plain, false);
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)i;
    board_uart_send(board, bytes, sizeof bytes);
    settle();
    TEST_ASSERT_EQUAL(255, get("r_count", 0));
    for (unsigned i = 0; i < sizeof bytes; i++) {
        TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", i));
        TEST_ASSERT_EQUAL_HEX8(i, get("r_data", i));
    }
}

static void test_rxc_is_set_when_the_stop_bit_has_been_voted(void)
{
    receive_on_board(UBRR_38400, plain, false);
    uint64_t sent = board_cycle(board);
    board_uart_send(board, "x", 1);
    run_until("r_count", 1, 10000);
    /* Sample 10 of bit 9 comes 153 ticks of 26 cycles after the first low one, which lies within a tick of the edge;
     * then the polling loop. */
    TEST_ASSERT_UINT64_WITHIN(60, 153 * 26 + 60, board_cycle(board) - sent);
}

/* Errors among bytes sent at a rate relative to the receiver's, in pairs with half a bit between them, or without a gap.
 * The second of a pair is 0xFF: its start bit may be found late, what counts is that the first is read well. */
static unsigned errors_at(double percent, bool double_speed, bool pairs)
{
    enum { COUNT = 252 };
    unsigned errors = 0;

    receive_on_board(double_speed ? 51 : UBRR_38400, (setting_t){double_speed ? U2X : 0, 0, FORMAT_8N1, 0}, false);
    board_uart_baud(board, 16e6 / BIT * percent / 100);
    for (unsigned i = 0; i < COUNT; i++) {
        uint8_t byte = pairs && i % 2 ? 0xFF : (uint8_t)(i * 7);
        board_uart_send(board, &byte, 1);
        if (pairs && i % 2)
            board_uart_gap(board, BIT / 2);
    }
    settle();
    for (unsigned i = 0; i < COUNT; i++)
        errors += i >= get("r_count", 0) || get("r_status", i) != (RXC | UDRE | (double_speed ? U2X : 0)) ||
                  get("r_data", i) != (pairs && i % 2 ? 0xFF : (uint8_t)(i * 7));
    board_free(board);
    board = NULL;
    return errors;
}

static void test_receiver_tolerates_the_rates_of_the_datasheet(void)
{
    /* Tables 20-2 and 20-3, D = 8: a frame and the next one's start bit. */
    TEST_ASSERT_EQUAL(0, errors_at(95.37, false, true));
    TEST_ASSERT_EQUAL(0, errors_at(104.57, false, true));
    TEST_ASSERT_EQUAL(0, errors_at(96.01, true, true));
    TEST_ASSERT_EQUAL(0, errors_at(103.89, true, true));
    /* Without end: a fast peer's start bit may come one sample after the votes, 154 or 78 samples after the last. */
    TEST_ASSERT_EQUAL(0, errors_at(100.00, false, false));
    TEST_ASSERT_EQUAL(0, errors_at(95.37, false, false));
    TEST_ASSERT_EQUAL(0, errors_at(100.0 * 160 / 154.1, false, false));
    TEST_ASSERT_EQUAL(0, errors_at(96.01, true, false));
    TEST_ASSERT_EQUAL(0, errors_at(100.0 * 80 / 78.1, true, false));
}

static void test_receiver_fails_where_two_of_three_votes_fall_into_the_next_bit(void)
{
    /* Slow: the stop bit's votes fall into bit 7 even in the best phase. Fast: into the next start bit. */
    TEST_ASSERT_GREATER_THAN(50, errors_at(100.0 * 144 / 153.5, false, false));
    TEST_ASSERT_GREATER_THAN(50, errors_at(100.0 * 160 / 150.5, false, false));
    TEST_ASSERT_GREATER_THAN(50, errors_at(100.0 * 72 / 77.5, true, false));
    TEST_ASSERT_GREATER_THAN(50, errors_at(100.0 * 80 / 74.5, true, false));
}

static void test_receiver_holds_two_bytes_and_the_shift_register(void)
{
    receive_on_board(UBRR_38400, plain, true);
    board_uart_send_text(board, "abc");
    settle();
    set("p_hold", 0, 0);
    run(1000);
    TEST_ASSERT_EQUAL(3, get("r_count", 0));
    for (unsigned i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL('a' + i, get("r_data", i));
        TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", i));
    }
    TEST_ASSERT_EQUAL(0, board_uart_overruns(board));
}

static void test_fourth_byte_overruns_at_its_start_bit(void)
{
    receive_on_board(UBRR_38400, plain, true);
    board_uart_send_text(board, "abcdef");
    settle();
    set("p_hold", 0, 0);
    run(1000);
    TEST_ASSERT_EQUAL(3, get("r_count", 0));
    TEST_ASSERT_EQUAL('a', get("r_data", 0));
    TEST_ASSERT_EQUAL('b', get("r_data", 1));
    TEST_ASSERT_EQUAL('f', get("r_data", 2));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 1));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(RXC | UDRE | DOR, get("r_status", 2), "lost between b and f");
    TEST_ASSERT_EQUAL(3, board_uart_overruns(board));
    board_uart_send_text(board, "g");
    settle();
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(RXC | UDRE, get("r_status", 3), "DOR is over");
}

static void test_byte_read_before_the_next_start_bit_prevents_the_overrun(void)
{
    receive_on_board(UBRR_38400, plain, true);
    board_uart_send_text(board, "abc");
    board_uart_gap(board, 10 * BIT);
    board_uart_send_text(board, "d");
    uint64_t end = board_uart_last_sent(board);
    run(end - 12 * BIT - board_cycle(board)); /* abc complete, d not begun */
    set("p_hold", 0, 0);
    settle();
    TEST_ASSERT_EQUAL(4, get("r_count", 0));
    TEST_ASSERT_EQUAL(0, board_uart_overruns(board));
}

static void test_low_stop_bit_flags_its_own_byte_only(void)
{
    receive_on_board(UBRR_38400, plain, true);
    board_uart_send_text(board, "a");
    board_uart_send_bad(board, 'b');
    board_uart_send_text(board, "c");
    settle();
    set("p_hold", 0, 0);
    run(1000);
    TEST_ASSERT_EQUAL(3, get("r_count", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE | FE, get("r_status", 1));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 2));
    TEST_ASSERT_EQUAL('b', get("r_data", 1));
    TEST_ASSERT_EQUAL('c', get("r_data", 2));
}

static void test_break_is_one_zero_byte_with_a_framing_error(void)
{
    receive_on_board(UBRR_38400, plain, false);
    board_uart_baud(board, 38400 / 5.0);
    board_uart_send(board, "\0", 1); /* low for 45 of the receiver's bits */
    board_uart_baud(board, 38400);
    board_uart_send_text(board, "x");
    settle();
    TEST_ASSERT_EQUAL(2, get("r_count", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE | FE, get("r_status", 0));
    TEST_ASSERT_EQUAL_HEX8(0, get("r_data", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 1));
    TEST_ASSERT_EQUAL('x', get("r_data", 1));
}

static void test_short_low_pulse_is_noise(void)
{
    receive_on_board(UBRR_38400, plain, false);
    board_uart_baud(board, 38400 * 3.0);
    board_uart_send(board, "\xFF", 1); /* low for a third of a bit */
    board_uart_gap(board, 20 * BIT);
    board_uart_baud(board, 38400);
    board_uart_send_text(board, "x");
    settle();
    TEST_ASSERT_EQUAL(1, get("r_count", 0));
    TEST_ASSERT_EQUAL('x', get("r_data", 0));
}

static void test_parity_is_checked(void)
{
    receive_on_board(UBRR_38400, (setting_t){0, 0, FORMAT_7E1, 0}, false);
    board_uart_send(board, "\x41\xC1", 2); /* the same seven bits; the second byte's eighth makes parity odd */
    settle();
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 0));
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE | UPE, get("r_status", 1));
    TEST_ASSERT_EQUAL_HEX8(0x41, get("r_data", 0));
    TEST_ASSERT_EQUAL_HEX8(0x41, get("r_data", 1));
}

static void test_ninth_bit_is_rxb8(void)
{
    receive_on_board(UBRR_38400, (setting_t){0, UCSZ2, FORMAT_8N1, 0}, false);
    board_uart_send(board, "\x12", 1); /* its stop bit is taken for bit 8 */
    board_uart_gap(board, 2 * BIT);
    board_uart_send_bad(board, 0x34); /* bit 8 is low, then a high bit stops */
    settle();
    TEST_ASSERT_EQUAL(2, get("r_count", 0));
    TEST_ASSERT_EQUAL_HEX8(0x12, get("r_data", 0));
    TEST_ASSERT_EQUAL_HEX8(RXB8, get("r_ninth", 0) & RXB8);
    TEST_ASSERT_EQUAL_HEX8(0x34, get("r_data", 1));
    TEST_ASSERT_EQUAL_HEX8(0, get("r_ninth", 1) & RXB8);
    TEST_ASSERT_EQUAL_HEX8(RXC | UDRE, get("r_status", 1));
}

static void test_multiprocessor_mode_ignores_data_frames(void)
{
    receive_on_board(UBRR_38400, (setting_t){MPCM, UCSZ2, FORMAT_8N1, 0}, false);
    board_uart_send(board, "\x12", 1);
    board_uart_gap(board, 2 * BIT);
    board_uart_send_bad(board, 0x34);
    settle();
    TEST_ASSERT_EQUAL(1, get("r_count", 0));
    TEST_ASSERT_EQUAL_HEX8(0x12, get("r_data", 0));
}

static void test_disabling_the_receiver_flushes_it(void)
{
    receive_on_board(UBRR_38400, plain, true);
    board_uart_send_text(board, "abc");
    settle();
    set("p_flush", 0, 1);
    run(1000);
    set("p_hold", 0, 0);
    board_uart_send_text(board, "d");
    settle();
    TEST_ASSERT_EQUAL(1, get("r_count", 0));
    TEST_ASSERT_EQUAL('d', get("r_data", 0));
}

/* -- interrupts, peer ---------------------------------------------------------------------------------------------------------- */

static void start_echo(void)
{
    start(PROGRAM("usart_echo"));
    run(10000); /* .bss is cleared, the receiver is on */
}

static void test_interrupts_echo_a_long_stream_without_loss(void)
{
    enum { COUNT = 20000 };
    static uint8_t bytes[COUNT];
    size_t count;

    start_echo();
    double sent = (double)board_cycle(board);
    for (unsigned i = 0; i < COUNT; i++)
        bytes[i] = (uint8_t)(i * 31 + i / 256);
    board_uart_send(board, bytes, COUNT);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE((uint64_t)ceil(sent + COUNT * 10 * (16e6 / 38400)), board_uart_last_sent(board),
                                     "the peer's rate drifts");
    settle();
    TEST_ASSERT_EQUAL(0, get("r_errors", 0));
    TEST_ASSERT_EQUAL(COUNT, get16("r_received"));
    TEST_ASSERT_EQUAL(COUNT, get16("r_sent"));
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_EQUAL(COUNT, count);
    for (unsigned i = 0; i < COUNT; i++)
        TEST_ASSERT_EQUAL_HEX8(bytes[i], byte[i].byte);
}

static void test_tx_complete_interrupt_comes_once_a_pause(void)
{
    start_echo();
    board_uart_send_text(board, "ab");
    board_uart_gap(board, 5 * BYTE);
    board_uart_send_text(board, "c");
    settle();
    TEST_ASSERT_EQUAL_STRING("abc", board_uart_text(board));
    /* The echo of a ends before that of b begins only if the peer is slower than the board: 38,400 against 38,462. */
    TEST_ASSERT_INT_WITHIN(1, 2, get16("r_completed"));
    run(10 * BYTE);
    TEST_ASSERT_INT_WITHIN(1, 2, get16("r_completed"));
}

static void keep_byte(void *ctx, board_uart_byte_t byte)
{
    char *text = ctx;
    size_t length = strlen(text);
    text[length] = (char)byte.byte;
    text[length + 1] = '\0';
}

static void test_callback_gets_bytes_instead_of_the_store(void)
{
    char text[16] = "";
    start_echo();
    board_on_uart(board, keep_byte, text);
    board_uart_send_text(board, "hello");
    settle();
    TEST_ASSERT_EQUAL_STRING("hello", text);
    TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
    board_on_uart(board, NULL, NULL);
    board_uart_send_text(board, "again");
    settle();
    TEST_ASSERT_EQUAL_STRING("again", board_uart_text(board));
    board_uart_clear(board);
    TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
}

static void test_bytes_sent_before_the_receiver_is_on_are_lost(void)
{
    start(PROGRAM("usart_echo"));
    board_uart_send_text(board, "x"); /* its start bit falls into the start-up code */
    settle();
    board_uart_send_text(board, "y");
    settle();
    const char *text = board_uart_text(board);
    TEST_ASSERT_EQUAL('y', text[strlen(text) - 1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_registers_hold_their_initial_values_after_reset);
    RUN_TEST(test_byte_lasts_ten_bits_of_16_prescaler_periods);
    RUN_TEST(test_double_speed_halves_the_bit_in_any_order_of_writing);
    RUN_TEST(test_frame_formats_have_their_own_lengths);
    RUN_TEST(test_bytes_follow_each_other_without_a_gap);
    RUN_TEST(test_txc_is_set_with_the_last_stop_bit_and_cleared_by_writing_one);
    RUN_TEST(test_transmitter_has_one_buffer_and_the_shift_register);
    RUN_TEST(test_disabling_the_transmitter_waits_for_pending_bytes);
    RUN_TEST(test_start_bits_keep_to_the_free_running_shift_clock);
    RUN_TEST(test_peer_at_another_rate_reads_rubbish);
    RUN_TEST(test_receiver_gets_every_byte_value_back_to_back);
    RUN_TEST(test_rxc_is_set_when_the_stop_bit_has_been_voted);
    RUN_TEST(test_receiver_tolerates_the_rates_of_the_datasheet);
    RUN_TEST(test_receiver_fails_where_two_of_three_votes_fall_into_the_next_bit);
    RUN_TEST(test_receiver_holds_two_bytes_and_the_shift_register);
    RUN_TEST(test_fourth_byte_overruns_at_its_start_bit);
    RUN_TEST(test_byte_read_before_the_next_start_bit_prevents_the_overrun);
    RUN_TEST(test_low_stop_bit_flags_its_own_byte_only);
    RUN_TEST(test_break_is_one_zero_byte_with_a_framing_error);
    RUN_TEST(test_short_low_pulse_is_noise);
    RUN_TEST(test_parity_is_checked);
    RUN_TEST(test_ninth_bit_is_rxb8);
    RUN_TEST(test_multiprocessor_mode_ignores_data_frames);
    RUN_TEST(test_disabling_the_receiver_flushes_it);
    RUN_TEST(test_interrupts_echo_a_long_stream_without_loss);
    RUN_TEST(test_tx_complete_interrupt_comes_once_a_pause);
    RUN_TEST(test_callback_gets_bytes_instead_of_the_store);
    RUN_TEST(test_bytes_sent_before_the_receiver_is_on_are_lost);
    return UNITY_END();
}
