#include "master.h"
#include "image.h"
#include "crc8.h"
#include "soft_peer.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Tx En covers the line from a bit before the first start bit on, and no longer than an interrupt takes behind the last
 * stop bit. */
#define FALL_MOST (20 * US)

master_measures_t master_measures;
uint64_t master_patience;

static unsigned terminal, crc_mode;
static double line_bit;
static uint64_t sent_from, sent_at; /* first start bit and last stop bit of what the master sends without a gap */

/* -- frames -------------------------------------------------------------------------------------------------------- */

frame_t master_frame(uint8_t destination, uint8_t origin, const char *body)
{
    const size_t length = strlen(body);
    frame_t frame = {.byte = {2, destination, origin}, .count = 3 + length};
    memcpy(frame.byte + 3, body, length);
    uint8_t crc = crc_mode == 2 ? crc8(frame.byte + 1, length + 2) : crc8(frame.byte + 3, length);
    if (crc_mode == 1 && crc == 0) { /* would read as none */
        frame.byte[frame.count++] = ' ';
        crc = crc8(frame.byte + 3, length + 1);
    }
    frame.byte[frame.count++] = 3;
    if (crc_mode != 0)
        frame.byte[frame.count++] = crc;
    frame.byte[frame.count++] = 0;
    return frame;
}

frame_t master_hex(const char *bytes)
{
    frame_t frame = {.count = 0};
    for (char *end; *bytes != '\0'; bytes = end) {
        frame.byte[frame.count++] = (uint8_t)strtoul(bytes, &end, 16);
        end += strspn(end, " ");
    }
    return frame;
}

/* -- the line ------------------------------------------------------------------------------------------------------ */

void master_begin(unsigned terminal_at, unsigned mode)
{
    master_begin_at(terminal_at, mode, BAUD);
}

void master_begin_at(unsigned terminal_at, unsigned mode, uint32_t baud)
{
    terminal = terminal_at;
    crc_mode = mode;
    line_bit = 16e6 / baud;
    master_patience = 5 * MS;
    IMAGE_SET(network, terminal);
    IMAGE_SET(crc_mode, mode);
    if (terminal == TERMINAL_SOFT) {
        IMAGE_SET(hw_baud, baud);
        board_uart_baud(board, baud);
        soft_peer_begin(board, BAUD);
    } else {
        IMAGE_SET(sw_baud, baud);
        soft_peer_begin(board, baud);
    }
    sent_from = sent_at = 0;
}

void master_boot(unsigned terminal_at, unsigned mode)
{
    image_off();
    image_power_on();
    master_begin(terminal_at, mode);
    image_run(3 * SECOND / 2);
    image_assert_holds(master_shown(), "SAC>");
    master_clear();
    image_train_clear();
}

void master_send(const frame_t *frame)
{
    const bool goes_on = sent_at > board_cycle(board);
    const uint64_t from = goes_on ? sent_at : board_cycle(board) + 50;
    if (!goes_on)
        sent_from = from;
    if (terminal == TERMINAL_SOFT) {
        board_uart_send(board, frame->byte, frame->count);
        sent_at = from + (uint64_t)(10 * line_bit * (double)frame->count);
    } else {
        sent_at = soft_peer_send(frame->byte, frame->count, from, line_bit);
    }
}

uint64_t master_sent_at(void)
{
    return sent_at;
}

static void check_tx_en(const board_uart_byte_t *byte, size_t bytes)
{
    size_t edges, n = 0;
    const board_edge_t *edge = soft_peer_tx_en(&edges);
    if (soft_peer_bad != 0)
        image_fail("%u bytes without a stop bit", soft_peer_bad);
    if (soft_peer_off > 8)
        image_fail("an edge of S/W Tx was %.1f cycles off", soft_peer_off);
    for (size_t i = 0; i < edges; i++) {
        if (edge[i].level != (i % 2 == 0))
            image_fail("Tx En: edge %zu is a %s", i, edge[i].level ? "rise" : "fall");
        if (i % 2 == 0)
            continue;
        const uint64_t rise = edge[i - 1].cycle, fall = edge[i].cycle;
        if (n == bytes || byte[n].start_cycle > fall)
            image_fail("Tx En high from %" PRIu64 " to %" PRIu64 " for no byte", rise, fall);
        if ((double)byte[n].start_cycle < (double)rise + line_bit - 1)
            image_fail("Tx En rose at %" PRIu64 ", the start bit came at %" PRIu64, rise, byte[n].start_cycle);
        const uint64_t before = byte[n].start_cycle - rise;
        while (n < bytes && byte[n].start_cycle < fall)
            n++;
        if (fall + 2 < byte[n - 1].end_cycle || fall > byte[n - 1].end_cycle + FALL_MOST)
            image_fail("Tx En fell at %" PRIu64 ", the last stop bit ended at %" PRIu64, fall, byte[n - 1].end_cycle);
        if (sent_from < fall && sent_at > rise)
            image_fail("the board drove the line from %" PRIu64 ", the master until %" PRIu64, rise, sent_at);
        master_measures_t *m = &master_measures;
        if (m->rise_min == 0 || before < m->rise_min)
            m->rise_min = before;
        if (before > m->rise_max)
            m->rise_max = before;
        if (fall > byte[n - 1].end_cycle + m->fall_max)
            m->fall_max = fall - byte[n - 1].end_cycle;
        if (fall - rise > m->enabled_max)
            m->enabled_max = fall - rise;
    }
    if (edges % 2 == 0 && n != bytes)
        image_fail("a byte at %" PRIu64 " without Tx En", byte[n].start_cycle);
}

const board_uart_byte_t *master_heard(size_t *count)
{
    size_t soft_count;
    const board_uart_byte_t *soft = soft_peer_bytes(&soft_count);
    const board_uart_byte_t *byte = terminal == TERMINAL_SOFT ? board_uart_received(board, count) : soft;
    if (terminal != TERMINAL_SOFT)
        *count = soft_count;
    check_tx_en(byte, *count);
    return byte;
}

void master_clear(void)
{
    if (terminal == TERMINAL_SOFT) {
        soft_peer_clear_tx_en();
        board_uart_clear(board);
    } else {
        soft_peer_clear();
    }
}

static bool tx_en(void)
{
    return board_pin_level(board, TX_EN) != 0;
}

void master_exchange(const frame_t *frame)
{
    master_clear();
    master_send(frame);
    image_run(sent_at - board_cycle(board));
    const uint64_t end = sent_at;
    const uint64_t answer_by = end + master_patience + (uint64_t)(20 * line_bit);
    while (!tx_en() && board_cycle(board) < answer_by)
        image_run(50 * US);
    while (tx_en() && board_cycle(board) < answer_by + SECOND / 10 + (uint64_t)(400 * line_bit))
        image_run(50 * US);
    image_run(50 * US);
    if (tx_en())
        image_fail("Tx En is still high at %" PRIu64, board_cycle(board));
    size_t count;
    const board_uart_byte_t *byte = master_heard(&count);
    if (count != 0) {
        const uint64_t after = byte[0].start_cycle - end;
        if (master_measures.answer_min == 0 || after < master_measures.answer_min)
            master_measures.answer_min = after;
        if (after > master_measures.answer_max)
            master_measures.answer_max = after;
        if ((double)after < 10 * line_bit)
            image_fail("the answer came %" PRIu64 " cycles after the packet", after);
    }
}

void master_ask(const char *body)
{
    const frame_t frame = master_frame(UNIT, MASTER, body);
    master_exchange(&frame);
}

void master_assert_heard(const char *hex)
{
    char expected[400] = "", seen[400] = "";
    size_t count;
    const board_uart_byte_t *byte = master_heard(&count);
    const frame_t frame = master_hex(hex);
    for (size_t i = 0; i < frame.count; i++)
        snprintf(expected + 3 * i, 4, "%02X ", frame.byte[i]);
    for (size_t i = 0; i < count && i < 120; i++)
        snprintf(seen + 3 * i, 4, "%02X ", byte[i].byte);
    if (strcmp(expected, seen) != 0)
        image_fail("expected on the line %s, saw %s", expected, seen);
}

void master_assert_ack(void)
{
    static const char *const ack[] = {"02 01 55 06 03 00", "02 01 55 06 03 DD 00"};
    master_assert_heard(ack[crc_mode]);
}

/* -- the terminal -------------------------------------------------------------------------------------------------- */

static uint64_t begin_typing(const char *text)
{
    if (terminal == TERMINAL_SOFT)
        return soft_peer_send(text, strlen(text), board_cycle(board) + 50, 16e6 / BAUD);
    image_send(text);
    return board_cycle(board) + (uint64_t)(160e6 / BAUD * (double)strlen(text));
}

void master_type(const char *text)
{
    const uint64_t end = begin_typing(text);
    while (board_cycle(board) < end || (terminal == TERMINAL_USART && board_uart_sending(board)))
        image_run(50 * US);
}

void master_begin_line(const char *line)
{
    char text[100];
    snprintf(text, sizeof text, "%s\r", line);
    begin_typing(text);
}

const char *master_text(void)
{
    return terminal == TERMINAL_SOFT ? soft_peer_text() : board_uart_text(board);
}

const char *master_shown(void)
{
    static char text[65536];
    snprintf(text, sizeof text, "%s", master_text());
    if (terminal == TERMINAL_SOFT)
        soft_peer_clear_tx();
    else
        board_uart_clear(board);
    return text;
}
