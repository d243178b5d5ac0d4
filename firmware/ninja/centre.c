/* See centre.h. Each axis goes through the legs of a table. */
#include "ninja/centre.h"
#include "ninja/drive.h"
#include "ninja/path.h"
#include "ninja/sensor_port.h"

typedef struct {
    enum { UNTIL_NEGATIVE, UNTIL_BEYOND, ALL } until; /* the sensor says so; or all of its steps */
    bool far; /* from anywhere; or it is near */
    uint32_t step_us;
} leg_t;

/* A leg is left out if what it looks for is so already. It goes in the positive direction to get there, else in the
 * negative one. */
static const leg_t legs[] = {
    {UNTIL_BEYOND, true, PATH_CYCLE_US(NINJA_SEARCH_STEPS_PER_S)},
    {UNTIL_NEGATIVE, true, PATH_CYCLE_US(NINJA_SEARCH_STEPS_PER_S)},
    {ALL, false, PATH_CYCLE_US(NINJA_SEARCH_STEPS_PER_S)},
    {UNTIL_BEYOND, false, PATH_CYCLE_US(NINJA_APPROACH_STEPS_PER_S)},
};
#define LEGS (sizeof legs / sizeof legs[0])

static bool runs;
static uint8_t axis;
static uint8_t leg;
static bool moves; /* in this leg */
static bool found; /* what it looks for */

void centre_begin(void)
{
    runs = true;
    axis = 0;
    leg = 0;
    moves = false;
    found = false;
}

void centre_stop(void)
{
    runs = false;
}

bool centre_runs(void)
{
    return runs;
}

static bool seen(void)
{
    return legs[leg].until != ALL && sensor_port_beyond(axis) == (legs[leg].until == UNTIL_BEYOND);
}

static void next_axis(void)
{
    path_centre(axis);
    leg = 0;
    runs = ++axis != AXES;
}

static void next_leg(void)
{
    if (++leg == LEGS) {
        next_axis();
    }
}

static void begin_leg(void)
{
    const path_limits_t *limits = &path_limits[axis];
    int16_t steps = (int16_t)(limits->backlash + (legs[leg].far ? limits->max - limits->min : NINJA_RUN_UP));
    if (legs[leg].until != ALL) {
        steps = (int16_t)(steps + NINJA_SEARCH_MARGIN);
    }
    if (legs[leg].until != UNTIL_BEYOND) {
        steps = (int16_t)-steps;
    }
    drive_by(axis, steps, legs[leg].step_us);
}

bool centre_poll(void)
{
    if (!runs) {
        return false;
    }
    if (drive_runs()) { /* this leg, or a move that was halted */
        if (found || !seen()) {
            return false;
        }
        found = true;
        drive_halt();
        return true;
    }
    if (!moves) {
        found = seen();
        if (found) {
            next_leg();
        } else {
            moves = true;
            begin_leg();
        }
        return true;
    }
    moves = false;
    if (found || seen() || legs[leg].until == ALL) {
        next_leg();
    } else {
        next_axis(); /* given up */
    }
    return true;
}
