/* The three timers together: their prescalers, and the pins that clock or capture. */
#include "timer.h"

#include <stdlib.h>
#include <string.h>

#define REG_GTCCR 0x43
#define GTCCR_TSM 0x80
#define GTCCR_PSRASY 0x02
#define GTCCR_PSRSYNC 0x01
#define REG_TCCR1B 0x81
#define TCCR1B_ICES1 0x40

/* 17.1: an edge of T0 or T1 reaches the counter after 2.5 to 3.5 cycles; the pads' edges lie on clock edges here. ICP1
 * goes through the same synchroniser and edge detector (16.6.1). */
#define EDGE_DELAY_CYCLES 3

enum { EDGE_T0, EDGE_T1, EDGE_ICP };

void timers_sync(board_t *b, uint64_t cycle)
{
    for (int i = 0; i < 3; i++)
        timer_sync(&b->timers->timer[i], cycle);
}

void timers_replan(board_t *b)
{
    for (int i = 0; i < 3; i++)
        timer_plan(&b->timers->timer[i]);
}

static void timer0_due(board_t *b, uint64_t cycle)
{
    timer_sync(&b->timers->timer[0], cycle);
    timer_plan(&b->timers->timer[0]);
}

static void timer1_due(board_t *b, uint64_t cycle)
{
    timer_sync(&b->timers->timer[1], cycle);
    timer_plan(&b->timers->timer[1]);
}

static void timer2_due(board_t *b, uint64_t cycle)
{
    timer_sync(&b->timers->timer[2], cycle);
    timer_plan(&b->timers->timer[2]);
}

/* 17.1, 17.4.1: PSRSYNC and PSRASY fall back by hardware unless TSM holds them, which also halts the timers. */
static void write_gtccr(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    struct timers *timers = b->timers;
    bool hold = value & GTCCR_TSM;

    timers_sync(b, cycle);
    if ((value & GTCCR_PSRSYNC) || timers->shared.held)
        timers->shared.zero = cycle;
    if ((value & GTCCR_PSRASY) || timers->timer2s.held)
        timers->timer2s.zero = cycle;
    timers->shared.held = hold && (value & GTCCR_PSRSYNC);
    timers->timer2s.held = hold && (value & GTCCR_PSRASY);
    REG(b, address) = hold ? value : 0;
    timers_replan(b);
}

/* -- edges of T0, T1, ICP1 --------------------------------------------------------------------------------------------- */

static void edge_due(board_t *b, int which, uint64_t cycle);

static void t0_due(board_t *b, uint64_t cycle)
{
    edge_due(b, EDGE_T0, cycle);
}

static void t1_due(board_t *b, uint64_t cycle)
{
    edge_due(b, EDGE_T1, cycle);
}

static void icp_due(board_t *b, uint64_t cycle)
{
    edge_due(b, EDGE_ICP, cycle);
}

static void capture(counter_t *t, uint64_t cycle)
{
    if (t->top_from == TOP_ICR)
        return; /* 16.6: no capture while ICR1 is TOP */
    timer_sync(t, cycle);
    t->icr = t->count;
    timer_set_flags(t, FLAG_ICF, cycle);
}

static void plan_edge(board_t *b, int which)
{
    static const event_fn due[3] = {t0_due, t1_due, icp_due};
    if (b->timers->edge[which].count > 0)
        event_at(b, (event_slot_t)(EVENT_T0_EDGE + which), b->timers->edge[which].due[0], due[which]);
}

static void edge_due(board_t *b, int which, uint64_t cycle)
{
    struct timers *timers = b->timers;
    counter_t *t = &timers->timer[which == EDGE_T0 ? 0 : 1];

    timers->edge[which].count--;
    memmove(timers->edge[which].due, timers->edge[which].due + 1,
            (size_t)timers->edge[which].count * sizeof timers->edge[which].due[0]);
    if (which == EDGE_ICP)
        capture(t, cycle);
    else if (t->source == CLOCK_EXTERNAL)
        timer_external_tick(t, cycle);
    plan_edge(b, which);
}

static void add_edge(board_t *b, int which, uint64_t cycle)
{
    struct timers *timers = b->timers;
    if (timers->edge[which].count == 8)
        return; /* edges closer than a cycle are not seen */
    timers->edge[which].due[timers->edge[which].count++] = cycle + EDGE_DELAY_CYCLES;
    plan_edge(b, which);
}

static void t0_changed(board_t *b, int level, uint64_t cycle)
{
    const counter_t *t = &b->timers->timer[0];
    if (t->source == CLOCK_EXTERNAL && t->external_rising == level)
        add_edge(b, EDGE_T0, cycle);
}

static void t1_changed(board_t *b, int level, uint64_t cycle)
{
    const counter_t *t = &b->timers->timer[1];
    if (t->source == CLOCK_EXTERNAL && t->external_rising == level)
        add_edge(b, EDGE_T1, cycle);
}

static void icp1_changed(board_t *b, int level, uint64_t cycle)
{
    bool rising = REG(b, REG_TCCR1B) & TCCR1B_ICES1;
    if (rising == (bool)level)
        add_edge(b, EDGE_ICP, cycle);
}

/* -- life ------------------------------------------------------------------------------------------------------------ */

void board_fast_pwm_tov(board_t *b, board_tov_t when)
{
    b->timers->tov = when;
    timers_replan(b);
}

void timers_init(board_t *b)
{
    static const counter_t wired[3] = {
        {.number = 0,
         .max = 0xFF,
         .reg_tifr = 0x35,
         .reg_timsk = 0x6E,
         .slot = EVENT_TIMER0,
         .event = timer0_due,
         .vector_overflow = VECTOR_TIMER0_OVF,
         .compare = {{.pin = BOARD_PIN('D', 6), .vector = VECTOR_TIMER0_COMPA},
                     {.pin = BOARD_PIN('D', 5), .vector = VECTOR_TIMER0_COMPB}}},
        {.number = 1,
         .max = 0xFFFF,
         .reg_tifr = 0x36,
         .reg_timsk = 0x6F,
         .slot = EVENT_TIMER1,
         .event = timer1_due,
         .vector_overflow = VECTOR_TIMER1_OVF,
         .compare = {{.pin = BOARD_PIN('B', 1), .vector = VECTOR_TIMER1_COMPA},
                     {.pin = BOARD_PIN('B', 2), .vector = VECTOR_TIMER1_COMPB}}},
        {.number = 2,
         .max = 0xFF,
         .reg_tifr = 0x37,
         .reg_timsk = 0x70,
         .slot = EVENT_TIMER2,
         .event = timer2_due,
         .vector_overflow = VECTOR_TIMER2_OVF,
         .compare = {{.pin = BOARD_PIN('B', 3), .vector = VECTOR_TIMER2_COMPA},
                     {.pin = BOARD_PIN('D', 3), .vector = VECTOR_TIMER2_COMPB}}},
    };
    struct timers *timers = calloc(1, sizeof *timers);
    if (timers == NULL)
        abort();
    b->timers = timers;
    for (int i = 0; i < 3; i++) {
        timers->timer[i] = wired[i];
        timers->timer[i].board = b;
        timers->timer[i].top = wired[i].max;
        timers->timer[i].prescaler = i == 2 ? &timers->timer2s : &timers->shared;
    }
    timer8_init(&timers->timer[0]);
    timer16_init(&timers->timer[1]);
    timer8_init(&timers->timer[2]);
    reg_on_write(b, REG_GTCCR, write_gtccr);
    pin_listen(b, BOARD_PIN('D', 4), t0_changed);
    pin_listen(b, BOARD_PIN('D', 5), t1_changed);
    pin_listen(b, BOARD_PIN('B', 0), icp1_changed);
}

void timers_reset(board_t *b)
{
    struct timers *timers = b->timers;
    uint64_t cycle = board_time(b);

    timers->shared = timers->timer2s = (prescaler_t){cycle, false};
    for (int i = 0; i < 3; i++) {
        counter_t *t = &timers->timer[i];
        t->source = CLOCK_STOPPED;
        t->at = cycle;
        t->count = 0;
        t->down = t->blocked = false;
        t->wave = WAVE_NORMAL;
        t->top_from = TOP_FIXED;
        t->top = t->max;
        t->icr = 0;
        t->temp = 0;
        for (int channel = 0; channel < 2; channel++) {
            compare_t *c = &t->compare[channel];
            c->ocr = c->buffer = 0;
            c->connected = c->latch = false; /* 16.8: a reset clears the OC1x latch */
            c->at_match = c->at_match_down = c->at_bottom = PIN_KEEPS;
        }
        timer_plan(t);
    }
    for (int which = 0; which < 3; which++) {
        timers->edge[which].count = 0;
        event_cancel(b, (event_slot_t)(EVENT_T0_EDGE + which));
    }
}

void timers_free(board_t *b)
{
    free(b->timers);
}
