/* The parameters that the firmware runs with.
 *
 * Units:   in the names.
 * Context: written before motion starts (boot); read by the main loop everywhere. Interrupts never read them.
 * Until they are kept in EEPROM they hold the factory values below; each can be set at build time (make firmware
 * DEFS='-DSETTINGS_USTEP=3'), and the tests on the board write them in RAM when main is reached.
 * Source:  manual lines 684-835. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stdint.h>
#include "motion/command.h"

typedef struct {
    uint32_t cycle_us;       /* b: default cycle, us per full step; seeds the queue and the session */
    uint32_t hw_baud;        /* m: bits per second of the hardware port */
    uint16_t steps_per_rev;  /* a: full steps per revolution, >= 1 */
    accel_code_t accel[2];   /* d, f: harmonic, linear */
    accel_code_t decel[2];   /* e, g: harmonic, linear */
    uint8_t ramp;            /* B: 0 harmonic, 1 linear at start-up */
    uint8_t cw_level;        /* F: level of dir for clockwise, 0 or 1 */
    uint8_t direction;       /* G: 0 CW, 1 CCW: direction of a command that gives none */
    uint8_t ustep;           /* J: microsteps as a power of two, 0..7 */
    uint8_t pulse_us;        /* K: width of the clk pulse, >= 1 */
    uint8_t slow_rpm;        /* L: start, stop and reversal speed, >= 1 */
    uint8_t driver;          /* N: 0 A4988, 1 DRV8825, 2 by driver_map */
    uint8_t driver_map[8];   /* U: the pins MS3 MS2 MS1 of each ustep */
    uint8_t full_step;       /* u: 1 counts are full steps, 0 pulses */
} settings_t;

extern settings_t settings;

#endif
