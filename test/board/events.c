/* The event queue: one slot a cause, few enough to be searched in a line. */
#include "board_internal.h"

static void find_next(board_t *b)
{
    uint64_t least = NEVER;
    for (int slot = 0; slot < EVENT_SLOTS; slot++)
        if (b->event_cycle[slot] < least)
            least = b->event_cycle[slot];
    b->next_event = least;
}

void event_at(board_t *b, event_slot_t slot, uint64_t cycle, event_fn fn)
{
    uint64_t before = b->event_cycle[slot];
    b->event_cycle[slot] = cycle;
    b->event_fn[slot] = fn;
    if (cycle <= b->next_event)
        b->next_event = cycle;
    else if (before == b->next_event)
        find_next(b);
}

void event_cancel(board_t *b, event_slot_t slot)
{
    if (b->event_cycle[slot] == NEVER)
        return;
    event_at(b, slot, NEVER, NULL);
}

uint64_t event_due(const board_t *b, event_slot_t slot)
{
    return b->event_cycle[slot];
}

void events_run_until(board_t *b, uint64_t cycle)
{
    bool nested = b->in_event;
    uint64_t outer = b->now;

    b->in_event = true;
    while (b->next_event <= cycle) {
        uint64_t due = b->next_event;
        int slot = 0;
        while (b->event_cycle[slot] != due)
            slot++;
        b->event_cycle[slot] = NEVER;
        find_next(b);
        b->now = due;
        b->event_fn[slot](b, due);
    }
    b->in_event = nested;
    b->now = outer;
}

uint64_t board_time(const board_t *b)
{
    return b->in_event ? b->now : b->avr->cycle;
}
