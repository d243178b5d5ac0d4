/* USART0 of the simulated board and the peer at the other end of its line: DS40002061 chapter 20, asynchronous mode.
 *
 * A byte is one event in each direction. What a line does is a list of frames with exact (fractional) start times; both
 * receivers, the chip's and the peer's, sample that list when the last sample of a frame is due.
 *
 * Clocks (20.3, figure 20-2). The prescaler counts UBRR0 + 1 cycles; the receiver samples at each of its ticks, the
 * transmitter shifts at every 16th (8th with U2X0). The prescaler runs all the time, so a byte written while the
 * transmitter is idle starts at the next shift clock, up to one bit time later. The datasheet does not tell the phase of
 * that clock: here the write of UBRR0L starts both ("immediate update of the baud rate prescaler", 20.11.5).
 *
 * Not modelled: synchronous and SPI mode, power reduction, the two cycles of the receiver's synchroniser, the levels of
 * RXD (the peer's bytes are not seen on pin D0, nor what drives D0 by the receiver). TXD shows the bits only while
 * somebody watches the pin when a byte starts; otherwise it stays high. A change of rate or format lets the byte that is
 * being sent end as it began; a byte that is being received is lost. A byte written to UDR0 while TXEN0 is 0 is lost. */
#include "board_internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UCSR0A = 0xC0, UCSR0B = 0xC1, UCSR0C = 0xC2, UBRR0L = 0xC4, UBRR0H = 0xC5, UDR0 = 0xC6 };

/* UCSR0A, 20.11.2 */
enum { MPCM = 0x01, U2X = 0x02, UPE = 0x04, DOR = 0x08, FE = 0x10, UDRE = 0x20, TXC = 0x40, RXC = 0x80 };
/* UCSR0B, 20.11.3 */
enum { TXB8 = 0x01, RXB8 = 0x02, UCSZ2 = 0x04, TXEN = 0x08, RXEN = 0x10, UDRIE = 0x20, TXCIE = 0x40, RXCIE = 0x80 };
/* UCSR0C, 20.11.4 */
enum { UCSZ10 = 0x06, USBS = 0x08, UPM0 = 0x10, UPM1 = 0x20 };

#define RXD BOARD_PIN('D', 0)
#define TXD BOARD_PIN('D', 1)

/* -- a line: frames in the order of their time, high in between ------------------------------------------------------- */

typedef struct {
    double start;  /* cycle of the first bit's leading edge */
    double bit;    /* cycles a bit */
    uint16_t bits; /* levels, the first one (the start bit) in bit 0 */
    uint8_t count; /* of bits */
} frame_t;

typedef struct {
    frame_t *frames;
    size_t head; /* frames before it are of the past */
    size_t count;
    size_t room;
} line_t;

static void *grown(void *items, size_t *room, size_t size)
{
    *room = *room ? *room * 2 : 64;
    items = realloc(items, *room * size);
    if (!items)
        abort();
    return items;
}

static void line_push(line_t *line, frame_t frame)
{
    if (line->head > 1024 && line->head > line->count / 2) {
        line->count -= line->head;
        memmove(line->frames, line->frames + line->head, line->count * sizeof *line->frames);
        line->head = 0;
    }
    if (line->count == line->room)
        line->frames = grown(line->frames, &line->room, sizeof *line->frames);
    line->frames[line->count++] = frame;
}

static double frame_end(const frame_t *frame)
{
    return frame->start + frame->count * frame->bit;
}

/* Nobody will ask for times before this one any more. */
static void line_forget(line_t *line, double until)
{
    while (line->head < line->count && frame_end(&line->frames[line->head]) <= until)
        line->head++;
}

/* The first time from t on at which the line has that level; INFINITY: none as far as is known. */
static double line_find(const line_t *line, double t, int level)
{
    for (size_t i = line->head; i < line->count; i++) {
        const frame_t *frame = &line->frames[i];
        double end = frame_end(frame);
        if (end <= t)
            continue;
        if (t < frame->start) {
            if (level)
                return t;
            t = frame->start;
        }
        unsigned k = (unsigned)((t - frame->start) / frame->bit);
        if (frame->start + (k + 1) * frame->bit <= t)
            k++; /* the quotient was rounded down below a whole number: t would have both levels */
        for (; k < frame->count; k++) {
            if ((frame->bits >> k & 1) == level)
                return fmax(t, frame->start + k * frame->bit);
        }
        t = end;
    }
    return level ? t : INFINITY;
}

static int line_level(const line_t *line, double t)
{
    return line_find(line, t, 1) <= t;
}

/* -- state -------------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint16_t data;
    uint8_t errors; /* FE, DOR, UPE: buffered with the byte, 20.7.4 */
} received_t;

struct usart {
    /* clock and format, from the registers */
    uint32_t tick;         /* cycles between two samples */
    uint32_t samples;      /* a bit: 16 or 8 */
    uint32_t vote;         /* number of the first of the three samples that vote: 8 or 4 (figures 20-5 to 20-7) */
    uint32_t data_bits;    /* 5 to 9 */
    uint32_t parity;       /* UPM1 and UPM0 as in UCSR0C; 0: none */
    uint32_t stop_bits;    /* 1 or 2, of the transmitter */
    uint64_t clock_origin; /* the prescaler's last restart */

    /* transmitter */
    bool tx_full; /* the buffer holds a byte: UDRE0 is 0 */
    uint16_t tx_buffer;
    bool tx_shifting;
    frame_t tx_frame; /* in the shift register */
    uint32_t tx_edge; /* the bit whose leading edge comes next, if TXD is watched */
    bool txc;

    /* receiver */
    received_t fifo[2];
    unsigned fifo_count;
    received_t shift; /* a complete byte that found the FIFO full, 20.7.4 */
    bool shift_waiting;
    bool lost; /* bytes were lost: the next one carries DOR */
    uint8_t last_read;
    uint64_t rx_search; /* looks for a start bit from here on */
    bool rx_high;       /* and the line was high just before */
    uint64_t rx_first;  /* the start bit's first low sample */
    bool rx_at_start;   /* the planned event is the start bit's vote, not the stop bit's */
    uint32_t overruns;

    /* peer */
    double peer_bit; /* cycles */
    line_t from_peer;
    double anchor;     /* the peer's bytes start at anchor + n x 10 bits: no sum of rounding errors */
    uint64_t anchored; /* n */
    double tail;       /* end of what the peer was told to send */
    line_t to_peer;
    double peer_search;
    bool peer_high;
    board_uart_byte_t *decoded;
    size_t decoded_count, decoded_room;
    char *text; /* the same, NUL-terminated */
    size_t text_room;
    void (*on_byte)(void *ctx, board_uart_byte_t byte);
    void *on_byte_ctx;
};

/* Flags into UCSR0A, requests to the interrupt logic: after every change. */
static void refresh(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;
    uint8_t flags = 0;

    if (u->fifo_count)
        flags = (uint8_t)(flags | RXC | u->fifo[0].errors);
    if (!u->tx_full)
        flags |= UDRE;
    if (u->txc)
        flags |= TXC;
    REG(b, UCSR0A) = (uint8_t)((REG(b, UCSR0A) & (U2X | MPCM)) | flags);

    uint8_t ninth = u->fifo_count && u->fifo[0].data & 0x100 ? RXB8 : 0;
    uint8_t enabled = REG(b, UCSR0B) = (uint8_t)((REG(b, UCSR0B) & ~RXB8) | ninth);
    irq_set(b, VECTOR_USART_RX, flags & RXC && enabled & RXCIE, cycle);
    irq_set(b, VECTOR_USART_UDRE, flags & UDRE && enabled & UDRIE, cycle);
    irq_set(b, VECTOR_USART_TX, flags & TXC && enabled & TXCIE, cycle);
}

static int parity_bit(const struct usart *u, uint16_t data)
{
    int odd = __builtin_parity(data & ((1u << u->data_bits) - 1u));
    return u->parity == (UPM1 | UPM0) ? !odd : odd;
}

/* -- the peer listens ------------------------------------------------------------------------------------------------------ */

static void peer_keep(struct usart *u, board_uart_byte_t byte)
{
    if (u->on_byte) {
        u->on_byte(u->on_byte_ctx, byte);
        return;
    }
    if (u->decoded_count == u->decoded_room)
        u->decoded = grown(u->decoded, &u->decoded_room, sizeof *u->decoded);
    if (u->decoded_count + 1 >= u->text_room)
        u->text = grown(u->text, &u->text_room, 1);
    u->text[u->decoded_count] = (char)byte.byte;
    u->decoded[u->decoded_count++] = byte;
    u->text[u->decoded_count] = '\0';
}

/* Decodes what is complete by now, sampling in the middle of the peer's own bits. */
static void peer_listen(struct usart *u, uint64_t now)
{
    for (;;) {
        double from = u->peer_high ? u->peer_search : line_find(&u->to_peer, u->peer_search, 1);
        double start = line_find(&u->to_peer, from, 0);
        double last = start + 9.5 * u->peer_bit;
        if (!(last <= (double)now))
            return;
        line_forget(&u->to_peer, start);
        const frame_t *frame = &u->to_peer.frames[u->to_peer.head];
        board_uart_byte_t byte = {(uint64_t)llround(start), (uint64_t)llround(frame_end(frame)), 0};
        for (int i = 0; i < 8; i++)
            byte.byte = (uint8_t)(byte.byte | line_level(&u->to_peer, start + (1.5 + i) * u->peer_bit) << i);
        u->peer_high = line_level(&u->to_peer, last);
        u->peer_search = last;
        line_forget(&u->to_peer, last);
        peer_keep(u, byte);
    }
}

/* -- transmitter, 20.6 --------------------------------------------------------------------------------------------------------- */

static void tx_ended(board_t *b, uint64_t cycle);

static uint16_t frame_bits(const struct usart *u, uint16_t data, uint8_t *count)
{
    uint32_t bits = (data & ((1u << u->data_bits) - 1u)) << 1;
    uint32_t n = 1 + u->data_bits;
    if (u->parity)
        bits |= (uint32_t)parity_bit(u, data) << n++;
    for (uint32_t i = 0; i < u->stop_bits; i++)
        bits |= 1u << n++;
    *count = (uint8_t)n;
    return (uint16_t)bits;
}

/* TXD at the leading edge of a bit that differs from the one before; then the next such edge. */
static void tx_edge(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;
    const frame_t *frame = &u->tx_frame;
    int level = frame->bits >> u->tx_edge & 1;

    pin_override(b, TXD, PIN_OUTPUT, level, cycle);
    do
        u->tx_edge++;
    while (u->tx_edge < frame->count && (frame->bits >> u->tx_edge & 1) == level);
    if (u->tx_edge < frame->count)
        event_at(b, EVENT_USART_3, (uint64_t)(frame->start + u->tx_edge * frame->bit), tx_edge);
}

static void tx_load(board_t *b, uint16_t data, uint64_t start)
{
    struct usart *u = b->usart;
    frame_t *frame = &u->tx_frame;

    frame->start = (double)start;
    frame->bit = (double)(u->tick * u->samples);
    frame->bits = frame_bits(u, data, &frame->count);
    u->tx_shifting = true;
    line_push(&u->to_peer, *frame);
    event_at(b, EVENT_USART_TX, (uint64_t)frame_end(frame), tx_ended);
    if (pin_watched(b, TXD)) {
        u->tx_edge = 0;
        event_at(b, EVENT_USART_3, start, tx_edge);
    }
}

static void tx_ended(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;

    u->tx_shifting = false;
    if (u->tx_full) {
        u->tx_full = false;
        tx_load(b, u->tx_buffer, cycle);
    } else {
        u->txc = true;
        if (!(REG(b, UCSR0B) & TXEN)) /* disabled meanwhile: effective now, 20.6.5 */
            pin_override(b, TXD, PIN_FREE, 0, cycle);
    }
    refresh(b, cycle);
    peer_listen(u, cycle);
}

static void tx_write(board_t *b, uint8_t value, uint64_t cycle)
{
    struct usart *u = b->usart;
    uint8_t control = REG(b, UCSR0B);
    uint16_t data = (uint16_t)(value | (control & TXB8) << 8);

    if (!(control & TXEN) || u->tx_full)
        return;
    if (u->tx_shifting) {
        u->tx_buffer = data;
        u->tx_full = true;
        return;
    }
    /* To the shift register at once; out with the next shift clock. */
    uint64_t bit = (uint64_t)u->tick * u->samples;
    tx_load(b, data, u->clock_origin + ((cycle - u->clock_origin) / bit + 1) * bit);
}

static void tx_acknowledged(board_t *b, int vector, uint64_t cycle)
{
    (void)vector;
    b->usart->txc = false;
    refresh(b, cycle);
}

/* -- receiver, 20.7 and 20.8 --------------------------------------------------------------------------------------------------- */

static void rx_event(board_t *b, uint64_t cycle);

/* The first sample at or after t. */
static uint64_t sample_from(const struct usart *u, double t)
{
    double ticks = ceil((t - (double)u->clock_origin) / u->tick);
    return u->clock_origin + (ticks > 0 ? (uint64_t)ticks * u->tick : 0);
}

/* The sample that is the n-th (from 1) of a bit; the start bit is bit 0. */
static uint64_t sample_at(const struct usart *u, uint32_t bit, uint32_t n)
{
    return u->rx_first + (uint64_t)(bit * u->samples + n - 1) * u->tick;
}

static int rx_bit(const struct usart *u, uint32_t bit)
{
    int high = 0;
    for (uint32_t i = 0; i < 3; i++)
        high += line_level(&u->from_peer, (double)sample_at(u, bit, u->vote + i));
    return high >= 2;
}

/* Number of the stop bit: start bit 0, data bits, parity. */
static uint32_t rx_stop_bit(const struct usart *u)
{
    return 1 + u->data_bits + (u->parity != 0);
}

/* The first low sample after a high one, from rx_search on; NEVER: none as far as is known. */
static uint64_t rx_find_start(struct usart *u)
{
    for (;;) {
        if (!u->rx_high) {
            uint64_t high = sample_from(u, line_find(&u->from_peer, (double)u->rx_search, 1));
            u->rx_high = line_level(&u->from_peer, (double)high);
            u->rx_search = u->rx_high ? high : high + 1;
            continue;
        }
        double edge = line_find(&u->from_peer, (double)u->rx_search, 0);
        if (isinf(edge))
            return NEVER;
        uint64_t low = sample_from(u, edge);
        if (!line_level(&u->from_peer, (double)low))
            return low;
        u->rx_search = low;
    }
}

static void rx_plan(board_t *b)
{
    struct usart *u = b->usart;

    event_cancel(b, EVENT_USART_RX);
    if (!(REG(b, UCSR0B) & RXEN))
        return;
    line_forget(&u->from_peer, (double)u->rx_search);
    u->rx_first = rx_find_start(u);
    if (u->rx_first == NEVER)
        return;
    /* While a byte waits in the shift register, the moment of the next start bit decides whether it is lost. */
    u->rx_at_start = u->shift_waiting;
    event_at(b, EVENT_USART_RX, sample_at(u, u->rx_at_start ? 0 : rx_stop_bit(u), u->vote + 2), rx_event);
}

/* The receiver forgets what it was receiving and looks for a start bit from now on. */
static void rx_restart(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;

    u->rx_search = cycle;
    u->rx_high = line_level(&u->from_peer, (double)cycle);
    rx_plan(b);
}

static void rx_store(struct usart *u, received_t byte)
{
    if (u->fifo_count < 2) {
        u->fifo[u->fifo_count++] = byte;
    } else {
        u->shift = byte;
        u->shift_waiting = true;
    }
}

static void rx_event(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;

    if (rx_bit(u, 0)) { /* two of three samples high: noise, 20.8.1 */
        uint64_t last = sample_at(u, 0, u->vote + 2);
        u->rx_high = line_level(&u->from_peer, (double)last);
        u->rx_search = last + u->tick;
        rx_plan(b);
        return;
    }
    if (u->rx_at_start) {
        if (u->shift_waiting) {
            u->shift_waiting = false;
            u->lost = true;
            u->overruns++;
        }
        u->rx_at_start = false;
        event_at(b, EVENT_USART_RX, sample_at(u, rx_stop_bit(u), u->vote + 2), rx_event);
        return;
    }

    received_t byte = {0, 0};
    for (uint32_t i = 0; i < u->data_bits; i++)
        byte.data = (uint16_t)(byte.data | rx_bit(u, 1 + i) << i);
    if (u->parity && rx_bit(u, 1 + u->data_bits) != parity_bit(u, byte.data))
        byte.errors |= UPE;
    int stop = rx_bit(u, rx_stop_bit(u));
    if (!stop)
        byte.errors |= FE;

    /* "right after the last of the bits used for majority voting", 20.8.2; a low line must rise first (break). */
    u->rx_search = sample_at(u, rx_stop_bit(u), u->vote + 3);
    u->rx_high = stop;

    /* Multi-processor mode: data frames are ignored, 20.9. */
    bool address = u->data_bits == 9 ? byte.data >> 8 & 1 : stop;
    if (address || !(REG(b, UCSR0A) & MPCM)) {
        if (u->lost)
            byte.errors |= DOR;
        u->lost = false;
        rx_store(u, byte);
    }
    refresh(b, cycle);
    rx_plan(b);
}

static void rx_flush(struct usart *u)
{
    u->fifo_count = 0;
    u->shift_waiting = false;
    u->lost = false;
}

/* -- registers ------------------------------------------------------------------------------------------------------------------- */

static void configure(board_t *b, uint64_t cycle)
{
    struct usart *u = b->usart;
    struct usart before = *u;
    uint8_t format = REG(b, UCSR0C);
    uint32_t size = (uint32_t)(format & UCSZ10) >> 1 | (uint32_t)(REG(b, UCSR0B) & UCSZ2);

    u->tick = ((uint32_t)(REG(b, UBRR0H) << 8) | REG(b, UBRR0L)) + 1;
    u->samples = REG(b, UCSR0A) & U2X ? 8 : 16;
    u->vote = REG(b, UCSR0A) & U2X ? 4 : 8;
    u->data_bits = size == 7 ? 9 : 5 + (size & 3);
    u->parity = format & UPM1 ? format & (UPM1 | UPM0) : 0;
    u->stop_bits = format & USBS ? 2 : 1;
    if (u->tick != before.tick || u->samples != before.samples || u->data_bits != before.data_bits ||
        u->parity != before.parity)
        rx_restart(b, cycle);
}

static uint8_t read_register(board_t *b, uint16_t address, uint64_t cycle)
{
    (void)cycle;
    return REG(b, address);
}

static uint8_t read_data(board_t *b, uint16_t address, uint64_t cycle)
{
    struct usart *u = b->usart;
    (void)address;

    if (u->fifo_count) {
        u->last_read = (uint8_t)u->fifo[0].data;
        u->fifo[0] = u->fifo[1];
        u->fifo_count--;
        if (u->shift_waiting) {
            u->shift_waiting = false;
            rx_store(u, u->shift);
        }
        refresh(b, cycle);
    }
    return u->last_read;
}

static void write_data(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    (void)address;
    tx_write(b, value, cycle);
    refresh(b, cycle);
}

static void write_status(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    if (value & TXC)
        b->usart->txc = false;
    REG(b, address) = value & (U2X | MPCM);
    configure(b, cycle);
    refresh(b, cycle);
}

static void write_control(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    struct usart *u = b->usart;
    uint8_t changed = (uint8_t)(REG(b, address) ^ value);

    REG(b, address) = value;
    configure(b, cycle);
    if (changed & RXEN) {
        rx_flush(u); /* 20.7.6 */
        pin_override(b, RXD, value & RXEN ? PIN_INPUT : PIN_FREE, 0, cycle);
        rx_restart(b, cycle);
    }
    if (changed & TXEN && !u->tx_shifting)
        pin_override(b, TXD, value & TXEN ? PIN_OUTPUT : PIN_FREE, 1, cycle);
    refresh(b, cycle);
}

static void write_format(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) = value;
    configure(b, cycle);
}

static void write_baud(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) = address == UBRR0H ? value & 0x0F : value;
    if (address == UBRR0L) {
        b->usart->clock_origin = cycle;
        rx_restart(b, cycle);
    }
    configure(b, cycle);
}

/* -- life ------------------------------------------------------------------------------------------------------------------------- */

void usart_init(board_t *b)
{
    struct usart *u = b->usart = calloc(1, sizeof *u);
    if (!u)
        abort();
    u->peer_bit = (double)BOARD_CPU_HZ / 38400.0;
    u->peer_high = true;
    u->text = grown(NULL, &u->text_room, 1);
    u->text[0] = '\0';
    reg_on_read(b, UCSR0A, read_register);
    reg_on_read(b, UCSR0B, read_register);
    reg_on_read(b, UDR0, read_data);
    reg_on_write(b, UCSR0A, write_status);
    reg_on_write(b, UCSR0B, write_control);
    reg_on_write(b, UCSR0C, write_format);
    reg_on_write(b, UBRR0L, write_baud);
    reg_on_write(b, UBRR0H, write_baud);
    reg_on_write(b, UDR0, write_data);
    irq_on_ack(b, VECTOR_USART_TX, tx_acknowledged);
    /* The Nano's USB converter holds an idle line high. */
    pin_drive(b, RXD, 1, 0);
}

void usart_reset(board_t *b)
{
    struct usart *u = b->usart;
    uint64_t now = board_time(b);

    event_cancel(b, EVENT_USART_RX);
    event_cancel(b, EVENT_USART_TX);
    event_cancel(b, EVENT_USART_3);

    if (u->tx_shifting) { /* the peer saw only the bits that had begun */
        frame_t *cut = &u->to_peer.frames[u->to_peer.count - 1];
        double gone = ceil(((double)now - cut->start) / cut->bit);
        cut->count = (uint8_t)(gone < 0 ? 0 : gone < cut->count ? gone : cut->count);
    }
    u->tx_shifting = false;
    u->tx_full = false;
    u->txc = false;
    u->last_read = 0;
    rx_flush(u);

    REG(b, UCSR0A) = 0;
    REG(b, UCSR0B) = 0;
    REG(b, UCSR0C) = UCSZ10;
    REG(b, UBRR0L) = 0;
    REG(b, UBRR0H) = 0;
    u->clock_origin = now;
    configure(b, now);
    refresh(b, now);
}

void usart_free(board_t *b)
{
    struct usart *u = b->usart;
    if (!u)
        return;
    free(u->from_peer.frames);
    free(u->to_peer.frames);
    free(u->decoded);
    free(u->text);
    free(u);
    b->usart = NULL;
}

/* -- the peer: board.h -------------------------------------------------------------------------------------------------------------- */

static void peer_send(board_t *b, uint16_t bits, uint8_t count)
{
    struct usart *u = b->usart;
    double now = (double)board_time(b);

    if (u->tail < now) {
        u->anchor = now;
        u->anchored = 0;
        u->tail = now;
    }
    line_push(&u->from_peer, (frame_t){u->tail, u->peer_bit, bits, count});
    u->anchored += count;
    u->tail = u->anchor + (double)u->anchored * u->peer_bit;
    if (event_due(b, EVENT_USART_RX) == NEVER)
        rx_plan(b);
}

/* What follows is timed from the end of what there is. */
static void peer_anchor(struct usart *u, double tail)
{
    u->tail = tail;
    u->anchor = tail;
    u->anchored = 0;
}

void board_uart_baud(board_t *b, double baud)
{
    struct usart *u = b->usart;

    peer_listen(u, board_time(b));
    u->peer_bit = (double)BOARD_CPU_HZ / baud;
    peer_anchor(u, u->tail);
}

void board_uart_send(board_t *b, const void *bytes, size_t count)
{
    const uint8_t *byte = bytes;
    for (size_t i = 0; i < count; i++)
        peer_send(b, (uint16_t)(byte[i] << 1 | 1 << 9), 10);
}

void board_uart_send_text(board_t *b, const char *text)
{
    board_uart_send(b, text, strlen(text));
}

void board_uart_gap(board_t *b, uint64_t cycles)
{
    struct usart *u = b->usart;
    peer_anchor(u, fmax(u->tail, (double)board_time(b)) + (double)cycles);
}

void board_uart_send_bad(board_t *b, uint8_t byte)
{
    peer_send(b, (uint16_t)(byte << 1 | 1 << 10), 11);
}

bool board_uart_sending(const board_t *b)
{
    return b->usart->tail > (double)board_time(b);
}

uint64_t board_uart_last_sent(const board_t *b)
{
    return (uint64_t)ceil(b->usart->tail);
}

const board_uart_byte_t *board_uart_received(const board_t *b, size_t *count)
{
    peer_listen(b->usart, board_time(b));
    *count = b->usart->decoded_count;
    return b->usart->decoded;
}

const char *board_uart_text(const board_t *b)
{
    peer_listen(b->usart, board_time(b));
    return b->usart->text;
}

void board_uart_clear(board_t *b)
{
    peer_listen(b->usart, board_time(b));
    b->usart->decoded_count = 0;
    b->usart->text[0] = '\0';
}

void board_on_uart(board_t *b, void (*fn)(void *ctx, board_uart_byte_t byte), void *ctx)
{
    peer_listen(b->usart, board_time(b));
    b->usart->on_byte = fn;
    b->usart->on_byte_ctx = ctx;
}

uint32_t board_uart_overruns(const board_t *b)
{
    return b->usart->overruns;
}
