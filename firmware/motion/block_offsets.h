/* Where block.S finds the members of block_t; block.c checks each at compile time. */
#ifndef MOTION_BLOCK_OFFSETS_H
#define MOTION_BLOCK_OFFSETS_H

#define BLOCK_TOP 0
#define BLOCK_SLOPE 4
#define BLOCK_CURVE 8
#define BLOCK_CARRY 12
#define BLOCK_WIDTH 14
#define BLOCK_RUNS 16
#define BLOCK_PULSES 17
#define BLOCK_FLAGS 18
#define BLOCK_SHAPE 19
#define BLOCK_GEAR 20

#define BLOCK_FASTER_BIT 0
#define BLOCK_SPLIT_BIT 1

/* Free slots of the ring that an append leaves: one stays empty, two are still needed for the position, two more are
 * what the last run may take. */
#define BLOCK_RING_MOST_BYTES ((SEGMENT_COUNT - 5) * SEGMENT_BYTES)

#endif
