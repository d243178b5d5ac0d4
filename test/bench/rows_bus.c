/* Rows: packets while the motor runs; several units at one sync edge. */
#include "bench.h"
#include "bus.h"
#include "crc8.h"

#include <stdio.h>
#include <string.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

#define BAUD 38400
#define CHARACTER (10 * TICKS_PER_S / BAUD)
#define SYNC BOARD_PIN('D', 3)
enum { STX = 2, ETX = 3, ACK = 6, MASTER = 1, OWN = 85, OTHER = 86 }; /* 85: the factory's d_id */

static void run_bus(bus_t *bus, uint64_t cycles)
{
    if (bus_run_for(bus, cycles) == BOARD_CRASHED)
        die("the image crashed: %s", board_crash(bus_crashed(bus)));
}

/* As the manual has it, k CRC 1; three characters of silence follow. */
static void send(bus_t *bus, bus_peer_t *master, uint8_t destination, const char *body)
{
    const uint8_t crc = crc8((const uint8_t *)body, strlen(body));
    bus_peer_send(master, (const uint8_t[]){STX, destination, MASTER}, 3);
    bus_peer_send(master, body, strlen(body));
    bus_peer_send(master, (const uint8_t[]){ETX, crc, 0}, 3);
    bus_peer_hold(master, -1, 3 * CHARACTER);
    run_bus(bus, bus_peer_free_at(master) - bus_cycle(bus));
}

/* Whether what came last is an ACK of this node's, waited for 10 ms. */
static bool acknowledged(bus_t *bus, bus_peer_t *master)
{
    enum { ACK_BYTES = 7 };
    const uint64_t end = bus_cycle(bus) + TICKS_PER_S / 100;
    size_t count;
    const bus_byte_t *byte = bus_peer_received(master, &count);
    while (count < ACK_BYTES || byte[count - ACK_BYTES].echo) {
        if (bus_cycle(bus) > end)
            return false;
        run_bus(bus, CHARACTER);
        byte = bus_peer_received(master, &count);
    }
    run_bus(bus, 3 * CHARACTER);
    byte += count - ACK_BYTES;
    return byte[0].byte == STX && byte[1].byte == MASTER && byte[2].byte == OWN && byte[3].byte == ACK;
}

/* A second of cruise, packets all the time. */
static bool packets_kept(result_t *result, uint32_t cycle_us, uint8_t ustep)
{
    const uint64_t ticks = cycle_us * TICKS_PER_US >> ustep;
    const unsigned pulses = (unsigned)(TICKS_PER_S / ticks);
    unsigned sent = 0, answered = 0;
    char text[80];
    run_t run;
    run_begin(&run, (setup_t){.ustep = ustep, .pulse_us = 1, .baud = BAUD});
    bus_t *bus = bus_new();
    bus_peer_t *master = bus_peer(bus, BAUD);
    bus_join(bus, run.board);
    snprintf(text, sizeof text, "m%upvc%ua999d999\n", pulses, cycle_us);
    run_type(&run, text);
    run_bus(bus, TICKS_PER_S / 50);
    const uint64_t from = bus_cycle(bus);
    while (run.pulses < pulses && sent < 1000) {
        bus_peer_clear(master);
        send(bus, master, OTHER, "m2000v150a1.5d1.5");
        send(bus, master, OWN, sent & 1 ? "v150" : "a1.25");
        sent++;
        answered += acknowledged(bus, master);
    }
    const double seconds = (double)(bus_cycle(bus) - from) / TICKS_PER_S;
    run_bus(bus, TICKS_PER_S / 100);
    const uint64_t off = run_grid_error(&run, ticks);
    bus_free(bus);
    const report_t report = run_report(&run);
    detail(result, "- %g kHz: %u packets a second for this unit and as many for another, %u of %u answered; %zu of %u pulses, "
                   "%llu cycles off the grid, position %d, faults %u\n",
           (double)TICKS_PER_S / (double)ticks / 1000, (unsigned)(sent / seconds), answered, sent, run.pulses, pulses,
           (unsigned long long)off, report.position, report.faults);
    const bool kept = sent > 0 && answered == sent && run.pulses == pulses && off == 0 && report.position == (int)pulses &&
                      report.faults == 0;
    if (kept)
        figure(result, "%g kHz, %u + %u packets a second", (double)TICKS_PER_S / (double)ticks / 1000,
               (unsigned)(sent / seconds), (unsigned)(sent / seconds));
    run_end(&run, &result->worst);
    return kept;
}

void row_packets(result_t *result)
{
    static const struct {
        uint32_t cycle_us;
        uint8_t ustep;
    } rates[] = {{2, 0}, {5, 1}, {3, 0}, {4, 0}, {5, 0}, {6, 0}, {8, 0}, {10, 0}, {15, 0}, {20, 0}, {30, 0}};
    result->verdict = VERDICT_NOT_MET;
    for (size_t i = 0; i < COUNT_OF(rates); i++)
        if (packets_kept(result, rates[i].cycle_us, rates[i].ustep)) {
            if (rates[i].cycle_us <= 10)
                result->verdict = VERDICT_MET;
            return;
        }
    figure(result, "below 33 kHz");
}

/* How far apart the first pulses are at one edge, in cycles of the line; they are forgotten then. */
static uint64_t skew(bus_t *bus, run_t *unit, size_t units, bool busy, bus_peer_t *master)
{
    for (size_t i = 0; i < units; i++)
        run_type(&unit[i], "m20svc200a999d999\n");
    run_bus(bus, TICKS_PER_S / 20);
    const uint64_t at = bus_cycle(bus) + TICKS_PER_S / 500;
    for (size_t i = 0; i < units; i++) {
        unit[i].pulses = 0;
        board_pin_drive_at(unit[i].board, SYNC, 0, bus_board_cycle(unit[i].board, at));
        board_pin_drive_at(unit[i].board, SYNC, 1, bus_board_cycle(unit[i].board, at + TICKS_PER_S / 1000));
    }
    if (busy)
        send(bus, master, 200, "m1234567v1234a1.5d2.5");
    run_bus(bus, TICKS_PER_S / 50);
    uint64_t first = UINT64_MAX;
    uint64_t last = 0;
    for (size_t i = 0; i < units; i++) {
        if (unit[i].pulses != 20)
            die("%zu pulses of 20 after sync", unit[i].pulses);
        const uint64_t rise = bus_cycle_of(unit[i].board, unit[i].rise[0]);
        first = rise < first ? rise : first;
        last = rise > last ? rise : last;
    }
    return last - first;
}

void row_skew(result_t *result)
{
    enum { UNITS = 12, ROUNDS = 50 };
    run_t unit[UNITS];
    uint64_t worst = 0;
    bus_t *bus = bus_new();
    bus_peer_t *master = bus_peer(bus, BAUD);
    for (size_t i = 0; i < UNITS; i++) {
        run_begin(&unit[i], SETUP_FACTORY);
        run_for(&unit[i], i * 3011); /* another phase of its time base */
        board_pin_drive(unit[i].board, SYNC, 1);
        bus_join(bus, unit[i].board);
        bus_skew(bus, unit[i].board, 0.01 * (double)i / (UNITS - 1) - 0.005);
    }
    for (unsigned busy = 0; busy < 2; busy++) {
        uint64_t most = 0;
        for (unsigned round = 0; round < ROUNDS; round++) {
            run_bus(bus, round * 997);
            const uint64_t now = skew(bus, unit, UNITS, busy, master);
            most = now > most ? now : most;
        }
        detail(result, "- %u edges, %s: %llu cycles at most\n", (unsigned)ROUNDS, busy ? "packets on the line" : "at rest",
               (unsigned long long)most);
        worst = most > worst ? most : worst;
    }
    figure(result, "%.2f µs at most", (double)worst / TICKS_PER_US);
    result->verdict = worst <= TICKS_PER_US ? VERDICT_MET : VERDICT_NOT_MET;
    bus_free(bus);
    for (size_t i = 0; i < UNITS; i++)
        run_end(&unit[i], &result->worst);
}
