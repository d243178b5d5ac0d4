#include "net/bus.h"
#include "base/inline.h"
#include "base/timebase_port.h"
#include "base/zeroed.h"
#include "net/bus_port.h"
#include "settings.h"

bus_counters_t bus_counters;
packet_t bus_packet;
uint8_t bus_awake;

static enum { LISTENING, PUTTING, LEAVING } phase; /* LEAVING: all is put, the last bits go out */
static uint8_t put, count; /* bytes of the packet that is sent */
static uint16_t since_128us; /* something was heard or sent */

static uint8_t ops_waiting;
static uint8_t ops; /* 1: DC2; the oldest in the highest bit of those waiting */

NOINLINE uint8_t bus_strict(void)
{
    return settings.crc_mode & 2;
}

void bus_init(void)
{
    AT_BOOT_ZERO(bus_counters);
    AT_BOOT_ZERO(bus_packet);
    AT_BOOT_ZERO(phase);
    AT_BOOT_ZERO(bus_awake);
    AT_BOOT_ZERO(ops_waiting);
}

static NOINLINE bool silent_for(uint8_t characters)
{
    return (uint16_t)(timebase_128us() - since_128us) > bus_port_characters_128us(characters);
}

static NOINLINE void heard(void)
{
    since_128us = timebase_128us();
}

/* What is to go out. What came in meanwhile waits: it is the echo, and may be the next packet, for the end of one's own can
 * be long past when it is seen here. */
static void send(void)
{
    heard();
    while (put != count) {
        if (bus_port_free() == 0) {
            return;
        }
        bus_port_put((&bus_packet.stx)[put++]);
    }
    if (phase == PUTTING) {
        phase = LEAVING;
        bus_port_end();
    }
    if (!bus_port_sending()) {
        phase = LISTENING;
    }
}

NOINLINE packet_event_t bus_poll(void)
{
    if (phase != LISTENING) {
        send();
        return PACKET_NONE;
    }
    packet_event_t event = PACKET_NONE;
    const uint8_t own = settings.device_id;
    for (int16_t byte; event == PACKET_NONE && (byte = bus_port_get()) >= 0;) {
        heard();
        event = packet_take(&bus_packet, (uint8_t)byte, own, bus_strict());
        if (bus_packet.origin == own) {
            event = PACKET_NONE; /* the echo */
        }
    }
    if (event == PACKET_NONE && packet_under_way(&bus_packet) && silent_for(BUS_SILENCE_CHARACTERS)) {
        event = packet_end(&bus_packet, own, bus_strict());
    }
    if (event != PACKET_NONE) {
        (&bus_counters.good)[event - PACKET_WHOLE]++;
    }
    return event;
}

uint8_t bus_expects(void)
{
    return (uint8_t)(packet_under_way(&bus_packet) | ops_waiting);
}

uint8_t bus_sending(void)
{
    return phase;
}

NOINLINE uint8_t bus_free(uint8_t characters)
{
    return phase == LISTENING && !packet_under_way(&bus_packet) && silent_for(characters);
}

NOINLINE void bus_send(uint8_t destination, uint8_t crc)
{
    bus_packet.destination = destination;
    bus_packet.origin = settings.device_id;
    count = packet_close(&bus_packet, crc, bus_strict());
    put = 0;
    phase = PUTTING;
    bus_awake = 1;
    bus_port_begin();
}

void bus_clear(void)
{
    bus_counters = (bus_counters_t){0};
    bus_port_clear();
}

void bus_ops(uint8_t byte)
{
    if (ops_waiting < 8) {
        bus_awake = 1;
        ops_waiting++;
        ops = (uint8_t)(ops << 1 | (byte >> 1 & 1)); /* DC2 has this bit */
    }
}

uint8_t bus_ops_wait(void)
{
    return ops_waiting;
}

uint8_t bus_ops_next(void)
{
    ops_waiting--;
    return (uint8_t)(PACKET_DC1 + (ops >> ops_waiting & 1));
}
