/* What the processor spends: interrupts, masked sections, stack, sleep. */
#include "board_internal.h"

#include <string.h>

void measures_reset(board_t *b)
{
    b->isr_depth = 0;
    b->masked_since = NEVER;
    b->i_seen = false;
}

void measures_enter(board_t *b, int vector, uint64_t start)
{
    board_isr_t *isr = &b->measures.isr[vector];
    uint32_t latency = (uint32_t)(start - b->irq_since[vector]);

    isr->count++;
    if (start > b->irq_since[vector] && latency > isr->latency_max)
        isr->latency_max = latency;
    b->masked_since = start;
    if (b->isr_depth < ISR_DEPTH_MAX) {
        isr_frame_t *frame = &b->isr_frame[b->isr_depth++];
        frame->start = start;
        frame->nested = 0;
        frame->vector = (uint8_t)vector;
    }
}

void measures_reti(board_t *b)
{
    const isr_frame_t *frame;
    board_isr_t *isr;
    uint64_t whole;
    uint64_t own;

    if (b->isr_depth == 0)
        return;
    frame = &b->isr_frame[--b->isr_depth];
    isr = &b->measures.isr[frame->vector];
    whole = b->avr->cycle - frame->start;
    own = whole - frame->nested;
    isr->cycles += own;
    if (own > isr->cycles_max)
        isr->cycles_max = (uint32_t)own;
    if (b->isr_depth > 0)
        b->isr_frame[b->isr_depth - 1].nested += whole;
}

/* Called before measures_reti(), so that RETI still belongs to its interrupt. */
void measures_i_changed(board_t *b, uint32_t pc)
{
    uint32_t masked;

    b->i_seen = b->avr->sreg[S_I];
    if (!b->i_seen) {
        b->masked_since = b->avr->cycle;
        return;
    }
    if (b->masked_since == NEVER) {
        b->masked_since = 0;
        return;
    }
    masked = (uint32_t)(b->avr->cycle - b->masked_since);
    if (b->isr_depth > 0) {
        if (masked > b->measures.isr_masked_max) {
            b->measures.isr_masked_max = masked;
            b->measures.isr_masked_vector = b->isr_frame[b->isr_depth - 1].vector;
        }
    } else if (masked > b->measures.masked_max) {
        b->measures.masked_max = masked;
        b->measures.masked_max_pc = (uint16_t)pc;
    }
}

const board_measures_t *board_measures(const board_t *b)
{
    board_t *mine = (board_t *)b; /* the sums are brought up to date when they are asked for */
    mine->measures.cycles = b->avr->cycle - b->measures_since;
    if (b->avr->state == cpu_Sleeping) {
        mine->measures.sleep_cycles += b->avr->cycle - b->sleep_since;
        mine->sleep_since = b->avr->cycle;
    }
    return &b->measures;
}

void board_measures_clear(board_t *b)
{
    uint16_t sp = board_peek16(b, R_SPL);
    memset(&b->measures, 0, sizeof b->measures);
    b->measures.stack_low = sp;
    b->measures_since = b->avr->cycle;
    b->sleep_since = b->avr->cycle;
}
