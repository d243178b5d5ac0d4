/* The simulated head: see head.h. */
#include "head.h"
#include "board_internal.h"

#include <math.h>
#include <stdlib.h>

#define CYCLE_STEPS 4 /* an electrical cycle */
#define PULL_OUT 2    /* so far from where the pattern pulls it, a rotor falls into the next cycle */
#define BACKLASH_MAX 200
#define COILS 4
#define HISTORY 128 /* steps: more than two windows have at the highest rate */
#define RATE_INTERVALS 8

static const struct {
    board_pin_t coil_a, sensor; /* coils B, C, D on the pins that follow */
    int low_limit, high_limit;
} build[HEAD_AXES] = {
    [HEAD_X] = {BOARD_PIN('D', 4), BOARD_PIN('B', 0), -1800, 1800},
    [HEAD_Y] = {BOARD_PIN('C', 0), BOARD_PIN('B', 1), -1200, 550},
};

/* What a pattern of coils does: pulls to one of four positions, or none of them. */
enum { HOLDS = -1, WRONG = -2 };
static const int8_t pulls_to[1 << COILS] = {
    [0x0] = HOLDS, [0x1] = HOLDS, [0x2] = HOLDS, [0x4] = HOLDS, [0x8] = HOLDS, /* none or one */
    [0x3] = 0,     [0x6] = 1,     [0xC] = 2,     [0x9] = 3,                    /* A+B, B+C, C+D, D+A */
    [0x5] = WRONG, [0xA] = WRONG, [0x7] = WRONG, [0xB] = WRONG, [0xD] = WRONG, [0xE] = WRONG, [0xF] = WRONG,
};

typedef struct {
    head_state_t state;
    head_sensor_t sensor;
    int low_stop, high_stop; /* of the platform */
    int pulled_to;           /* where the coils pull the rotor, or last did: only a stop keeps it from there */
    bool in_phase;           /* the rotor stands where the next pattern is expected; unknown before the first one */
    struct {
        uint64_t cycle;
        int direction;
    } history[HISTORY];    /* step n at [n % HISTORY] */
    uint64_t current_from; /* the first step since the current came on */
    uint64_t judged_from;  /* the first since the rotor stood, or lost steps */
} motor_t;

struct head {
    board_t *b;
    motor_t motor[HEAD_AXES];
    void (*on_step)(void *ctx, head_step_t step);
    void *on_step_ctx;
};

const head_options_t head_defaults = {.axis = {[HEAD_X] = {.backlash = 12}, [HEAD_Y] = {.backlash = 6}}};

static int clamped(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

/* -- linkage and sensor ------------------------------------------------------------------------------------------- */

static int rotor_of(const motor_t *m)
{
    return m->state.platform + m->state.slack;
}

static void sense(head_t *h, head_axis_t axis, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];

    m->state.sensor_low = m->sensor == HEAD_SENSOR_STUCK_LOW ||
                          (m->sensor == HEAD_SENSOR_WORKS && m->state.platform >= 0);
    pin_drive(h->b, build[axis].sensor, m->state.sensor_low ? 0 : -1, cycle);
}

/* The rotor goes where it is pulled to, as far as the stops let it, and takes the platform along. */
static void turn(head_t *h, head_axis_t axis, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];
    int rotor = clamped(m->pulled_to, m->low_stop, m->high_stop + m->state.backlash);

    m->state.platform = clamped(m->state.platform, rotor - m->state.backlash, rotor);
    m->state.slack = rotor - m->state.platform;
    sense(h, axis, cycle);
}

/* -- what a rotor can follow ---------------------------------------------------------------------------------------- */

/* Steps from `after` on, `until` included, those back subtracted. */
static int steps_within(const motor_t *m, uint64_t after, uint64_t until)
{
    int steps = 0;

    for (uint64_t n = m->state.steps; n-- > m->judged_from && m->state.steps - n <= HISTORY;)
        if (m->history[n % HISTORY].cycle > after && m->history[n % HISTORY].cycle <= until)
            steps += m->history[n % HISTORY].direction;
    return steps;
}

static void lose(motor_t *m, int direction)
{
    m->pulled_to -= direction * CYCLE_STEPS;
    m->state.lost_steps += CYCLE_STEPS;
    m->judged_from = m->state.steps;
}

/* Has the rate changed too much in the window that ends here? Too fast a start leaves the rotor behind, too sudden a stop
 * lets it run on. */
static void judge_rate(motor_t *m, uint64_t cycle)
{
    uint64_t middle = cycle > HEAD_WINDOW_CYCLES ? cycle - HEAD_WINDOW_CYCLES : 0;
    uint64_t start = middle > HEAD_WINDOW_CYCLES ? middle - HEAD_WINDOW_CYCLES : 0;
    int change = steps_within(m, middle, cycle) - steps_within(m, start, middle);

    if (abs(change) > HEAD_CHANGE_MAX)
        lose(m, change > 0 ? 1 : -1);
}

/* A motor under current that has got no step for a window stands: was that too sudden? */
static void judge_stop(head_t *h, head_axis_t axis, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];
    uint64_t stood_at = m->state.last_step + HEAD_WINDOW_CYCLES;

    if (m->state.steps > m->judged_from && cycle >= stood_at) {
        judge_rate(m, stood_at);
        m->judged_from = m->state.steps;
        turn(h, axis, cycle);
    }
}

static void step(head_t *h, head_axis_t axis, int direction, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];
    bool too_soon = m->state.steps > m->judged_from && cycle - m->state.last_step < HEAD_STEP_CYCLES_MIN;

    m->history[m->state.steps % HISTORY].cycle = cycle;
    m->history[m->state.steps % HISTORY].direction = direction;
    m->state.last_step = cycle;
    m->state.steps++;
    m->pulled_to += direction;
    if (too_soon)
        lose(m, direction);
    else
        judge_rate(m, cycle);
    turn(h, axis, cycle);
    if (abs(m->pulled_to - rotor_of(m)) > PULL_OUT) { /* held by a stop */
        lose(m, direction);
        turn(h, axis, cycle);
    }
    if (h->on_step != NULL)
        h->on_step(h->on_step_ctx,
                   (head_step_t){cycle, axis, direction, rotor_of(m), m->state.platform, m->state.lost_steps});
}

/* -- coils ---------------------------------------------------------------------------------------------------------- */

static void current_ends(head_t *h, head_axis_t axis, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];

    if (m->state.steps > m->current_from && cycle - m->state.last_step < HEAD_STEP_CYCLES_MIN) {
        m->pulled_to -= m->history[(m->state.steps - 1) % HISTORY].direction;
        turn(h, axis, cycle);
    }
    m->in_phase = m->pulled_to == rotor_of(m);
    m->pulled_to = rotor_of(m);
    m->current_from = m->judged_from = m->state.steps;
}

static void pattern(head_t *h, head_axis_t axis, uint8_t coils, uint64_t cycle)
{
    motor_t *m = &h->motor[axis];
    int pull = pulls_to[coils];

    judge_stop(h, axis, cycle);
    m->state.coils = coils;
    if (coils == 0)
        current_ends(h, axis, cycle);
    if (pull == WRONG)
        m->state.wrong_patterns++;
    if (pull < 0)
        return;
    switch ((pull - m->pulled_to) & (CYCLE_STEPS - 1)) {
    case 1: step(h, axis, 1, cycle); break;
    case 2: /* the opposite one: pulls to both sides alike */
        if (m->in_phase)
            m->state.wrong_patterns++;
        else
            m->pulled_to += 2;
        turn(h, axis, cycle);
        break;
    case 3: step(h, axis, -1, cycle); break;
    }
    m->in_phase = true;
}

static void coil_changed(board_t *b, int level, uint64_t cycle)
{
    head_t *h = b->head;

    (void)level;
    if (h == NULL)
        return;
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        uint8_t coils = 0;
        for (int coil = 0; coil < COILS; coil++)
            coils |= (uint8_t)(pin_level(b, (board_pin_t)(build[axis].coil_a + coil)) << coil);
        if (coils != h->motor[axis].state.coils) /* all pins of a port change at once, each is told of */
            pattern(h, axis, coils, cycle);
    }
}

/* -- life ----------------------------------------------------------------------------------------------------------- */

head_t *head_new(board_t *b, const head_options_t *options)
{
    head_t *h = calloc(1, sizeof *h);

    if (h == NULL)
        abort();
    h->b = b;
    b->head = h;
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        motor_t *m = &h->motor[axis];
        m->state.low_limit = build[axis].low_limit;
        m->state.high_limit = build[axis].high_limit;
        m->state.backlash = clamped(options->axis[axis].backlash, 0, BACKLASH_MAX);
        m->low_stop = m->state.low_limit - HEAD_STOP_MARGIN;
        m->high_stop = m->state.high_limit + HEAD_STOP_MARGIN;
        m->sensor = options->axis[axis].sensor;
        head_place(h, axis, options->axis[axis].start, 0);
        for (int coil = 0; coil < COILS; coil++)
            pin_listen(b, (board_pin_t)(build[axis].coil_a + coil), coil_changed);
    }
    coil_changed(b, 0, board_time(b));
    return h;
}

void head_free(head_t *h)
{
    if (h == NULL)
        return;
    h->b->head = NULL;
    free(h);
}

void head_place(head_t *h, head_axis_t axis, int platform, int slack)
{
    motor_t *m = &h->motor[axis];

    m->state.platform = clamped(platform, m->low_stop, m->high_stop);
    m->state.slack = clamped(slack, 0, m->state.backlash);
    m->pulled_to = rotor_of(m);
    m->in_phase = false;
    m->current_from = m->judged_from = m->state.steps;
    sense(h, axis, board_time(h->b));
}

void head_break_sensor(head_t *h, head_axis_t axis, head_sensor_t how)
{
    h->motor[axis].sensor = how;
    sense(h, axis, board_time(h->b));
}

void head_on_step(head_t *h, void (*fn)(void *ctx, head_step_t step), void *ctx)
{
    h->on_step = fn;
    h->on_step_ctx = ctx;
}

const head_state_t *head_state(head_t *h, head_axis_t axis)
{
    judge_stop(h, axis, board_time(h->b));
    return &h->motor[axis].state;
}

double head_rate(const head_t *h, head_axis_t axis)
{
    const motor_t *m = &h->motor[axis];
    uint64_t intervals = m->state.steps - m->current_from; /* the one that goes on counted */
    uint64_t last = m->state.steps - 1;
    double interval = (double)(board_time(h->b) - m->state.last_step);

    if (intervals-- == 0)
        return 0;
    if (intervals > RATE_INTERVALS)
        intervals = RATE_INTERVALS;
    if (intervals > 0)
        interval = fmax(interval, (double)(m->state.last_step - m->history[(last - intervals) % HISTORY].cycle) /
                                      (double)intervals);
    return interval > 0 ? m->history[last % HISTORY].direction * (double)BOARD_CPU_HZ / interval : 0;
}
