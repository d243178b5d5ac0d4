/* The command processor: which command is executed next.
 *
 * Positions 1..30 are the queue, circular, fed by motion commands and executed in order; 0 holds the continuous command
 * and 31 the one-shot, both hidden. An entry is pending from queue_add() until the engine begins it. What comes next is,
 * in this order: the command that preempts, the next one of the loop or of the xRef array, the oldest pending one. It is
 * offered to the engine, which takes its values when it plans it: until then edits reach it.
 * Context: main loop.
 * Errors:  a status; nothing is changed then. What would begin motion is refused while Estop is active (STATUS_ESTOP), and
 *          where an entry, older than the settings in force, is impossible with them (as engine_check() says).
 * Tests:   test/host/test_queue.c, test/image/test_image_processor.c
 * Source:  manual lines 271, 302-371, 485, 553-610, 959; decisions, sections 4 and 5. */
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
    QUEUE_ARRAY = 31, /* entries of the xRef array, its terminator among them */
};

/* Seeds every entry with the system defaults, as session_init() has left them; nothing is pending, the array is empty. */
void queue_init(void);

/* Seeds the entries 1..30 with the session defaults, one motor revolution each (qc); what is pending stays so. */
void queue_clear(void);

/* Saves the entries 1..30 in the background (eeprom/store.h), and gets them back: the last snapshot, or system defaults
 * if none was ever saved. STATUS_BUSY: something is being written; STATUS_SNAPSHOT: it is damaged, nothing is changed. */
void queue_save(void);
status_t queue_restore(bool *saved); /* whether there was a snapshot */

/* Stores a command that engine_check() passed at the next available position and makes it pending.
 * STATUS_QUEUE_FULL when all 30 are. */
status_t queue_add(const motion_command_t *command);

/* Changes an entry, 1..30, from its next execution on. */
void queue_edit(uint8_t position, const motion_command_t *command);

/* Takes back the last queue_add() or queue_edit(), once. STATUS_NOTHING_TO_UNDO, also while that entry is executed. */
status_t queue_undo(void);

/* Ends the running command at once, as N, and executes `position`; loop and queue go on with what would have come next.
 * 1..30, or QUEUE_CONTINUOUS or QUEUE_ONE_SHOT with the command that it holds from then on. */
status_t queue_preempt(uint8_t position);
status_t queue_preempt_with(uint8_t position, const motion_command_t *command);

/* While the continuous command runs, it goes on with this velocity and acceleration; otherwise nothing. */
void queue_follow(const motion_command_t *command);

/* It becomes so many RPM faster, or slower (to 1 RPM at least), by its own acceleration; other motion does not change. */
void queue_throttle(int8_t rpm);

/* Gives the engine what comes next; not 0 if anything changed. Call often. */
uint8_t queue_poll(void);

/* The loop from a start to a finish, 1..30 and not the same (STATUS_LOOP_BOUNDS): begins once both are known, after the
 * running command; may be changed while it runs. autorun: 1 to `finish`, where they may be the same. */
typedef enum { QUEUE_LOOP_START, QUEUE_LOOP_FINISH } queue_bound_t;
status_t queue_loop_bound(queue_bound_t bound, uint8_t position);
status_t queue_loop_from_first(uint8_t finish);
void queue_loop_passes(uint16_t passes); /* of the loop or array that runs or begins next; 0: endless */

/* The xRef array: entry 0..30, position 1..30 or 0 for its end. queue_array_run(): STATUS_ARRAY_EMPTY. */
status_t queue_array_set(uint8_t entry, uint8_t position);
uint8_t queue_array(uint8_t entry);
status_t queue_array_run(uint16_t passes);

/* L: the loop, or the array's, ends with the running command; continuous motion with its own deceleration. */
void queue_loop_end(void);

/* S and s: all of it ends; nothing pending is executed, the entries stay. decel, linear: the session's. */
void queue_stop(void);
void queue_stop_graceful(accel_code_t decel, bool linear);

/* N and n: the running command ends, now or with its own deceleration; the next one follows. A loop that continuous
 * motion has interrupted executes one more. */
void queue_next(void);
void queue_next_graceful(void);

uint8_t queue_next_position(void); /* where the next motion command will be stored, 1..30 */
uint8_t queue_pending(void);       /* 0..30 */
bool queue_is_executing(void);
uint8_t queue_executing_position(void); /* of the command that the engine executes; 0 if none, or continuous */

const motion_command_t *queue_entry(uint8_t position); /* 0..31 */

#endif
