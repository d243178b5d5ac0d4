/* The benchmark: runs the whole image on the simulated board and compares with the targets.
 *
 *     bench [--strict] [--jobs N] [--stack FILE] [--markdown FILE] image.elf [row ...]
 *
 * Without names all rows are run and the table is written to the Markdown file. --stack: what tools/check_stack.py
 * printed. Exit code: 0; 1 with --strict if a target is missed; 2 if a row could not be measured. */
#include "bench.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

const char *bench_elf;
const char *bench_stack_report;

typedef struct {
    const char *name; /* on the command line */
    const char *figure;
    const char *conditions;
    const char *target;
    void (*measure)(result_t *result); /* NULL: later */
} row_t;

static const row_t rows[] = {
    {"cruise", "step rate kept, exact count: cruise",
     "pulses of 1 µs, both ports idle, 1,000,000 pulses and other counts", "500 kHz", row_cruise_rate},
    {"harmonic", "step rate kept, exact count: both harmonic ramps",
     "a = 10 (the same in pulses with microsteps); terminal receiving at 250 kBd", "200 kHz", row_harmonic_rate},
    {"linear", "step rate kept, exact count: both linear ramps", "500 rad/s²; terminal receiving at 250 kBd", "200 kHz",
     row_linear_rate},
    {"packets", "step rate with packets arriving", "38,400 Bd on the software port, none lost: a packet for another unit, one for this, its answer", "100 kHz",
     row_packets},
    {"load-cruise", "processor load at 33.3 kHz, cruise", "cycles in interrupts", "<= 6 %", row_load_cruise},
    {"load-ramps", "processor load at 33.3 kHz, ramps",
     "harmonic a = 10, linear 500 rad/s², cycles in interrupts and planner", "<= 25 %", row_load_ramps},
    {"jitter", "edge jitter in cruise",
     "terminal flooded at 38,400 and 250,000 Bd, echo on, 33 to 500 kHz, 1 s each (software port, encoder: later)",
     "0 cycles", row_jitter},
    {"error", "ramp error against the ideal curve",
     "all intervals from the first, full step, harmonic up to a = 10, linear up to 500 rad/s²",
     "<= 0.03 % rms, <= 0.1 % max (or 1 tick)", row_ramp_error},
    {"newline", "newline to first pulse", "from standstill, end of the stop bit to the rising edge", "<= 150 µs",
     row_first_pulse},
    {"streaming", "excess between streamed commands", "d999, 2 to 3,000 µs", "0 ticks", row_streaming},
    {"skew", "start skew of nodes released by one sync edge",
     "twelve units, clocks to 50 ppm off; at rest, and with packets on the line", "<= 1 µs", row_skew},
    {"estop", "Estop edge to last possible rising edge",
     "each cycle of a period in cruise and ramps, terminal receiving at 250 kBd (joins, stops, EEPROM: test_image_estop)",
     "<= 3 µs", row_estop},
    {"periods", "range of periods", "vc, every interval measured", "2 µs to 2^32-1 µs", row_periods},
    {"memory", "flash / static RAM", "from the image", "<= 26 KB / <= 1,400 B, stack proven to fit", row_memory},
    {"isr", "step interrupt", "every path; single runs, and the maximum of all rows", "<= 160 cycles", row_isr_paths},
    {"masked", "interrupts masked elsewhere",
     "outside interrupts: the maximum of all rows; in the other interrupts: terminal flooded in standstill",
     "<= 80 cycles", row_masked},
};
#define ROWS (sizeof rows / sizeof rows[0])

/* -- results --------------------------------------------------------------------------------------------------- */

static void append(char *text, size_t size, const char *format, va_list arguments)
{
    size_t used = strlen(text);
    vsnprintf(text + used, size - used, format, arguments);
}

void figure(result_t *result, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    append(result->figure, sizeof result->figure, format, arguments);
    va_end(arguments);
}

void detail(result_t *result, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    append(result->detail, sizeof result->detail, format, arguments);
    va_end(arguments);
}

void worst_clear(worst_t *worst)
{
    memset(worst, 0, sizeof *worst);
    worst->stack_low = UINT16_MAX;
}

void worst_add(worst_t *sum, const worst_t *other)
{
    for (int v = 0; v < BOARD_VECTORS; v++) {
        board_isr_t *to = &sum->isr[v];
        const board_isr_t *from = &other->isr[v];
        to->count += from->count;
        to->cycles += from->cycles;
        if (from->cycles_max > to->cycles_max)
            to->cycles_max = from->cycles_max;
        if (from->latency_max > to->latency_max)
            to->latency_max = from->latency_max;
    }
    if (other->masked_max > sum->masked_max) {
        sum->masked_max = other->masked_max;
        sum->masked_max_pc = other->masked_max_pc;
    }
    if (other->isr_masked_max > sum->isr_masked_max) {
        sum->isr_masked_max = other->isr_masked_max;
        sum->isr_masked_vector = other->isr_masked_vector;
    }
    if (other->stack_low < sum->stack_low)
        sum->stack_low = other->stack_low;
}

void row_memory(result_t *result)
{
    image_size_t size = image_size(bench_elf);
    figure(result, "%u B / %u B", size.flash, size.ram);
    bool proven = false;
    if (bench_stack_report) {
        char report[LINE_BYTES] = "";
        FILE *file = fopen(bench_stack_report, "r");
        if (file && fgets(report, sizeof report, file)) {
            report[strcspn(report, "\n")] = '\0';
            detail(result, "- %s\n", report);
            unsigned bound;
            unsigned left;
            proven = sscanf(report, "stack %u of %u", &bound, &left) == 2 && bound <= left;
        }
        if (file)
            fclose(file);
    }
    figure(result, proven ? ", the stack fits" : ", stack not proven");
    result->verdict = size.flash <= 26624 && size.ram <= 1400 && proven ? VERDICT_MET : VERDICT_NOT_MET;
}

/* -- running --------------------------------------------------------------------------------------------------- */

static result_t results[ROWS];

typedef struct {
    pid_t pid;
    int pipe;
    size_t row;
} job_t;

static job_t begin(size_t row)
{
    int ends[2];
    if (pipe(ends) != 0)
        die("no pipe");
    fflush(NULL);
    job_t job = {.pid = fork(), .pipe = ends[0], .row = row};
    if (job.pid < 0)
        die("cannot fork");
    if (job.pid == 0) {
        result_t *result = calloc(1, sizeof *result);
        if (!result)
            die("out of memory");
        worst_clear(&result->worst);
        rows[row].measure(result);
        const char *from = (const char *)result;
        for (size_t done = 0; done < sizeof *result;) {
            ssize_t n = write(ends[1], from + done, sizeof *result - done);
            if (n <= 0)
                _exit(2);
            done += (size_t)n;
        }
        _exit(0);
    }
    close(ends[1]);
    return job;
}

static bool finish(job_t *job)
{
    char *to = (char *)&results[job->row];
    size_t done = 0;
    ssize_t n;
    while (done < sizeof results[0] && (n = read(job->pipe, to + done, sizeof results[0] - done)) > 0)
        done += (size_t)n;
    close(job->pipe);
    int status;
    waitpid(job->pid, &status, 0);
    return done == sizeof results[0];
}

static const char *verdict_text(size_t row)
{
    switch (results[row].verdict) {
    case VERDICT_MET: return "met";
    case VERDICT_NOT_MET: return "not met";
    case VERDICT_LATER: return "later";
    case VERDICT_NONE: break;
    }
    return "";
}

/* -- printing -------------------------------------------------------------------------------------------------- */

static const char *const vector_names[BOARD_VECTORS] = {
    "RESET",        "INT0",         "INT1",        "PCINT0",      "PCINT1",       "PCINT2",       "WDT",
    "TIMER2_COMPA", "TIMER2_COMPB", "TIMER2_OVF",  "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF",
    "TIMER0_COMPA", "TIMER0_COMPB", "TIMER0_OVF",  "SPI_STC",     "USART_RX",     "USART_UDRE",   "USART_TX",
    "ADC",          "EE_READY",     "ANALOG_COMP", "TWI",         "SPM_READY",
};

static void print_table(FILE *out, const bool *chosen)
{
    fprintf(out, "| figure | conditions | target | measured | |\n|---|---|---|---|---|\n");
    for (size_t i = 0; i < ROWS; i++)
        if (chosen[i])
            fprintf(out, "| %s | %s | %s | %s | %s |\n", rows[i].figure, rows[i].conditions, rows[i].target,
                    results[i].figure, verdict_text(i));
}

static void print_worst(FILE *out, const worst_t *worst)
{
    char where[80];
    fprintf(out, "\n| interrupt | runs | cycles, mean | cycles, max | latency, max |\n|---|---|---|---|---|\n");
    for (int v = 0; v < BOARD_VECTORS; v++) {
        const board_isr_t *isr = &worst->isr[v];
        if (isr->count)
            fprintf(out, "| %s | %llu | %.1f | %u | %u |\n", vector_names[v], (unsigned long long)isr->count,
                    (double)isr->cycles / (double)isr->count, isr->cycles_max, isr->latency_max);
    }
    image_where(bench_elf, worst->masked_max_pc, where, sizeof where);
    fprintf(out, "\n- Longest time with interrupts masked outside interrupts: %u cycles, ended at %s.\n",
            worst->masked_max, where);
    fprintf(out, "- Longest time with interrupts masked inside an interrupt: %u cycles, in %s.\n",
            worst->isr_masked_max, vector_names[worst->isr_masked_vector % BOARD_VECTORS]);
    fprintf(out, "- Lowest stack pointer: 0x%04x, %u bytes of stack used.\n", worst->stack_low,
            0x8FFu - worst->stack_low);
}

/* Two rows have their last word from all of them. */
static void conclude(const bool *chosen, worst_t *worst)
{
    worst_clear(worst);
    for (size_t i = 0; i < ROWS; i++)
        if (chosen[i] && rows[i].measure)
            worst_add(worst, &results[i].worst);
    for (size_t i = 0; i < ROWS; i++) {
        if (!chosen[i])
            continue;
        if (rows[i].measure == row_isr_paths) {
            uint32_t most = worst->isr[STEP_VECTOR].cycles_max;
            figure(&results[i], "; %u in all rows", most);
            if (most > 160)
                results[i].verdict = VERDICT_NOT_MET;
        }
        if (rows[i].measure == row_masked) {
            char where[80];
            image_where(bench_elf, worst->masked_max_pc, where, sizeof where);
            figure(&results[i], "; outside interrupts %u (before %s)", worst->masked_max, where);
            if (worst->masked_max > 80)
                results[i].verdict = VERDICT_NOT_MET;
        }
    }
}

static void print_all(FILE *out, const bool *chosen, const worst_t *worst)
{
    print_table(out, chosen);
    for (size_t i = 0; i < ROWS; i++) {
        if (!chosen[i] || !rows[i].measure)
            continue;
        if (results[i].detail[0])
            fprintf(out, "\n## %s\n\n%s", rows[i].figure,
                    results[i].detail[0] == '\n' ? results[i].detail + 1 : results[i].detail);
    }
    if (worst->stack_low != UINT16_MAX) {
        fprintf(out, "\n## Interrupts, over all runs\n");
        print_worst(out, worst);
    }
}

static const char introduction[] =
    "# Benchmark\n\n"
    "Written by `make bench`: the image build/sac.elf, unmodified, on the simulated board. One tick is one CPU cycle, "
    "62.5 ns.\n\n";

int main(int argc, char **argv)
{
    bool strict = false;
    long jobs = sysconf(_SC_NPROCESSORS_ONLN);
    const char *markdown = NULL;
    bool chosen[ROWS] = {false};
    bool any = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--strict") == 0) {
            strict = true;
        } else if (strcmp(argv[i], "--jobs") == 0 && i + 1 < argc) {
            jobs = atol(argv[++i]);
        } else if (strcmp(argv[i], "--stack") == 0 && i + 1 < argc) {
            bench_stack_report = argv[++i];
        } else if (strcmp(argv[i], "--markdown") == 0 && i + 1 < argc) {
            markdown = argv[++i];
        } else if (!bench_elf) {
            bench_elf = argv[i];
        } else {
            size_t row = 0;
            while (row < ROWS && strcmp(rows[row].name, argv[i]) != 0)
                row++;
            if (row == ROWS)
                die("no row %s", argv[i]);
            chosen[row] = any = true;
        }
    }
    if (!bench_elf) {
        fprintf(stderr, "bench [--strict] [--jobs N] [--stack FILE] [--markdown FILE] image.elf [row ...]\nrows:");
        for (size_t i = 0; i < ROWS; i++)
            fprintf(stderr, " %s", rows[i].name);
        fputc('\n', stderr);
        return 2;
    }
    if (!any)
        for (size_t i = 0; i < ROWS; i++)
            chosen[i] = true;

    bool measured = true;
    job_t running[ROWS];
    size_t count = 0;
    for (size_t i = 0; i <= ROWS; i++) {
        while (count && (i == ROWS || count >= (size_t)(jobs < 1 ? 1 : jobs))) {
            job_t job = running[0];
            memmove(running, running + 1, --count * sizeof running[0]);
            if (!finish(&job)) {
                measured = false;
                results[job.row].verdict = VERDICT_NOT_MET;
                snprintf(results[job.row].figure, LINE_BYTES, "could not be measured");
            }
        }
        if (i == ROWS || !chosen[i])
            continue;
        results[i].verdict = VERDICT_LATER;
        if (rows[i].measure)
            running[count++] = begin(i);
    }

    worst_t worst;
    conclude(chosen, &worst);
    print_all(stdout, chosen, &worst);
    if (markdown && !any) {
        FILE *out = fopen(markdown, "w");
        if (!out)
            die("cannot write %s", markdown);
        fputs(introduction, out);
        print_all(out, chosen, &worst);
        fclose(out);
    }
    bool missed = false;
    for (size_t i = 0; i < ROWS; i++)
        missed = missed || (chosen[i] && results[i].verdict == VERDICT_NOT_MET);
    return !measured ? 2 : strict && missed ? 1 : 0;
}
