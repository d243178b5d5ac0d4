/* The command queue: 30 circular entries, fed by motion commands and executed in order.
 *
 * Positions 1..30 are the queue; 0 (continuous motion) and 31 (one-shot) are set aside and hidden. An entry is pending
 * from queue_add() until the engine has taken its copy; the engine takes the next command while one runs, so that it
 * is planned in time. Entries stay as they are after they were executed, until they are overwritten.
 * Context: main loop.
 * Errors:  STATUS_QUEUE_FULL when all 30 positions are pending; nothing is changed then.
 * Tests:   test/host/test_queue.c
 * Source:  manual lines 271, 302-345, 485, 606-610. */
#ifndef QUEUE_QUEUE_H
#define QUEUE_QUEUE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "motion/command.h"

enum {
    QUEUE_CONTINUOUS = 0, /* position of the continuous command */
    QUEUE_FIRST = 1,
    QUEUE_LAST = 30,
    QUEUE_ONE_SHOT = 31, /* position of the one-shot command */
    QUEUE_POSITIONS = 32,
};

/* Seeds every entry with the system defaults, as session_init() has left them; nothing is pending. */
void queue_init(void);

/* Stores a command that engine_check() passed at the next available position and makes it pending. */
status_t queue_add(const motion_command_t *command);

/* Hands the next pending command to the engine if it takes one; true if it did. Call often. */
bool queue_poll(void);

/* S and s: nothing pending is executed, the entries stay. decel, linear: the session's. */
void queue_stop(void);
void queue_stop_graceful(accel_code_t decel, bool linear);

/* N and n: the running command ends, now or with its own deceleration; the next pending one follows. */
void queue_next(void);
void queue_next_graceful(void);

uint8_t queue_next_position(void);      /* where the next motion command will be stored, 1..30 */
uint8_t queue_pending(void);            /* 0..30 */
uint8_t queue_executing_position(void); /* of the command that the engine executes, 0 if none */

const motion_command_t *queue_entry(uint8_t position); /* 0..31 */

#endif
