#include "host/bus_node.h"
#include "host/network_start.h"
#include "queue/ops.h"

_Static_assert(BUS_NODE_CHARACTER_US == BUS_PORT_FAKE_CHARACTER_US, "the same line");

enum { ROUND_US = 128, QUIET_US = 20000 };

static void round_of_the_main_loop(void)
{
    terminal_poll();
    network_poll();
    engine_fake.ended = engine_fake.begun; /* motions take no time */
    queue_poll();
    ops_poll();
    store_poll();
}

static void run_to(uint32_t us)
{
    const uint32_t quiet_us = us - timebase_fake_us;
    if (quiet_us > QUIET_US && quiet_us <= INT32_MAX) {
        timebase_fake_us = us - QUIET_US;
    }
    while ((int32_t)(us - timebase_fake_us) > 0) {
        timebase_fake_us += us - timebase_fake_us < ROUND_US ? us - timebase_fake_us : ROUND_US;
        round_of_the_main_loop();
    }
}

static void start(uint8_t address)
{
    network_start(address, 2);
}

static void hear(const void *bytes, size_t count)
{
    bus_port_fake_clear();
    terminal_port_fake_clear();
    bus_port_fake_receive(bytes, count);
}

static size_t executed(uint32_t *counts, size_t most)
{
    const size_t count = engine_fake.submitted_count;
    for (size_t i = 0; i < count && i < most; i++) {
        counts[i] = engine_fake.submitted[i].count;
    }
    engine_fake.submitted_count = 0;
    return count;
}

static void counters(uint16_t *good, uint16_t *wrong, uint16_t *discarded, uint16_t *resent)
{
    *good = bus_counters.good;
    *wrong = bus_counters.wrong;
    *discarded = bus_counters.discarded;
    *resent = bus_counters.resent;
    bus_clear();
}

static uint32_t clashes(void)
{
    return bus_port_fake.clashes;
}

__attribute__((visibility("default"))) const bus_node_t bus_node = {
    .start = start,
    .run_to = run_to,
    .hear = hear,
    .sent = bus_port_fake_sent,
    .executed = executed,
    .counters = counters,
    .clashes = clashes,
};
