/* A simulated pan and tilt head on a board: two unipolar stepper motors (azimuth X, altitude Y) with backlash between
 * motor and platform, end stops, and a centre sensor each.
 *
 * Coils A, B, C, D of X hang on D4 to D7 (PD4-PD7), of Y on A0 to A3 (PC0-PC3), high: current flows. The centre sensors
 * pull D8 (X, PB0) and D9 (Y, PB1) to ground while the platform stands at its centre or on the positive side of it;
 * otherwise they leave the pin to its pull-up.
 *
 * Units:   steps: full steps of the motor, and of the platform alike; positive is right and up. 10 steps are a degree
 *          (HEAD_STEPS_PER_DEGREE). Cycles: as in board.h.
 * Motor:   two coils that lie side by side pull the rotor to one of four positions, A+B to those that are multiples of
 *          4, B+C one further, then C+D, D+A. A neighbouring pair moves it by one step. One coil holds it where it is,
 *          none leaves it there: the gears hold. What a rotor cannot follow costs it whole electrical cycles, 4 steps:
 *          HEAD_STEP_CYCLES_MIN, HEAD_CHANGE_MAX, an end stop. Any other pattern is wrong, and so is one opposite to the
 *          last: it moves nothing and is counted.
 * Linkage: the motor turns through the slack, 0 to `backlash` steps, before it takes the platform along: a step in
 *          positive direction first takes slack up to `backlash`, one in negative direction down to 0.
 * Errors:  none; an option out of range is brought to the nearest that is allowed. Out of memory: abort().
 * Context: hears the pins itself, so edges may be recorded besides. One head a board; what board.h offers may be used.
 * Source:  N105-N128; decisions 0.5, A-NIN-02, A-NIN-12, A-NIN-13; docs/design.md for the numbers. */
#ifndef BOARD_HEAD_H
#define BOARD_HEAD_H

#include "board.h"

#define HEAD_STEPS_PER_DEGREE 10
/* End stops: so many steps beyond the limits of the axes, X -1800 to 1800, Y -1200 to 550. */
#define HEAD_STOP_MARGIN 40
/* Shortest time between two steps of a motor: 750 steps/s. A step whose current lasts no longer is not made. */
#define HEAD_STEP_CYCLES_MIN (BOARD_CPU_HZ / 750)
/* In each 1/26 s a motor makes at most so many steps more, or fewer, than in the 1/26 s before: it starts and stops at up
 * to 156 steps/s, and above that its rate changes by up to 4,056 steps/s^2. */
#define HEAD_WINDOW_CYCLES (BOARD_CPU_HZ / 26)
#define HEAD_CHANGE_MAX 6

typedef struct head head_t;

typedef enum { HEAD_X, HEAD_Y, HEAD_AXES } head_axis_t;
typedef enum { HEAD_SENSOR_WORKS, HEAD_SENSOR_STUCK_HIGH, HEAD_SENSOR_STUCK_LOW } head_sensor_t;

typedef struct {
    struct {
        int start;    /* of the platform; the slack is 0 then */
        int backlash; /* 0 to 200 */
        head_sensor_t sensor;
    } axis[HEAD_AXES];
} head_options_t;
/* In the centre, backlash X 12 and Y 6, sensors in order. */
extern const head_options_t head_defaults;

typedef struct {
    int low_limit, high_limit; /* what the axis is made for; the stops lie beyond */
    int backlash;
    int platform;            /* the position that counts: 0 in the centre */
    int slack;               /* 0 to backlash; the rotor stands at platform + slack */
    uint8_t coils;           /* bit 0: A ... bit 3: D */
    uint64_t steps;          /* that patterns have asked for, either way */
    uint64_t last_step;      /* its cycle; 0: none yet */
    uint64_t lost_steps;     /* by which the rotor stayed behind or went too far: a multiple of 4 for each time */
    uint64_t wrong_patterns; /* how many times one came up */
    bool sensor_low;         /* its pin is pulled to ground */
} head_state_t;

head_t *head_new(board_t *b, const head_options_t *options);
void head_free(head_t *h); /* before its board */

/* As it is at the board's present cycle; valid until the board runs on. */
const head_state_t *head_state(head_t *h, head_axis_t axis);
/* Steps per second, with sign: the mean of the last 8 intervals at most, slower when the next step is due and does not come;
 * 0 with the coils off. */
double head_rate(const head_t *h, head_axis_t axis);

/* Turned by hand: coils are to be off. */
void head_place(head_t *h, head_axis_t axis, int platform, int slack);
void head_break_sensor(head_t *h, head_axis_t axis, head_sensor_t how);

/* Called at every step that a pattern asks for, after it has been made (or lost). */
typedef struct {
    uint64_t cycle;
    head_axis_t axis;
    int direction;       /* 1 or -1 */
    int rotor;           /* where it stands now */
    int platform;        /* likewise */
    uint64_t lost_steps; /* so far */
} head_step_t;
void head_on_step(head_t *h, void (*fn)(void *ctx, head_step_t step), void *ctx);

#endif
