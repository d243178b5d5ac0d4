/* The motion engine: plays motion commands as exact pulse trains.
 *
 * Purpose: takes one command at a time, plans its profile, feeds segments to the step timer ahead of time, and keeps
 *          state, position and velocity. The next command is planned while the current one runs, so that a command
 *          without deceleration is continued exactly one interval after its last pulse.
 * Units:   pulses, RPM, microseconds; see command.h.
 * Context: main loop only. The step interrupt plays what engine_poll() has prepared.
 * Errors:  status_t; a refused command changes nothing.
 * Source:  manual lines 19-35 (states, environments), 249-263 (truncation, GAP), 606-628, 925-928. */
#ifndef MOTION_ENGINE_H
#define MOTION_ENGINE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "motion/command.h"

typedef enum { MOTION_STANDBY, MOTION_ACCEL, MOTION_CRUISE, MOTION_DECEL, MOTION_STOP } motion_state_t;

void engine_init(void); /* takes over the settings: motor, microsteps, slow speed, pulse width */

/* Whether this command could be executed: its period and pulse width fit, its count does not overflow. */
status_t engine_check(const motion_command_t *command);

/* What comes next: a command that engine_check() passed, or null. It begins at once at standstill, otherwise after the
 * running one; its values are taken when it is planned, not long before, and may change until then. */
void engine_offer(const motion_command_t *command);
uint8_t engine_commands_begun(void); /* taken from the offers since boot, modulo 256 */

/* Called in the middle of a start from standstill, which takes a millisecond or two: the first pulse is due, or has been
 * made. To be implemented by who has to know (queue/ops.c). */
void engine_on_start(void);

/* Lets a command with MOTION_SYNC that stands ready begin: its first pulse comes a fixed time later, and its start wait.
 * The sync pin does the same by itself. With nothing held nothing happens. */
void engine_release(void);

/* Keeps the segment ring filled. Call often; not 0 if it did some work. */
uint8_t engine_poll(void);
bool engine_plays(void); /* pulses or silence: something may end */

/* Not 0: periods are being played, or in the ring, that bear no start edge's interrupt before the step interrupt. */
uint8_t engine_hurries(void);

/* Number of commands ended (completed or cut short) since boot, modulo 256. */
uint8_t engine_commands_ended(void);
uint8_t engine_commands_played(void); /* of these, all but those stopped before their first pulse; modulo 256 */

void engine_stop(void);                                     /* S: no further pulse; everything taken is dropped */
void engine_stop_graceful(accel_code_t decel, bool linear); /* s: ramp down from the present speed, drop the rest */
/* N: end the running command now; n: with its own deceleration. False: it ends by itself within 10 ms, and the next one
 * has begun; ask again later if that is to be ended too. */
bool engine_next(bool graceful);

/* One pulse, at once; ignored unless in STANDBY. */
void engine_single_pulse(bool ccw);

motion_state_t engine_state(void);
int32_t engine_position(void); /* pulses, clockwise positive */

/* Velocity in play: of the running command at this moment, or kept from the last one. cycle_us is per full step. */
void engine_velocity(uint32_t *rpm, uint32_t *cycle_us);

/* GAP testing (on after boot): whether the velocity in play is dropped one interval after the end of a command. */
void engine_set_gap(bool on);
bool engine_gap(void);

/* What went wrong in the engine since boot; a bit stays set until reset. */
enum {
    ENGINE_FAULT_STARVED = 1 << 0, /* the ring ran empty in a profile: the last interval was held */
    ENGINE_FAULT_LATE = 1 << 1,    /* a new interval was written too late for its period */
};
uint8_t engine_faults(void);

/* Velocity arithmetic of the manual (lines 85, 541-547): RPM from a command, cycle from a command. */
uint32_t command_rpm(const motion_command_t *command);
uint32_t command_cycle_us(const motion_command_t *command);

#endif
