#include "host/fakes/bus_port_fake.h"
#include <assert.h>
#include <string.h>
#include "host/fakes/timebase_port_fake.h"
#include "net/bus_port.h"

enum { PLACES = 31, MOST = 4096 };

bus_port_fake_t bus_port_fake;

static struct {
    uint8_t byte;
    uint32_t at_us; /* its stop bit has come */
} arriving[MOST];
static size_t arriving_count, taken_count;
static uint8_t sent[MOST];
static size_t sent_count;
static bool on, ended; /* Tx En; bus_port_end() */

/* Time goes round, and may jump: what is not about to come is past. */
static bool is_past(uint32_t us)
{
    return us - timebase_fake_us - 1 >= (MOST + PLACES) * BUS_PORT_FAKE_CHARACTER_US;
}

static uint32_t later(uint32_t us)
{
    return is_past(us) ? timebase_fake_us : us;
}

static void arrive(uint8_t byte, uint32_t at_us)
{
    assert(arriving_count < MOST);
    arriving[arriving_count].byte = byte;
    arriving[arriving_count++].at_us = at_us;
}

static bool is_on(void)
{
    if (ended && is_past(bus_port_fake.left_us)) {
        on = ended = false;
    }
    return on;
}

void bus_port_fake_reset(void)
{
    memset(&bus_port_fake, 0, sizeof bus_port_fake);
    bus_port_fake.left_us = bus_port_fake.arrived_us = timebase_fake_us;
    arriving_count = taken_count = sent_count = 0;
    on = ended = false;
}

void bus_port_fake_receive(const void *bytes, size_t count)
{
    if (taken_count == arriving_count) {
        arriving_count = taken_count = 0;
    }
    for (size_t i = 0; i < count; i++) {
        bus_port_fake.arrived_us = later(bus_port_fake.arrived_us) + BUS_PORT_FAKE_CHARACTER_US;
        arrive(((const uint8_t *)bytes)[i], bus_port_fake.arrived_us);
    }
}

const uint8_t *bus_port_fake_sent(size_t *count)
{
    *count = sent_count;
    return sent;
}

void bus_port_fake_clear(void)
{
    sent_count = 0;
}

uint8_t bus_port_waiting(void)
{
    return taken_count != arriving_count && is_past(arriving[taken_count].at_us);
}

int16_t bus_port_get(void)
{
    return bus_port_waiting() ? arriving[taken_count++].byte : -1;
}

void bus_port_begin(void)
{
    assert(!is_on());
    bus_port_fake.begins++;
    bus_port_fake.clashes += !is_past(bus_port_fake.arrived_us);
    bus_port_fake.begun_us = timebase_fake_us;
    bus_port_fake.left_us = timebase_fake_us + BUS_PORT_FAKE_CHARACTER_US / 10;
    on = true;
}

uint8_t bus_port_free(void)
{
    const uint32_t left_us = later(bus_port_fake.left_us) - timebase_fake_us;
    return (uint8_t)(PLACES - (left_us + BUS_PORT_FAKE_CHARACTER_US - 1) / BUS_PORT_FAKE_CHARACTER_US);
}

void bus_port_put(uint8_t byte)
{
    assert(on && !ended && bus_port_free() != 0 && sent_count < MOST);
    bus_port_fake.left_us = later(bus_port_fake.left_us) + BUS_PORT_FAKE_CHARACTER_US;
    sent[sent_count++] = byte;
    if (bus_port_fake.echo) {
        arrive(byte, bus_port_fake.left_us);
    }
}

void bus_port_end(void)
{
    assert(on && !ended);
    ended = true;
}

bool bus_port_sending(void)
{
    return is_on();
}

uint16_t bus_port_characters_128us(uint8_t characters)
{
    return (uint16_t)((characters * BUS_PORT_FAKE_CHARACTER_US + 127) / 128);
}

uint8_t bus_port_framing_errors(void)
{
    return bus_port_fake.framing_errors;
}

uint8_t bus_port_overruns(void)
{
    return bus_port_fake.overruns;
}

void bus_port_clear(void)
{
    bus_port_fake.framing_errors = bus_port_fake.overruns = 0;
}
