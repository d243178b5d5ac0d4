/* Rows: newline to first pulse, streaming, Estop, range of periods. */
#include "bench.h"

#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static double us(uint64_t ticks)
{
    return (double)ticks / TICKS_PER_US;
}

/* From the end of the stop bit of the line's end to the rising edge. */
static uint64_t first_pulse(result_t *result, const char *line, uint8_t ustep, uint32_t baud, uint64_t phase)
{
    run_t run;
    run_begin(&run, (setup_t){.ustep = ustep, .pulse_us = 1, .baud = baud});
    run_for(&run, phase);
    run_type(&run, line);
    run_until_pulses(&run, 1, TICKS_PER_S / 5);
    if (run.pulses == 0)
        die("no pulse from %s: %s", line, board_uart_text(run.board));
    uint64_t wait = run.rise[0] - board_uart_last_sent(run.board);
    run_end(&run, &result->worst);
    return wait;
}

void row_first_pulse(result_t *result)
{
    static const struct {
        const char *what;
        const char *lines;
        uint8_t ustep;
    } cases[] = {
        {"as the manual's example", "m2000v150\n", 0},
        {"linear", "m2000v150a10.47d10.47l1\n", 0},
        {"truncated", "m20v150\n", 0},
        {"linear, truncated", "m20v150l1a10d10\n", 0},
        {"without ramps", "m2000vc3000a999d999\n", 0},
        {"without ramps, 500 kHz", "m2000vc2a999d999\n", 0},
        {"counter-clockwise", "m-2000v150\n", 0},
        {"all parameters", "m-1234567v12345a12.34d56.78u200t0l1s0p\n", 0},
        {"microsteps", "m2000v150a.5d.5\n", 4},
        {"pulses", "m2000pv150\n", 4},
        {"one step", "m1\n", 0},
    };
    static const uint32_t bauds[] = {38400, 250000};
    const unsigned phases = 12;
    uint64_t worst = 0;
    const char *worst_line = "";
    detail(result, "\n| command | 38,400 Bd, µs | 250,000 Bd, µs |\n|---|---|---|\n");
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        int length = (int)strlen(cases[i].lines) - 1;
        detail(result, "| %s: `%.*s` |", cases[i].what, length, cases[i].lines);
        for (size_t b = 0; b < COUNT_OF(bauds); b++) {
            uint64_t most = 0;
            uint64_t least = UINT64_MAX;
            for (unsigned p = 0; p < phases; p++) {
                uint64_t wait = first_pulse(result, cases[i].lines, cases[i].ustep, bauds[b], p * 1237);
                if (wait > most)
                    most = wait;
                if (wait < least)
                    least = wait;
            }
            detail(result, " %.1f to %.1f |", us(least), us(most));
            if (bauds[b] == 38400 && most > worst) {
                worst = most;
                worst_line = cases[i].lines;
            }
        }
        detail(result, "\n");
    }
    figure(result, "%.1f µs at most (`%.*s`)", us(worst), (int)strlen(worst_line) - 1, worst_line);
    result->verdict = worst <= 150 * TICKS_PER_US ? VERDICT_MET : VERDICT_NOT_MET;
}

/* Commands of `steps` each, without ramps. The first takes long enough to let the others arrive. */
typedef struct {
    uint32_t steps;
    uint32_t cycle_us[6]; /* of each command; 0: no more */
    uint8_t pulse_us;
} stream_t;

/* The largest distance of any interval from its command's, those between two commands included. */
static uint64_t stream(result_t *result, const stream_t *commands, uint32_t baud, bool *exact)
{
    run_t run;
    char text[400] = "";
    size_t at = 0;
    size_t count = 0;
    uint64_t most = 0;
    for (; commands->cycle_us[count]; count++)
        at += (size_t)snprintf(text + at, sizeof text - at, "m%uvc%ua999d999\n", commands->steps,
                               commands->cycle_us[count]);
    uint64_t pulses = (uint64_t)count * commands->steps;
    run_begin(&run, (setup_t){.ustep = 0, .pulse_us = commands->pulse_us, .baud = baud});
    run_type(&run, text);
    run_until_quiet(&run, TICKS_PER_S, 60 * TICKS_PER_S);
    for (size_t k = 0; k + 1 < run.pulses && k < pulses; k++) {
        uint64_t wanted = (uint64_t)commands->cycle_us[k / commands->steps] * TICKS_PER_US;
        uint64_t got = run_interval(&run, k);
        uint64_t off = got > wanted ? got - wanted : wanted - got;
        if (off > most)
            most = off;
    }
    report_t report = run_report(&run);
    detail(result, "- %zu commands of %u steps, vc", count, commands->steps);
    for (size_t c = 0; c < count; c++)
        detail(result, " %u", commands->cycle_us[c]);
    detail(result, ", %u Bd: %llu ticks, %zu of %llu pulses, position %d, faults %u\n", baud, (unsigned long long)most,
           run.pulses, (unsigned long long)pulses, report.position, report.faults);
    *exact = run.pulses == pulses && report.position == (int)pulses && report.faults == 0;
    run_end(&run, &result->worst);
    return most;
}

void row_streaming(result_t *result)
{
    static const stream_t cases[] = {
        {200, {2000, 2000, 2000, 2000}, 2},
        {20000, {30, 30, 30, 30}, 2},
        {50000, {10, 10, 10, 10}, 2},
        {100000, {5, 5, 5, 5}, 2},
        {200000, {2, 2, 2, 2}, 1},
        {20000, {2, 2}, 1},
        {23333, {2, 2, 2}, 1},
        {1000, {1000, 500, 1500, 30, 3000}, 2},
        {20000, {100, 5, 40, 4, 10}, 2},
        {30000, {3, 7, 4, 6, 3}, 2},
        {1, {400000, 2000, 2000}, 2},
        {3, {100000, 500, 700, 20000}, 2},
    };
    static const uint32_t bauds[] = {38400, 250000};
    uint64_t worst = 0;
    bool all_exact = true;
    for (size_t i = 0; i < COUNT_OF(cases); i++)
        for (size_t b = 0; b < COUNT_OF(bauds); b++) {
            bool exact;
            uint64_t most = stream(result, &cases[i], bauds[b], &exact);
            all_exact = all_exact && exact;
            if (most > worst)
                worst = most;
        }
    figure(result, "%llu ticks%s", (unsigned long long)worst, all_exact ? "" : ", counts or faults wrong");
    result->verdict = worst == 0 && all_exact ? VERDICT_MET : VERDICT_NOT_MET;
}

/* From the edge at Estop to the last rise of clk, at each of so many cycles from here on: one process for each. */
static int64_t last_rise(run_t *run, unsigned phases)
{
    int64_t *after = mmap(NULL, phases * sizeof *after, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (after == MAP_FAILED)
        die("out of memory");
    fflush(NULL);
    for (unsigned i = 0; i < phases; i++) {
        after[i] = INT64_MAX;
        pid_t pid = fork();
        if (pid < 0)
            die("cannot fork");
        if (pid == 0) {
            uint64_t edge = board_cycle(run->board) + i;
            board_pin_drive_at(run->board, BOARD_PIN('D', 2), 0, edge);
            run_for(run, phases + TICKS_PER_S / 500);
            after[i] = (int64_t)run->last_rise - (int64_t)edge;
            _exit(0);
        }
        waitpid(pid, NULL, 0);
    }
    int64_t most = INT64_MIN;
    for (unsigned i = 0; i < phases; i++)
        most = after[i] > most ? after[i] : most;
    munmap(after, phases * sizeof *after);
    return most;
}

void row_estop(result_t *result)
{
    static const struct {
        const char *line;
        uint8_t ustep, pulse_us;
        unsigned pulses; /* before */
        unsigned phases;
    } cases[] = {
        {"m1000000vc30a999d999\n", 0, 2, 5000, 480}, {"m1000000vc10a999d999\n", 0, 2, 5000, 320},
        {"m1000000vc5a999d999\n", 0, 2, 5000, 320},  {"m1000000vc2a999d999\n", 0, 1, 5000, 320},
        {"m20000v3000a20d20\n", 0, 2, 20, 1500},     {"m20000vc10a10d10\n", 0, 2, 2000, 1500},
        {"m60000vc3a10d10\n", 0, 1, 9500, 1500},     {"m60000vc5a10d10\n", 1, 1, 11000, 1500},
        {"m60000vc5a500d500l1\n", 0, 2, 3000, 1500},
    };
    int64_t worst = INT64_MIN;
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        run_t run;
        run_begin(&run, (setup_t){.ustep = cases[i].ustep, .pulse_us = cases[i].pulse_us, .baud = 250000});
        run_type(&run, cases[i].line);
        run_flood(&run, FLOOD_ANSWERED);
        if (!run_until_pulses(&run, cases[i].pulses, 60 * TICKS_PER_S))
            die("no motion from %s", cases[i].line);
        int64_t most = last_rise(&run, cases[i].phases);
        detail(result, "- `%.*s`, microsteps %u: %lld cycles\n", (int)strlen(cases[i].line) - 1, cases[i].line,
               1u << cases[i].ustep, (long long)most);
        worst = most > worst ? most : worst;
        run_end(&run, &result->worst);
    }
    figure(result, "%.2f µs at most", (double)worst / TICKS_PER_US);
    result->verdict = worst <= 3 * (int64_t)TICKS_PER_US ? VERDICT_MET : VERDICT_NOT_MET;
}

/* All intervals of `pulses` pulses at one period are exact. */
static bool period_exact(result_t *result, uint32_t period_us, unsigned pulses)
{
    run_t run;
    char text[80];
    uint64_t ticks = (uint64_t)period_us * TICKS_PER_US;
    run_begin(&run, (setup_t){.ustep = 0, .pulse_us = 1, .baud = 38400});
    snprintf(text, sizeof text, "m%uvc%ua999d999\n", pulses, period_us);
    run_type(&run, text);
    run_until_pulses(&run, pulses, ticks * pulses + TICKS_PER_S);
    run_for(&run, TICKS_PER_S / 10);
    report_t report = run_report(&run);
    bool exact = run.pulses == pulses && report.position == (int)pulses && report.faults == 0;
    uint64_t last = 0;
    for (size_t k = 0; k + 1 < run.pulses; k++) {
        last = run_interval(&run, k);
        exact = exact && last == ticks;
    }
    detail(result, "- vc%u: %zu of %u pulses, interval %llu of %llu ticks\n", period_us, run.pulses, pulses,
           (unsigned long long)last, (unsigned long long)ticks);
    run_end(&run, &result->worst);
    return exact;
}

void row_periods(result_t *result)
{
    static const struct {
        uint32_t period_us;
        unsigned pulses;
    } cases[] = {{2, 1000},  {3, 1000},  {5, 1000},  {6, 1000},  {7, 1000},     {2047, 50},
                 {2048, 50}, {2049, 50}, {2056, 50}, {2057, 50}, {4095, 50},    {4096, 50},
                 {4097, 50}, {4104, 50}, {6144, 50}, {6145, 50}, {10000019, 3}, {4294967295u, 2}};
    bool all = true;
    for (size_t i = 0; i < COUNT_OF(cases); i++)
        all = period_exact(result, cases[i].period_us, cases[i].pulses) && all;
    figure(result, all ? "2 µs to 4,294,967,295 µs, exact" : "not exact everywhere");
    result->verdict = all ? VERDICT_MET : VERDICT_NOT_MET;
}
