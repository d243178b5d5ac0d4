/* Interrupt requests and vector entry, datasheet 7.7 and 12. */
#include "board_internal.h"

/* 7.7.1: four cycles from the end of the running instruction to the first instruction at the vector; four more when
 * the processor slept. */
#define ENTRY_CYCLES 4
#define WAKE_CYCLES 4

void irq_set(board_t *b, int vector, bool requested, uint64_t cycle)
{
    uint32_t bit = 1u << vector;
    if (requested == ((b->irq_requests & bit) != 0))
        return;
    b->irq_requests ^= bit;
    b->irq_since[vector] = cycle;
}

void irq_on_ack(board_t *b, int vector, irq_ack_t ack)
{
    b->irq_ack[vector] = ack;
}

static void push(avr_t *avr, uint8_t value)
{
    uint16_t sp = (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
    if (sp <= avr->ramend)
        avr->data[sp] = value;
    sp--;
    avr->data[R_SPL] = (uint8_t)sp;
    avr->data[R_SPH] = (uint8_t)(sp >> 8);
}

bool irq_dispatch(board_t *b)
{
    avr_t *avr = b->avr;
    uint64_t start;
    int vector;

    if (b->irq_requests == 0 || !avr->sreg[S_I] || b->irq_hold)
        return false;

    if (avr->state == cpu_Sleeping) {
        b->measures.sleep_cycles += avr->cycle - b->sleep_since;
        avr->state = cpu_Running;
        avr->cycle += WAKE_CYCLES;
        events_run(b, avr->cycle); /* meanwhile a more urgent one may have come, the level gone, or a reset */
        if (b->irq_requests == 0 || !avr->sreg[S_I] || avr->state != cpu_Running)
            return true;
    }
    vector = __builtin_ctz(b->irq_requests);
    start = avr->cycle;
    measures_enter(b, vector, start);
    avr->cycle = start + ENTRY_CYCLES;
    push(avr, (uint8_t)(avr->pc >> 1));
    push(avr, (uint8_t)(avr->pc >> 9));
    avr->sreg[S_I] = 0;
    b->i_seen = false;
    avr->pc = (avr_flashaddr_t)vector * 4;
    if (b->irq_ack[vector] != NULL)
        b->irq_ack[vector](b, vector, start);
    return true;
}
