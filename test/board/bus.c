/* The line: what the drivers do is put in order after each quantum, then told to all that hear it. */
#include "board_internal.h"
#include "bus.h"
#include "splitmix64.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NODES_MAX 32
#define PEERS_MAX 8

#define SW_RX BOARD_PIN('D', 4)
#define SW_TX BOARD_PIN('D', 6)
#define TX_EN BOARD_PIN('D', 7)

#define RELEASED (-1)
#define BITS 10 /* start, 8 data, stop */

/* From `cycle` on a driver drives 0, 1 or nothing. */
typedef struct {
    uint64_t cycle;
    int8_t level;
} change_t;

/* What a driver will do, the earliest first. */
typedef struct {
    change_t *change;
    size_t first, count, size;
} plan_t;

typedef struct {
    plan_t plan;
    int level; /* of what it drives now */
} driver_t;

typedef struct bus_node {
    bus_t *bus;
    board_t *board;
    driver_t driver;
    /* its clock: at bus cycle `since` the board's was `board_since`, and it makes `rate` cycles a bus cycle */
    uint64_t since, board_since;
    double rate;
} bus_node_t;

struct bus_peer {
    bus_t *bus;
    driver_t driver;
    double bit_cycles;
    uint64_t free_at;
    /* the receiver */
    bool receiving;
    bool echo;
    uint64_t start;
    int bits; /* taken of this character, the start bit included */
    uint16_t shift;
    bus_byte_t *byte;
    size_t byte_count, byte_size;
};

struct bus {
    uint64_t now;
    bus_node_t node[NODES_MAX];
    int node_count;
    bus_peer_t *peer[PEERS_MAX];
    int peer_count;
    board_t *crashed;
    int level;   /* as it is heard */
    unsigned drivers;
    bool contending;
    uint32_t contentions;
    /* bit errors */
    double error_probability, error_bit_cycles;
    uint64_t random;
    uint64_t error_slot_start; /* of the bit time that is damaged or not */
    uint64_t error_due;        /* its end; NEVER: the line is not driven, or nothing is ever damaged */
    double error_slots;        /* since error_slot_start */
    bool inverted;
    uint32_t errors_made;
};

static void *grown(void *array, size_t *size, size_t element)
{
    *size = *size ? *size * 2 : 64;
    array = realloc(array, *size * element);
    if (array == NULL)
        abort();
    return array;
}

/* -- plans ----------------------------------------------------------------------------------------------------------- */

static uint64_t plan_due(const plan_t *plan)
{
    return plan->first < plan->count ? plan->change[plan->first].cycle : NEVER;
}

static void plan_add(plan_t *plan, uint64_t cycle, int level)
{
    if (plan->first == plan->count)
        plan->first = plan->count = 0;
    if (plan->count == plan->size)
        plan->change = grown(plan->change, &plan->size, sizeof *plan->change);
    plan->change[plan->count++] = (change_t){cycle, (int8_t)level};
}

/* The last of the changes that are due by then. */
static void driver_run(driver_t *driver, uint64_t cycle)
{
    while (plan_due(&driver->plan) <= cycle)
        driver->level = driver->plan.change[driver->plan.first++].level;
}

/* -- nodes ----------------------------------------------------------------------------------------------------------- */

static uint64_t board_cycle_at(const bus_node_t *node, uint64_t bus_time)
{
    return node->board_since + (uint64_t)llround((double)(bus_time - node->since) * node->rate);
}

static uint64_t bus_cycle_at(const bus_node_t *node, uint64_t board_time_)
{
    if (board_time_ <= node->board_since)
        return node->since;
    return node->since + (uint64_t)llround((double)(board_time_ - node->board_since) / node->rate);
}

uint64_t bus_board_cycle(const board_t *b, uint64_t bus_cycle)
{
    return board_cycle_at(b->bus_node, bus_cycle);
}

uint64_t bus_cycle_of(const board_t *b, uint64_t board_cycle_)
{
    return bus_cycle_at(b->bus_node, board_cycle_);
}

static void node_drives(board_t *b, int level, uint64_t cycle)
{
    bus_node_t *node = b->bus_node;
    (void)level;
    if (node != NULL)
        plan_add(&node->driver.plan, bus_cycle_at(node, cycle), pin_level(b, TX_EN) ? pin_level(b, SW_TX) : RELEASED);
}

void bus_join(bus_t *bus, board_t *b)
{
    if (bus->node_count == NODES_MAX)
        abort();
    bus_node_t *node = &bus->node[bus->node_count++];
    *node = (bus_node_t){.bus = bus, .board = b, .rate = 1, .since = bus->now, .board_since = board_cycle(b)};
    node->driver.level = RELEASED;
    b->bus_node = node;
    pin_listen(b, SW_TX, node_drives);
    pin_listen(b, TX_EN, node_drives);
    timers_sync(b, board_time(b));
    timers_replan(b); /* the edges of OC0A are seen from now on */
    node_drives(b, 0, board_cycle(b));
    board_pin_drive(b, SW_RX, bus->level);
}

void bus_skew(bus_t *bus, board_t *b, double percent)
{
    bus_node_t *node = b->bus_node;
    if (node == NULL || node->bus != bus || !(fabs(percent) <= 20))
        abort();
    node->board_since = board_cycle_at(node, bus->now);
    node->since = bus->now;
    node->rate = 1 + percent / 100;
}

/* -- what a peer hears ----------------------------------------------------------------------------------------------- */

static uint64_t sample_due(const bus_peer_t *p)
{
    return p->start + (uint64_t)llround((p->bits + 0.5) * p->bit_cycles);
}

static void character_ends(bus_peer_t *p, uint64_t cycle)
{
    if (p->byte_count == p->byte_size)
        p->byte = grown(p->byte, &p->byte_size, sizeof *p->byte);
    p->byte[p->byte_count++] =
        (bus_byte_t){p->start, cycle, (uint8_t)(p->shift >> 1), !(p->shift >> (BITS - 1) & 1), p->echo};
    p->receiving = false;
}

/* The line had its level up to this cycle. */
static void listen_up_to(bus_peer_t *p, uint64_t cycle)
{
    while (p->receiving && sample_due(p) < cycle) {
        uint64_t sampled = sample_due(p);
        p->shift |= (uint16_t)(p->bus->level << p->bits);
        p->bits++;
        if (p->bits == 1 && (p->shift & 1))
            p->receiving = false; /* too short for a start bit */
        else if (p->bits == BITS)
            character_ends(p, sampled);
    }
}

static void hear_edge(bus_peer_t *p, uint64_t cycle)
{
    listen_up_to(p, cycle);
    if (p->receiving || p->bus->level == 0)
        return;
    p->receiving = true; /* the line falls */
    p->echo = p->driver.level != RELEASED;
    p->start = cycle;
    p->bits = 0;
    p->shift = 0;
}

/* -- the line -------------------------------------------------------------------------------------------------------- */

static void line_becomes(bus_t *bus, int level, uint64_t cycle)
{
    if (level == bus->level)
        return;
    for (int i = 0; i < bus->peer_count; i++)
        hear_edge(bus->peer[i], cycle);
    bus->level = level;
    for (int i = 0; i < bus->node_count; i++) {
        bus_node_t *node = &bus->node[i];
        board_pin_drive_at(node->board, SW_RX, level, board_cycle_at(node, cycle + BUS_DELAY));
    }
}

/* Uniform in [0, 1). */
static double random_fraction(bus_t *bus)
{
    return (double)(splitmix64(&bus->random) >> 11) / 9007199254740992.0;
}

static void next_error_slot(bus_t *bus)
{
    bus->inverted = random_fraction(bus) < bus->error_probability;
    bus->errors_made += bus->inverted;
    bus->error_slots++;
    bus->error_due = bus->error_slot_start + (uint64_t)llround(bus->error_slots * bus->error_bit_cycles);
}

/* The bit times that can be damaged begin when the line begins to be driven. */
static void errors_run(bus_t *bus, uint64_t cycle)
{
    if (bus->drivers == 0 || bus->error_probability <= 0) {
        bus->error_due = NEVER;
        bus->inverted = false;
    } else if (bus->error_due == NEVER) {
        bus->error_slot_start = cycle;
        bus->error_slots = 0;
        next_error_slot(bus);
    } else if (bus->error_due <= cycle) {
        next_error_slot(bus);
    }
}

static void count_driver(const driver_t *driver, unsigned *low, unsigned *high)
{
    *low += driver->level == 0;
    *high += driver->level == 1;
}

/* All that happens at this very cycle is done before anybody looks: one OUT may change level and enable together. */
static void at_cycle(bus_t *bus, uint64_t cycle)
{
    unsigned low = 0, high = 0;
    for (int i = 0; i < bus->node_count; i++) {
        driver_run(&bus->node[i].driver, cycle);
        count_driver(&bus->node[i].driver, &low, &high);
    }
    for (int i = 0; i < bus->peer_count; i++) {
        driver_run(&bus->peer[i]->driver, cycle);
        count_driver(&bus->peer[i]->driver, &low, &high);
    }
    bool contending = low > 0 && high > 0;
    bus->contentions += contending && !bus->contending;
    bus->contending = contending;
    bus->drivers = low + high;
    errors_run(bus, cycle);
    line_becomes(bus, (low == 0) != bus->inverted, cycle);
}

static uint64_t next_due(const bus_t *bus)
{
    uint64_t due = bus->error_due;
    for (int i = 0; i < bus->node_count; i++)
        if (plan_due(&bus->node[i].driver.plan) < due)
            due = plan_due(&bus->node[i].driver.plan);
    for (int i = 0; i < bus->peer_count; i++)
        if (plan_due(&bus->peer[i]->driver.plan) < due)
            due = plan_due(&bus->peer[i]->driver.plan);
    return due;
}

board_run_t bus_run_to(bus_t *bus, uint64_t cycle)
{
    while (bus->now < cycle && bus->crashed == NULL) {
        uint64_t end = cycle - bus->now < BUS_QUANTUM ? cycle : bus->now + BUS_QUANTUM;
        for (int i = 0; i < bus->node_count; i++)
            if (board_run_to(bus->node[i].board, board_cycle_at(&bus->node[i], end)) == BOARD_CRASHED)
                bus->crashed = bus->node[i].board;
        for (uint64_t due; (due = next_due(bus)) <= end;)
            at_cycle(bus, due > bus->now ? due : bus->now); /* a reset between runs is over already */
        bus->now = end;
    }
    for (int i = 0; i < bus->peer_count; i++)
        listen_up_to(bus->peer[i], bus->now);
    return bus->crashed != NULL ? BOARD_CRASHED : BOARD_RAN;
}

board_run_t bus_run_for(bus_t *bus, uint64_t cycles)
{
    return bus_run_to(bus, bus->now + cycles);
}

/* -- peers ----------------------------------------------------------------------------------------------------------- */

bus_peer_t *bus_peer(bus_t *bus, double baud)
{
    if (bus->peer_count == PEERS_MAX)
        abort();
    bus_peer_t *p = calloc(1, sizeof *p);
    if (p == NULL)
        abort();
    p->bus = bus;
    p->driver.level = RELEASED;
    p->bit_cycles = (double)BOARD_CPU_HZ / baud;
    bus->peer[bus->peer_count++] = p;
    return p;
}

/* Where what is planned next begins: what is to be at a cycle that is over comes too late for it. */
static uint64_t free_from(const bus_peer_t *p)
{
    return p->free_at > p->bus->now ? p->free_at : p->bus->now + 1;
}

void bus_peer_send(bus_peer_t *p, const void *bytes, size_t count)
{
    const uint8_t *byte = bytes;
    uint64_t start = free_from(p);
    double bit = 0;

    for (size_t i = 0; i < count; i++) {
        unsigned frame = 1u << (BITS - 1) | (unsigned)byte[i] << 1;
        for (int n = 0; n < BITS; n++, bit++, frame >>= 1)
            plan_add(&p->driver.plan, start + (uint64_t)llround(bit * p->bit_cycles), frame & 1);
    }
    p->free_at = start + (uint64_t)llround(bit * p->bit_cycles);
    plan_add(&p->driver.plan, p->free_at, RELEASED);
}

void bus_peer_hold(bus_peer_t *p, int level, uint64_t cycles)
{
    uint64_t start = free_from(p);
    p->free_at = start + cycles;
    plan_add(&p->driver.plan, start, level);
    plan_add(&p->driver.plan, p->free_at, RELEASED);
}

void bus_peer_stop(bus_peer_t *p)
{
    p->driver.plan.first = p->driver.plan.count = 0;
    p->free_at = p->bus->now;
    plan_add(&p->driver.plan, p->bus->now + 1, RELEASED);
}

uint64_t bus_peer_free_at(const bus_peer_t *p)
{
    return p->free_at;
}

const bus_byte_t *bus_peer_received(const bus_peer_t *p, size_t *count)
{
    *count = p->byte_count;
    return p->byte;
}

void bus_peer_clear(bus_peer_t *p)
{
    p->byte_count = 0;
}

/* -- life ------------------------------------------------------------------------------------------------------------ */

bus_t *bus_new(void)
{
    bus_t *bus = calloc(1, sizeof *bus);
    if (bus == NULL)
        abort();
    bus->level = 1;
    bus->error_due = NEVER;
    return bus;
}

void bus_free(bus_t *bus)
{
    if (bus == NULL)
        return;
    for (int i = 0; i < bus->node_count; i++) {
        bus->node[i].board->bus_node = NULL;
        free(bus->node[i].driver.plan.change);
    }
    for (int i = 0; i < bus->peer_count; i++) {
        free(bus->peer[i]->driver.plan.change);
        free(bus->peer[i]->byte);
        free(bus->peer[i]);
    }
    free(bus);
}

void bus_bit_errors(bus_t *bus, double probability, double baud, uint64_t seed)
{
    bus->error_probability = probability;
    bus->error_bit_cycles = (double)BOARD_CPU_HZ / baud;
    bus->random = seed;
    bus->error_due = NEVER;
    at_cycle(bus, bus->now);
}

uint64_t bus_cycle(const bus_t *bus)
{
    return bus->now;
}

board_t *bus_crashed(const bus_t *bus)
{
    return bus->crashed;
}

int bus_level(const bus_t *bus)
{
    return bus->level;
}

unsigned bus_drivers(const bus_t *bus)
{
    return bus->drivers;
}

uint32_t bus_contentions(const bus_t *bus)
{
    return bus->contentions;
}

uint32_t bus_bit_errors_made(const bus_t *bus)
{
    return bus->errors_made;
}
