#include "network.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console.h"
#include "eeprom_file.h"
#include "pace.h"
#include "pty.h"
#include "signals.h"
#include "test/board/bus.h"

#define CYCLES_PER_MS (BOARD_CPU_HZ / 1000)
#define NS_PER_MS INT64_C(1000000)

enum {
    FIRST_ADDRESS = 10,
    SAVE_MS = 2000,       /* host's time between two looks at the EEPROMs */
    OPEN_RESET_MS = 50,   /* host's time from the opening of a port to the reset: programs flush first */
    PROMPT_MS = 3000,     /* simulated: longest wait for a prompt */
    ANSWER_MS = 300,      /* simulated: until a line is executed and all is in the EEPROM */
    BITS_PER_BYTE = 10,
};

typedef struct {
    board_t *board;
    pty_t pty;
    char *link;
    char *eeprom_path;
    eeprom_file_t eeprom;
    uint64_t line_free_cycle; /* when all bytes sent to the board will have gone out */
    int64_t reset_at_ns;      /* the port has been opened: reset then; 0: nothing due */
} node_t;

static struct {
    const options_t *o;
    bus_t *bus;
    bus_peer_t *peer;
    pty_t pty; /* of the line */
    char *link;
    node_t node[OPTIONS_NODES_MAX];
    unsigned ready; /* nodes that are open */
    bool line_ready;
    int64_t next_save_ns;
} net;

static volatile sig_atomic_t end_signal;

static void on_end(int number)
{
    end_signal = number;
}

static char *path_with(const char *path, const char *end)
{
    char *whole = NULL;

    if (path != NULL && asprintf(&whole, "%s.%s", path, end) < 0) {
        abort();
    }
    return whole;
}

/* -- a node's address ---------------------------------------------------------------------------------------------- */

static bool has_prompt(board_t *b, void *context)
{
    size_t count;
    const board_uart_byte_t *byte = board_uart_received(b, &count);

    (void)context;
    return count > 0 && byte[count - 1].byte == '>';
}

/* As a user would, since the layout of the EEPROM is the image's own business: once to set it, and, as a new address is
 * on trial at first, once more after a power-on to confirm it. */
static bool type_address(const char *image, unsigned address, uint8_t *cells)
{
    board_t *b = board_new(image, NULL);
    char line[16];

    if (b == NULL) {
        return false;
    }
    snprintf(line, sizeof line, "$CM%u\r", address);
    for (int i = 0; i < 2; i++) {
        board_reset(b, BOARD_RESET_POWER_ON);
        board_uart_clear(b);
        board_run_until(b, has_prompt, NULL, PROMPT_MS * CYCLES_PER_MS);
        board_uart_send_text(b, line);
        board_run_for(b, ANSWER_MS * CYCLES_PER_MS);
    }
    memcpy(cells, board_eeprom(b), BOARD_EEPROM_BYTES);
    board_free(b);
    return true;
}

static bool erased(const uint8_t *cells)
{
    for (size_t i = 0; i < BOARD_EEPROM_BYTES; i++) {
        if (cells[i] != 0xff) {
            return false;
        }
    }
    return true;
}

/* -- opening and closing ------------------------------------------------------------------------------------------- */

static bool open_node(node_t *n, unsigned address)
{
    const options_t *o = net.o;
    uint8_t cells[BOARD_EEPROM_BYTES];
    char name[8];

    snprintf(name, sizeof name, "%u", address);
    n->eeprom_path = path_with(o->eeprom, name);
    n->link = path_with(o->link, name);
    memset(cells, 0xff, sizeof cells);
    if (n->eeprom_path != NULL) {
        if (!eeprom_file_open(&n->eeprom, n->eeprom_path)) {
            return false;
        }
        memcpy(cells, n->eeprom.saved, sizeof cells);
    }
    if (erased(cells) && !type_address(o->image, address, cells)) {
        return false;
    }
    n->board = board_new(o->image, cells);
    if (n->board == NULL || !pty_open(&n->pty, n->link)) {
        return false;
    }
    board_uart_baud(n->board, o->baud);
    bus_join(net.bus, n->board);
    return true;
}

static void say_port(const char *what, const pty_t *pty)
{
    char line[256];

    snprintf(line, sizeof line, "sacsim: %s %s%s%s", what, pty->name, pty->link != NULL ? " = " : "",
             pty->link != NULL ? pty->link : "");
    console_print(line);
}

static bool open_all(void)
{
    char what[32];

    if (access(net.o->image, R_OK) != 0) {
        console_say("cannot read %s: %s", net.o->image, strerror(errno));
        return false;
    }
    for (; net.ready < net.o->nodes; net.ready++) {
        if (!open_node(&net.node[net.ready], FIRST_ADDRESS + net.ready)) {
            return false;
        }
    }
    net.link = path_with(net.o->link, "bus");
    net.line_ready = pty_open(&net.pty, net.link);
    if (!net.line_ready) {
        return false;
    }
    net.peer = bus_peer(net.bus, net.o->bus_baud);
    for (unsigned i = 0; i < net.ready; i++) {
        snprintf(what, sizeof what, "node %u", FIRST_ADDRESS + i);
        say_port(what, &net.node[i].pty);
    }
    say_port("bus", &net.pty);
    return true;
}

static bool save_all(void)
{
    bool ok = true;

    for (unsigned i = 0; i < net.ready; i++) {
        node_t *n = &net.node[i];

        ok = (n->eeprom_path == NULL || eeprom_file_save(&n->eeprom, board_eeprom(n->board))) && ok;
    }
    return ok;
}

static void close_all(void)
{
    bus_free(net.bus);
    for (unsigned i = 0; i < net.o->nodes; i++) {
        node_t *n = &net.node[i];

        if (i < net.ready) {
            pty_close(&n->pty);
        }
        board_free(n->board);
        eeprom_file_close(&n->eeprom);
        free(n->eeprom_path);
        free(n->link);
    }
    if (net.line_ready) {
        pty_close(&net.pty);
    }
    free(net.link);
}

/* -- the run ------------------------------------------------------------------------------------------------------- */

/* How many bytes a line that is free from `free_at` on can begin to carry until then; the others wait in the pty. */
static size_t room(uint64_t now, uint64_t free_at, uint64_t until, double baud, size_t max)
{
    uint64_t from = free_at > now ? free_at : now;
    size_t bytes = from >= until ? 0 : 1 + (size_t)((double)(until - from) * baud / BITS_PER_BYTE / (double)BOARD_CPU_HZ);

    return bytes < max ? bytes : max;
}

static void node_input(node_t *n, uint64_t cycles)
{
    uint64_t now = board_cycle(n->board);
    uint8_t bytes[256];
    size_t max;

    if (pty_opened(&n->pty) && net.o->reset_on_open) {
        n->reset_at_ns = pace_now_ns() + OPEN_RESET_MS * NS_PER_MS;
    }
    if (n->reset_at_ns != 0 && pace_now_ns() >= n->reset_at_ns) {
        n->reset_at_ns = 0;
        board_reset(n->board, BOARD_RESET_EXTERNAL);
    }
    max = room(now, n->line_free_cycle, now + cycles, net.o->baud, sizeof bytes);
    if (max > 0 && n->pty.open) {
        size_t got = pty_read(&n->pty, bytes, max);

        if (got > 0 && n->reset_at_ns == 0) { /* in reset the board hears nothing */
            uint64_t from = n->line_free_cycle > now ? n->line_free_cycle : now;

            board_uart_send(n->board, bytes, got);
            n->line_free_cycle =
                from + (uint64_t)((double)got * BITS_PER_BYTE * (double)BOARD_CPU_HZ / net.o->baud);
        }
    }
}

static void node_output(node_t *n)
{
    size_t count;
    const board_uart_byte_t *received = board_uart_received(n->board, &count);

    for (size_t i = 0; i < count && n->reset_at_ns == 0; i++) {
        pty_write(&n->pty, &received[i].byte, 1, net.o->fast);
    }
    pty_write(&n->pty, NULL, 0, false);
    board_uart_clear(n->board);
}

static void line_input(uint64_t cycles)
{
    uint64_t now = bus_cycle(net.bus);
    uint8_t bytes[256];
    size_t max = room(now, bus_peer_free_at(net.peer), now + cycles, net.o->bus_baud, sizeof bytes);

    pty_opened(&net.pty);
    if (max > 0 && net.pty.open) {
        size_t got = pty_read(&net.pty, bytes, max);

        if (got > 0) {
            bus_peer_send(net.peer, bytes, got);
        }
    }
}

static void line_output(void)
{
    size_t count;
    const bus_byte_t *received = bus_peer_received(net.peer, &count);

    for (size_t i = 0; i < count; i++) {
        if (!received[i].echo) {
            pty_write(&net.pty, &received[i].byte, 1, net.o->fast);
        }
    }
    pty_write(&net.pty, NULL, 0, false);
    bus_peer_clear(net.peer);
}

static int run(void)
{
    uint64_t limit = net.o->for_seconds > 0.0 ? (uint64_t)(net.o->for_seconds * (double)BOARD_CPU_HZ) : UINT64_MAX;
    pace_t pace;

    pace_start(&pace, net.o->fast ? PACE_FAST : 1.0, 0);
    while (end_signal == 0 && bus_cycle(net.bus) < limit) {
        uint64_t target = pace_target(&pace, bus_cycle(net.bus));
        double speed;

        target = target < limit ? target : limit;
        for (unsigned i = 0; i < net.ready; i++) {
            node_input(&net.node[i], target - bus_cycle(net.bus));
        }
        line_input(target - bus_cycle(net.bus));
        if (bus_run_to(net.bus, target) == BOARD_CRASHED) {
            console_say("the firmware crashed at %.7f s: %s", (double)bus_cycle(net.bus) / (double)BOARD_CPU_HZ,
                        board_crash(bus_crashed(net.bus)));
            return EXIT_CRASHED;
        }
        for (unsigned i = 0; i < net.ready; i++) {
            node_output(&net.node[i]);
        }
        line_output();
        if (pace_now_ns() >= net.next_save_ns) {
            net.next_save_ns = pace_now_ns() + SAVE_MS * NS_PER_MS;
            if (!save_all()) {
                return EXIT_TROUBLE;
            }
        }
        speed = pace_wait(&pace, bus_cycle(net.bus));
        if (speed > 0.0) {
            console_say("this host is too slow for real time: it reaches %.2fx", speed);
        }
    }
    return -end_signal;
}

int network_run(const options_t *o)
{
    int code = EXIT_TROUBLE;

    signals_handle_ends(on_end);
    net.o = o;
    net.bus = bus_new();
    if (open_all()) {
        code = run();
        if (!save_all() && code == EXIT_SUCCESS) {
            code = EXIT_TROUBLE;
        }
    }
    close_all();
    return code;
}
