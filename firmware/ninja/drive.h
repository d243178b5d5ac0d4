/* Moves on the way: a path (path.h) played by the stepper (stepper_port.h).
 *
 * Context: main loop. Errors: none. Units: as in path.h.
 * Source:  seed lines N41-55, N87-94. Tests: test/host/test_ninja_path.c; test/image/test_ninja_image.c */
#ifndef NINJA_DRIVE_H
#define NINJA_DRIVE_H

#include <stdbool.h>
#include <stdint.h>
#include "ninja/stepper_port.h"

void drive_init(void);

/* Begin a move, while none is under way; nothing happens if no step is to be made. */
void drive_to(const int16_t target[AXES], uint32_t step_us);
void drive_by(uint8_t axis, int16_t steps, uint32_t step_us);

/* The move under way makes no further step; its coils go off where the next one would have been. Position and slack are
 * right afterwards. */
void drive_halt(void);

/* A move is under way, its closing interval included. */
bool drive_runs(void);

/* Keeps the stepper going; true if there was something to do. */
bool drive_poll(void);

#endif
