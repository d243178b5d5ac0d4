#include "soft_peer.h"

#include <math.h>


#define SW_RX BOARD_PIN('D', 4)
#define SW_TX BOARD_PIN('D', 6)
#define TX_EN BOARD_PIN('D', 7)

double soft_peer_off;
unsigned soft_peer_bad, soft_peer_enabled;

static board_t *board_of;
static double bit;
static char text[65536];
static size_t length;

void soft_peer_begin(board_t *b, double baud)
{
    board_of = b;
    bit = (double)BOARD_CPU_HZ / baud;
    board_pin_drive(b, SW_RX, 1);
    board_on_edge(b, NULL, NULL); /* stored */
    board_record(b, SW_TX, true);
    board_record(b, TX_EN, true);
    soft_peer_clear();
}

uint64_t soft_peer_send(const void *bytes, size_t count, uint64_t from, double bit_cycles)
{
    double at = (double)from;
    for (size_t i = 0; i < count; i++) {
        unsigned frame = ((const uint8_t *)bytes)[i] << 1 | 1u << 9;
        for (int k = 0; k < 10; k++, at += bit_cycles)
            board_pin_drive_at(board_of, SW_RX, frame >> k & 1, (uint64_t)llround(at));
    }
    return (uint64_t)llround(at);
}

void soft_peer_level(int level, uint64_t cycle)
{
    board_pin_drive_at(board_of, SW_RX, level, cycle);
}

/* All edges since soft_peer_clear(): a byte begins at the first falling one after the byte before. */
const char *soft_peer_text(void)
{
    static board_edge_t tx[400000];
    size_t count, n = 0;
    const board_edge_t *edges = board_edges(board_of, &count);
    soft_peer_enabled = 0;
    for (size_t i = 0; i < count; i++) {
        soft_peer_enabled += edges[i].pin == TX_EN;
        if (edges[i].pin == SW_TX && n < sizeof tx / sizeof tx[0])
            tx[n++] = edges[i];
    }
    length = 0;
    soft_peer_bad = 0;
    soft_peer_off = 0;
    for (size_t i = 0; i < n;) {
        const double start = (double)tx[i].cycle;
        if (tx[i].level || start + 10 * bit > (double)board_cycle(board_of)) {
            i++;
            continue;
        }
        unsigned frame = 0;
        int level = 0;
        double least = 0, most = 0;
        for (int k = 0; k < 10; k++) {
            while (i < n && (double)tx[i].cycle < start + (k + 0.5) * bit) {
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
        if (length + 1 < sizeof text)
            text[length++] = (char)(frame >> 1 & 0xFF);
    }
    text[length] = '\0';
    return text;
}

void soft_peer_clear(void)
{
    board_edges_clear(board_of);
}
