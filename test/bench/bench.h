/* What the parts of the benchmark share.
 *
 * Every row of the table is one function that runs the whole image on boards of its own and fills in a result. Rows run
 * in processes of their own, several at a time; what they print is put together in the order of the table.
 * Units: cycles of the CPU clock = ticks of the step timer (62.5 ns), unless the name says otherwise. */
#ifndef BENCH_H
#define BENCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "board.h"

#define TICKS_PER_US 16u
#define TICKS_PER_S 16000000ull
#define STEP_VECTOR 13 /* TIMER1_OVF, datasheet 12.4 (reset is 0) */

/* -- results --------------------------------------------------------------------------------------------------- */

typedef enum { VERDICT_MET, VERDICT_NOT_MET, VERDICT_LATER, VERDICT_NONE } verdict_t;

#define LINE_BYTES 400
#define DETAIL_BYTES 8000

/* What all boards of a row have seen of their interrupts. */
typedef struct {
    board_isr_t isr[BOARD_VECTORS];
    uint32_t masked_max;
    uint16_t masked_max_pc;
    uint32_t isr_masked_max;
    uint8_t isr_masked_vector;
    uint16_t stack_low;
} worst_t;

typedef struct {
    verdict_t verdict;
    char figure[LINE_BYTES];
    char detail[DETAIL_BYTES]; /* Markdown, below the table */
    worst_t worst;
} result_t;

void figure(result_t *result, const char *format, ...) __attribute__((format(printf, 2, 3))); /* appends */
void detail(result_t *result, const char *format, ...) __attribute__((format(printf, 2, 3))); /* appends */

void worst_clear(worst_t *worst);
void worst_add(worst_t *sum, const worst_t *other);

/* -- rows ------------------------------------------------------------------------------------------------------ */

extern const char *bench_elf;          /* the image */
extern const char *bench_stack_report; /* what tools/check_stack.py printed; NULL: not given */

void row_cruise_rate(result_t *result);
void row_harmonic_rate(result_t *result);
void row_linear_rate(result_t *result);
void row_load_cruise(result_t *result);
void row_load_ramps(result_t *result);
void row_jitter(result_t *result);
void row_ramp_error(result_t *result);
void row_first_pulse(result_t *result);
void row_streaming(result_t *result);
void row_packets(result_t *result);
void row_skew(result_t *result);
void row_estop(result_t *result);
void row_periods(result_t *result);
void row_memory(result_t *result);
void row_isr_paths(result_t *result);
void row_masked(result_t *result);

/* -- one run of the image (run.c) -------------------------------------------------------------------------------- */

typedef struct {
    uint8_t ustep;    /* power of two */
    uint8_t pulse_us; /* width of the pulse */
    uint32_t baud;
} setup_t;

#define SETUP_FACTORY ((setup_t){.ustep = 0, .pulse_us = 2, .baud = 38400})

/* What the terminal is kept receiving: nothing; lines one after the other, with a pause in which each can be answered
 * (the answer is longer than the line); lines without any pause. */
typedef enum { FLOOD_NONE, FLOOD_ANSWERED, FLOOD_SOLID } flood_t;

typedef struct {
    board_t *board;
    setup_t setup;
    uint64_t *rise; /* rising edges of clk */
    size_t pulses;
    size_t room;
    uint64_t last_rise;
    size_t bad_widths; /* pulses that are not setup.pulse_us long */
    flood_t flood;
    uint64_t fed_until; /* cycle until which what has been given to the peer will last */
    size_t fed_lines;
    worst_t worst;
} run_t;

/* Starts the image, sets what the commands cannot set yet, and waits for the prompt. */
void run_begin(run_t *run, setup_t setup);
/* Frees the board; what it has measured is added to `worst`. */
void run_end(run_t *run, worst_t *worst);

/* Types lines (each ended by '\n' in `text`, sent as CR) back to back. */
void run_type(run_t *run, const char *text);
/* From now on lines that change nothing arrive without a pause. */
void run_flood(run_t *run, flood_t flood);
void run_for(run_t *run, uint64_t cycles);
/* Until no pulse has come for `quiet` cycles, or `limit` cycles have passed. */
void run_until_quiet(run_t *run, uint64_t quiet, uint64_t limit);
/* Until so many pulses have been made; false: not within `limit` cycles. */
bool run_until_pulses(run_t *run, size_t pulses, uint64_t limit);

/* Clears the board's measures after adding them to the run's worst. */
void run_measures_clear(run_t *run);
const board_measures_t *run_measures(run_t *run);

/* In standstill: what the command p answers. Ends a flood. */
typedef struct {
    int position;
    unsigned faults; /* engine.h */
} report_t;
report_t run_report(run_t *run);

uint64_t run_interval(const run_t *run, size_t k); /* between pulse k and k + 1 */
/* Largest distance of any edge from the grid that the first one begins. */
uint64_t run_grid_error(const run_t *run, uint64_t ticks);

void die(const char *format, ...) __attribute__((noreturn, format(printf, 1, 2)));

/* -- the ideal curve (ideal.c): written from the manual and the decisions, not from the firmware ------------------- */

typedef struct {
    uint64_t steps;
    uint32_t cycle_us; /* of a full step, in cruise */
    double accel;      /* RPM per full step, or rad/s^2; 999: none */
    double decel;
    bool linear;
    uint8_t ustep;
} motion_t;

typedef struct {
    motion_t motion;
    uint64_t accel_pulses;
    uint64_t cruise_pulses;
    uint64_t decel_pulses;
    long double tick_rpm; /* ticks per pulse times RPM */
    long double slow_ticks;
    long double cruise_ticks;
    long double c0_accel; /* linear: first interval from standstill */
    long double c0_decel;
} ideal_t;

void ideal_plan(ideal_t *ideal, const motion_t *motion);
uint64_t ideal_pulses(const ideal_t *ideal);
long double ideal_interval(const ideal_t *ideal, uint64_t k);
bool ideal_is_ramp(const ideal_t *ideal, uint64_t k);
/* The command that asks for this motion, with a line end. */
void ideal_command(const motion_t *motion, char *text, size_t size);

typedef struct {
    uint64_t intervals;
    double rms_percent;
    double max_percent;
    double max_ticks;
    double worst_ticks_percent; /* largest error of those beyond one tick, in % */
    double beyond_rms_percent;  /* rms of what exceeds one tick */
    uint64_t worst_at;          /* interval with max_percent */
    uint64_t first_bad;         /* first interval that is off by more than 0.1 % and a tick; UINT64_MAX: none */
    double sum_ticks;           /* error of the sum of all intervals, cruise included */
} ramp_error_t;

/* Compares the run's pulses from `first` on with the ideal; the closing interval is not seen. */
void ideal_compare(const ideal_t *ideal, const run_t *run, size_t first, ramp_error_t *error);
/* Where the first interval out of the target is: its number and speed. */
void ramp_error_where(const ramp_error_t *error, const ideal_t *ideal, char *text, size_t size);
/* Within the target: 0.03 % rms and 0.1 % at most, where that is more than a tick. */
bool ramp_error_met(const ramp_error_t *error);

/* -- the image file (image_file.c) --------------------------------------------------------------------------------- */

typedef struct {
    uint32_t flash;
    uint32_t ram;
} image_size_t;

image_size_t image_size(const char *elf);
/* Name of the function that holds this byte address, and the distance into it. */
void image_where(const char *elf, uint16_t address, char *text, size_t size);

#endif
