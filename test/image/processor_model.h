/* The command processor as a state machine, written from the manual and the decisions, apart from the firmware: which
 * command's pulse comes next, and how many each makes in which direction.
 *
 * It is told what went in (lines, edges of pins) and what came out (pulses), in order. What went in takes effect within
 * a short time, not at one cycle, and a command that is cut short makes so many pulses as it made: so it follows all
 * states that can explain what was seen, and complains when there is none left.
 *
 * How it reads what the decisions leave open:
 *   1. LS and LF (likewise l<nn>, xl) do not preempt: the loop begins when the running command is done, before what is
 *      pending; that follows when the loop has ended (A-MOT-06).
 *   2. L ends continuous and loops; what is pending in the queue follows. Without either it does nothing.
 *   3. L clears bounds and number of passes also of a loop that has not begun.
 *   4. S, s and Estop forget bounds and passes too, not the xRef array.
 *   5. A bound equal to the other one is ignored, the old one stays.
 *   6. A changed bound counts when the running command is done: LF set to its position ends the pass there.
 *   7. N and n on a command that waits (t, sync) drop it; so does whatever preempts.
 *   8. X on X: the first one is cut. After it the loop or the queue goes on as if the first had ended.
 *   9. X and N cut at once whatever direction follows; m that turns round may ramp down first (A-DIR-02).
 *  10. N or n on a continuous command that interrupted a loop: one more command of the loop, or of the xRef array, then
 *      the loop is forgotten (bounds typed from then on are a new one) and what is pending follows.
 *  11. m on m: the second replaces the first; what the first has interrupted is still interrupted.
 *  12. n and L never make more pulses than the command has. s ramps down with the session's decel and law, and may make
 *      more where it is flatter than what is left.
 *  13. y counts only for a command whose turn has come; during the closing interval of the one before, either.
 *  14. An edited entry counts from the next time it is taken up; which may be some milliseconds before it begins.
 *  15. While Estop is low m, x and single pulses are refused; loops are not started (not tested).
 *  16. LN while a loop runs is not tested; nor are loops set while continuous or another loop runs.
 *
 * Units:   cycles of 62.5 ns.
 * Source:  manual lines 331-367, 545-610, 628-640; decisions 0.2, 0.3 and sections 4 to 6. */
#ifndef TEST_IMAGE_PROCESSOR_MODEL_H
#define TEST_IMAGE_PROCESSOR_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "model.h"

typedef struct processor processor_t;

/* A fresh unit: the queue seeded with the session's defaults. session: a motion line, e.g. "m200v100a1d1". */
processor_t *processor_new(machine_t machine, const char *session);
void processor_free(processor_t *p);

/* What goes in, in order of time; cycle: when it can take effect at the earliest. "+" and "-" are lines too.
 * Returns false if the model does not know the line. */
bool processor_line(processor_t *p, uint64_t cycle, const char *line);
void processor_sync_edge(processor_t *p, uint64_t cycle); /* falling */
void processor_estop(processor_t *p, uint64_t cycle, int level);

/* What comes out. Each returns false if no state explains it; processor_states() then tells those that were left. */
bool processor_pulse(processor_t *p, uint64_t cycle, uint8_t dir);
bool processor_silence(processor_t *p, uint64_t cycle); /* no pulse until then */
bool processor_rests(processor_t *p, uint64_t cycle);   /* and none will come: the motor stands */

typedef enum {
    PROCESSOR_AT_REST,    /* nothing runs, nothing is held, nothing is pending */
    PROCESSOR_RUNS,       /* a command makes pulses */
    PROCESSOR_WAITS,      /* a command has begun or is about to, without a pulse yet */
    PROCESSOR_ENDS_SOON,  /* within 30 ms, and the next one follows */
    PROCESSOR_HELD,       /* a command waits for sync */
    PROCESSOR_LOOPS,      /* a loop or the xRef array is run, or interrupted */
    PROCESSOR_ARRAY,      /* the latter */
    PROCESSOR_CONTINUOUS, /* runs or is about to */
    PROCESSOR_ENDING,     /* a command is being cut or ramps down */
    PROCESSOR_HALF_LOOP,  /* one bound is set */
    PROCESSOR_ESTOPPED
} processor_condition_t;
bool processor_may_be(processor_t *p, processor_condition_t condition);  /* in one of the states */
bool processor_must_be(processor_t *p, processor_condition_t condition); /* in all of them */

unsigned processor_pending_most(processor_t *p);
unsigned processor_next_position(const processor_t *p); /* `Q is at`, of the first state */
/* Row of the queue in the first state, as `q` prints it, without extra pulses, waits and ramps: "20 CCW 500". */
void processor_row(const processor_t *p, unsigned position, char *row, size_t size);

const char *processor_states(const processor_t *p); /* some of them, in words */
size_t processor_state_count(const processor_t *p);
bool processor_gave_up(const processor_t *p); /* too many states */

#endif
