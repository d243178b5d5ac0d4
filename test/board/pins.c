/* The three ports and what hangs on their pins, datasheet 14. */
#include "board_internal.h"

#include <stdlib.h>
#include <string.h>

#define PORTS 3
#define PINS (PORTS * 8)
#define WIRES_MAX 16
#define LISTENERS_MAX 2 /* a pin */
#define CLOCKS_MAX 4

#define REG_PIN(port) (uint16_t)(0x23 + 3 * (port))
#define REG_DDR(port) (uint16_t)(0x24 + 3 * (port))
#define REG_PORT(port) (uint16_t)(0x25 + 3 * (port))
#define REG_MCUCR 0x55
#define MCUCR_PUD 0x10

typedef struct {
    uint8_t driven, driven_level; /* from outside */
    uint8_t value, value_level;   /* a peripheral's level instead of PORT's */
    uint8_t force_out, force_in;  /* a peripheral's direction instead of DDR's */
    uint8_t level;                /* of the pads */
    uint8_t level_before;         /* before the cycle of the last change: the synchroniser still shows it */
    uint64_t changed_at;
    uint8_t recorded, wired, listened;
} port_t;

typedef struct {
    uint64_t cycle;
    uint64_t order; /* drives of one cycle keep their order */
    board_pin_t pin;
    int8_t level;
} drive_t;

typedef struct {
    board_pin_t pin;
    double half_period_cycles;
    uint64_t start;
    uint64_t edges;
    uint64_t due; /* NEVER: not running */
} pin_clock_t;

struct pins {
    port_t port[PORTS];
    pin_listener_t listener[PINS][LISTENERS_MAX];
    struct {
        board_pin_t output, input;
    } wire[WIRES_MAX];
    int wire_count;
    drive_t *drive; /* a heap, the earliest first */
    size_t drive_count, drive_size;
    uint64_t drive_order;
    pin_clock_t clock[CLOCKS_MAX];
    board_edge_t *edge;
    size_t edge_count, edge_size;
    void (*on_edge)(void *ctx, board_edge_t edge);
    void *on_edge_ctx;
};

static uint8_t pin_bit(board_pin_t pin)
{
    return (uint8_t)(1u << (pin & 7));
}

static void *grown(void *array, size_t *size, size_t element)
{
    *size = *size ? *size * 2 : 256;
    array = realloc(array, *size * element);
    if (array == NULL)
        abort();
    return array;
}

/* -- levels ---------------------------------------------------------------------------------------------------------- */

static uint8_t levels(const board_t *b, int port)
{
    const port_t *p = &b->pins->port[port];
    uint8_t port_bits = REG(b, REG_PORT(port));
    uint8_t out = (uint8_t)((REG(b, REG_DDR(port)) | p->force_out) & ~p->force_in);
    uint8_t out_level = (uint8_t)((port_bits & ~p->value) | (p->value_level & p->value));
    uint8_t pull_up = (REG(b, REG_MCUCR) & MCUCR_PUD) ? 0 : port_bits;
    uint8_t in_level = (uint8_t)((p->driven_level & p->driven) | (pull_up & ~p->driven)); /* a floating pin reads 0 */
    return (uint8_t)((out & out_level) | (~out & in_level));
}

static void report_edge(struct pins *pins, board_edge_t edge)
{
    if (pins->on_edge != NULL) {
        pins->on_edge(pins->on_edge_ctx, edge);
        return;
    }
    if (pins->edge_count == pins->edge_size)
        pins->edge = grown(pins->edge, &pins->edge_size, sizeof *pins->edge);
    pins->edge[pins->edge_count++] = edge;
}

static void edge_seen(board_t *b, board_pin_t pin, int level, uint64_t cycle)
{
    struct pins *pins = b->pins;
    port_t *p = &pins->port[pin >> 3];
    uint8_t bit = pin_bit(pin);

    if (p->recorded & bit)
        report_edge(pins, (board_edge_t){cycle, pin, (uint8_t)level});
    if (p->wired & bit)
        for (int i = 0; i < pins->wire_count; i++)
            if (pins->wire[i].output == pin)
                pin_drive(b, pins->wire[i].input, level, cycle);
    if (p->listened & bit)
        for (int i = 0; i < LISTENERS_MAX && pins->listener[pin][i] != NULL; i++)
            pins->listener[pin][i](b, level, cycle);
}

static void update(board_t *b, int port, uint64_t cycle)
{
    port_t *p = &b->pins->port[port];
    uint8_t now = levels(b, port);
    uint8_t changed = now ^ p->level;
    uint8_t seen;

    if (changed == 0)
        return;
    if (cycle != p->changed_at)
        p->level_before = p->level;
    p->changed_at = cycle;
    p->level = now;
    extint_pins_changed(b, port, now, changed, cycle); /* first: a callback may drive pins in its turn */
    seen = changed & (p->recorded | p->wired | p->listened);
    while (seen) {
        int bit = __builtin_ctz(seen);
        seen &= (uint8_t)(seen - 1);
        edge_seen(b, (board_pin_t)(port * 8 + bit), now >> bit & 1, cycle);
    }
}

/* -- registers ------------------------------------------------------------------------------------------------------ */

/* 14.2.4: the synchroniser delays by half a cycle to one and a half: what changed at the very edge that starts the
 * reading cycle is not yet seen (so OUT, NOP, IN). */
static uint8_t read_pins(board_t *b, uint16_t address, uint64_t cycle)
{
    const port_t *p = &b->pins->port[(address - REG_PIN(0)) / 3];
    timers_sync(b, cycle);
    return p->changed_at >= cycle ? p->level_before : p->level;
}

/* 14.2.2: ones toggle PORT bits. */
static void write_pins(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    int port = (address - REG_PIN(0)) / 3;
    REG(b, REG_PORT(port)) ^= reg_written_ones(b, value);
    update(b, port, cycle);
}

static void write_port_or_ddr(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) = value;
    update(b, (address - REG_PIN(0)) / 3, cycle);
}

static void write_mcucr(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) = value;
    for (int port = 0; port < PORTS; port++)
        update(b, port, cycle);
}

/* -- for the models -------------------------------------------------------------------------------------------------- */

void pin_override(board_t *b, board_pin_t pin, pin_override_t how, int level, uint64_t cycle)
{
    port_t *p = &b->pins->port[pin >> 3];
    uint8_t bit = pin_bit(pin);

    p->value &= (uint8_t)~bit;
    p->value_level &= (uint8_t)~bit;
    p->force_out &= (uint8_t)~bit;
    p->force_in &= (uint8_t)~bit;
    if (how == PIN_VALUE || how == PIN_OUTPUT) {
        p->value |= bit;
        if (level)
            p->value_level |= bit;
    }
    if (how == PIN_OUTPUT)
        p->force_out |= bit;
    if (how == PIN_INPUT)
        p->force_in |= bit;
    update(b, pin >> 3, cycle);
}

int pin_level(const board_t *b, board_pin_t pin)
{
    return b->pins->port[pin >> 3].level >> (pin & 7) & 1;
}

void pin_drive(board_t *b, board_pin_t pin, int level, uint64_t cycle)
{
    port_t *p = &b->pins->port[pin >> 3];
    uint8_t bit = pin_bit(pin);

    p->driven &= (uint8_t)~bit;
    p->driven_level &= (uint8_t)~bit;
    if (level >= 0)
        p->driven |= bit;
    if (level > 0)
        p->driven_level |= bit;
    update(b, pin >> 3, cycle);
}

bool pin_watched(const board_t *b, board_pin_t pin)
{
    const port_t *p = &b->pins->port[pin >> 3];
    return ((p->recorded | p->wired | p->listened | extint_watched(b, pin >> 3)) & pin_bit(pin)) != 0;
}

void pin_listen(board_t *b, board_pin_t pin, pin_listener_t fn)
{
    int i = 0;
    while (i < LISTENERS_MAX && b->pins->listener[pin][i] != NULL && b->pins->listener[pin][i] != fn)
        i++;
    if (i == LISTENERS_MAX)
        abort(); /* more listeners than LISTENERS_MAX */
    b->pins->listener[pin][i] = fn;
    b->pins->port[pin >> 3].listened |= pin_bit(pin);
}

/* -- drives planned ahead: a binary heap ------------------------------------------------------------------------------ */

static bool earlier(const drive_t *a, const drive_t *b)
{
    return a->cycle != b->cycle ? a->cycle < b->cycle : a->order < b->order;
}

static void swap(drive_t *a, drive_t *b)
{
    drive_t held = *a;
    *a = *b;
    *b = held;
}

static drive_t take_earliest(struct pins *pins)
{
    drive_t first = pins->drive[0];
    size_t i = 0;

    pins->drive[0] = pins->drive[--pins->drive_count];
    for (;;) {
        size_t least = i;
        for (size_t child = 2 * i + 1; child <= 2 * i + 2 && child < pins->drive_count; child++)
            if (earlier(&pins->drive[child], &pins->drive[least]))
                least = child;
        if (least == i)
            return first;
        swap(&pins->drive[i], &pins->drive[least]);
        i = least;
    }
}

static void drives_due(board_t *b, uint64_t cycle)
{
    struct pins *pins = b->pins;
    while (pins->drive_count > 0 && pins->drive[0].cycle <= cycle) {
        drive_t drive = take_earliest(pins);
        pin_drive(b, drive.pin, drive.level, cycle);
    }
    if (pins->drive_count > 0)
        event_at(b, EVENT_PIN_DRIVE, pins->drive[0].cycle, drives_due);
}

void board_pin_drive_at(board_t *b, board_pin_t pin, int level, uint64_t cycle)
{
    struct pins *pins = b->pins;
    size_t i = pins->drive_count;

    if (pins->drive_count == pins->drive_size)
        pins->drive = grown(pins->drive, &pins->drive_size, sizeof *pins->drive);
    if (cycle < board_time(b))
        cycle = board_time(b);
    pins->drive[i] = (drive_t){cycle, pins->drive_order++, pin, (int8_t)level};
    pins->drive_count++;
    while (i > 0 && earlier(&pins->drive[i], &pins->drive[(i - 1) / 2])) {
        swap(&pins->drive[i], &pins->drive[(i - 1) / 2]);
        i = (i - 1) / 2;
    }
    event_at(b, EVENT_PIN_DRIVE, pins->drive[0].cycle, drives_due);
}

/* -- square waves ------------------------------------------------------------------------------------------------------ */

static void clocks_due(board_t *b, uint64_t cycle);

static void plan_clocks(board_t *b)
{
    uint64_t due = NEVER;
    for (int i = 0; i < CLOCKS_MAX; i++)
        if (b->pins->clock[i].due < due)
            due = b->pins->clock[i].due;
    event_at(b, EVENT_PIN_CLOCK, due, clocks_due);
}

static void clocks_due(board_t *b, uint64_t cycle)
{
    for (int i = 0; i < CLOCKS_MAX; i++) {
        pin_clock_t *clock = &b->pins->clock[i];
        if (clock->due > cycle)
            continue;
        clock->edges++;
        clock->due = clock->start + (uint64_t)((double)(clock->edges + 1) * clock->half_period_cycles + 0.5);
        pin_drive(b, clock->pin, clock->edges & 1, cycle);
    }
    plan_clocks(b);
}

void board_pin_clock(board_t *b, board_pin_t pin, double hz)
{
    pin_clock_t *clock = NULL;
    for (int i = 0; i < CLOCKS_MAX; i++)
        if (b->pins->clock[i].due != NEVER && b->pins->clock[i].pin == pin)
            clock = &b->pins->clock[i];
    for (int i = 0; i < CLOCKS_MAX && clock == NULL; i++)
        if (b->pins->clock[i].due == NEVER)
            clock = &b->pins->clock[i];
    if (clock == NULL)
        abort(); /* more clocks than CLOCKS_MAX */

    clock->pin = pin;
    clock->start = board_time(b);
    clock->edges = 0;
    clock->due = NEVER;
    if (hz > 0) {
        pin_drive(b, pin, 0, clock->start);
        clock->half_period_cycles = (double)BOARD_CPU_HZ / hz / 2;
        clock->due = clock->start + (uint64_t)(clock->half_period_cycles + 0.5);
    }
    plan_clocks(b);
}

/* -- for the tests ---------------------------------------------------------------------------------------------------- */

void board_pin_drive(board_t *b, board_pin_t pin, int level)
{
    pin_drive(b, pin, level, board_time(b));
}

int board_pin_level(const board_t *b, board_pin_t pin)
{
    timers_sync((board_t *)b, board_time(b)); /* edges that nobody watches are made late */
    return pin_level(b, pin);
}

void board_pin_wire(board_t *b, board_pin_t output, board_pin_t input)
{
    struct pins *pins = b->pins;
    if (pins->wire_count == WIRES_MAX)
        abort();
    timers_sync(b, board_time(b));
    pins->wire[pins->wire_count].output = output;
    pins->wire[pins->wire_count].input = input;
    pins->wire_count++;
    pins->port[output >> 3].wired |= pin_bit(output);
    pin_drive(b, input, pin_level(b, output), board_time(b));
    timers_replan(b);
}

void board_record(board_t *b, board_pin_t pin, bool on)
{
    port_t *p = &b->pins->port[pin >> 3];
    timers_sync(b, board_time(b));
    if (on)
        p->recorded |= pin_bit(pin);
    else
        p->recorded &= (uint8_t)~pin_bit(pin);
    timers_replan(b);
}

const board_edge_t *board_edges(const board_t *b, size_t *count)
{
    *count = b->pins->edge_count;
    return b->pins->edge;
}

void board_edges_clear(board_t *b)
{
    b->pins->edge_count = 0;
}

void board_on_edge(board_t *b, void (*fn)(void *ctx, board_edge_t edge), void *ctx)
{
    b->pins->on_edge = fn;
    b->pins->on_edge_ctx = ctx;
}

/* -- life ------------------------------------------------------------------------------------------------------------ */

void pins_init(board_t *b)
{
    b->pins = calloc(1, sizeof *b->pins);
    if (b->pins == NULL)
        abort();
    for (int i = 0; i < CLOCKS_MAX; i++)
        b->pins->clock[i].due = NEVER;
    for (int port = 0; port < PORTS; port++) {
        reg_on_read(b, REG_PIN(port), read_pins);
        reg_on_write(b, REG_PIN(port), write_pins);
        reg_on_write(b, REG_DDR(port), write_port_or_ddr);
        reg_on_write(b, REG_PORT(port), write_port_or_ddr);
    }
    reg_on_write(b, REG_MCUCR, write_mcucr);
}

/* All pins become inputs without pull-up; what the outside drives, it goes on driving. */
void pins_reset(board_t *b)
{
    for (int port = 0; port < PORTS; port++) {
        port_t *p = &b->pins->port[port];
        p->value = p->value_level = p->force_out = p->force_in = 0;
        update(b, port, board_time(b));
    }
}

void pins_free(board_t *b)
{
    free(b->pins->drive);
    free(b->pins->edge);
    free(b->pins);
}
