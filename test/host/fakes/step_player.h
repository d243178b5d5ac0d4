/* A fake of motion/step_port.h: plays the segment ring as hal/step_isr.S and hal/step_timer.c do, without a processor.
 *
 * Purpose: the cycle of every edge of clk and dir and of every change of the state, for tests of the engine. Time
 *          advances only when the test says so (and while step_port_halt() lets a pulse pass); the test calls
 *          engine_poll() in between. Many equal periods are passed at once, so that long motions cost little.
 * Units:   ticks of 62.5 ns since step_player_reset().
 * Model:   Timer1 in mode 15 with double-buffered OCR1A and OCR1B; the interrupt counts at BOTTOM, and writes the
 *          buffers step_player_load_ticks later (after a wait for an early reload: STEP_PLAYER_WAITED_TICKS later). If
 *          the period is over by then, they take effect one period later and step_late is set, as on the chip.
 * Source:  datasheet DS40002061 section 16.9.3. */
#ifndef STEP_PLAYER_H
#define STEP_PLAYER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "motion/segment.h"
#include "motion/step_port.h"

/* Rising edges of clk that are `period` ticks apart, all with the same level of dir. */
typedef struct {
    uint64_t first;  /* time of the first edge */
    uint64_t period; /* 0 while count is 1 */
    uint64_t count;
    bool dir;
} player_run_t;

typedef struct {
    uint64_t time;
    uint8_t value; /* level of dir, or motion_state_t */
} player_change_t;

#define STEP_PLAYER_LOAD_TICKS 80   /* interrupt latency 28 and 52 to the last register: the worst that is allowed */
#define STEP_PLAYER_WAITED_TICKS 30 /* from the end of a period that was waited for to the last register ... */
#define STEP_PLAYER_WAITS_AFTER 63  /* ... if the interrupt, latency 28 and 35 cycles, waits by then */

void step_player_reset(void);
extern uint32_t step_player_load_ticks; /* STEP_PLAYER_LOAD_TICKS after a reset */

void step_player_advance(uint64_t ticks); /* a little more if the interrupt is at work then */
void step_player_advance_to(uint64_t time);
bool step_player_to_next_load(void); /* until the interrupt has loaded a segment or run out; false: nothing will come */
bool step_player_to_next_load_or(uint64_t ticks); /* the same, or until so many have passed */
uint64_t step_player_now(void);
bool step_player_stopped(void); /* the timer has no clock: no edge will come */

/* While held, the interrupt does not run; a period that ends meanwhile is seen by step_port_snapshot() as over. */
void step_player_hold_interrupt(bool hold);

/* What has been seen. Consecutive edges at equal distances are joined into runs. */
size_t step_player_runs(void);
const player_run_t *step_player_run(size_t index);
uint64_t step_player_edges(void);            /* all of them */
uint64_t step_player_edge(uint64_t index);   /* time of one */
uint64_t step_player_interval(uint64_t index); /* between edge `index` and the next */
int64_t step_player_position(bool cw_level); /* edges with dir at cw_level less the others */
size_t step_player_states(void);
const player_change_t *step_player_state(size_t index);
size_t step_player_dirs(void);
const player_change_t *step_player_dir(size_t index);
bool step_player_dir_level(void);

/* What must never happen; each makes the tests fail. */
typedef struct {
    unsigned cut_pulses;    /* a pulse ended before its time */
    unsigned lost_counts;   /* two periods ended before the interrupt ran */
    unsigned dir_in_pulse;  /* dir changed while clk was high */
    unsigned bad_segments;  /* a period shorter than 32 ticks, or a pulse that does not fit its period */
} player_harm_t;
const player_harm_t *step_player_harm(void);

#endif
