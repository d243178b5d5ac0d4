/* Row: error of the ramps against the ideal curve. */
#include "bench.h"

#include <math.h>
#include <stdio.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

/* One motion with both its ramps; a line of the table. */
static void measure(result_t *result, const motion_t *motion, ramp_error_t *error, bool *exact)
{
    run_t run;
    ideal_t ideal;
    char text[80];
    ideal_plan(&ideal, motion);
    ideal_command(motion, text, sizeof text);
    run_begin(&run, (setup_t){.ustep = motion->ustep, .pulse_us = 1, .baud = 38400});
    run_type(&run, text);
    run_until_pulses(&run, ideal_pulses(&ideal), 120 * TICKS_PER_S);
    run_for(&run, TICKS_PER_S / 10);
    ideal_compare(&ideal, &run, 0, error);
    report_t report = run_report(&run);
    *exact = run.pulses == ideal_pulses(&ideal) && report.position == (int)run.pulses && report.faults == 0;
    double first = 100.0 * ((double)(run_interval(&run, 0) / ideal_interval(&ideal, 0)) - 1.0);
    char line[80];
    snprintf(line, sizeof line, "%.*s", (int)sizeof line - 1, text);
    for (char *c = line; *c; c++)
        if (*c == '\n')
            *c = '\0';
    char where[60];
    char wrong[80] = "";
    ramp_error_where(error, &ideal, where, sizeof where);
    if (!*exact)
        snprintf(wrong, sizeof wrong, "%+lld pulses, faults %u",
                 (long long)run.pulses - (long long)ideal_pulses(&ideal), report.faults);
    detail(result, "| `%s`%s | %g kHz | %+.4f | %.4f | %.4f at %llu | %.2f | %.4f | %.4f | %s | %+.1f | %s |\n", line,
           motion->ustep ? " (microsteps)" : "", 1000.0 / motion->cycle_us * (1 << motion->ustep), first,
           error->rms_percent, error->max_percent, (unsigned long long)error->worst_at, error->max_ticks,
           error->worst_ticks_percent, error->beyond_rms_percent, where, error->sum_ticks, wrong);
    run_end(&run, &result->worst);
}

void row_ramp_error(result_t *result)
{
    /* Within the stated conditions: full steps, harmonic up to 10, linear up to 500. */
    static const motion_t stated[] = {
        {.steps = 2000, .cycle_us = 2000, .accel = 1, .decel = 1},
        {.steps = 4000, .cycle_us = 1875, .accel = 5, .decel = 5, .linear = true},
        {.steps = 3000, .cycle_us = 100, .accel = 10, .decel = 10},
        {.steps = 400, .cycle_us = 100, .accel = 10, .decel = 10},
        {.steps = 30000, .cycle_us = 50, .accel = 0.5, .decel = 1.5},
        {.steps = 3000, .cycle_us = 30, .accel = 10, .decel = 10},
        {.steps = 30000, .cycle_us = 30, .accel = 1, .decel = 1},
        {.steps = 7000, .cycle_us = 10, .accel = 10, .decel = 10},
        {.steps = 13000, .cycle_us = 5, .accel = 10, .decel = 10},
        {.steps = 1000, .cycle_us = 1875, .accel = 10.47, .decel = 10.47, .linear = true},
        {.steps = 2000, .cycle_us = 300, .accel = 50, .decel = 50, .linear = true},
        {.steps = 1000, .cycle_us = 100, .accel = 500, .decel = 500, .linear = true},
        {.steps = 10000, .cycle_us = 100, .accel = 500, .decel = 500, .linear = true},
        {.steps = 80000, .cycle_us = 30, .accel = 500, .decel = 500, .linear = true},
        {.steps = 650000, .cycle_us = 10, .accel = 500, .decel = 500, .linear = true},
    };
    static const motion_t steep[] = {
        {.steps = 2000, .cycle_us = 30, .accel = 100, .decel = 100},
        {.steps = 2000, .cycle_us = 5, .accel = 100, .decel = 100},
        {.steps = 500, .cycle_us = 5, .accel = 998, .decel = 998},
        {.steps = 5000, .cycle_us = 10, .accel = 998, .decel = 998, .linear = true, .ustep = 0},
        {.steps = 400000, .cycle_us = 10, .accel = 998, .decel = 998, .linear = true},
        {.steps = 2000, .cycle_us = 100, .accel = 10, .decel = 10, .ustep = 3},
        {.steps = 4000, .cycle_us = 320, .accel = 500, .decel = 500, .linear = true, .ustep = 4},
        {.steps = 20000, .cycle_us = 40, .accel = 500, .decel = 500, .linear = true, .ustep = 2},
    };
    static const char heading[] =
        "\n| %s | to | first interval %% | rms %% | max %% at interval | max ticks | max %% beyond a tick | rms %% of what "
        "is beyond a tick | first out of the target | sum, ticks | |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
    bool met = true;
    double rms = 0.0;
    double beyond_rms = 0.0;
    double beyond_max = 0.0;
    double ticks = 0.0;
    detail(result, heading, "within the stated conditions");
    for (size_t i = 0; i < COUNT_OF(stated); i++) {
        ramp_error_t error;
        bool exact;
        measure(result, &stated[i], &error, &exact);
        met = met && exact && ramp_error_met(&error);
        rms = fmax(rms, error.rms_percent);
        beyond_rms = fmax(beyond_rms, error.beyond_rms_percent);
        beyond_max = fmax(beyond_max, error.worst_ticks_percent);
        ticks = fmax(ticks, error.max_ticks);
    }
    detail(result, heading, "beyond");
    for (size_t i = 0; i < COUNT_OF(steep); i++) {
        ramp_error_t error;
        bool exact;
        measure(result, &steep[i], &error, &exact);
    }
    figure(
        result,
        "%.2f ticks at most; where it is more than a tick %.4f %% max, rms of that part %.4f %%; rms of all, rounding "
        "to ticks included, %.4f %%",
        ticks, beyond_max, beyond_rms, rms);
    result->verdict = met ? VERDICT_MET : VERDICT_NOT_MET;
}
