/* One run of the whole image on a board of its own. */
#include "bench.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The firmware's struct as it lies in the AVR's memory: nothing is aligned there. */
#pragma pack(push, 1)
#include "settings.h"
#pragma pack(pop)

#define CLK BOARD_PIN('B', 2)
#define SLICE (2 * TICKS_PER_S / 1000)

/* Lines that change nothing: blanks, and defaults that the running commands do not use. */
static const char *const flood_lines[] = {" a line that begins with a space does nothing\r", "a1.25\r",
                                          " and so does this one, which is a little longer\r", "v150\r"};
#define FLOOD_LINES (sizeof flood_lines / sizeof flood_lines[0])
#define PROMPT_BYTES 8 /* what a line is answered with, more than its echo: CR, LF, the prompt */

void die(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs("bench: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(2);
}

static void on_edge(void *ctx, board_edge_t edge)
{
    run_t *run = ctx;
    if (!edge.level) {
        if (edge.cycle - run->last_rise != (uint64_t)run->setup.pulse_us * TICKS_PER_US)
            run->bad_widths++;
        return;
    }
    if (run->pulses == run->room) {
        run->room = run->room ? 2 * run->room : 4096;
        run->rise = realloc(run->rise, run->room * sizeof *run->rise);
        if (!run->rise)
            die("out of memory");
    }
    run->rise[run->pulses++] = edge.cycle;
    run->last_rise = edge.cycle;
}

static uint16_t symbol(run_t *run, const char *name)
{
    uint16_t address;
    if (!board_symbol(run->board, name, &address))
        die("%s has no symbol %s", bench_elf, name);
    return address;
}

static void checked(run_t *run, board_run_t why)
{
    if (why == BOARD_CRASHED)
        die("the image crashed: %s", board_crash(run->board));
}

void run_begin(run_t *run, setup_t setup)
{
    memset(run, 0, sizeof *run);
    worst_clear(&run->worst);
    run->setup = setup;
    run->board = board_new(bench_elf, NULL);
    if (!run->board)
        exit(2);
    if (board_run_past(run->board, symbol(run, "store_load_settings"), TICKS_PER_S) != BOARD_MATCHED)
        die("the image does not load its settings");
    uint16_t at = symbol(run, "settings");
    board_poke8(run->board, (uint16_t)(at + offsetof(settings_t, driver_id)), 2); /* has every factor */
    board_poke8(run->board, (uint16_t)(at + offsetof(settings_t, ustep)), setup.ustep);
    board_poke8(run->board, (uint16_t)(at + offsetof(settings_t, pulse_us)), setup.pulse_us);
    board_poke32(run->board, (uint16_t)(at + offsetof(settings_t, hw_baud)), setup.baud);
    board_uart_baud(run->board, setup.baud);
    board_record(run->board, CLK, true);
    board_on_edge(run->board, on_edge, run);
    run_for(run, TICKS_PER_S + TICKS_PER_S / 5); /* the window and the prompt */
    if (!strstr(board_uart_text(run->board), "SAC>"))
        die("no prompt: \"%s\"", board_uart_text(run->board));
    board_uart_clear(run->board);
    board_measures_clear(run->board); /* start-up is no part of any figure */
}

static void take_measures(run_t *run)
{
    const board_measures_t *m = board_measures(run->board);
    worst_t seen;
    memcpy(seen.isr, m->isr, sizeof seen.isr);
    seen.masked_max = m->masked_max;
    seen.masked_max_pc = m->masked_max_pc;
    seen.isr_masked_max = m->isr_masked_max;
    seen.isr_masked_vector = m->isr_masked_vector;
    seen.stack_low = m->stack_low;
    worst_add(&run->worst, &seen);
}

void run_measures_clear(run_t *run)
{
    take_measures(run);
    board_measures_clear(run->board);
}

const board_measures_t *run_measures(run_t *run)
{
    return board_measures(run->board);
}

void run_end(run_t *run, worst_t *worst)
{
    take_measures(run);
    worst_add(worst, &run->worst);
    board_free(run->board);
    free(run->rise);
    run->rise = NULL;
}

void run_type(run_t *run, const char *text)
{
    for (; *text; text++)
        board_uart_send(run->board, *text == '\n' ? "\r" : text, 1);
}

static void feed(run_t *run, uint64_t until)
{
    uint64_t byte_cycles = 10 * TICKS_PER_S / run->setup.baud;
    if (run->fed_until < board_cycle(run->board))
        run->fed_until = board_cycle(run->board);
    while (run->fed_until < until) {
        const char *line = flood_lines[run->fed_lines++ % FLOOD_LINES];
        board_uart_send_text(run->board, line);
        run->fed_until += strlen(line) * byte_cycles;
        if (run->flood == FLOOD_ANSWERED) {
            board_uart_gap(run->board, PROMPT_BYTES * byte_cycles);
            run->fed_until += PROMPT_BYTES * byte_cycles;
        }
    }
}

void run_flood(run_t *run, flood_t flood)
{
    run->flood = flood;
}

static void run_slice(run_t *run, uint64_t cycles)
{
    if (run->flood)
        feed(run, board_cycle(run->board) + cycles + SLICE);
    checked(run, board_run_for(run->board, cycles));
}

void run_for(run_t *run, uint64_t cycles)
{
    while (cycles) {
        uint64_t slice = cycles < SLICE || !run->flood ? cycles : SLICE;
        run_slice(run, slice);
        cycles -= slice;
    }
}

void run_until_quiet(run_t *run, uint64_t quiet, uint64_t limit)
{
    uint64_t end = board_cycle(run->board) + limit;
    uint64_t since = board_cycle(run->board);
    size_t pulses = run->pulses;
    while (board_cycle(run->board) < end && board_cycle(run->board) - since < quiet) {
        run_slice(run, SLICE);
        if (run->pulses != pulses) {
            pulses = run->pulses;
            since = run->last_rise;
        }
    }
}

bool run_until_pulses(run_t *run, size_t pulses, uint64_t limit)
{
    uint64_t end = board_cycle(run->board) + limit;
    while (run->pulses < pulses && board_cycle(run->board) < end)
        run_slice(run, SLICE);
    return run->pulses >= pulses;
}

report_t run_report(run_t *run)
{
    report_t report;
    run->flood = FLOOD_NONE;
    run_for(run, TICKS_PER_S / 10);
    board_uart_clear(run->board);
    run_type(run, "\np\n");
    run_for(run, TICKS_PER_S / 10);
    const char *text = strstr(board_uart_text(run->board), "position ");
    if (!text || sscanf(text, "position %d %*s faults %u", &report.position, &report.faults) != 2)
        die("no position in \"%s\"", board_uart_text(run->board));
    return report;
}

uint64_t run_interval(const run_t *run, size_t k)
{
    return run->rise[k + 1] - run->rise[k];
}

uint64_t run_grid_error(const run_t *run, uint64_t ticks)
{
    uint64_t most = 0;
    for (size_t k = 0; k < run->pulses; k++) {
        uint64_t ideal = run->rise[0] + k * ticks;
        uint64_t off = run->rise[k] > ideal ? run->rise[k] - ideal : ideal - run->rise[k];
        if (off > most)
            most = off;
    }
    return most;
}
