/* The Ninja's build constants: what the mechanism is like.
 *
 * Each may be set otherwise: make firmware DEFS=-DNINJA_BACKLASH_X=9
 * Units:   steps are full steps, and units of position; their rates are per second.
 * Limits:  checked in path.c at compile time.
 * Source:  seed lines N18-39 (X, Y, V), N87-128 (motion); decisions A-NIN-02, -03, -12, -14. */
#ifndef NINJA_CONSTANTS_H
#define NINJA_CONSTANTS_H

/* Velocity at which a ramp begins and ends, 1..255. What is commanded at or below it has no ramp. */
#ifndef NINJA_START_STEPS_PER_S
#define NINJA_START_STEPS_PER_S 50
#endif

/* Velocity of V63 and of S, up to 1,000. */
#ifndef NINJA_TOP_STEPS_PER_S
#define NINJA_TOP_STEPS_PER_S 500
#endif

/* Velocity of V0, "a dead creep", 8 or more. The others of V lie between in equal ratios. */
#ifndef NINJA_CREEP_STEPS_PER_S
#define NINJA_CREEP_STEPS_PER_S 8
#endif

/* Acceleration and deceleration in steps/s^2, 10..9500. From 955 on it is rounded to whole rad/s^2 of SAC's ramp
 * values: 1,000 is 104.72, run as 105 (1,002.7). */
#ifndef NINJA_ACCELERATION
#define NINJA_ACCELERATION 1000
#endif

/* V at power-up. */
#ifndef NINJA_POWER_UP_V
#define NINJA_POWER_UP_V 32
#endif

/* The ends of the travel: left and right, down and up. */
#ifndef NINJA_X_MIN
#define NINJA_X_MIN (-1800)
#endif
#ifndef NINJA_X_MAX
#define NINJA_X_MAX 1800
#endif
#ifndef NINJA_Y_MIN
#define NINJA_Y_MIN (-1200)
#endif
#ifndef NINJA_Y_MAX
#define NINJA_Y_MAX 550
#endif

/* Steps that a motor makes after a change of direction before the platform follows, 0..200. */
#ifndef NINJA_BACKLASH_X
#define NINJA_BACKLASH_X 12
#endif
#ifndef NINJA_BACKLASH_Y
#define NINJA_BACKLASH_Y 6
#endif

/* Centring: how fast the sensor's edge is looked for, how fast it is approached in the end, how many steps more than
 * the backlash lie before it then, and how many more than the sensor can be away either takes before it is given up:
 * more than the whole travel and the backlash, or than those steps and the backlash. */
#ifndef NINJA_SEARCH_STEPS_PER_S
#define NINJA_SEARCH_STEPS_PER_S 200
#endif
#ifndef NINJA_APPROACH_STEPS_PER_S
#define NINJA_APPROACH_STEPS_PER_S 25
#endif
#ifndef NINJA_RUN_UP
#define NINJA_RUN_UP 20
#endif
#ifndef NINJA_SEARCH_MARGIN
#define NINJA_SEARCH_MARGIN 200
#endif

#endif
