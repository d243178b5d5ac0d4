/* Profiles: a motion command turned into acceleration, cruise and deceleration.
 *
 * Purpose: how many pulses each phase has, where each begins, and what velocity stays in play at the end.
 * Units:   pulses; velocities in RPM * 100 * microstep factor ("units", see ramp.h); intervals in ticks of the timer's clock.
 * Context: main loop; pure arithmetic. Tests: test/host/test_profile.c, test/avr/.
 * Source:  manual lines 85-107, 249-269 (ramp lengths, truncation), 159, 792 (slow speed), 165-169 (transitions),
 *          543-547 (velocity and cycle), 1005-1015 (microsteps).
 *
 * A profile of N pulses has N intervals: interval k lies between pulse k and pulse k + 1, the last one between its last
 * pulse and what follows. */
#ifndef MOTION_PROFILE_H
#define MOTION_PROFILE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "motion/command.h"
#include "motion/ramp.h"

/* An interval of any length: `chunks` times PROFILE_CHUNK_TICKS plus the rest, which is below that. */
#define PROFILE_CHUNK_LOG2 15
#define PROFILE_CHUNK_TICKS (1u << PROFILE_CHUNK_LOG2)
typedef struct {
    uint32_t chunks;
    uint32_t ticks_q8; /* ticks * 256 */
} profile_interval_t;

typedef struct {
    uint32_t accel_pulses; /* intervals while the velocity changes to the target */
    uint32_t cruise_pulses;
    uint32_t decel_pulses; /* intervals down to slow speed */
    uint32_t v_start;      /* velocity of the first acceleration interval */
    uint32_t v_peak;       /* velocity reached: the target, or less in a truncated profile */
    uint32_t v_exit;       /* velocity in play at the end */
    uint32_t exit_cycle_us; /* its cycle, if it is the commanded one; 0: it follows from v_exit */
    uint32_t accel_centi;  /* ramp values in hundredths */
    uint32_t decel_centi;
    profile_interval_t cruise;
    uint32_t cycle_us; /* commanded, microseconds per full step */
    bool faster;       /* acceleration is upward */
    bool linear;
    bool steep_decel;  /* fewer pulses than the deceleration needs: it is made steeper, to end at slow speed */
} profile_t;

/* What the profiles depend on, derived from the settings once. */
typedef struct {
    ramp_constants_t ramp;
    uint32_t us_rpm;     /* microseconds * RPM per full step: 60e6 / steps per revolution */
    uint32_t v_slow;     /* slow speed in units */
    uint32_t slow_ticks; /* its interval, rounded up */
    uint8_t factor_log2; /* microsteps per full step */
} profile_basis_t;

void profile_basis(profile_basis_t *basis, uint16_t steps_per_rev, uint8_t factor_log2, uint8_t slow_rpm,
                   uint32_t clock_hz);

/* Microseconds, divided by a power of two, in ticks. */
void profile_interval(const profile_basis_t *basis, uint32_t us, uint8_t halvings, profile_interval_t *interval);

/* Velocity arithmetic of the manual: integer RPM from a cycle and integer cycle from RPM, truncated. */
uint32_t profile_rpm(const profile_basis_t *basis, const motion_command_t *command);
uint32_t profile_cycle_us(const profile_basis_t *basis, const motion_command_t *command);

/* STATUS_OK, or why the command cannot be executed with a pulse of pulse_us. */
status_t profile_check(const profile_basis_t *basis, const motion_command_t *command, uint16_t pulse_us);

/* Plans a checked command that begins at velocity v_in (slow speed from standstill). */
void profile_plan(profile_t *profile, const profile_basis_t *basis, const motion_command_t *command, uint32_t v_in);

/* Plans a deceleration alone: from velocity v to slow speed. No pulses if there is no ramp to run. */
void profile_plan_decel(profile_t *profile, const profile_basis_t *basis, uint32_t v, accel_code_t decel, bool linear);

/* Full steps of a ramp between two velocities in units, integer (manual lines 89, 265). */
uint32_t profile_ramp_steps(const profile_basis_t *basis, uint32_t v_from, uint32_t v_to, uint32_t centi, bool linear);

/* Begins the profile's acceleration, or its deceleration. */
void profile_begin_ramp(const profile_t *profile, const profile_basis_t *basis, bool accel, ramp_t *ramp);

#endif
