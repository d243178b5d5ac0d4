/* See path.h. */
#include "ninja/path.h"
#include "motion/profile.h"

/* So that 1 RPM is 1 step/s. */
#define STEPS_PER_REV 60

/* Intervals that a ramp may lack. */
#define RAMP_LACKS 2

/* Hundredths of rad/s^2 at 60 steps per revolution, and the ramp value next to it (motion/command.h). */
#define RAD_CENTI ((uint32_t)(NINJA_ACCELERATION) * 10472 / 1000)
#define ACCELERATION \
    ((accel_code_t)(RAD_CENTI <= 9999 ? RAD_CENTI : ACCEL_CODE_WHOLE - 100 + (RAD_CENTI + 50) / 100))

_Static_assert(NINJA_START_STEPS_PER_S >= 1 && NINJA_START_STEPS_PER_S <= 255, "profile_basis() takes a byte");
_Static_assert(NINJA_TOP_STEPS_PER_S >= NINJA_CREEP_STEPS_PER_S, "V63 is not slower than V0");
_Static_assert(NINJA_TOP_STEPS_PER_S <= 1000 && NINJA_CREEP_STEPS_PER_S >= 8, "1..125 ms a step");
_Static_assert(NINJA_ACCELERATION >= 10 && NINJA_ACCELERATION <= 9500, "the ramp values' range");
_Static_assert(NINJA_X_MAX - NINJA_X_MIN + NINJA_SEARCH_MARGIN <= 10000 &&
                   NINJA_Y_MAX - NINJA_Y_MIN + NINJA_SEARCH_MARGIN <= 10000, "16 bits, also beyond the travel");
_Static_assert(NINJA_BACKLASH_X <= 200 && NINJA_BACKLASH_Y <= 200, "a byte");

const path_limits_t path_limits[AXES] = {
    {NINJA_X_MIN, NINJA_X_MAX, NINJA_BACKLASH_X},
    {NINJA_Y_MIN, NINJA_Y_MAX, NINJA_BACKLASH_Y},
};

static struct {
    int16_t position;
    uint8_t slack;
} axes[AXES];

static profile_basis_t basis;

/* The move. */
static profile_t profile;
static ramp_t ramp;
static uint16_t steps[AXES];  /* to make, without sign */
static uint8_t negative;      /* STEPPER_NEGATIVE of each axis */
static uint32_t cycle_us;     /* of the major axis at full speed */
static uint16_t most;         /* steps of the major axis: M */
static uint16_t made;         /* by it: k */
static uint16_t part[AXES];   /* k * steps modulo M */
static uint16_t fraction_q16; /* of a tick, carried on */
static enum { START, ACCEL, CRUISE, DECEL, OVER } phase;
static uint16_t left; /* intervals of the phase */

void path_init(void)
{
    profile_basis(&basis, STEPS_PER_REV, 0, NINJA_START_STEPS_PER_S, STEPPER_HZ);
    for (uint8_t axis = 0; axis < AXES; axis++) {
        path_centre(axis);
    }
    phase = OVER;
}

int16_t path_position(uint8_t axis)
{
    return axes[axis].position;
}

void path_centre(uint8_t axis)
{
    axes[axis].position = 0;
    axes[axis].slack = path_limits[axis].backlash;
}

static int16_t magnitude(int16_t value)
{
    return value < 0 ? (int16_t)-value : value;
}

static uint8_t slack_ahead(uint8_t axis, bool backwards)
{
    const uint8_t slack = axes[axis].slack;
    return backwards ? slack : (uint8_t)(path_limits[axis].backlash - slack);
}

/* -- planning ------------------------------------------------------------------------------------------------------ */

static void set_axis(uint8_t axis, int16_t distance, uint8_t more)
{
    steps[axis] = (uint16_t)(magnitude(distance) + more);
    if (distance < 0) {
        negative = (uint8_t)(negative | STEPPER_NEGATIVE << 2 * axis);
    }
}

static uint8_t begin(uint32_t step_us)
{
    most = steps[AXIS_X] > steps[AXIS_Y] ? steps[AXIS_X] : steps[AXIS_Y];
    if (most == 0) {
        phase = OVER;
        return 0;
    }
    cycle_us = step_us;
    made = 0;
    part[AXIS_X] = part[AXIS_Y] = 0;
    fraction_q16 = 0;
    phase = START;
    left = 1;
    return (uint8_t)((steps[AXIS_X] != 0) << AXIS_X | (steps[AXIS_Y] != 0) << AXIS_Y);
}

uint8_t path_to(const int16_t target[AXES], uint32_t step_us)
{
    negative = 0;
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const int16_t distance = (int16_t)(target[axis] - axes[axis].position);
        set_axis(axis, distance, distance == 0 ? 0 : slack_ahead(axis, distance < 0));
    }
    return begin(step_us);
}

uint8_t path_by(uint8_t axis, int16_t distance, uint32_t step_us)
{
    negative = 0;
    steps[AXIS_X] = steps[AXIS_Y] = 0;
    set_axis(axis, distance, 0);
    return begin(step_us);
}

/* -- one wait after the other -------------------------------------------------------------------------------------- */

/* SAC's ramps have whole steps, to velocities of whole RPM: they may end two steps short of the cruise's. Here they
 * take those from the cruise, so that no step of velocity is larger than the law's. */
static uint16_t take_from_cruise(void)
{
    uint16_t more = (uint16_t)((profile.cruise_pulses + 1) / 2);
    if (more > RAMP_LACKS) {
        more = RAMP_LACKS;
    }
    profile.cruise_pulses -= more;
    return more;
}

static void plan(void)
{
    const motion_command_t command = {
        .count = most,
        .velocity = cycle_us,
        .accel = ACCELERATION,
        .decel = ACCELERATION,
        .flags = MOTION_LINEAR | MOTION_CYCLE,
    };
    profile_plan(&profile, &basis, &command, basis.v_slow);
    if (profile.accel_pulses != 0) {
        profile.accel_pulses += take_from_cruise();
        profile.decel_pulses += take_from_cruise();
    }
}

/* On to the next phase that has intervals. The move is planned during the start interval, so that motion begins at
 * once. */
static void next_phase(void)
{
    while (left == 0 && phase != OVER) {
        if (phase == START) {
            plan();
        }
        phase++;
        left = phase == ACCEL    ? (uint16_t)profile.accel_pulses
               : phase == CRUISE ? (uint16_t)profile.cruise_pulses
               : phase == DECEL  ? (uint16_t)profile.decel_pulses
                                 : 0;
        if (left != 0 && phase != CRUISE) {
            profile_begin_ramp(&profile, &basis, phase == ACCEL, &ramp);
            ramp.most_log2 = 0; /* groups of one pulse */
        }
    }
}

/* The interval that is due in this phase. */
static uint32_t interval_ticks(void)
{
    if (phase == START) {
        return basis.slow_ticks;
    }
    const uint32_t shortest = cycle_us * (STEPPER_HZ / 1000000);
    if (phase == CRUISE) {
        return shortest;
    }
    ramp_time_t interval;
    block_t unused; /* of a single pulse */
    ramp_next(&ramp, 1, &interval, &unused);
    if (interval.ticks < shortest) {
        return shortest;
    }
    fraction_q16 = (uint16_t)(fraction_q16 + interval.frac_q16);
    return interval.ticks + (fraction_q16 < interval.frac_q16);
}

/* The axes whose turn it is at the next step of the major one. */
static uint8_t next_step(void)
{
    uint8_t action = 0;
    for (uint8_t axis = 0; axis < AXES; axis++) {
        part[axis] = (uint16_t)(part[axis] + steps[axis]);
        if (part[axis] >= most) {
            part[axis] = (uint16_t)(part[axis] - most);
            action = (uint8_t)(action | STEPPER_STEP << 2 * axis | (negative & STEPPER_NEGATIVE << 2 * axis));
        }
    }
    return action;
}

bool path_next(stepper_wait_t *wait)
{
    next_phase();
    if (phase == OVER) {
        return false;
    }
    wait->ticks = interval_ticks();
    wait->action = STEPPER_END;
    if (made != most) {
        made++;
        wait->action = next_step();
    }
    left--;
    return true;
}

/* -- position ------------------------------------------------------------------------------------------------------ */

void path_made(uint8_t axis, int16_t distance)
{
    const bool backwards = distance < 0;
    int16_t slack = slack_ahead(axis, backwards);
    if (slack > magnitude(distance)) {
        slack = magnitude(distance);
    }
    if (backwards) {
        slack = (int16_t)-slack;
    }
    axes[axis].slack = (uint8_t)(axes[axis].slack + slack);
    axes[axis].position = (int16_t)(axes[axis].position + distance - slack);
}
