/* The two motors: steps at exact times; implemented by hal/stepper.c with Timer1.
 *
 * A move is a row of waits, each followed by a step of one axis or both, or by the end: all coils off. The main loop
 * keeps a short ring of them filled, the timer's interrupt makes the steps.
 * Units:   ticks of 0.5 us. A wait begins where the one before has ended, so there is no drift. One that comes too late
 *          for that begins late: no step is lost.
 * Context: main loop. Errors: none. Tests: test/host/fakes/head_fake.c stands in for it; test/image.
 * Source:  seed lines N105-110 (two coils at a time, off between moves); decisions 0.5. */
#ifndef NINJA_STEPPER_PORT_H
#define NINJA_STEPPER_PORT_H

#include <stdbool.h>
#include <stdint.h>

enum { AXIS_X, AXIS_Y, AXES }; /* azimuth, altitude */

#define STEPPER_HZ 2000000UL

/* What follows a wait. Bits of an axis are shifted by 2 * axis. */
enum {
    STEPPER_STEP = 1 << 0,
    STEPPER_NEGATIVE = 1 << 1, /* with STEPPER_STEP */
    STEPPER_END = 1 << 4,      /* nothing else: all coils off, the move is over */
};

typedef struct {
    uint32_t ticks; /* 2,000..16,000,000 */
    uint8_t action; /* STEPPER_... */
} stepper_wait_t;

/* Nothing is energised, motor counts are 0. Once, at boot. */
void stepper_port_init(void);

/* Begins a move, while none is under way: the axes of the mask (1 << axis) get their present pattern at once. */
void stepper_port_start(uint8_t axes, const stepper_wait_t *first);

/* Room for another wait? And appends it, if a move is under way. */
bool stepper_port_room(void);
void stepper_port_put(const stepper_wait_t *wait);

/* Where the next step would have been, all coils go off instead: the move is over. A halt character that has been
 * received does the same before the main loop knows of it. */
void stepper_port_halt(void);

/* A move is under way, its end included. */
bool stepper_port_runs(void);

/* Motor count n, modulo 65,536: steps made so far in the positive direction less those in the negative one. While no
 * move is under way. Its pattern is n modulo 4: coils A+B, B+C, C+D, D+A. */
uint16_t stepper_port_count(uint8_t axis);

#endif
