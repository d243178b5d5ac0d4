#include "soft_peer.h"
#include "image.h"

#include <math.h>

#define SW_RX BOARD_PIN('D', 4)
#define SW_TX BOARD_PIN('D', 6)

#define MOST_EDGES 400000
#define MOST_BYTES 65536

double soft_peer_off;
unsigned soft_peer_bad;
size_t soft_peer_flip = SIZE_MAX;

static board_t *board_of;
static double bit;
static board_edge_t tx[MOST_EDGES], tx_en[MOST_EDGES];
static size_t tx_count, tx_en_count;
static board_uart_byte_t bytes_seen[MOST_BYTES];
static char text[MOST_BYTES + 1];

static void on_edge(void *ctx, board_edge_t edge)
{
    if (edge.pin == SW_TX && tx_count < MOST_EDGES)
        tx[tx_count++] = edge;
    else if (edge.pin == TX_EN && tx_en_count < MOST_EDGES)
        tx_en[tx_en_count++] = edge;
    else
        image_on_edge(ctx, edge);
}

void soft_peer_begin(board_t *b, double baud)
{
    board_of = b;
    bit = (double)BOARD_CPU_HZ / baud;
    board_pin_drive(b, SW_RX, 1);
    board_on_edge(b, on_edge, NULL);
    board_record(b, SW_TX, true);
    board_record(b, TX_EN, true);
    soft_peer_clear();
}

uint64_t soft_peer_send(const void *bytes, size_t count, uint64_t from, double bit_cycles)
{
    double at = (double)from;
    for (size_t i = 0; i < count; i++) {
        unsigned frame = ((const uint8_t *)bytes)[i] << 1 | 1u << 9;
        if (soft_peer_flip / 10 == i)
            frame ^= 1u << soft_peer_flip % 10;
        for (int k = 0; k < 10; k++, at += bit_cycles)
            board_pin_drive_at(board_of, SW_RX, frame >> k & 1, (uint64_t)llround(at));
    }
    soft_peer_flip = SIZE_MAX;
    const uint64_t end = (uint64_t)llround(at);
    board_pin_drive_at(board_of, SW_RX, 1, end); /* idle, whatever the last bit was */
    return end;
}

void soft_peer_level(int level, uint64_t cycle)
{
    board_pin_drive_at(board_of, SW_RX, level, cycle);
}

/* All edges since soft_peer_clear(): a byte begins at the first falling one after the byte before. */
const board_uart_byte_t *soft_peer_bytes(size_t *count)
{
    size_t length = 0;
    soft_peer_bad = 0;
    soft_peer_off = 0;
    for (size_t i = 0; i < tx_count;) {
        const double start = (double)tx[i].cycle;
        if (tx[i].level || start + 10 * bit > (double)board_cycle(board_of)) {
            i++;
            continue;
        }
        unsigned frame = 0;
        int level = 0;
        double least = 0, most = 0;
        for (int k = 0; k < 10; k++) {
            while (i < tx_count && (double)tx[i].cycle < start + (k + 0.5) * bit) {
                const double off = remainder((double)tx[i].cycle - start, bit);
                least = fmin(least, off);
                most = fmax(most, off);
                level = tx[i++].level;
            }
            frame |= (unsigned)level << k;
        }
        soft_peer_off = fmax(soft_peer_off, (most - least) / 2);
        if (frame >> 9 == 0)
            soft_peer_bad++;
        if (length < MOST_BYTES)
            bytes_seen[length++] = (board_uart_byte_t){(uint64_t)start, (uint64_t)llround(start + 10 * bit),
                                                       (uint8_t)(frame >> 1)};
    }
    *count = length;
    return bytes_seen;
}

const char *soft_peer_text(void)
{
    size_t count;
    soft_peer_bytes(&count);
    for (size_t i = 0; i < count; i++)
        text[i] = (char)bytes_seen[i].byte;
    text[count] = '\0';
    return text;
}

const board_edge_t *soft_peer_tx_en(size_t *count)
{
    *count = tx_en_count;
    return tx_en;
}

void soft_peer_clear_tx(void)
{
    tx_count = 0;
}

void soft_peer_clear_tx_en(void)
{
    tx_en_count = 0;
}

void soft_peer_clear(void)
{
    soft_peer_clear_tx();
    soft_peer_clear_tx_en();
}
