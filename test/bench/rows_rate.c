/* Rows: step rates kept with an exact count, jitter. */
#include "bench.h"

#include <stdio.h>
#include <stdlib.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

typedef struct {
    uint32_t cycle_us; /* of a full step */
    uint8_t ustep;
} rate_t;

static uint32_t rate_ticks(const rate_t *rate)
{
    return rate->cycle_us * TICKS_PER_US >> rate->ustep;
}

static double rate_khz(const rate_t *rate)
{
    return (double)TICKS_PER_S / rate_ticks(rate) / 1000.0;
}

/* A motion of so few pulses has no run that could be reloaded in time: its intervals are stretched where they are below
 * 96 ticks (docs/design.md). That is printed, not judged. */
static unsigned stretched_pulses(const rate_t *rate)
{
    return rate_ticks(rate) < 40 ? 4 : 3;
}

static bool cruise_kept(result_t *result, const rate_t *rate, unsigned pulses)
{
    run_t run;
    char text[80];
    run_begin(&run, (setup_t){.ustep = rate->ustep, .pulse_us = 1, .baud = 38400});
    snprintf(text, sizeof text, "m%upvc%ua999d999\n", pulses, rate->cycle_us);
    run_type(&run, text);
    run_until_quiet(&run, TICKS_PER_S / 2, 60 * TICKS_PER_S);
    uint64_t off = run_grid_error(&run, rate_ticks(rate));
    report_t report = run_report(&run);
    bool exact = off == 0 || pulses <= stretched_pulses(rate);
    bool kept =
        run.pulses == pulses && exact && run.bad_widths == 0 && report.faults == 0 && report.position == (int)pulses;
    if (!kept || off)
        detail(result,
               "- %g kHz: %zu of %u pulses, %llu ticks off the grid, %zu pulses of a wrong length, faults %u, "
               "position %d%s\n",
               rate_khz(rate), run.pulses, pulses, (unsigned long long)off, run.bad_widths, report.faults,
               report.position, kept ? " (too short a motion for this rate: stretched)" : "");
    run_end(&run, &result->worst);
    return kept;
}

void row_cruise_rate(result_t *result)
{
    static const rate_t rates[] = {{4, 1}, {5, 1}, {3, 0}, {4, 0}, {5, 0}, {10, 0}, {30, 0}};
    /* Counts around what fills bytes and words of a counter, and others. */
    static const unsigned counts[] = {1000000, 1,     2,     3,     4,     5,      6,      7,      255,    256,   257,
                                      258,     511,   512,   513,   1000,  1234,   5000,   23333,  27777,  33333, 65535,
                                      65536,   65537, 65538, 77777, 99999, 100003, 131072, 131075, 150001, 200000};
    result->verdict = VERDICT_NOT_MET;
    for (size_t i = 0; i < COUNT_OF(rates); i++) {
        size_t kept = 0;
        for (size_t c = 0; c < COUNT_OF(counts); c++)
            kept += cruise_kept(result, &rates[i], counts[c]);
        if (kept != COUNT_OF(counts))
            continue;
        figure(result, "%g kHz, %u of %u pulses, every interval exact; %zu other counts likewise", rate_khz(&rates[i]),
               counts[0], counts[0], kept - 1);
        if (rate_ticks(&rates[i]) <= 32)
            result->verdict = VERDICT_MET;
        return;
    }
    figure(result, "none");
}

typedef enum { RAMPS_WRONG, RAMPS_COUNTED, RAMPS_KEPT } ramps_t; /* counted: an exact count, but a fault was latched */

/* Lines that the terminal has refused: none of those that are sent is wrong, so it did not receive them whole. */
static unsigned refused_lines(const run_t *run)
{
    unsigned refused = 0;
    for (const char *c = board_uart_text(run->board); *c; c++)
        refused += *c == '?';
    return refused;
}

/* Both ramps of one kind up to the rate, while the terminal receives. */
static ramps_t ramps_kept(result_t *result, const rate_t *rate, bool linear, unsigned *damaged)
{
    run_t run;
    char text[80];
    ideal_t ideal;
    ramp_error_t error;
    motion_t motion = {.steps = UINT32_MAX, .cycle_us = rate->cycle_us, .linear = linear, .ustep = rate->ustep};
    motion.accel = motion.decel = linear ? 500.0 / (1 << rate->ustep) : 10.0; /* the same in pulses */
    ideal_plan(&ideal, &motion);
    uint64_t full_steps = (ideal.accel_pulses + ideal.decel_pulses) >> rate->ustep;
    motion.steps = full_steps + 20000;
    ideal_plan(&ideal, &motion);
    ideal_command(&motion, text, sizeof text);

    setup_t setup = {.ustep = rate->ustep, .pulse_us = (uint8_t)(rate_ticks(rate) < 48 ? 1 : 2), .baud = 250000};
    run_begin(&run, setup);
    run_type(&run, text);
    run_flood(&run, FLOOD_ANSWERED);
    run_until_pulses(&run, ideal_pulses(&ideal), 120 * TICKS_PER_S);
    run_until_quiet(&run, TICKS_PER_S / 2, 5 * TICKS_PER_S);
    ideal_compare(&ideal, &run, 0, &error);
    *damaged = refused_lines(&run);
    report_t report = run_report(&run);
    char where[60];
    ramp_error_where(&error, &ideal, where, sizeof where);
    uint32_t overruns = board_uart_overruns(run.board);
    bool counted = run.pulses == ideal_pulses(&ideal) && report.position == (int)run.pulses && run.bad_widths == 0;
    bool kept = counted && report.faults == 0;
    detail(
        result,
        "- %s to %g kHz: %zu of %llu pulses, position %d, faults %u, %zu lines sent, %u error answers, %u bytes overrun; error %.4f %% rms, "
        "%.3f ticks max, %.4f %% max beyond a tick, first out of the target: %s; sum %+.1f ticks\n",
        linear ? "linear" : "harmonic", rate_khz(rate), run.pulses, (unsigned long long)ideal_pulses(&ideal),
        report.position, report.faults, run.fed_lines, *damaged, overruns, error.rms_percent, error.max_ticks,
        error.worst_ticks_percent, where, error.sum_ticks);
    run_end(&run, &result->worst);
    return kept ? RAMPS_KEPT : counted ? RAMPS_COUNTED : RAMPS_WRONG;
}

/* What the same reception costs without motion. */
static void terminal_alone(result_t *result)
{
    run_t run;
    uint64_t isr = 0;
    run_begin(&run, (setup_t){.ustep = 0, .pulse_us = 2, .baud = 250000});
    run_flood(&run, FLOOD_ANSWERED);
    run_for(&run, TICKS_PER_S / 10);
    run_measures_clear(&run);
    run_for(&run, TICKS_PER_S);
    const board_measures_t *m = run_measures(&run);
    for (int v = 0; v < BOARD_VECTORS; v++)
        isr += m->isr[v].cycles;
    detail(result, "- reception alone, in standstill: %.1f %% in interrupts, asleep %.1f %%\n",
           100.0 * (double)isr / (double)m->cycles, 100.0 * (double)m->sleep_cycles / (double)m->cycles);
    run_end(&run, &result->worst);
}

/* Goes down from the highest rate to the first that is kept. */
static void highest(result_t *result, const rate_t *rates, size_t count, bool linear)
{
    double counted = 0.0;
    result->verdict = VERDICT_NOT_MET;
    terminal_alone(result);
    for (size_t i = 0; i < count; i++) {
        double khz = rate_khz(&rates[i]);
        unsigned damaged;
        ramps_t ramps = ramps_kept(result, &rates[i], linear, &damaged);
        if (ramps != RAMPS_WRONG && counted == 0.0)
            counted = khz;
        if (ramps != RAMPS_KEPT)
            continue;
        figure(result, "%g kHz", khz);
        if (counted > khz)
            figure(result, " (exact count, but with a fault latched: %g kHz)", counted);
        if (damaged)
            figure(result, ", %u error answers of the terminal", damaged);
        if (khz >= 200.0)
            result->verdict = VERDICT_MET;
        return;
    }
    figure(result, "below %g kHz (exact count, but with a fault latched: %g kHz)", rate_khz(&rates[count - 1]),
           counted);
}

void row_harmonic_rate(result_t *result)
{
    static const rate_t rates[] = {{4, 1}, {5, 1}, {3, 0},  {7, 1},  {4, 0},  {9, 1}, {5, 0},
                                   {6, 0}, {8, 0}, {10, 0}, {15, 0}, {20, 0}, {30, 0}};
    highest(result, rates, COUNT_OF(rates), false);
}

void row_linear_rate(result_t *result)
{
    static const rate_t rates[] = {{4, 0}, {5, 0}, {6, 0}, {8, 0}, {10, 0}, {20, 0}, {30, 0}};
    highest(result, rates, COUNT_OF(rates), true);
}

void row_jitter(result_t *result)
{
    static const rate_t rates[] = {{30, 0}, {10, 0}, {5, 0}, {3, 0}, {4, 1}};
    static const uint32_t bauds[] = {38400, 250000};
    uint64_t worst = 0;
    bool exact = true;
    for (size_t b = 0; b < COUNT_OF(bauds); b++) {
        detail(result, "- %u Bd:", bauds[b]);
        for (size_t i = 0; i < COUNT_OF(rates); i++) {
            run_t run;
            char text[80];
            uint64_t pulses = TICKS_PER_S / rate_ticks(&rates[i]); /* one second */
            run_begin(&run, (setup_t){.ustep = rates[i].ustep, .pulse_us = 1, .baud = bauds[b]});
            snprintf(text, sizeof text, "m%llupvc%ua999d999\n", (unsigned long long)pulses, rates[i].cycle_us);
            run_type(&run, text);
            run_flood(&run, FLOOD_SOLID);
            run_until_quiet(&run, TICKS_PER_S / 10, 5 * TICKS_PER_S);
            uint64_t off = run_grid_error(&run, rate_ticks(&rates[i]));
            size_t sent;
            board_uart_received(run.board, &sent);
            unsigned damaged = refused_lines(&run);
            report_t report = run_report(&run);
            detail(result,
                   " %g kHz %llu cycles (%zu of %llu pulses, faults %u, %zu bytes sent back, %u error answers)%s",
                   rate_khz(&rates[i]), (unsigned long long)off, run.pulses, (unsigned long long)pulses, report.faults,
                   sent, damaged, i + 1 < COUNT_OF(rates) ? ";" : "\n");
            exact = exact && run.pulses == pulses && report.position == (int)pulses && report.faults == 0;
            if (off > worst)
                worst = off;
            run_end(&run, &result->worst);
        }
    }
    figure(result, "%llu cycles%s", (unsigned long long)worst, exact ? "" : ", counts wrong");
    result->verdict = worst == 0 && exact ? VERDICT_MET : VERDICT_NOT_MET;
}
