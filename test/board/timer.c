/* The counting machine of the timers: see timer.h. */
#include "timer.h"

/* -- flags ---------------------------------------------------------------------------------------------------------- */

static void update_lines(counter_t *t, uint64_t cycle)
{
    board_t *b = t->board;
    uint8_t requested = REG(b, t->reg_tifr) & REG(b, t->reg_timsk);
    irq_set(b, t->vector_overflow, requested & FLAG_TOV, cycle);
    irq_set(b, t->compare[0].vector, requested & FLAG_OCA, cycle);
    irq_set(b, t->compare[1].vector, requested & FLAG_OCB, cycle);
    if (t->number == 1)
        irq_set(b, VECTOR_TIMER1_CAPT, requested & FLAG_ICF, cycle);
}

void timer_set_flags(counter_t *t, uint8_t flags, uint64_t cycle)
{
    board_t *b = t->board;
    uint8_t fresh = flags & (uint8_t)~REG(b, t->reg_tifr);
    if (fresh == 0)
        return;
    REG(b, t->reg_tifr) |= fresh;
    if (fresh & REG(b, t->reg_timsk))
        update_lines(t, cycle);
}

/* -- pins ------------------------------------------------------------------------------------------------------------ */

static void show_latch(counter_t *t, const compare_t *c, uint64_t cycle)
{
    pin_override(t->board, c->pin, c->connected ? PIN_VALUE : PIN_FREE, c->latch, cycle);
}

static bool after(pin_action_t action, bool latch)
{
    switch (action) {
    case PIN_KEEPS: return latch;
    case PIN_CLEARS: return false;
    case PIN_SETS: return true;
    case PIN_TOGGLES: return !latch;
    }
    return latch;
}

static void set_latch(counter_t *t, compare_t *c, bool level, uint64_t cycle)
{
    if (level == c->latch)
        return;
    c->latch = level;
    show_latch(t, c, cycle);
}

/* -- one tick -------------------------------------------------------------------------------------------------------- */

static void load_buffers(counter_t *t)
{
    t->compare[0].ocr = t->compare[0].buffer;
    t->compare[1].ocr = t->compare[1].buffer;
    if (t->top_from == TOP_OCRA)
        t->top = t->compare[0].ocr;
}

static pin_action_t match_action(const counter_t *t, const compare_t *c, uint16_t leaving)
{
    if (t->wave < WAVE_PHASE)
        return c->at_match;
    /* 16.9.4: at the extremes the output is constant, as if the match had come from the other side. */
    if (leaving == t->top && t->top != 0)
        return c->at_match_down;
    if (leaving == 0)
        return c->at_match;
    return t->down ? c->at_match_down : c->at_match;
}

static void tick(counter_t *t, uint64_t cycle)
{
    const uint16_t leaving = t->count;
    const bool compares = !t->blocked;
    const bool at_top = compares && leaving == t->top;
    bool bottom = false; /* a single-slope counter returns */
    uint8_t flags = 0;
    uint8_t matched = 0;

    t->blocked = false;
    for (int i = 0; i < 2; i++)
        if (compares && leaving == t->compare[i].ocr) {
            flags |= (uint8_t)(FLAG_OCA << i);
            matched |= (uint8_t)(1 << i);
        }
    if (at_top && t->top_from == TOP_ICR)
        flags |= FLAG_ICF;

    if (t->wave < WAVE_PHASE) {
        bottom = at_top || leaving == t->max;
        t->count = bottom ? 0 : (uint16_t)(leaving + 1);
        if (t->wave != WAVE_FAST) {
            if (leaving == t->max)
                flags |= FLAG_TOV;
        } else if (t->board->timers->tov == BOARD_TOV_LEAVING_TOP ? at_top : t->count == t->top) {
            flags |= FLAG_TOV;
        }
    } else if (!t->down) {
        t->down = leaving >= t->top && leaving != 0;
        t->count = (uint16_t)(t->down ? leaving - 1 : leaving + (t->top != 0));
    } else {
        t->count = (uint16_t)(leaving - 1);
    }

    for (int i = 0; i < 2; i++) {
        compare_t *c = &t->compare[i];
        bool level = c->latch;
        if (!c->connected)
            continue;
        if (matched >> i & 1)
            level = after(match_action(t, c, leaving), level);
        if (bottom)
            level = after(c->at_bottom, level);
        set_latch(t, c, level, cycle);
    }

    if (bottom && t->wave == WAVE_FAST)
        load_buffers(t);
    if (t->wave >= WAVE_PHASE) {
        if (t->wave == WAVE_PHASE && leaving == t->top)
            load_buffers(t);
        if (t->count == 0 && (t->down || t->top == 0)) { /* BOTTOM reached */
            t->down = false;
            flags |= FLAG_TOV;
            if (t->wave == WAVE_PHASE_FREQ)
                load_buffers(t);
        }
    }
    timer_set_flags(t, flags, cycle);
}

/* -- many ticks ------------------------------------------------------------------------------------------------------ */

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

/* Ticks before the one that ends the way up: at TOP, or at MAX when TOP has been passed (a double-slope counter above
 * TOP turns at once). */
static uint32_t ticks_to_end(const counter_t *t)
{
    if (t->count <= t->top)
        return (uint32_t)(t->top - t->count);
    return t->wave >= WAVE_PHASE ? 0 : (uint32_t)(t->max - t->count);
}

/* Ticks from now on that do nothing but count. A match whose flag is set already and whose pin is not connected does
 * nothing either. */
static uint32_t quiet_ticks(const counter_t *t)
{
    const uint32_t v = t->count;
    const uint8_t flags = REG(t->board, t->reg_tifr);
    uint32_t quiet;

    if (t->blocked)
        return 0;
    if (t->down) {
        quiet = v - 1; /* the tick that reaches BOTTOM */
        for (int i = 0; i < 2; i++)
            if (t->compare[i].ocr <= v)
                quiet = least(quiet, v - t->compare[i].ocr);
        return quiet;
    }
    quiet = ticks_to_end(t);
    if (t->wave == WAVE_FAST && !(flags & FLAG_TOV) && v < t->top && quiet > 0)
        quiet--; /* the tick that reaches TOP */
    for (int i = 0; i < 2; i++) {
        const compare_t *c = &t->compare[i];
        if (c->ocr >= v && (c->connected || !(flags & (FLAG_OCA << i))))
            quiet = least(quiet, c->ocr - v);
    }
    return quiet;
}

static void move(counter_t *t, uint32_t ticks)
{
    t->count = (uint16_t)(t->down ? t->count - ticks : t->count + ticks);
}

/* The prescaler's k-th edge since its zero. */
static uint64_t edge_cycle(const counter_t *t, uint64_t k)
{
    return t->prescaler->zero + (k << t->shift);
}

/* After two whole periods without a register access everything repeats every second period (a toggled pin needs two),
 * so that long times are skipped at once. Only a timer that nobody watches gets here with many periods. */
#define PERIODS_UNTIL_STEADY 3

static void advance(counter_t *t, uint64_t ticks, uint64_t k)
{
    int periods = 0;

    while (ticks > 0) {
        uint32_t quiet = quiet_ticks(t);
        if (quiet >= ticks) {
            move(t, (uint32_t)ticks);
            return;
        }
        move(t, quiet);
        k += quiet + 1u;
        ticks -= quiet + 1u;
        tick(t, edge_cycle(t, k));
        if (t->count == 0 && ++periods == PERIODS_UNTIL_STEADY) {
            uint64_t top = t->top;
            uint64_t two_periods = t->wave < WAVE_PHASE ? 2 * (top + 1) : 4 * (top ? top : 1);
            uint64_t skipped = ticks / two_periods * two_periods;
            ticks -= skipped;
            k += skipped;
        }
    }
}

void timer_sync(counter_t *t, uint64_t cycle)
{
    if (cycle <= t->at)
        return;
    if (t->source == CLOCK_INTERNAL && !t->prescaler->held) {
        uint64_t first = (t->at - t->prescaler->zero) >> t->shift;
        uint64_t last = (cycle - t->prescaler->zero) >> t->shift;
        if (last != first)
            advance(t, last - first, first);
    }
    t->at = cycle;
}

void timer_external_tick(counter_t *t, uint64_t cycle)
{
    t->at = cycle;
    tick(t, cycle);
}

/* -- the next tick that somebody sees --------------------------------------------------------------------------------- */

void timer_plan(counter_t *t)
{
    board_t *b = t->board;
    const uint8_t wanted = REG(b, t->reg_timsk) & (uint8_t)~REG(b, t->reg_tifr);
    const uint32_t v = t->count;
    bool any = (wanted & (FLAG_TOV | FLAG_OCA | FLAG_OCB | FLAG_ICF)) != 0;
    uint32_t ticks = UINT32_MAX; /* before the one that matters */

    if (t->source != CLOCK_INTERNAL || t->prescaler->held) {
        event_cancel(b, t->slot);
        return;
    }
    for (int i = 0; i < 2; i++) {
        const compare_t *c = &t->compare[i];
        bool edge = c->connected && pin_watched(b, c->pin);
        if (edge)
            any = true;
        if (!edge && !(wanted & (FLAG_OCA << i)))
            continue;
        if (t->down ? c->ocr <= v : c->ocr >= v)
            ticks = least(ticks, t->down ? v - c->ocr : c->ocr - v);
    }
    if (!any) {
        event_cancel(b, t->slot);
        return;
    }
    if (t->down) {
        ticks = least(ticks, v > 0 ? v - 1 : 0);
    } else {
        uint32_t end =
            ticks_to_end(t); /* always: what lies behind the counter, or above TOP, is looked for anew there */
        if ((wanted & FLAG_TOV) && t->wave == WAVE_FAST && v < t->top)
            ticks = least(ticks, end - 1);
        ticks = least(ticks, end);
    }
    event_at(b, t->slot, edge_cycle(t, ((t->at - t->prescaler->zero) >> t->shift) + ticks + 1u), t->event);
}

/* -- what the registers do ------------------------------------------------------------------------------------------- */

void timer_write_count(counter_t *t, uint16_t value)
{
    t->count = value;
    t->blocked = true; /* also while the clock is stopped */
}

void timer_write_compare(counter_t *t, int channel, uint16_t value)
{
    compare_t *c = &t->compare[channel];
    c->buffer = value;
    if (timer_is_pwm(t))
        return;
    c->ocr = value;
    if (channel == 0 && t->top_from == TOP_OCRA)
        t->top = value;
}

void timer_set_wave(counter_t *t, wave_t wave, top_from_t from, uint16_t fixed_top)
{
    t->wave = wave;
    t->top_from = from;
    if (wave < WAVE_PHASE)
        t->down = false;
    if (!timer_is_pwm(t))
        load_buffers(t); /* 16.7: outside PWM the buffers are transparent */
    switch (from) {
    case TOP_FIXED: t->top = fixed_top; break;
    case TOP_OCRA: t->top = t->compare[0].ocr; break;
    case TOP_ICR: t->top = t->icr; break;
    }
}

void timer_set_output(counter_t *t, int channel, int com, bool may_toggle, uint64_t cycle)
{
    compare_t *c = &t->compare[channel];
    const pin_action_t plain[4] = {PIN_KEEPS, PIN_TOGGLES, PIN_CLEARS, PIN_SETS};
    const pin_action_t inverse[4] = {PIN_KEEPS, PIN_TOGGLES, PIN_SETS, PIN_CLEARS};

    if (timer_is_pwm(t) && com == 1 && !may_toggle)
        com = 0;
    c->connected = com != 0;
    c->at_match = plain[com];
    c->at_match_down = inverse[com];
    c->at_bottom = t->wave == WAVE_FAST && com >= 2 ? inverse[com] : PIN_KEEPS;
    show_latch(t, c, cycle);
}

/* 16.7.1: as a real match, but no flag and no clearing of the counter; PWM modes ignore it. */
void timer_force_compare(counter_t *t, int channel, uint64_t cycle)
{
    compare_t *c = &t->compare[channel];
    if (!timer_is_pwm(t) && c->connected)
        set_latch(t, c, after(c->at_match, c->latch), cycle);
}

void timer_set_clock(counter_t *t, clock_source_t source, int shift)
{
    t->source = source;
    t->shift = shift;
}

/* -- flag registers, the same in all three ----------------------------------------------------------------------------- */

static counter_t *owner_of(board_t *b, uint16_t address)
{
    for (int i = 0; i < 3; i++)
        if (b->timers->timer[i].reg_tifr == address || b->timers->timer[i].reg_timsk == address)
            return &b->timers->timer[i];
    return NULL;
}

static uint8_t read_flags(board_t *b, uint16_t address, uint64_t cycle)
{
    timer_sync(owner_of(b, address), cycle);
    return REG(b, address);
}

static void write_flags(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    counter_t *t = owner_of(b, address);
    timer_sync(t, cycle);
    REG(b, address) &= (uint8_t)~reg_written_ones(b, value);
    update_lines(t, cycle);
    timer_plan(t);
}

static void write_mask(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    counter_t *t = owner_of(b, address);
    timer_sync(t, cycle);
    REG(b, address) = value;
    update_lines(t, cycle);
    timer_plan(t);
}

static void ack(board_t *b, int vector, uint64_t cycle)
{
    counter_t *t = &b->timers->timer[vector >= VECTOR_TIMER0_COMPA ? 0 : vector >= VECTOR_TIMER1_CAPT ? 1 : 2];
    uint8_t flag = vector == t->vector_overflow     ? FLAG_TOV
                   : vector == t->compare[0].vector ? FLAG_OCA
                   : vector == t->compare[1].vector ? FLAG_OCB
                                                    : FLAG_ICF;
    timer_sync(t, cycle);
    REG(b, t->reg_tifr) &= (uint8_t)~flag;
    update_lines(t, cycle);
    timer_plan(t);
}

void timer_init(counter_t *t)
{
    board_t *b = t->board;
    reg_on_read(b, t->reg_tifr, read_flags);
    reg_on_write(b, t->reg_tifr, write_flags);
    reg_on_write(b, t->reg_timsk, write_mask);
    irq_on_ack(b, t->vector_overflow, ack);
    irq_on_ack(b, t->compare[0].vector, ack);
    irq_on_ack(b, t->compare[1].vector, ack);
    if (t->number == 1)
        irq_on_ack(b, VECTOR_TIMER1_CAPT, ack);
}
