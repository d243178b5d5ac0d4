/* See block.h. On the AVR block.S does this. */
#include "motion/block.h"
#include "motion/segment.h"

#ifdef __AVR__
#include <stddef.h>
#define CHECK(name, member) _Static_assert(BLOCK_##name == offsetof(block_t, member), "block_offsets.h: " #member)
CHECK(TOP, top_q16);
CHECK(SLOPE, slope_q16);
CHECK(CURVE, curve_q16);
CHECK(CARRY, carry_q16);
CHECK(WIDTH, width_ticks);
CHECK(RUNS, runs);
CHECK(PULSES, pulses);
CHECK(FLAGS, flags);
CHECK(SHAPE, shape);
CHECK(GEAR, gear);
#else

static void append(const block_t *block, uint8_t periods, uint16_t top)
{
    if (periods == 0)
        return;
    segment_t *s = &segments[step_head / SEGMENT_BYTES];
    uint8_t early = (uint8_t)((top < SEGMENT_EARLY1_BELOW_TICKS - 1) + (top < SEGMENT_EARLY2_BELOW_TICKS - 1) +
                              (top < SEGMENT_EARLY3_BELOW_TICKS - 1));
    s->top = top;
    s->match = (uint16_t)(top - block->width_ticks);
    s->count_low = (uint8_t)(periods - early);
    s->count_high = 0;
    s->flags = (uint8_t)(block->flags | early << SEGMENT_EARLY_SHIFT);
    s->gear = block->gear;
    step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

void block_append(block_t *block)
{
    while (block->runs && (uint8_t)(step_head - step_tail) <= BLOCK_RING_MOST_BYTES) {
        uint32_t x = block->top_q16;
        if (!(block->shape & BLOCK_SPLIT)) {
            x += block->carry_q16;
            block->carry_q16 = (uint16_t)x;
            append(block, block->pulses, (uint16_t)(x >> 16));
        } else {
            uint16_t top = (uint16_t)(x >> 16);
            uint32_t fraction = (uint32_t)(uint16_t)x * block->pulses + block->carry_q16;
            uint8_t longer = (uint8_t)(fraction >> 16);
            block->carry_q16 = (uint16_t)fraction;
            if (block->shape & BLOCK_FASTER)
                append(block, longer, (uint16_t)(top + 1));
            append(block, (uint8_t)(block->pulses - longer), top);
            if (!(block->shape & BLOCK_FASTER))
                append(block, longer, (uint16_t)(top + 1));
        }
        block->top_q16 += (uint32_t)block->slope_q16;
        block->slope_q16 = (int32_t)((uint32_t)block->slope_q16 + (uint32_t)block->curve_q16); /* may wrap after the last */
        block->runs--;
    }
}
#endif
