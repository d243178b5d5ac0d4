/* See engine.h; why it is built this way: docs/design.md. */
#include "motion/engine.h"
#include "base/atomic.h"
#include "base/inline.h"
#include "motion/block.h"
#include "motion/profile.h"
#include "motion/ramp.h"
#include "motion/segment.h"
#include "motion/step_port.h"
#include "settings.h"

#define TICKS_PER_US 16u
#define PROFILE_CHUNK_US_LOG2 (PROFILE_CHUNK_LOG2 - 4)
#define PROFILE_CHUNK_US (1u << PROFILE_CHUNK_US_LOG2)
#define DIR_SETUP_TICKS 80u      /* dir before the first pulse: 5 us, the slowest common drivers ask for it */
#define TURN_TICKS (DIR_SETUP_TICKS + 100u) /* the same where the step interrupt sets dir: its latency and cycles */
#define TAIL_TICKS 320u          /* the end of the closing interval, on which a following command is joined */
#define SHORTEST_PIECE_TICKS 128u
#define RUN_MAX_PERIODS 65000u
#define AHEAD_TICKS 24576u       /* silence begun before a profile with ramps is planned: 1.5 ms */
#define AHEAD_LONG_TICKS 49152u  /* twice that, where possible */
#define AHEAD_SHORT_TICKS 12000u /* and one without ramps */
#define AHEAD_PERIODS 12u        /* they last; when the last one begins, the next segment must be there */
#define CUT_KEEP_TICKS 49152u    /* motion left to run while a deceleration is planned */
#define CRUISE_GROUP_TICKS 4096u /* shortest run of a cruise whose interval has a fraction */
#define JOIN_TICKS 18000u         /* before the tail: to plan a command and emit its first intervals */
#define JOIN_LINEAR_TICKS 40000u  /* the same for a linear one */
#define JOIN_FLAT_TICKS 2500u     /* and for one without ramps */
#define JOIN_SOON_TICKS 160000u   /* before the tail: when that is done at the earliest */
#define START_TICKS 12000u       /* in the ring before the timer runs */
#define START_PERIODS 4u         /* and at least so many: a segment is loaded when the one before it begins */
#define RING_REFILL 12u          /* free segments for a block to be gone on with */
#define RING_RESERVE 4u          /* segments that one step of emission may need */

/* What comes next of the command being emitted. */
typedef enum {
    STAGE_REST, /* nothing: all of it is in the ring or played */
    STAGE_LEAD, /* start wait and first pulse */
    STAGE_RUN,  /* the intervals between its pulses */
    STAGE_TAIL, /* the end of its closing interval */
    STAGE_GAP,  /* the interval in which the velocity stays in play */
    STAGE_END,
} stage_t;

typedef struct {
    uint16_t width_ticks; /* of a pulse */
    bool next_taken;
    bool playing; /* the timer runs (it may play silence) */
    stage_t stage;
    motion_state_t ramp_state; /* the phase being emitted, that `ramp` was begun for; MOTION_STANDBY: none */
    uint32_t *phase_left;      /* its pulses, in `profile` */

    uint32_t silence_chunks; /* still to be emitted before ... */
    uint16_t piece_ticks;    /* ... this period; 0: none */
    bool piece_pulse;
    uint16_t owed;        /* held pulses still to be left out */
    int32_t carry_q16;    /* 1/65536 ticks rounded off so far */
    uint16_t ahead_ticks; /* part of the next interval that has been emitted as silence */
    bool dir_due;         /* the next single period sets the dir pin */

    uint32_t closing_chunks; /* closing interval of the last command emitted: so many PROFILE_CHUNK_TICKS ... */
    uint16_t closing_ticks;  /* ... and these */
    uint16_t tail_ticks;     /* its end */
    bool tail_fast;          /* too fast for a tail: a following command lengthens the last run instead */
    uint8_t tail_offset;     /* the tail's segment, while stage is REST, GAP or END */
    bool tail_awaited;       /* it has not begun: its command has not ended, and another one can be joined to it */
    bool joined;             /* the ring holds the end of one command and the beginning of the next one ... */
    uint8_t joined_offset;   /* ... which begins at the end of this segment */

    int32_t emitted; /* position, in pulses, when all that is in the ring has been played */
    uint32_t v_in_play;
    uint32_t in_play_cycle_us; /* 0: follows from v_in_play */
    uint8_t ended;
    uint8_t faults;
    bool gap_off;
    bool single; /* the ring plays single pulses */
} engine_t;

static engine_t engine;
static profile_basis_t basis;
static uint32_t certain_centi;   /* steepest linear ramp whose first interval is longer than AHEAD_LONG_TICKS */
static motion_command_t command; /* being emitted or played */
static motion_command_t next;    /* taken, not begun */
static profile_t profile;        /* what is left of the command to be emitted */
static ramp_t ramp;
static block_t block; /* of the phase being emitted, while it has runs left */

#define HERE HIDDEN(&engine)

static bool dir_level(bool ccw)
{
    return ccw != (settings.cw_level != 0);
}

static bool is_ccw(const motion_command_t *c)
{
    return (c->flags & MOTION_CCW) != 0;
}

/* Segment flags of a command's pulses, and with `turn` those that set the dir pin. */
static uint8_t direction_flags(const motion_command_t *c, bool turn)
{
    uint8_t flags = is_ccw(c) ? 1 << SEGMENT_CCW_BIT : 0;
    if (turn) {
        flags |= 1 << SEGMENT_SET_DIR_BIT;
        if (dir_level(is_ccw(c)))
            flags |= 1 << SEGMENT_DIR_BIT;
    }
    return flags;
}

void engine_init(void)
{
    engine_t *e = &engine;
    profile_basis(&basis, settings.steps_per_rev, settings.ustep, settings.slow_rpm);
    e->v_in_play = basis.v_slow;
    certain_centi = (130000000u >> basis.factor_log2) / basis.steps_per_rev;
    e->width_ticks = (uint16_t)settings.pulse_us * TICKS_PER_US;
    step_port_init();
}

/* -- the ring -------------------------------------------------------------------------------------------------- */

/* So many periods before its end such a segment's reload is begun. */
static NOINLINE uint8_t early_periods(const segment_t *s)
{
    return (uint8_t)((s->flags & SEGMENT_EARLY_MASK) >> SEGMENT_EARLY_SHIFT);
}

/* The same for periods of top + 1 ticks. */
static NOINLINE uint8_t early_of(uint16_t top)
{
    return (uint8_t)((top < SEGMENT_EARLY1_BELOW_TICKS - 1) + (top < SEGMENT_EARLY2_BELOW_TICKS - 1) +
                     (top < SEGMENT_EARLY3_BELOW_TICKS - 1));
}

/* Periods that the interrupt counts: those waited for early are not among them. */
static uint16_t counted_periods(const segment_t *s)
{
    return (uint16_t)((uint16_t)(s->count_high << 8 | (uint8_t)(s->count_low - 1)) + 1);
}

/* Of so many of its periods. */
static NOINLINE uint32_t ticks_of(const segment_t *s, uint16_t periods)
{
    return (uint32_t)s->top * periods + periods;
}

static bool is_silent(const segment_t *s)
{
    return s->match == SEGMENT_SILENT;
}

static uint8_t ring_free(void)
{
    /* One slot stays empty; the loaded segment and the one before it are still needed for the position. */
    uint8_t used = (uint8_t)(step_head - step_tail) / SEGMENT_BYTES;
    return (uint8_t)(SEGMENT_COUNT - 3u - used);
}

/* Pulses of the running command that are not in the ring yet, its closing interval apart. */
static uint32_t profile_pulses_left(void)
{
    return profile.accel_pulses + profile.cruise_pulses + profile.decel_pulses;
}

/* Those of them that come after the next `planned` ones and may be repeated if the ring runs empty. */
static NOINLINE uint8_t pulses_to_come(uint16_t planned)
{
    uint32_t left = profile_pulses_left();
    if (left <= planned)
        return 0;
    left -= planned;
    return left > 255 ? 254 : (uint8_t)(left - 1);
}

static void add_pulses(uint8_t flags, uint16_t pulses)
{
    engine_t *e = HERE;
    if (flags & (1 << SEGMENT_CCW_BIT))
        e->emitted -= pulses;
    else
        e->emitted += pulses;
}

/* Is the one-period segment at `offset` being played, or over? (It is loaded one period before it begins, and what comes
 * after it when it begins.) */
static bool has_begun(uint8_t offset)
{
    return step_idle || (uint8_t)(step_head - offset) > (uint8_t)(step_head - step_tail + SEGMENT_BYTES);
}

/* The command whose closing interval has begun its tail has ended. */
static void look_for_end(void)
{
    engine_t *e = HERE;
    if (e->joined && has_begun(e->joined_offset))
        e->joined = false;
    if (e->tail_awaited && has_begun(e->tail_offset)) {
        e->tail_awaited = false;
        e->ended++;
    }
}

static NOINLINE uint8_t give(uint32_t *phase, uint8_t pulses)
{
    uint8_t some = *phase < pulses ? (uint8_t)*phase : pulses;
    *phase -= some;
    return (uint8_t)(pulses - some);
}

/* The interrupt has repeated the last interval because the ring was empty: so many pulses fewer are to be made. */
static void absorb_held(void)
{
    engine_t *e = HERE;
    uint8_t lock = atomic_begin();
    uint8_t held = step_held;
    step_held = 0;
    atomic_end(lock);
    e->faults |= ENGINE_FAULT_STARVED;
    add_pulses(step_flags, held);
    /* The cruise becomes shorter, or, where there is none, the ramps; the closing interval stays. */
    uint32_t left = profile_pulses_left();
    uint8_t given = left > held ? held : left ? (uint8_t)(left - 1) : 0;
    e->owed = (uint16_t)(e->owed + held - given);
    give(&profile.decel_pulses, give(&profile.accel_pulses, give(&profile.cruise_pulses, given)));
}

/* So many pulses may be repeated from now on if the ring runs empty. */
static void allow_hold(uint8_t pulses)
{
    uint8_t lock = atomic_begin();
    step_hold = pulses > step_held ? (uint8_t)(pulses - step_held) : 0; /* those held meanwhile will be given back */
    atomic_end(lock);
}

/* Before segments are appended: takes account of what has been played. True if held pulses were among it. */
static NOINLINE bool settle(uint8_t hold)
{
    look_for_end();
    allow_hold(hold); /* first, so that what is held from here on can be given back */
    if (step_held == 0)
        return false;
    absorb_held();
    return true;
}

/* Appends so many periods of the phase, of so many ticks (0: 65,536). Runs too short to be reloaded in time (periods that
 * need an early reload, no more of them than are waited for) are stretched: their count stays exact. */
static void push(uint16_t periods, uint16_t ticks, bool pulse)
{
    engine_t *e = HERE;
    segment_t *s = segment_at(step_head);
    bool turn = e->dir_due && periods == 1;
    uint8_t flags = (uint8_t)(e->ramp_state | direction_flags(&command, turn));
    e->dir_due = e->dir_due && !turn;
    settle(pulse ? pulses_to_come(0) : 0);
    if (pulse) {
        uint16_t given = e->owed < periods ? e->owed : periods;
        e->owed = (uint16_t)(e->owed - given);
        periods = (uint16_t)(periods - given);
        add_pulses(flags, periods);
    }
    if (periods == 0)
        return;
    uint16_t top = (uint16_t)(ticks - 1);
    uint8_t early = early_of(top);
    if (periods > early) {
        flags = (uint8_t)(flags | early << SEGMENT_EARLY_SHIFT);
        periods = (uint16_t)(periods - early);
    } else {
        top = SEGMENT_EARLY1_BELOW_TICKS - 1;
    }
    s->top = top;
    s->match = pulse ? (uint16_t)(top - e->width_ticks) : SEGMENT_SILENT;
    s->count_low = (uint8_t)periods;
    s->count_high = (uint8_t)((uint16_t)(periods - 1) >> 8);
    s->flags = flags;
    step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

/* The interval that ends with the pulse of the segment at `offset`: its period and the silence before it. */
static uint32_t interval_at(uint8_t offset)
{
    const segment_t *before = segment_at((uint8_t)(offset - SEGMENT_BYTES));
    uint32_t ticks = is_silent(before) ? ticks_of(before, counted_periods(before)) : 0;
    return ticks + ticks_of(segment_at(offset), 1);
}

/* Ticks from the segment at `offset`, which has so many periods left, to the one at `end`, or more than
 * JOIN_SOON_TICKS. */
static uint32_t ticks_between(uint8_t offset, uint16_t periods, uint8_t end)
{
    uint32_t ticks = 0;
    while (offset != end && ticks <= JOIN_SOON_TICKS) {
        ticks += ticks_of(segment_at(offset), periods);
        offset = (uint8_t)(offset + SEGMENT_BYTES);
        periods = counted_periods(segment_at(offset));
    }
    return ticks;
}

static int32_t signed_pulses(const segment_t *s, uint16_t pulses)
{
    if (is_silent(s))
        return 0;
    return s->flags & (1 << SEGMENT_CCW_BIT) ? -(int32_t)pulses : (int32_t)pulses;
}

/* Pulses in the segments from `offset` on, clockwise positive. */
static int32_t pulses_from(uint8_t offset)
{
    int32_t pulses = 0;
    while (offset != step_head) {
        const segment_t *s = segment_at(offset);
        pulses += signed_pulses(s, (uint16_t)(counted_periods(s) + early_periods(s)));
        offset = (uint8_t)(offset + SEGMENT_BYTES);
    }
    return pulses;
}

int32_t engine_position(void)
{
    engine_t *e = HERE;
    if (!e->playing)
        return e->emitted;
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded_offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    const segment_t *loaded = segment_at(loaded_offset);
    const segment_t *running = loaded;
    uint16_t counted = counted_periods(loaded);
    if (at.to_count == counted)
        running = segment_at((uint8_t)(loaded_offset - SEGMENT_BYTES));
    int32_t to_come = pulses_from(at.tail);
    if (!step_idle)
        to_come += signed_pulses(loaded, (uint16_t)(at.to_count + early_periods(loaded)));
    if (!at.pulse_high && !at.period_over && !step_idle)
        to_come += signed_pulses(running, 1);
    return e->emitted - to_come;
}

/* -- emission -------------------------------------------------------------------------------------------------- */

/* Sets up an interval of so many chunks and ticks (which may be negative) that ends with a pulse (or not); emit() turns it
 * into segments. */
static void set_interval(uint32_t chunks, int32_t ticks, bool pulse)
{
    engine_t *e = HERE;
    ticks -= e->ahead_ticks;
    e->ahead_ticks = 0;
    chunks += (uint32_t)(ticks >> PROFILE_CHUNK_LOG2);
    uint16_t piece = (uint16_t)((uint16_t)ticks % PROFILE_CHUNK_TICKS);
    /* No piece too short, and what fits a period is one. */
    while (chunks && (piece < SHORTEST_PIECE_TICKS || (chunks == 1 && piece < PROFILE_CHUNK_TICKS))) {
        piece = (uint16_t)(piece + PROFILE_CHUNK_TICKS);
        chunks--;
    }
    e->silence_chunks = chunks;
    e->piece_ticks = piece;
    e->piece_pulse = pulse;
}

/* Adds the carried fraction to a time; what remains is carried on. */
static NOINLINE uint32_t take_carry(uint32_t ticks, uint16_t frac_q16)
{
    engine_t *e = HERE;
    int32_t carry = e->carry_q16 + frac_q16;
    e->carry_q16 = carry & 0xFFFF;
    return (uint32_t)((int32_t)ticks + (carry >> 16));
}

/* push() without its cases: pulses of at least SEGMENT_EARLY1_BELOW_TICKS, many more to come. */
static NOINLINE void append(uint16_t periods, uint16_t top, uint16_t width, uint8_t flags)
{
    segment_t *s = segment_at(step_head);
    s->top = top;
    s->match = (uint16_t)(top - width);
    s->count_low = (uint8_t)periods;
    s->count_high = 0;
    s->flags = flags;
    step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

/* One pulse. */
static void append_pulse(uint16_t ticks, uint8_t flags)
{
    engine_t *e = HERE;
    append(1, (uint16_t)(ticks - 1), e->width_ticks, flags);
    add_pulses(flags, 1);
}

static void append_silence(uint16_t periods, uint16_t top, uint8_t flags)
{
    append(periods, top, (uint16_t)(top - SEGMENT_SILENT), flags);
}

static NOINLINE void begin_ramp(motion_state_t state)
{
    engine_t *e = HERE;
    if (e->ramp_state == state)
        return;
    e->ramp_state = state;
    if (state == MOTION_ACCEL)
        profile_begin_accel(&profile, &basis, &ramp);
    else
        profile_begin_decel(&profile, &basis, &ramp);
}

/* Does the phase have its longer intervals first? */
static NOINLINE bool speeds_up(void)
{
    engine_t *e = &engine;
    return e->ramp_state == MOTION_ACCEL && profile.faster;
}

/* `pulses` intervals of the phase that last `ticks` together: of two neighbouring values. Too few of either kind for an
 * early reload are made like the others, and the difference is carried. */
static void emit_flat(uint16_t pulses, uint32_t ticks)
{
    engine_t *e = &engine;
    if (pulses == 1) {
        if (ticks > 65535u || e->ahead_ticks)
            set_interval(0, (int32_t)ticks, true);
        else
            push(1, (uint16_t)ticks, true);
        return;
    }
    uint16_t each = (uint16_t)(ticks / pulses);
    uint16_t longer = (uint16_t)((uint16_t)ticks - each * pulses);
    uint16_t ideal = longer;
    uint8_t early = early_of((uint16_t)(each - 1));
    if (longer <= early)
        longer = 0;
    else if (pulses - longer <= early)
        longer = pulses;
    e->carry_q16 += (int32_t)(int16_t)(ideal - longer) * 65536;
    bool first = e->ramp_state == MOTION_CRUISE || speeds_up();
    if (first && longer)
        push(longer, (uint16_t)(each + 1), true);
    if (pulses != longer)
        push((uint16_t)(pulses - longer), each, true);
    if (!first && longer)
        push(longer, (uint16_t)(each + 1), true);
}

/* The phase's pulses that may be emitted: the last one of all has the closing interval. */
static NOINLINE uint32_t pulses_of_phase(void)
{
    engine_t *e = &engine;
    uint32_t most = profile_pulses_left() - 1;
    return *e->phase_left < most ? *e->phase_left : most;
}

/* Appends what the ring has room for of the block. */
static void emit_block(void)
{
    engine_t *e = HERE;
    uint8_t pulses = block.pulses;
    uint8_t runs = block.runs;
    uint16_t planned = (uint16_t)(runs * pulses);
    if (settle(pulses_to_come(planned))) {
        uint32_t most = pulses_of_phase();
        if (most < planned) /* held pulses have been taken from it */
            block.runs = runs = (uint8_t)((uint16_t)most / pulses);
    }
    block_append(&block);
    uint16_t made = (uint16_t)((uint8_t)(runs - block.runs) * pulses);
    *e->phase_left -= made;
    add_pulses(block.flags, made);
    if (block.runs == 0)
        e->carry_q16 += (int32_t)(block.shape & BLOCK_SPLIT ? block.carry_q16 : (uint32_t)block.carry_q16 * pulses);
}

/* What the block's runs do not say: the ticks carried so far, their segments' flags. */
static void begin_block(void)
{
    engine_t *e = HERE;
    bool split = block.top_q16 >> 16 >= BLOCK_SPLIT_TICKS - 1;
    block.shape = (uint8_t)((speeds_up() ? BLOCK_FASTER : 0) | (split ? BLOCK_SPLIT : 0));
    uint32_t carry = 0;
    if (e->carry_q16 > 0) { /* otherwise it waits for a single interval */
        carry = (uint32_t)e->carry_q16;
        e->carry_q16 = 0;
        if (!split || carry > UINT16_MAX) {
            carry /= block.pulses; /* of each interval */
            if (split || carry > UINT16_MAX) { /* left by runs of more pulses */
                block.top_q16 += carry / block.runs;
                carry = 0;
            }
        }
    }
    block.carry_q16 = (uint16_t)carry;
    block.width_ticks = e->width_ticks;
    block.flags = (uint8_t)(e->ramp_state | direction_flags(&command, false));
}

/* The next intervals of the ramp of `ramp_state`: pulses all alike, a block, or some of the former before a block. */
static void emit_ramp(uint32_t at_most)
{
    engine_t *e = &engine;
    if (e->ahead_ticks || e->dir_due || e->owed)
        at_most = 1;
    uint32_t ticks = 0;
    uint8_t pulses = 0;
    do {
        ramp_time_t sum;
        uint16_t group = ramp_next(&ramp, &basis.ramp, at_most, &sum, &block);
        if (block.runs) {
            begin_block();
            break;
        }
        ticks += take_carry(sum.ticks, sum.frac_q16);
        pulses = (uint8_t)(pulses + group);
        at_most -= group;
    } while (ramp.rest && at_most);
    *e->phase_left -= pulses;
    if (pulses)
        emit_flat(pulses, ticks);
}

static void emit_cruise(uint32_t at_most)
{
    engine_t *e = &engine;
    const profile_interval_t *interval = &profile.cruise;
    uint32_t ticks = interval->ticks_q8 >> 8;
    uint8_t frac = (uint8_t)interval->ticks_q8;
    uint32_t chunks = interval->chunks;
    if (chunks == 1 && ticks < PROFILE_CHUNK_TICKS - 1) {
        ticks += PROFILE_CHUNK_TICKS;
        chunks = 0;
    }
    if (chunks || e->ahead_ticks) {
        (*e->phase_left)--;
        set_interval(chunks, (int32_t)take_carry(ticks, (uint16_t)(frac << 8)), true);
        return;
    }
    uint16_t run = at_most > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)at_most;
    if (frac == 0 || run < 8) {
        *e->phase_left -= run;
        uint32_t fraction = (uint32_t)frac * run;
        emit_flat(run, take_carry(ticks * run + (fraction >> 8), (uint16_t)(fraction << 8)));
        return;
    }
    /* Runs of two neighbouring values. */
    uint8_t pulses = 8;
    run /= 8;
    for (uint16_t least = CRUISE_GROUP_TICKS / 8; pulses < 128 && ticks < least && run > 1; least /= 2) {
        pulses = (uint8_t)(pulses * 2);
        run /= 2;
    }
    block.runs = (uint8_t)(run > 255u ? 255u : run);
    block.pulses = pulses;
    block.top_q16 = ((ticks - 1) << 16) | (uint32_t)frac << 8;
    block.slope_q16 = 0;
    block.curve_q16 = 0;
    begin_block();
}

/* The interval after the last pulse of the command, which is of this phase: body, then tail. */
static void begin_closing(void)
{
    engine_t *e = HERE;
    profile_t *p = &profile;
    ramp_time_t last;
    uint32_t chunks = 0;
    if (e->ramp_state == MOTION_CRUISE) {
        chunks = p->cruise.chunks;
        last.ticks = p->cruise.ticks_q8 >> 8;
        last.frac_q16 = (uint16_t)(p->cruise.ticks_q8 << 8);
    } else {
        (void)ramp_next(&ramp, &basis.ramp, 1, &last, &block);
    }
    uint32_t ticks = take_carry(last.ticks, last.frac_q16);
    chunks += ticks >> PROFILE_CHUNK_LOG2;
    ticks &= PROFILE_CHUNK_TICKS - 1;
    *e->phase_left = 0;
    e->closing_chunks = chunks;
    e->closing_ticks = (uint16_t)ticks;
    e->tail_ticks = TAIL_TICKS;
    if (chunks || ticks >= 2 * TAIL_TICKS)
        set_interval(chunks, (int32_t)(ticks - TAIL_TICKS), false);
    else
        e->tail_ticks = (uint16_t)ticks;
    e->tail_fast = e->tail_ticks < SEGMENT_EARLY1_BELOW_TICKS;
    if (e->tail_fast)
        e->tail_ticks = SHORTEST_PIECE_TICKS;
    e->stage = STAGE_TAIL;
}

static void push_tail(void)
{
    engine_t *e = HERE;
    e->tail_offset = step_head;
    e->ramp_state = MOTION_STOP;
    push(1, e->tail_ticks, false);
    e->tail_awaited = true;
}

/* What comes next, but for a block, which is only begun. False if there is nothing. */
static bool emit_other(void)
{
    engine_t *e = HERE;
    if (e->silence_chunks) {
        uint16_t periods = e->silence_chunks > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)e->silence_chunks;
        e->silence_chunks -= periods;
        push(periods, PROFILE_CHUNK_TICKS, false);
        return true;
    }
    if (e->piece_ticks) {
        uint16_t ticks = e->piece_ticks;
        e->piece_ticks = 0;
        push(1, ticks, e->piece_pulse);
        return true;
    }
    profile_t *p = &profile;
    switch (e->stage) {
    case STAGE_REST:
        return false;
    case STAGE_LEAD: {
        /* The start wait, then the first pulse. */
        uint32_t us = command.start_wait_us;
        e->ramp_state = MOTION_STANDBY;
        set_interval(us >> PROFILE_CHUNK_US_LOG2, (int32_t)((uint16_t)us % PROFILE_CHUNK_US * TICKS_PER_US), true);
        e->stage = STAGE_RUN;
        break;
    }
    case STAGE_RUN: {
        motion_state_t state = MOTION_ACCEL;
        uint32_t *left = &p->accel_pulses;
        while (*left == 0 && state != MOTION_DECEL) {
            left++; /* cruise, deceleration */
            state++;
        }
        e->phase_left = left;
        uint32_t at_most = pulses_of_phase();
        if (state == MOTION_CRUISE)
            e->ramp_state = MOTION_CRUISE;
        else
            begin_ramp(state);
        if (at_most == 0)
            begin_closing();
        else if (state == MOTION_CRUISE)
            emit_cruise(at_most);
        else
            emit_ramp(at_most);
        break;
    }
    case STAGE_TAIL:
        push_tail();
        e->v_in_play = p->v_exit;
        e->in_play_cycle_us = p->exit_cycle_us;
        e->stage = STAGE_GAP;
        break;
    case STAGE_GAP:
        if (e->next_taken)
            return false; /* it will be joined */
        e->ramp_state = MOTION_STANDBY;
        if (!e->gap_off)
            set_interval(e->closing_chunks, e->tail_fast ? e->tail_ticks : e->closing_ticks, false);
        e->stage = STAGE_END;
        break;
    case STAGE_END:
        push(1, SHORTEST_PIECE_TICKS, false);
        e->stage = STAGE_REST;
        break;
    }
    return true;
}

/* One step of emission; false if there is nothing to emit. The ring has room for RING_RESERVE segments. */
static bool emit(void)
{
    if (block.runs == 0) {
        bool more = emit_other();
        if (block.runs == 0)
            return more;
    }
    emit_block();
    return true;
}

/* Nothing of the command is to be emitted any more, or joined to. */
static void drop_emission(void)
{
    engine_t *e = HERE;
    e->silence_chunks = 0;
    e->piece_ticks = 0;
    block.runs = 0;
    e->ahead_ticks = 0;
    e->ramp_state = MOTION_STANDBY;
    e->tail_awaited = false;
}

/* -- starting and joining ----------------------------------------------------------------------------------------- */

static void begin_ring(void)
{
    engine_t *e = &engine;
    if (e->playing)
        step_port_halt();
    e->playing = false;
    step_head = step_tail = 0;
    step_hold = 0;
    step_held = 0;
    step_idle = 0;
    e->owed = 0;
    e->carry_q16 = 0;
    e->dir_due = false;
    e->joined = false;
    e->single = false;
    drop_emission();
}

static void forget_velocity(void)
{
    engine_t *e = HERE;
    e->v_in_play = basis.v_slow;
    e->in_play_cycle_us = 0;
}

/* Is the velocity in play kept until now? */
static void expire_gap(void)
{
    engine_t *e = &engine;
    if (!e->gap_off)
        forget_velocity();
}

static void plan(void)
{
    engine_t *e = HERE;
    profile_plan(&profile, &basis, &command, e->v_in_play);
}

static NOINLINE void play(void)
{
    engine_t *e = &engine;
    e->playing = true;
    step_port_start();
}

/* The first interval of most profiles is long, whatever the rest turns out to be: then the first pulse need not wait for
 * the planning. Returns how much of that interval may certainly be begun, from few operations; 0: plan first. */
static uint16_t certain_ticks(void)
{
    engine_t *e = HERE;
    if (e->v_in_play != basis.v_slow)
        return 0;
    if (command.accel == ACCEL_NONE) { /* the cruise interval, or that of the deceleration */
        uint16_t flat = command.decel == ACCEL_NONE ? AHEAD_SHORT_TICKS : AHEAD_LONG_TICKS;
        return command.flags & MOTION_CYCLE && command.velocity >> basis.factor_log2 >= flat / 8 ? flat : 0;
    }
    if (basis.slow_ticks < AHEAD_TICKS + SHORTEST_PIECE_TICKS)
        return 0;
    uint16_t least_rpm;
    uint16_t ahead = AHEAD_TICKS;
    uint32_t accel = accel_centi(command.accel);
    if (!(command.flags & MOTION_LINEAR)) {
        /* At least one step of acceleration, at slow speed. */
        least_rpm = (uint16_t)(settings.slow_rpm + 2u + (uint16_t)(accel >> 6));
        if (basis.slow_ticks >= AHEAD_LONG_TICKS + SHORTEST_PIECE_TICKS)
            ahead = AHEAD_LONG_TICKS;
    } else {
        /* c0 = sqrt(3.217e17 / (sprf * F * centi)) ticks is long enough; at least one step from 100 RPM on with 200 steps
         * and more, and no less of acceleration than of deceleration in a truncated profile. */
        least_rpm = basis.steps_per_rev >= 200 && accel <= certain_centi && command.accel <= command.decel ? 100 : 65535;
        ahead = AHEAD_LONG_TICKS;
    }
    uint32_t velocity = command.velocity;
    bool fast = command.flags & MOTION_CYCLE ? velocity < 65536u && velocity * least_rpm <= basis.us_rpm
                                             : velocity >= least_rpm;
    return fast ? ahead : 0;
}

/* Emits enough to be played until the next round of the main loop, and where a ramp begins steeply, before the timer
 * runs, until the intervals that are slow to plan, one by one, are over. */
static void fill(void)
{
    engine_t *e = HERE;
    uint32_t ticks = 0;
    uint16_t periods = 0;
    uint8_t offset = step_head;
    while ((ticks < START_TICKS || periods < START_PERIODS ||
            (!e->playing && (e->ramp_state == MOTION_ACCEL || e->ramp_state == MOTION_DECEL) &&
             (ramp.steep > 1 || ramp.group_log2 == 0))) &&
           ring_free() >= RING_RESERVE && emit()) {
        uint16_t first = counted_periods(segment_at(offset));
        ticks += ticks_between(offset, first, step_head);
        periods = (uint16_t)(first + (uint8_t)(step_head - offset) / SEGMENT_BYTES); /* at least */
        offset = step_head;
    }
}

/* Without ramps a command is all cruise: it need not be planned either, if its interval is of whole ticks and the pulses
 * last for long enough. Emits them and returns how many; 0: plan first. */
static uint16_t begin_cruise(void)
{
    engine_t *e = HERE;
    uint8_t factor_log2 = basis.factor_log2;
    if (command.accel != ACCEL_NONE || command.decel != ACCEL_NONE)
        return 0;
    uint32_t cycle_us = profile_cycle_us(&basis, &command);
    uint16_t ticks = (uint16_t)(cycle_us * TICKS_PER_US);
    if (cycle_us > UINT16_MAX / TICKS_PER_US || ticks & ((1u << factor_log2) - 1))
        return 0;
    ticks = (uint16_t)(ticks >> factor_log2);
    uint32_t pulses = command.count - 1; /* at least: full steps have more */
    uint16_t run = pulses > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)pulses;
    if ((uint32_t)run * ticks < START_TICKS)
        return 0;
    profile.accel_pulses = profile.cruise_pulses = profile.decel_pulses = 0;
    e->ramp_state = MOTION_CRUISE;
    push(run, ticks, true);
    play();
    return run;
}

/* Starts a command, which is not planned yet, from standstill. */
static void start(const motion_command_t *c)
{
    engine_t *e = &engine;
    begin_ring();
    command = *c;
    e->next_taken = false;
    step_port_dir(dir_level(is_ccw(&command)));
    uint8_t flags = direction_flags(&command, false);
    uint16_t cruised = 0;
    e->stage = STAGE_LEAD;
    if (command.start_wait_us < 4096u) {
        uint16_t lead = (uint16_t)(command.start_wait_us * TICKS_PER_US);
        uint16_t least = (uint16_t)(DIR_SETUP_TICKS + e->width_ticks);
        append_pulse(lead < least ? least : lead, flags);
        e->stage = STAGE_RUN;
        e->ahead_ticks = certain_ticks();
        if (e->ahead_ticks) {
            flags = (uint8_t)(flags | (command.accel == ACCEL_NONE ? MOTION_CRUISE : MOTION_ACCEL));
            append_silence(AHEAD_PERIODS, (uint16_t)(e->ahead_ticks / AHEAD_PERIODS - 1), flags);
            play();
        } else {
            cruised = begin_cruise();
        }
    } else {
        emit(); /* sets the interval up, then its silence, then the pulse */
        emit();
        emit();
        play();
    }
    plan();
    profile.cruise_pulses -= cruised;
    fill();
    if (!e->playing)
        play();
}

/* Ticks of the start wait, saturated. */
static uint32_t wait_ticks(uint32_t us)
{
    return us < UINT32_MAX / TICKS_PER_US ? us * TICKS_PER_US : UINT32_MAX;
}

/* Ticks until the tail begins, or more than JOIN_SOON_TICKS; 0: it has begun. */
static uint32_t ticks_to_tail(void)
{
    engine_t *e = HERE;
    step_snapshot_t at = step_port_snapshot();
    uint8_t offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    look_for_end();
    if (!e->tail_awaited)
        return 0;
    if (offset == e->tail_offset) {
        /* It is loaded: what is left of the period before it. */
        uint16_t top = segment_at((uint8_t)(offset - SEGMENT_BYTES))->top;
        uint16_t counter = step_port_counter();
        return at.period_over || counter > top ? 0 : top - counter;
    }
    return ticks_between(offset, at.to_count, e->tail_offset);
}

/* Has the segment after the tail begun? (An idle timer is dealt with by engine_poll.) */
static bool tail_is_over(void)
{
    engine_t *e = HERE;
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded = (uint8_t)(at.tail - SEGMENT_BYTES);
    if (step_idle || !has_begun(e->tail_offset))
        return false;
    return loaded != (uint8_t)(e->tail_offset + SEGMENT_BYTES) || at.to_count != counted_periods(segment_at(loaded));
}

/* Lets the command in `next` follow the one that has been emitted: exactly one interval after its last pulse where there
 * is time to plan it and to emit its first intervals, otherwise as soon as possible after its end. Not long before, so
 * that the running command can still be cut without the next one. */
static void join_next(void)
{
    engine_t *e = HERE;
    uint32_t ticks = ticks_to_tail();
    if (ticks > JOIN_SOON_TICKS)
        return; /* later */
    uint16_t needed = next.flags & MOTION_LINEAR ? JOIN_LINEAR_TICKS : JOIN_TICKS;
    if (next.accel == ACCEL_NONE && next.decel == ACCEL_NONE)
        needed = JOIN_FLAT_TICKS;
    if (ticks < needed) {
        if (tail_is_over()) { /* else at its end */
            if (step_idle)
                expire_gap();
            start(&next);
        }
        return;
    }
    bool turns = is_ccw(&next) != is_ccw(&command);
    uint32_t wait = wait_ticks(next.start_wait_us);
    bool waits = wait >= SHORTEST_PIECE_TICKS;
    uint8_t flags = (uint8_t)(MOTION_STOP | direction_flags(&next, turns));
    uint8_t offset = e->tail_offset;
    bool done;
    if (e->tail_fast && !turns && wait == 0) {
        offset = (uint8_t)(offset - SEGMENT_BYTES); /* the last run */
        done = step_port_extend(offset);
    } else {
        const segment_t *tail = segment_at(offset);
        uint16_t top = tail->top;
        uint16_t match = SEGMENT_SILENT;
        if (waits) {
            flags = tail->flags;
        } else {
            top = (uint16_t)(top + wait);
            if (turns && top < TURN_TICKS + e->width_ticks)
                top = (uint16_t)(TURN_TICKS + e->width_ticks);
            match = (uint16_t)(top - e->width_ticks);
        }
        done = step_port_arm(offset, top, match, flags);
    }
    if (!done)
        return; /* not at this moment */
    e->joined_offset = offset;
    command = next;
    e->next_taken = false;
    drop_emission();
    e->joined = true;
    e->ended++;
    /* Longer than the gap the wait means a start from slow speed. */
    if (wait >> PROFILE_CHUNK_LOG2 >= e->closing_chunks && wait > (e->closing_chunks << PROFILE_CHUNK_LOG2) + e->closing_ticks)
        expire_gap();
    if (waits) {
        e->dir_due = turns;
        e->stage = STAGE_LEAD;
    } else {
        add_pulses(flags, 1);
        e->stage = STAGE_RUN;
    }
    plan();
    fill();
}

status_t engine_check(const motion_command_t *c)
{
    return profile_check(&basis, c, settings.pulse_us);
}

bool engine_can_accept(void)
{
    engine_t *e = &engine;
    return !e->next_taken;
}

void engine_submit(const motion_command_t *submitted)
{
    engine_t *e = HERE;
    if (!e->playing) {
        start(submitted);
    } else {
        next = *submitted;
        e->next_taken = true;
    }
}

NOINLINE bool engine_poll(void)
{
    engine_t *e = &engine;
    bool worked = false;
    look_for_end();
    if (step_late) {
        step_late = 0;
        e->faults |= ENGINE_FAULT_LATE;
    }
    if (e->playing && step_idle) {
        if (!step_port_snapshot().period_over) {
            /* The last period is not over. */
        } else if ((e->stage == STAGE_REST || e->stage == STAGE_GAP) && step_head == step_tail) {
            step_port_halt();
            e->playing = false;
            e->single = false;
            if (e->next_taken)
                start(&next);
            else
                expire_gap();
        } else if (step_head != step_tail) {
            /* The planner was so late that the timer ran out of segments: go on where it stopped. */
            if (e->stage == STAGE_RUN)
                e->faults |= ENGINE_FAULT_STARVED;
            step_port_start();
        }
        worked = true;
    }
    if (e->next_taken && e->playing && !e->single && (e->stage == STAGE_GAP || e->stage == STAGE_END || e->stage == STAGE_REST))
        join_next();
    /* Until the ring is half full nothing else is as urgent, within reason; then a step at a time. */
    uint8_t rounds = 6;
    if (e->playing) {
        do {
            if (ring_free() < (block.runs ? RING_REFILL : RING_RESERVE) || !emit())
                break;
            worked = true;
        } while (ring_free() > SEGMENT_COUNT / 2 && --rounds);
    }
    return worked;
}

uint8_t engine_commands_ended(void)
{
    engine_t *e = &engine;
    return e->ended;
}

/* A command has been begun (its start wait included) and has not ended. */
static bool running(void)
{
    engine_t *e = &engine;
    look_for_end();
    return e->tail_awaited || (e->playing && (e->stage == STAGE_LEAD || e->stage == STAGE_RUN || e->stage == STAGE_TAIL));
}

/* -- stopping ---------------------------------------------------------------------------------------------------- */

static void drop_next(void)
{
    engine_t *e = &engine;
    look_for_end();
    e->ended = (uint8_t)(e->ended + e->next_taken + e->joined);
    e->next_taken = false;
    e->joined = false;
}

/* Freezes the pulse train where it is. */
static void halt(void)
{
    engine_t *e = HERE;
    if (!e->playing)
        return;
    step_port_halt();
    if (running())
        e->ended++;
    e->emitted = engine_position();
    e->playing = false;
    drop_emission();
    e->stage = STAGE_REST;
    motion_state = MOTION_STANDBY;
}

void engine_stop(void)
{
    drop_next();
    halt();
    forget_velocity();
}

/* Ends the running command after what is to be played soon. Returns the interval there in ticks; 0: nothing to be cut
 * (it ends by itself now, or it stands in the middle of a wait or of an interval longer than that of slow speed). */
static uint32_t cut(void)
{
    engine_t *e = &engine;
    allow_hold(0);
    step_snapshot_t at = step_port_snapshot();
    uint8_t offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    uint16_t left = at.to_count;
    uint32_t keep_ticks = CUT_KEEP_TICKS;
    const segment_t *s;
    for (;;) {
        s = segment_at(offset);
        uint32_t ticks = ticks_of(s, left);
        uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
        if (is_silent(s)) {
            if ((s->flags & SEGMENT_STATE_MASK) == MOTION_STOP)
                return 0;
        } else if ((ticks >= keep_ticks && (left > 1 || after != at.tail)) || after == step_head) {
            /* (Not the last period of the loaded segment: what follows it may be loaded meanwhile.) */
            uint16_t needed = (uint16_t)(keep_ticks / ticks_of(s, 1) + 4u);
            if (needed < left)
                left = needed;
            break;
        }
        keep_ticks = keep_ticks > ticks ? keep_ticks - ticks : 0;
        if (after == step_head)
            return 0;
        offset = after;
        left = counted_periods(segment_at(offset));
    }
    uint32_t interval_ticks = interval_at(offset);
    if (interval_ticks > basis.slow_ticks + 1)
        return 0;
    int32_t dropped = pulses_from((uint8_t)(offset + SEGMENT_BYTES));
    e->emitted -= dropped + signed_pulses(s, step_port_shorten(offset, left));
    drop_emission();
    return interval_ticks;
}

/* Ends the running command with a deceleration, or none. */
static void end_command(accel_code_t decel, bool linear)
{
    engine_t *e = &engine;
    if (!running())
        return;
    motion_state_t state = engine_state();
    if (state == MOTION_STOP || (state == MOTION_DECEL && decel != ACCEL_NONE))
        return; /* ending already */
    uint32_t ticks = state == MOTION_STANDBY ? 0 : cut();
    if (ticks == 0) {
        if (state == MOTION_STANDBY || e->stage == STAGE_RUN || e->silence_chunks || e->piece_ticks) {
            /* In a start wait or at slow speed: there is nothing to ramp down from. */
            halt();
            forget_velocity();
        }
        return;
    }
    profile_plan_decel(&profile, &basis, ramp_velocity(&basis.ramp, ticks), decel, linear);
    profile.cruise.chunks = ticks >> PROFILE_CHUNK_LOG2;
    profile.cruise.ticks_q8 = (ticks & (PROFILE_CHUNK_TICKS - 1)) << 8;
    if (profile.decel_pulses == 0)
        profile.cruise_pulses = 1; /* the closing interval */
    e->ramp_state = MOTION_STANDBY;
    e->stage = STAGE_RUN;
}

void engine_stop_graceful(accel_code_t decel, bool linear)
{
    drop_next();
    end_command(decel, linear);
}

void engine_next(void)
{
    engine_t *e = &engine;
    look_for_end();
    if (!e->joined) /* else it ends within JOIN_SOON_TICKS */
        end_command(ACCEL_NONE, false);
}

void engine_next_graceful(void)
{
    engine_t *e = &engine;
    look_for_end();
    if (!e->joined)
        end_command(command.decel, (command.flags & MOTION_LINEAR) != 0);
}

/* Needs no plan: a ring of one segment. A pulse takes 13 us and is waited for before the next one: all of them are made,
 * as fast as they can be typed at 250,000 Bd. */
void engine_single_pulse(bool ccw)
{
    engine_t *e = HERE;
    if (e->single) {
        step_port_finish();
    } else if (running() || e->next_taken) {
        return;
    }
    begin_ring();
    e->stage = STAGE_REST;
    e->single = true;
    command.flags = ccw ? MOTION_CCW : 0;
    uint8_t flags = direction_flags(&command, true);
    append_pulse((uint16_t)(TURN_TICKS + e->width_ticks), flags);
    play();
}

/* -- what others see ------------------------------------------------------------------------------------------------ */

motion_state_t engine_state(void)
{
    return (motion_state_t)motion_state;
}

void engine_velocity(uint32_t *rpm, uint32_t *cycle_us)
{
    engine_t *e = HERE;
    uint32_t v = e->v_in_play;
    uint32_t exact_cycle_us = e->in_play_cycle_us;
    motion_state_t state = engine_state();
    if (e->playing && state == MOTION_CRUISE) {
        exact_cycle_us = profile.cycle_us;
        v = profile_rpm(&basis, &command) * 100u << basis.factor_log2;
    } else if (e->playing && (state == MOTION_ACCEL || state == MOTION_DECEL)) {
        uint8_t offset = (uint8_t)(step_tail - SEGMENT_BYTES);
        if (is_silent(segment_at(offset)))
            offset = (uint8_t)(offset + SEGMENT_BYTES);
        v = ramp_velocity(&basis.ramp, interval_at(offset));
        exact_cycle_us = 0;
    }
    *rpm = (v >> basis.factor_log2) / 100u;
    *cycle_us = exact_cycle_us;
    if (exact_cycle_us == 0) {
        ramp_time_t interval = ramp_interval(&basis.ramp, v);
        *cycle_us = (interval.ticks << basis.factor_log2) / TICKS_PER_US;
    }
}

void engine_set_gap(bool on)
{
    engine_t *e = HERE;
    e->gap_off = !on;
}

bool engine_gap(void)
{
    engine_t *e = HERE;
    return !e->gap_off;
}

uint8_t engine_faults(void)
{
    engine_t *e = &engine;
    return e->faults;
}

uint32_t command_rpm(const motion_command_t *c)
{
    return profile_rpm(&basis, c);
}

uint32_t command_cycle_us(const motion_command_t *c)
{
    return profile_cycle_us(&basis, c);
}
