/* Rows: processor load, the step interrupt's paths. */
#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SP_REGISTER 0x5D /* SPL, data address */
#define R24 24

/* What the processor did in a stretch of a run, in cycles. */
typedef struct {
    uint64_t cycles;
    uint64_t step_isr;
    uint64_t step_isr_runs;
    uint64_t isr; /* all interrupts, the step interrupt included */
    uint64_t sleep;
    uint64_t planner; /* engine_poll() where it did some work, interrupts inside not counted */
    uint64_t pulses;
} load_t;

static uint64_t isr_cycles(run_t *run)
{
    const board_measures_t *m = run_measures(run);
    uint64_t sum = 0;
    for (int v = 0; v < BOARD_VECTORS; v++)
        sum += m->isr[v].cycles;
    return sum;
}

static void load_add_measures(run_t *run, load_t *load)
{
    const board_measures_t *m = run_measures(run);
    load->cycles += m->cycles;
    load->step_isr += m->isr[STEP_VECTOR].cycles;
    load->step_isr_runs += m->isr[STEP_VECTOR].count;
    load->isr += isr_cycles(run);
    load->sleep += m->sleep_cycles;
}

static uint16_t code_symbol(run_t *run, const char *name)
{
    uint16_t address;
    if (!board_symbol(run->board, name, &address))
        die("%s has no symbol %s", bench_elf, name);
    return address;
}

/* Follows every call of engine_poll() until so many pulses have been made. */
static void run_planner(run_t *run, size_t pulses, load_t *load)
{
    uint16_t poll = code_symbol(run, "engine_poll");
    uint64_t end = board_cycle(run->board) + 60 * TICKS_PER_S;
    while (run->pulses < pulses && board_cycle(run->board) < end) {
        if (board_run_to_pc(run->board, poll, TICKS_PER_S / 100) != BOARD_MATCHED)
            continue;
        uint16_t sp = board_peek16(run->board, SP_REGISTER);
        uint16_t back =
            (uint16_t)((board_peek8(run->board, (uint16_t)(sp + 1)) << 8 | board_peek8(run->board, (uint16_t)(sp + 2)))
                       << 1);
        uint64_t began = board_cycle(run->board);
        uint64_t isr = isr_cycles(run);
        if (board_run_to_pc(run->board, back, 10 * TICKS_PER_S) != BOARD_MATCHED)
            die("engine_poll does not return");
        if (board_peek8(run->board, R24))
            load->planner += board_cycle(run->board) - began - (isr_cycles(run) - isr);
    }
}

static double percent(uint64_t part, uint64_t whole)
{
    return whole ? 100.0 * (double)part / (double)whole : 0.0;
}

static void print_load(result_t *result, const char *what, const load_t *load)
{
    detail(result,
           "- %s: step interrupt %.2f %% (%.1f cycles a pulse), all interrupts %.2f %%, planner %.2f %% (%.1f cycles a "
           "pulse), asleep %.2f %%, the rest (rounds of the main loop) %.2f %%\n",
           what, percent(load->step_isr, load->cycles), (double)load->step_isr / (double)load->pulses,
           percent(load->isr, load->cycles), percent(load->planner, load->cycles),
           (double)load->planner / (double)load->pulses, percent(load->sleep, load->cycles),
           percent(load->cycles - load->isr - load->planner - load->sleep, load->cycles));
}

void row_load_cruise(result_t *result)
{
    run_t run;
    load_t load = {.cycles = 0};
    run_begin(&run, SETUP_FACTORY);
    run_type(&run, "m200000vc30a999d999\n");
    run_until_pulses(&run, 20000, 5 * TICKS_PER_S);
    run_measures_clear(&run);
    size_t first = run.pulses;
    run_planner(&run, 120000, &load);
    load_add_measures(&run, &load);
    load.pulses = run.pulses - first;
    run_end(&run, &result->worst);
    print_load(result, "cruise", &load);

    load_t fraction = {.cycles = 0};
    run_begin(&run, (setup_t){.ustep = 5, .pulse_us = 2, .baud = 38400});
    run_type(&run, "m200000pvc961a999d999\n"); /* 480.5 ticks */
    run_until_pulses(&run, 20000, 5 * TICKS_PER_S);
    run_measures_clear(&run);
    first = run.pulses;
    run_planner(&run, 120000, &fraction);
    load_add_measures(&run, &fraction);
    fraction.pulses = run.pulses - first;
    run_end(&run, &result->worst);
    print_load(result, "cruise with an interval of 480.5 ticks", &fraction);
    figure(result, "%.2f %% in interrupts (%.1f cycles a pulse), asleep %.1f %%", percent(load.isr, load.cycles),
           (double)load.isr / (double)load.pulses, percent(load.sleep, load.cycles));
    result->verdict = percent(load.isr, load.cycles) <= 6.0 ? VERDICT_MET : VERDICT_NOT_MET;
}

/* Of a ramp through 33.3 kHz: from where the interval is `slow_us` to where it is `fast_us`, up and down. */
static void ramp_load(result_t *result, const char *what, const char *line, load_t *load)
{
    const uint64_t slow_ticks = 33 * TICKS_PER_US;
    const uint64_t fast_ticks = 27 * TICKS_PER_US;
    run_t run;
    size_t up_from;
    size_t up_to;
    size_t down_from;
    size_t down_to;

    /* Once to find where, once to measure. */
    run_begin(&run, SETUP_FACTORY);
    run_type(&run, line);
    run_until_quiet(&run, TICKS_PER_S / 5, 60 * TICKS_PER_S);
    for (up_from = 1; up_from + 1 < run.pulses && run_interval(&run, up_from) > slow_ticks; up_from++)
        ;
    for (up_to = up_from; up_to + 1 < run.pulses && run_interval(&run, up_to) > fast_ticks; up_to++)
        ;
    for (down_to = run.pulses - 2; down_to > up_to && run_interval(&run, down_to) > slow_ticks; down_to--)
        ;
    for (down_from = down_to; down_from > up_to && run_interval(&run, down_from) > fast_ticks; down_from--)
        ;
    run_end(&run, &result->worst);

    run_begin(&run, SETUP_FACTORY);
    run_type(&run, line);
    for (int phase = 0; phase < 2; phase++) {
        load_t ignored = {.cycles = 0};
        run_planner(&run, phase ? down_from : up_from, &ignored);
        run_measures_clear(&run);
        size_t first = run.pulses;
        run_planner(&run, phase ? down_to : up_to, load);
        load_add_measures(&run, load);
        load->pulses += run.pulses - first;
    }
    run_end(&run, &result->worst);
    print_load(result, what, load);
}

void row_load_ramps(result_t *result)
{
    load_t harmonic = {.cycles = 0};
    load_t linear = {.cycles = 0};
    ramp_load(result, "harmonic ramps, a = 10, 30.3 to 37 kHz", "m20000v13000a10d10l0\n", &harmonic);
    ramp_load(result, "linear ramps, 500 rad/s², 30.3 to 37 kHz", "m150000v13000a500d500l1\n", &linear);
    double h = percent(harmonic.isr + harmonic.planner, harmonic.cycles);
    double l = percent(linear.isr + linear.planner, linear.cycles);
    figure(result,
           "harmonic %.1f %% (interrupts %.1f, planner %.1f), asleep %.1f %%; linear %.1f %% (interrupts %.1f, planner "
           "%.1f), asleep %.1f %%",
           h, percent(harmonic.isr, harmonic.cycles), percent(harmonic.planner, harmonic.cycles),
           percent(harmonic.sleep, harmonic.cycles), l, percent(linear.isr, linear.cycles),
           percent(linear.planner, linear.cycles), percent(linear.sleep, linear.cycles));
    result->verdict = h <= 25.0 && l <= 25.0 ? VERDICT_MET : VERDICT_NOT_MET;
}

/* -- paths of the step interrupt --------------------------------------------------------------------------------- */

typedef enum {
    PATH_COUNTED,
    PATH_WRAPPED,
    PATH_LOADED,
    PATH_LOADED_DIR,
    PATH_LATE,
    PATH_EARLY,
    PATH_EARLIER,
    PATH_EMPTY,
    PATHS
} path_t;

static const char *const path_names[PATHS] = {"period counted",
                                              "period counted, low byte wrapped",
                                              "segment loaded",
                                              "segment loaded, dir changed",
                                              "segment loaded too late for its period (a fault)",
                                              "segment loaded one period early, the wait included",
                                              "segment loaded two periods early, the wait included",
                                              "ring empty"};

#define LONGEST 400

typedef struct {
    const board_measures_t *measures;
    uint64_t cycles;
    uint64_t count;
    uint16_t tail_address;
    uint16_t flags_address;
    uint16_t late_address;
    uint16_t high_address;
    uint8_t tail;
    uint8_t flags;
    uint8_t high;
    uint32_t histogram[PATHS][LONGEST + 1];
} paths_t;

static void remember(board_t *board, paths_t *paths)
{
    paths->tail = board_peek8(board, paths->tail_address);
    paths->flags = board_peek8(board, paths->flags_address);
    paths->high = board_peek8(board, paths->high_address);
}

/* Asked after every instruction. What is remembered is from the end of the interrupt before. */
static bool look_at_isr(board_t *board, void *ctx)
{
    paths_t *paths = ctx;
    const board_isr_t *isr = &paths->measures->isr[STEP_VECTOR];
    if (isr->count != paths->count) {
        /* It begins: what the main loop has changed meanwhile counts. */
        paths->count = isr->count;
        remember(board, paths);
        return false;
    }
    if (isr->cycles == paths->cycles)
        return false;
    uint64_t cycles = isr->cycles - paths->cycles;
    paths->cycles = isr->cycles;
    path_t path = PATH_COUNTED;
    if (board_peek8(board, paths->tail_address) != paths->tail) {
        bool early = paths->flags & 1 << 3;
        bool earlier = paths->flags & 1 << 4;
        bool dir = paths->flags & 1 << 7;
        if (board_peek8(board, paths->late_address))
            path = PATH_LATE;
        else
            path = earlier ? PATH_EARLIER : early ? PATH_EARLY : dir ? PATH_LOADED_DIR : PATH_LOADED;
    } else if (board_peek8(board, paths->flags_address) != paths->flags || cycles > 40) {
        path = PATH_EMPTY;
    } else if (board_peek8(board, paths->high_address) != paths->high) {
        path = PATH_WRAPPED;
    }
    paths->histogram[path][cycles < LONGEST ? cycles : LONGEST]++;
    return false;
}

void row_isr_paths(result_t *result)
{
    static const struct {
        const char *lines;
        uint8_t ustep;
        uint64_t run_us;
    } cases[] = {
        {"m20000vc30a10d10\n", 0, 1500000},
        {"m40000vc5a10d10\n", 0, 2000000},
        {"m40000vc4a10d10\n", 1, 2000000},
        {"m20000vc9a999d999\nm20000vc9a999d999\n", 2, 800000},
        {"m20000vc5a999d999\nm20000vc7a999d999\n", 1, 800000},
        {"m500vc1000a999d999\nm-500vc300a999d999\nm500v600\nm-400v3000a20d20\n", 0, 3000000},
        {"m300vc5000a20d20l1\n-\n+\n", 0, 2500000},
    };
    paths_t *paths = calloc(1, sizeof *paths);
    if (!paths)
        die("out of memory");
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        run_t run;
        run_begin(&run, (setup_t){.ustep = cases[i].ustep, .pulse_us = 1, .baud = 250000});
        paths->measures = run_measures(&run);
        paths->tail_address = code_symbol(&run, "step_tail");
        paths->late_address = code_symbol(&run, "step_late");
        paths->high_address = code_symbol(&run, "step_count_high");
        paths->flags_address = code_symbol(&run, "step_flags");
        paths->count = paths->measures->isr[STEP_VECTOR].count;
        paths->cycles = paths->measures->isr[STEP_VECTOR].cycles;
        remember(run.board, paths);
        run_type(&run, cases[i].lines);
        board_run_until(run.board, look_at_isr, paths, cases[i].run_us * TICKS_PER_US);
        run_end(&run, &result->worst);
    }
    detail(result, "\n| path of the step interrupt | cycles: runs |\n|---|---|\n");
    uint32_t most = 0;
    uint32_t fast = 0;
    for (int p = 0; p < PATHS; p++) {
        uint32_t least = 0;
        uint32_t longest = 0;
        unsigned values = 0;
        uint64_t runs = 0;
        for (uint32_t c = 0; c <= LONGEST; c++) {
            if (!paths->histogram[p][c])
                continue;
            if (!least)
                least = c;
            longest = c;
            values++;
            runs += paths->histogram[p][c];
        }
        detail(result, "| %s | ", path_names[p]);
        if (values <= 4) {
            const char *between = "";
            for (uint32_t c = 0; c <= LONGEST; c++)
                if (paths->histogram[p][c]) {
                    detail(result, "%s%u: %u", between, c, paths->histogram[p][c]);
                    between = ", ";
                }
        } else {
            detail(result, "%u to %u: %llu", least, longest, (unsigned long long)runs);
        }
        detail(result, " |\n");
        if (longest > most)
            most = longest;
        if (p == PATH_COUNTED)
            fast = longest;
    }
    free(paths);
    figure(result, "%u cycles for a counted period, %u at most", fast, most);
    result->verdict = most <= 160 ? VERDICT_MET : VERDICT_NOT_MET;
}

/* -- masked sections --------------------------------------------------------------------------------------------- */

/* A motion at this period is stopped, ended, followed, at many places of its period. */
static void disturb(result_t *result, uint32_t cycle_us, uint8_t ustep, const char *command)
{
    for (unsigned phase = 0; phase < 24; phase++) {
        run_t run;
        char text[80];
        run_begin(&run, (setup_t){.ustep = ustep, .pulse_us = 1, .baud = 250000});
        snprintf(text, sizeof text, "m2000000pvc%ua999d10\nm500v3000a999d999\n", cycle_us);
        run_type(&run, text);
        run_until_pulses(&run, 100, TICKS_PER_S);
        run_for(&run, phase * 13);
        run_type(&run, command);
        run_for(&run, TICKS_PER_S / 50);
        run_end(&run, &result->worst);
    }
}

void row_masked(result_t *result)
{
    static const uint32_t bauds[] = {38400, 250000};
    static const flood_t floods[] = {FLOOD_ANSWERED, FLOOD_SOLID};
    static const char *const commands[] = {"S\n", "s\n", "N\n", "n\n", "p\nvd\nq\ncf\n"};
    static const struct {
        uint32_t cycle_us;
        uint8_t ustep;
    } speeds[] = {{4, 1}, {5, 1}, {3, 0}, {7, 1}, {5, 0}, {6, 0}, {7, 0}, {20, 0}, {300, 0}, {5000, 0}};
    worst_t still;
    worst_clear(&still);
    for (size_t b = 0; b < sizeof bauds / sizeof bauds[0]; b++)
        for (size_t f = 0; f < sizeof floods / sizeof floods[0]; f++) {
            run_t run;
            run_begin(&run, (setup_t){.ustep = 0, .pulse_us = 2, .baud = bauds[b]});
            run_type(&run, "cf\nq\n?\nvd\np\n");
            run_for(&run, 2 * TICKS_PER_S);
            run_flood(&run, floods[f]);
            run_for(&run, TICKS_PER_S);
            run_end(&run, &still);
        }
    worst_add(&result->worst, &still);
    for (size_t s = 0; s < sizeof speeds / sizeof speeds[0]; s++)
        for (size_t c = 0; c < sizeof commands / sizeof commands[0]; c++)
            disturb(result, speeds[s].cycle_us, speeds[s].ustep, commands[c]);
    figure(result, "in other interrupts %u", still.isr_masked_max);
    result->verdict = still.isr_masked_max <= 80 ? VERDICT_MET : VERDICT_NOT_MET;
}
