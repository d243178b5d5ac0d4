/* Blocks: several runs of equal pulses in a row whose intervals follow a parabola, appended to the ring with a few
 * additions each.
 *
 * Purpose: the planner works out a group of many pulses at once; played flat, they would differ from the law by half of
 *          what the law changes in the group. A block turns the group into shorter runs that follow it.
 * Units:   ticks of the timer's clock in 1/65536; a run has 1, 2, 4, ... 128 pulses.
 * Context: main loop only. In assembler on the AVR (block.S, cycles there), elsewhere in block.c.
 * Errors:  none.
 * Source:  docs/design.md, "Blocks".
 * Limits:  intervals below 65,536 ticks. Split: none short enough to be reloaded early (segment.h). Otherwise: none above
 *          256 ticks, and more pulses than are waited for then. */
#ifndef MOTION_BLOCK_H
#define MOTION_BLOCK_H

#include <stdint.h>
#include "motion/block_offsets.h"

/* Shape of the runs. Split: of two neighbouring timer values, so that each interval is within a tick of the parabola.
 * Otherwise of one, and the ticks left over go into the runs that follow: for short periods, where reloads cost most. */
#define BLOCK_FASTER (1u << BLOCK_FASTER_BIT) /* the longer value comes first */
#define BLOCK_SPLIT (1u << BLOCK_SPLIT_BIT)
#define BLOCK_SPLIT_TICKS 128u /* from here on */

typedef struct {
    uint32_t top_q16;  /* mean interval of the next run, less one tick */
    int32_t slope_q16; /* its change to the run after it */
    int32_t curve_q16; /* change of slope_q16 from run to run */
    uint16_t carry_q16; /* what has been rounded off so far; less than a tick of the sum, or of each interval (unsplit) */
    uint16_t width_ticks; /* of a pulse */
    uint8_t runs;      /* still to be appended */
    uint8_t pulses;    /* of a run */
    uint8_t flags;     /* of their segments */
    uint8_t shape;     /* BLOCK_* bits */
    uint8_t gear;      /* of their segments */
} block_t;

/* Appends runs, of one segment or two, while there are any and the ring has room for two segments. */
void block_append(block_t *block);

#endif
