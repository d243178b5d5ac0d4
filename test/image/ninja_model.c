/* See ninja_model.h. */
#include "ninja_model.h"

#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define BACKSPACE 0x08
#define CTRL_R 0x12
#define V_TOP 63
#define HALT_CYCLES (40 * US)  /* a step so long after a halt was on its way */
#define EXACT 1e-4             /* of the time since a move's begin: tolerance of the ramp's arithmetic */
#define BUSY (4 * MS)          /* with planning a move: what is behind it in FIFO or macro may wait so long */
#define ENDLESS 1000           /* commands of a macro at one moment */
#define RATE(steps_per_s) ((uint32_t)lround(1e6 / (steps_per_s)))

static const struct {
    int min, max, backlash;
} axis_of[AXES] = {
    [AXIS_X] = {NINJA_X_MIN, NINJA_X_MAX, NINJA_BACKLASH_X},
    [AXIS_Y] = {NINJA_Y_MIN, NINJA_Y_MAX, NINJA_BACKLASH_Y},
};

/* Centring: in which direction, how fast, and what the sensor says at its end (or so many steps in any case). */
static const struct {
    int direction;
    double steps_per_s;
    enum { UNTIL_HIGH, UNTIL_LOW, RUN_UP } until;
} legs[] = {
    {1, NINJA_SEARCH_STEPS_PER_S, UNTIL_LOW},
    {-1, NINJA_SEARCH_STEPS_PER_S, UNTIL_HIGH},
    {-1, NINJA_SEARCH_STEPS_PER_S, RUN_UP},
    {1, NINJA_APPROACH_STEPS_PER_S, UNTIL_LOW},
};
#define LEGS (sizeof legs / sizeof legs[0])

__attribute__((format(printf, 2, 3)))
static bool complain(ninja_model_t *m, const char *format, ...)
{
    if (m->complaint[0] == '\0') {
        int n = snprintf(m->complaint, sizeof m->complaint, "cycle %" PRIu64 ": ", m->now);
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(m->complaint + n, sizeof m->complaint - (size_t)n, format, arguments);
        va_end(arguments);
    }
    return false;
}

uint32_t ninja_v_us(int v)
{
    const double ratio = (double)NINJA_TOP_STEPS_PER_S / NINJA_CREEP_STEPS_PER_S;
    return RATE(NINJA_CREEP_STEPS_PER_S * pow(ratio, v / (double)V_TOP));
}

static int saturated(long value, int min, int max)
{
    return (int)(value < min ? min : value > max ? max : value);
}

/* -- the mechanism ------------------------------------------------------------------------------------------------- */

static void turn(ninja_linkage_t *linkage, int backlash, int direction)
{
    const int slack = linkage->slack + direction;
    if (slack < 0 || slack > backlash)
        linkage->position += direction;
    else
        linkage->slack = slack;
}

/* At power-up a rotor may stand between the positions that A+B pulls it to, the multiples of 4: it is drawn to the next
 * one (from the middle upwards, as the head's is). */
static void align(ninja_model_t *m, uint8_t axis)
{
    static const int way[] = {0, -1, 2, 1};
    ninja_linkage_t *real = &m->real[axis];
    if (m->aligned[axis])
        return;
    m->aligned[axis] = true;
    for (int left = way[(real->position + real->slack) & 3]; left != 0; left -= left > 0 ? 1 : -1)
        turn(real, axis_of[axis].backlash, left > 0 ? 1 : -1);
}

static bool sensor_low(const ninja_model_t *m, uint8_t axis)
{
    const head_sensor_t sensor = m->sensor[axis];
    return sensor == HEAD_SENSOR_STUCK_LOW || (sensor == HEAD_SENSOR_WORKS && m->real[axis].position >= 0);
}

/* -- moves --------------------------------------------------------------------------------------------------------- */

static bool leg_done(const ninja_model_t *m)
{
    const unsigned leg = m->centre.leg;
    return legs[leg].until != RUN_UP && sensor_low(m, m->centre.axis) == (legs[leg].until == UNTIL_LOW);
}

/* Behind step k of a ramp from a standstill. */
static double law(unsigned k)
{
    static const double rad = 2 * 3.14159265358979 / 60;
    /* Whole rad/s^2, at 60 steps per revolution (constants.h). */
    const double acceleration = round(NINJA_ACCELERATION * rad) / rad;
    return (double)SECOND * sqrt(2 / acceleration) * (sqrt(k + 1.0) - sqrt(k));
}

/* Behind step k of the major axis. */
static double interval(const ninja_model_t *m, unsigned k)
{
    const double start = NINJA_START_INTERVAL;
    return floor((double)SECOND / m->move.cruise) <= NINJA_START_STEPS_PER_S
               ? m->move.cruise
               : fmax(m->move.cruise, fmax(law(k), fmin(start, law(m->move.most - 1 - k))));
}

static void all_due(ninja_model_t *m, ninja_what_t what)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        m->move.due[axis] = m->move.steps[axis] != 0;
        m->move.what[axis] = what;
    }
}

/* A move whose steps and directions are set. */
static void begin_move(ninja_model_t *m, uint32_t step_us)
{
    m->move.most = m->move.steps[AXIS_X] > m->move.steps[AXIS_Y] ? m->move.steps[AXIS_X] : m->move.steps[AXIS_Y];
    if (m->move.most == 0)
        return;
    m->move.cruise = (double)step_us * US;
    m->move.runs = true;
    m->move.begins = true;
    m->move.halted = false;
    m->move.made = 0;
    m->move.on = m->now;
    m->move.due_at = 0;
    all_due(m, NINJA_ON);
    m->started = m->now;
    m->moves++;
}

static void go(ninja_model_t *m, int v)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const ninja_linkage_t *own = &m->own[axis];
        const int distance = m->target[axis] - own->position;
        const int slack = distance > 0 ? axis_of[axis].backlash - own->slack : own->slack;
        m->move.direction[axis] = distance < 0 ? -1 : 1;
        m->move.steps[axis] = distance == 0 ? 0 : (unsigned)(abs(distance) + slack);
    }
    begin_move(m, ninja_v_us(v));
}

static void begin_leg(ninja_model_t *m)
{
    const uint8_t axis = m->centre.axis;
    const unsigned leg = m->centre.leg;
    const bool near = leg == LEGS - 1; /* the approach, from where the run-up has led */
    const int away = near || legs[leg].until == RUN_UP ? NINJA_RUN_UP : axis_of[axis].max - axis_of[axis].min;
    const int margin = legs[leg].until == RUN_UP ? 0 : NINJA_SEARCH_MARGIN;
    m->move.steps[AXIS_X] = m->move.steps[AXIS_Y] = 0;
    m->move.steps[axis] = (unsigned)(axis_of[axis].backlash + away + margin);
    m->move.direction[axis] = legs[leg].direction;
    begin_move(m, RATE(legs[leg].steps_per_s));
}

/* The step, or the end, that comes next. */
static void next_due(ninja_model_t *m)
{
    m->move.due_at += m->move.made == 0 ? (double)NINJA_START_INTERVAL : interval(m, m->move.made - 1);
    if (m->move.halted || m->move.made == m->move.most || (m->centre.runs && leg_done(m))) {
        all_due(m, NINJA_OFF);
        return;
    }
    const unsigned k = ++m->move.made;
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const uint64_t steps = m->move.steps[axis];
        m->move.due[axis] = k * steps / m->move.most > (k - 1) * steps / m->move.most;
        m->move.what[axis] = m->move.direction[axis] > 0 ? NINJA_UP : NINJA_DOWN;
    }
}

/* -- centring ------------------------------------------------------------------------------------------------------ */

static void begin_centring(ninja_model_t *m)
{
    m->centre.runs = true;
    m->centre.axis = AXIS_X;
    m->centre.leg = 0;
}

/* On from the leg whose turn it is, which need not be made where the sensor says so already. */
static void centre(ninja_model_t *m)
{
    while (m->centre.runs && !m->move.runs) {
        if (m->centre.leg == LEGS) {
            m->own[m->centre.axis] = (ninja_linkage_t){0, axis_of[m->centre.axis].backlash};
            m->centre.leg = 0;
            m->centre.runs = ++m->centre.axis < AXES;
        } else if (leg_done(m)) {
            m->centre.leg++;
        } else {
            begin_leg(m);
        }
    }
}

/* A leg's move is over. */
static void end_leg(ninja_model_t *m)
{
    const bool found = legs[m->centre.leg].until == RUN_UP || leg_done(m);
    m->centre.leg = found ? m->centre.leg + 1 : LEGS;
}

/* -- commands ------------------------------------------------------------------------------------------------------ */

static bool has_number(char letter)
{
    return strchr("XYVP", letter) != NULL;
}

static bool must_wait(const ninja_model_t *m, char letter)
{
    return strchr("MSICP", letter) != NULL && (m->move.runs || m->centre.runs);
}

static void execute(ninja_model_t *m, char letter, int value)
{
    switch (letter) {
    case 'X': m->target[AXIS_X] = saturated(value, NINJA_X_MIN, NINJA_X_MAX); break;
    case 'Y': m->target[AXIS_Y] = saturated(value, NINJA_Y_MIN, NINJA_Y_MAX); break;
    case 'V': m->v = value < 0 || value > V_TOP ? V_TOP : value; break;
    case 'M': go(m, m->v); break;
    case 'S': go(m, V_TOP); break;
    case 'I':
        for (uint8_t axis = 0; axis < AXES; axis++)
            m->target[axis] = saturated(m->own[axis].position + m->target[axis], axis_of[axis].min, axis_of[axis].max);
        go(m, m->v);
        break;
    case 'C': begin_centring(m); break;
    case 'P':
        m->pauses = (uint16_t)value != 0;
        m->pause_end = m->now + (uint16_t)value * SECOND / 10;
        m->pauses_made += m->pauses;
        break;
    case 'R':
        m->macro.runs = m->macro.commands != 0;
        m->macro.next = 0;
        break;
    case '(':
        m->macro.defining = true;
        m->macro.commands = m->macro.bytes = 0;
        break;
    case ')': m->macro.runs = false; break;
    }
}

static void keep(ninja_model_t *m, char letter, int value)
{
    const unsigned bytes = has_number(letter) ? 3 : 1;
    if (m->macro.bytes + bytes <= NINJA_MACRO) {
        m->macro.bytes += bytes;
        m->macro.command[m->macro.commands++] = (ninja_command_t){letter, value};
    }
}

/* False if it must wait. */
static bool obey(ninja_model_t *m, char letter, int value)
{
    if (m->macro.defining) {
        if (letter != '(')
            keep(m, letter, value);
        m->macro.defining = letter != ')';
        return true;
    }
    if (must_wait(m, letter))
        return false;
    execute(m, letter, value);
    return true;
}

static bool number_goes_on(ninja_model_t *m, uint8_t byte)
{
    if (isdigit(byte))
        m->magnitude = saturated(m->magnitude * 10 + byte - '0', 0, 1000000);
    else if (!m->begun && (byte == '+' || byte == '-'))
        m->negative = byte == '-';
    else
        return false;
    m->begun = true;
    return true;
}

/* The oldest byte of the FIFO; false if it stays there. */
static bool interpret(ninja_model_t *m, uint8_t byte)
{
    if (m->pending) {
        if (number_goes_on(m, byte))
            return true;
        if (!obey(m, m->pending, saturated(m->negative ? -m->magnitude : m->magnitude, -32768, 65535)))
            return false;
        m->pending = 0;
        if (m->pauses)
            return false;
    }
    const char letter = (char)toupper(byte);
    if (byte >= 0x80 || byte == 0 || strchr("XYVPMSIC()R", letter) == NULL)
        return true;
    if (!has_number(letter))
        return obey(m, letter, 0);
    m->pending = letter;
    m->begun = m->negative = false;
    m->magnitude = 0;
    return true;
}

/* All that can be done at this moment. */
static void go_on(ninja_model_t *m)
{
    for (unsigned commands = 0;;) {
        centre(m);
        if (m->pauses)
            return;
        if (m->macro.runs) {
            if (commands++ == ENDLESS) {
                m->unclear++; /* where it is when it is halted */
                return;
            }
            const ninja_command_t *command = &m->macro.command[m->macro.next];
            if (m->macro.next == m->macro.commands) {
                m->macro.runs = false;
            } else if (must_wait(m, command->letter)) {
                return;
            } else {
                m->macro.next++;
                execute(m, command->letter, command->value);
            }
        } else if (m->fifo_count > 0 && interpret(m, m->fifo[0])) {
            memmove(m->fifo, m->fifo + 1, --m->fifo_count);
        } else {
            return;
        }
    }
}

/* Something has ended by itself. */
static void settle(ninja_model_t *m)
{
    if (m->dropped != 0 && m->now - m->dropped < NINJA_LATENCY)
        m->unclear++;
    m->settled = m->now;
    m->was_full = m->fifo_count == NINJA_FIFO;
    go_on(m);
}

/* -- what goes in -------------------------------------------------------------------------------------------------- */

static void halt(ninja_model_t *m)
{
    if (m->now - m->settled < BUSY || m->now - m->started < BUSY)
        m->unclear++;
    m->halts++;
    if (m->move.begins) {
        m->move.runs = m->move.begins = false;
        m->unclear++;
    } else if (m->move.runs && !m->move.halted) {
        m->move.halted = true;
        m->move.halt_cycle = m->now;
    }
    m->centre.runs = m->pauses = m->macro.runs = false;
    m->fifo_count = 0;
    m->pending = 0;
    if (m->macro.defining) {
        m->macro.defining = false;
        m->macro.commands = 0;
    }
}

static void reset(ninja_model_t *m)
{
    m->target[AXIS_X] = m->target[AXIS_Y] = 0;
    m->v = NINJA_POWER_UP_V;
    m->macro.commands = 0;
    begin_centring(m);
}

void ninja_model_power_on(ninja_model_t *m, uint64_t cycle, const head_options_t *head)
{
    *m = (ninja_model_t){.now = cycle, .settled = cycle};
    for (uint8_t axis = 0; axis < AXES; axis++) {
        m->own[axis] = (ninja_linkage_t){0, axis_of[axis].backlash};
        m->real[axis] = (ninja_linkage_t){head->axis[axis].start, 0};
        m->sensor[axis] = head->axis[axis].sensor;
    }
    reset(m);
    go_on(m);
}

bool ninja_model_byte(ninja_model_t *m, uint64_t cycle, uint8_t byte)
{
    if (!ninja_model_until(m, cycle))
        return false;
    if (byte == BACKSPACE || byte == CTRL_R) {
        halt(m);
        if (byte == CTRL_R)
            reset(m);
    } else {
        if (m->was_full && m->now - m->settled < NINJA_LATENCY)
            m->unclear++;
        if (m->fifo_count < NINJA_FIFO) {
            m->fifo[m->fifo_count++] = byte;
        } else {
            m->dropped = m->now;
            m->drops++;
        }
    }
    go_on(m);
    return true;
}

/* -- what comes out ------------------------------------------------------------------------------------------------ */

/* When what is due comes at the earliest and at the latest. */
static void window(const ninja_model_t *m, double *first, double *last)
{
    const double due = (double)m->move.on + m->move.due_at;
    const double tolerance = NINJA_JITTER + EXACT * m->move.due_at;
    *first = m->move.begins ? (double)m->move.on - 10 * US : due - tolerance;
    *last = m->move.begins ? (double)m->move.on + NINJA_LATENCY : due + tolerance;
}

static bool anything_due(const ninja_model_t *m)
{
    return m->move.due[AXIS_X] || m->move.due[AXIS_Y];
}

bool ninja_model_until(ninja_model_t *m, uint64_t cycle)
{
    while (m->pauses && m->pause_end <= cycle) {
        m->now = m->pause_end;
        m->pauses = false;
        settle(m);
    }
    m->now = cycle;
    double first, last;
    window(m, &first, &last);
    if (m->move.runs && (double)cycle > last) {
        const uint8_t axis = m->move.due[AXIS_X] ? AXIS_X : AXIS_Y;
        return complain(m, "expected %c %s at %.0f, after %u of %u steps; it did not come", "XY"[axis],
                        m->move.halted ? "off (halted)" : ninja_names[m->move.what[axis]], last, m->move.made,
                        m->move.most);
    }
    return m->complaint[0] == '\0';
}

bool ninja_model_event(ninja_model_t *m, const ninja_event_t *event)
{
    const char *name = ninja_names[event->what];
    const char axis = "XY"[event->axis];
    if (!ninja_model_until(m, event->cycle))
        return false;
    if (event->what == NINJA_OFF && m->move.halted && m->move.what[event->axis] != NINJA_OFF)
        all_due(m, NINJA_OFF); /* instead of the step */
    if (!m->move.runs || !m->move.due[event->axis])
        return complain(m, "%c %s was not expected (%s)", axis, name,
                        m->move.runs ? "the other axis was" : "no move");
    const bool on_its_way = event->what == NINJA_OFF || event->cycle < m->move.halt_cycle + HALT_CYCLES;
    if (event->what != m->move.what[event->axis] || (m->move.halted && !on_its_way))
        return complain(m, "expected %c %s%s, saw %s, step %u of %u", axis, ninja_names[m->move.what[event->axis]],
                        m->move.halted ? " or off (halted)" : "", name, m->move.made, m->move.most);
    double first, last;
    window(m, &first, &last);
    if ((double)event->cycle < first)
        return complain(m, "%c %s comes %.1f us too early, step %u of %u", axis, name,
                        (first - (double)event->cycle) / US, m->move.made, m->move.most);
    if (m->move.begins) {
        m->move.begins = false;
        m->move.on = event->cycle;
    }
    if (event->what == NINJA_ON)
        align(m, event->axis);
    m->move.due[event->axis] = false;
    if (event->what == NINJA_UP || event->what == NINJA_DOWN) {
        const int direction = event->what == NINJA_UP ? 1 : -1;
        turn(&m->own[event->axis], axis_of[event->axis].backlash, direction);
        turn(&m->real[event->axis], axis_of[event->axis].backlash, direction);
    }
    if (anything_due(m))
        return true;
    if (event->what != NINJA_OFF) {
        next_due(m);
        return true;
    }
    m->move.runs = false;
    if (m->centre.runs && !m->move.halted)
        end_leg(m);
    settle(m);
    return m->complaint[0] == '\0';
}

bool ninja_model_rests(const ninja_model_t *m)
{
    return !m->move.runs && !m->centre.runs && !m->pauses && !m->macro.runs && m->fifo_count == 0;
}
