#include "host/fakes/step_player.h"
#include "motion/engine.h"
#include "motion/estop_port.h"
#include <stdlib.h>
#include <string.h>

#define LEAD_BEGIN 4
#define FREEZE_TICKS 16
#define SHORTEST_PERIOD 32
#define HOLD_PERIODS 4 /* as in step_isr.S */
#define EARLY SEGMENT_EARLY_MASK
#define SET_DIR (1 << SEGMENT_SET_DIR_BIT)
#define DIR (1 << SEGMENT_DIR_BIT)

segment_t segments[SEGMENT_COUNT];
volatile uint8_t step_head, step_tail, step_flags, step_hold, step_held, step_idle, step_late, motion_state;
uint32_t step_player_load_ticks;

static struct {
    uint64_t now;
    uint64_t blocked_until; /* the interrupt is at work */
    bool clocked;
    bool ready; /* without a clock, until it is released */
    bool counting; /* TOIE1 */
    bool held;     /* interrupts off */
    bool over;     /* TOV1 */
    /* the running period */
    uint64_t begin;
    uint16_t top, match;
    bool risen;
    /* buffers */
    uint16_t next_top, next_match;
    bool late_write; /* written after this period's end */
    uint16_t late_top, late_match;
    uint32_t to_count; /* step_count_high:GPIOR0 */
    uint8_t waiting;   /* periods still to be waited for before a reload */
    uint64_t waits_from;
    bool dir;
    unsigned loads;
    player_harm_t harm;
} p;

static struct {
    player_run_t *runs;
    size_t count, room;
    uint64_t edges;
    int64_t high_less_low; /* edges by the level of dir */
} seen;

typedef struct {
    player_change_t *changes;
    size_t count, room;
} history_t;
static history_t states, dirs;

/* -- recording ----------------------------------------------------------------------------------------------------- */

static void *grown(void *array, size_t *room, size_t item)
{
    *room = *room ? *room * 2 : 256;
    return realloc(array, *room * item);
}

static void record_edges(uint64_t first, uint64_t period, uint64_t count)
{
    seen.edges += count;
    seen.high_less_low += p.dir ? (int64_t)count : -(int64_t)count;
    if (seen.count) {
        player_run_t *last = &seen.runs[seen.count - 1];
        uint64_t distance = first - (last->first + last->period * (last->count - 1));
        if (last->dir == p.dir && (last->count == 1 || last->period == distance)) {
            if (count == 1 || period == distance) {
                last->period = distance;
                last->count += count;
                return;
            }
            if (last->count > 1) {
                last->count++;
                first += period;
                count--;
            }
        }
    }
    if (seen.count == seen.room)
        seen.runs = grown(seen.runs, &seen.room, sizeof *seen.runs);
    seen.runs[seen.count++] =
        (player_run_t){.first = first, .period = count > 1 ? period : 0, .count = count, .dir = p.dir};
}

static void record(history_t *history, uint64_t time, uint8_t value)
{
    if (history->count && history->changes[history->count - 1].value == value)
        return;
    if (history->count == history->room)
        history->changes = grown(history->changes, &history->room, sizeof *history->changes);
    history->changes[history->count++] = (player_change_t){.time = time, .value = value};
}

static void set_state(uint64_t time, uint8_t state)
{
    motion_state = state;
    record(&states, time, state);
}

static void set_dir(uint64_t time, bool level)
{
    if (level != p.dir && p.clocked && p.risen)
        p.harm.dir_in_pulse++;
    p.dir = level;
    record(&dirs, time, level);
}

/* -- the interrupt --------------------------------------------------------------------------------------------------- */

static uint32_t counted(const segment_t *s)
{
    return (uint32_t)s->count_high * 256u + (s->count_low ? s->count_low : 256u);
}

static void check_segment(const segment_t *s)
{
    if (s->top + 1u < SHORTEST_PERIOD || (s->match != SEGMENT_SILENT && s->match >= s->top))
        p.harm.bad_segments++;
}

static void load(uint32_t delay)
{
    const segment_t *s = segment_at(step_tail);
    check_segment(s);
    p.loads++;
    p.blocked_until = p.begin + delay;
    if (delay <= p.top) {
        p.next_top = s->top;
        p.next_match = s->match;
    } else {
        step_late = 1;
        p.late_write = true;
        p.late_top = s->top;
        p.late_match = s->match;
    }
    p.to_count = counted(s);
    if (step_flags & SET_DIR)
        set_dir(p.begin + delay, (step_flags & DIR) != 0);
    step_flags = s->flags;
    set_state(p.begin + delay, s->flags & SEGMENT_STATE_MASK);
    step_tail = (uint8_t)(step_tail + SEGMENT_BYTES);
}

static void ring_empty(void)
{
    uint8_t flags = step_flags;
    if (flags & SET_DIR)
        set_dir(p.begin + step_player_load_ticks, (flags & DIR) != 0);
    step_flags = flags & (uint8_t)~SET_DIR;
    uint8_t held = step_hold < HOLD_PERIODS ? step_hold : HOLD_PERIODS;
    if (flags & EARLY && held < HOLD_PERIODS) { /* silence, when what is due has been played */
        step_flags &= (uint8_t)~EARLY;
        p.to_count = (uint16_t)((flags & EARLY) >> SEGMENT_EARLY_SHIFT);
        return;
    }
    if (held) {
        step_hold = (uint8_t)(step_hold - held);
        step_held = (uint8_t)(step_held + held);
        p.to_count = held;
        return;
    }
    p.next_match = SEGMENT_SILENT;
    set_state(p.begin + step_player_load_ticks, 0);
    p.counting = false;
    step_idle = 1;
}

static void interrupt(void)
{
    if (p.waiting) {
        if (--p.waiting == 0) {
            uint64_t behind = p.waits_from > p.begin ? p.waits_from - p.begin : 0;
            load((uint32_t)behind + STEP_PLAYER_WAITED_TICKS);
        }
        return;
    }
    if (--p.to_count)
        return;
    if (step_head == step_tail) {
        ring_empty();
    } else if (step_flags & EARLY) {
        p.waiting = (uint8_t)((step_flags & EARLY) >> SEGMENT_EARLY_SHIFT);
        p.waits_from = p.begin + STEP_PLAYER_WAITS_AFTER;
    } else {
        load(step_player_load_ticks);
    }
}

/* -- the timer ------------------------------------------------------------------------------------------------------- */

static uint64_t period_end(void)
{
    return p.begin + p.top + 1u;
}

static void bottom(void)
{
    p.begin = period_end();
    p.risen = false;
    p.top = p.next_top;
    p.match = p.next_match;
    if (p.late_write) {
        p.late_write = false;
        p.next_top = p.late_top;
        p.next_match = p.late_match;
    }
    if (!p.counting) {
        p.over = true; /* the flag that nobody serves */
        return;
    }
    if (p.held) {
        p.harm.lost_counts += p.over;
        p.over = true;
        return;
    }
    interrupt();
}

static void rise(uint64_t until)
{
    if (p.risen || p.match == SEGMENT_SILENT || p.match >= p.top)
        return;
    uint64_t at = p.begin + p.match + 1u;
    if (at <= until) {
        record_edges(at, 0, 1);
        p.risen = true;
    }
}

/* Passes whole periods that need nothing but counting. */
static void pass_many(uint64_t until)
{
    uint64_t period = p.top + 1u;
    if (p.next_top != p.top || p.next_match != p.match || p.held || (p.over && p.counting) || p.late_write || until < period_end())
        return;
    uint64_t periods = (until - p.begin) / period;
    if (p.counting) {
        if (p.waiting || p.to_count < 2)
            return;
        if (periods > p.to_count - 1)
            periods = p.to_count - 1;
        p.to_count -= (uint32_t)periods;
    } else if (p.match != SEGMENT_SILENT) {
        return;
    }
    if (periods == 0)
        return;
    p.over = p.over || !p.counting;
    if (p.match < p.top) {
        uint64_t skip = p.risen;
        if (periods > skip)
            record_edges(p.begin + skip * period + p.match + 1u, period, periods - skip);
    }
    p.risen = false;
    p.begin += periods * period;
}

static void run_to(uint64_t until)
{
    while (p.clocked) {
        pass_many(until);
        rise(until);
        if (period_end() > until)
            break;
        bottom();
        if (p.waiting && period_end() > until)
            until = period_end(); /* the main loop waits as well */
        if (p.blocked_until > until)
            until = p.blocked_until;
    }
    p.now = until;
}

/* -- what the test does ------------------------------------------------------------------------------------------------ */

void step_player_reset(void)
{
    memset(&p, 0, sizeof p);
    memset(segments, 0, sizeof segments);
    step_head = step_tail = step_flags = step_hold = step_held = step_idle = step_late = motion_state = 0;
    step_player_load_ticks = STEP_PLAYER_LOAD_TICKS;
    seen.count = 0;
    seen.edges = 0;
    seen.high_less_low = 0;
    states.count = 0;
    dirs.count = 0;
}

void step_player_advance_to(uint64_t time)
{
    if (time > p.now)
        run_to(time);
}

void step_player_advance(uint64_t ticks)
{
    run_to(p.now + ticks);
}

bool step_player_to_next_load_or(uint64_t ticks)
{
    unsigned loads = p.loads;
    uint64_t last = ticks < UINT64_MAX - p.now ? p.now + ticks : UINT64_MAX;
    while (p.clocked && p.counting) {
        uint64_t end = period_end();
        if (!p.waiting && p.to_count > 1 && p.next_top == p.top && p.next_match == p.match)
            end = p.begin + (uint64_t)p.to_count * (p.top + 1u);
        if (end > last)
            end = last;
        run_to(end > p.now ? end : p.now);
        if (p.loads != loads || !p.counting || p.now >= last)
            return true;
    }
    return false;
}

bool step_player_to_next_load(void)
{
    return step_player_to_next_load_or(UINT64_MAX);
}

uint64_t step_player_now(void)
{
    return p.now;
}

bool step_player_stopped(void)
{
    return !p.clocked;
}

void step_player_hold_interrupt(bool hold)
{
    p.held = hold;
    if (!hold && p.over && p.counting) {
        p.over = false;
        interrupt();
        run_to(p.blocked_until > p.now ? p.blocked_until : p.now);
    }
}

size_t step_player_runs(void)
{
    return seen.count;
}

const player_run_t *step_player_run(size_t index)
{
    return &seen.runs[index];
}

uint64_t step_player_edges(void)
{
    return seen.edges;
}

uint64_t step_player_edge(uint64_t index)
{
    for (size_t i = 0; i < seen.count; i++) {
        const player_run_t *run = &seen.runs[i];
        if (index < run->count)
            return run->first + index * run->period;
        index -= run->count;
    }
    return UINT64_MAX;
}

uint64_t step_player_interval(uint64_t index)
{
    return step_player_edge(index + 1) - step_player_edge(index);
}

int64_t step_player_position(bool cw_level)
{
    return cw_level ? seen.high_less_low : -seen.high_less_low;
}

size_t step_player_states(void)
{
    return states.count;
}

const player_change_t *step_player_state(size_t index)
{
    return &states.changes[index];
}

size_t step_player_dirs(void)
{
    return dirs.count;
}

const player_change_t *step_player_dir(size_t index)
{
    return &dirs.changes[index];
}

bool step_player_dir_level(void)
{
    return p.dir;
}

const player_harm_t *step_player_harm(void)
{
    return &p.harm;
}

/* -- motion/step_port.h -------------------------------------------------------------------------------------------------- */

static void stop_clock(void)
{
    p.ready = false;
    p.clocked = false;
}

void step_port_init(void)
{
    stop_clock();
    p.counting = false;
}

void step_port_microsteps(uint8_t pins)
{
    (void)pins;
}

void step_port_clock(bool external)
{
    (void)external;
}

void step_port_hurry(void)
{
}

uint8_t step_port_hurries(void)
{
    return 0;
}

void step_port_dir(bool level)
{
    set_dir(p.now, level);
}

void step_port_hold(void)
{
    if (p.clocked && p.risen)
        p.harm.cut_pulses++;
    uint8_t first = step_tail;
    const segment_t *s = segment_at(first);
    segment_t *lead = &segments[(uint8_t)(first - SEGMENT_BYTES) / SEGMENT_BYTES];
    lead->top = STEP_PORT_LEAD_TICKS - 1;
    lead->match = SEGMENT_SILENT;
    lead->flags = 0;
    check_segment(s);
    p.begin = p.now - LEAD_BEGIN;
    p.top = STEP_PORT_LEAD_TICKS + LEAD_BEGIN - 1;
    p.match = SEGMENT_SILENT;
    p.risen = false;
    p.next_top = s->top;
    p.next_match = s->match;
    p.late_write = false;
    p.waiting = 0;
    p.over = false;
    p.to_count = counted(s);
    step_flags = s->flags;
    set_state(p.now, s->flags & SEGMENT_STATE_MASK);
    step_tail = (uint8_t)(first + SEGMENT_BYTES);
    step_idle = 0;
    p.counting = true;
    p.clocked = false;
    p.ready = true;
}

void step_port_release(void)
{
    if (p.ready) {
        p.begin = p.now - LEAD_BEGIN;
        p.clocked = true;
        p.ready = false;
    }
}

bool step_port_held(void)
{
    return p.ready;
}

void step_port_start(void)
{
    step_port_hold();
    step_port_release();
}

void step_port_halt(void)
{
    if (!p.counting) {
        if (p.clocked && p.risen)
            p.harm.cut_pulses++;
        stop_clock();
        return;
    }
    if (p.ready) {
        stop_clock();
        p.counting = false;
        return;
    }
    for (;;) {
        uint64_t count = p.now - p.begin;
        if (p.match == SEGMENT_SILENT || count + FREEZE_TICKS < p.match)
            break;
        bool freeze = p.top < SEGMENT_EARLY1_BELOW_TICKS && !p.waiting;
        if (freeze) {
            rise(period_end());
            p.begin = p.now = period_end();
            p.risen = false;
            p.over = true;
            break;
        }
        run_to(period_end());
        if (!p.counting)
            break; /* it was the last */
    }
    p.counting = false;
    stop_clock();
}

step_snapshot_t step_port_snapshot(void)
{
    step_snapshot_t at = {
        .tail = step_tail,
        .to_count = (uint16_t)(p.to_count ? p.to_count : 256u),
        .pulse_high = p.risen,
        .period_over = p.over,
    };
    return at;
}

uint16_t step_port_counter(void)
{
    return (uint16_t)(p.now - p.begin);
}

/* In the ring, not loaded: 1. Loaded: 0. Gone: -1. */
static int whereabouts(uint8_t after)
{
    uint8_t distance = (uint8_t)(after - step_tail);
    if (distance == 0)
        return 0;
    return distance <= (uint8_t)(step_head - step_tail) ? 1 : -1;
}

void step_port_finish(void)
{
    while (p.clocked && !(step_idle && p.over))
        run_to(period_end());
}

bool step_port_arm(uint8_t offset, uint16_t top, uint16_t match, uint8_t flags)
{
    segment_t *s = &segments[offset / SEGMENT_BYTES];
    uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
    uint16_t before_top = segment_at((uint8_t)(offset - SEGMENT_BYTES))->top;
    uint16_t too_late = before_top > 64 ? (uint16_t)(before_top - 64) : 0;
    int where = whereabouts(after);
    if (where == 0) {
        if (p.to_count != 1 || p.over || !p.clocked || p.now - p.begin >= too_late)
            return false;
        p.next_top = top;
        p.next_match = match;
        step_flags = flags;
    } else if (where < 0) {
        return false;
    }
    step_head = after;
    s->top = top;
    s->match = match;
    s->flags = flags;
    return true;
}

static void set_count(segment_t *s, uint32_t periods)
{
    s->count_low = (uint8_t)periods;
    s->count_high = (uint8_t)((periods - 1) >> 8);
}

bool step_port_extend(uint8_t offset)
{
    segment_t *s = &segments[offset / SEGMENT_BYTES];
    uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
    int where = whereabouts(after);
    if (where == 0) {
        uint8_t low = (uint8_t)p.to_count;
        if (low < 16 || low == 255)
            return false;
        p.to_count++;
    } else if (where < 0) {
        return false;
    }
    step_head = after;
    set_count(s, counted(s) + 1u);
    return true;
}

uint16_t step_port_shorten(uint8_t offset, uint16_t periods)
{
    segment_t *s = &segments[offset / SEGMENT_BYTES];
    uint32_t dropped = 0;
    step_head = (uint8_t)(offset + SEGMENT_BYTES);
    if (step_tail != step_head) {
        dropped = counted(s) - periods;
        set_count(s, periods);
    } else if (p.to_count > periods) {
        dropped = p.to_count - periods;
        set_count(s, counted(s) - dropped);
        p.to_count = periods;
    }
    return (uint16_t)dropped;
}

bool estop_port_active(void)
{
    return false;
}

void engine_on_start(void) {}
