/* See engine.h; why it is built this way: docs/design.md. */
#include "motion/engine.h"
#include "base/atomic.h"
#include "base/inline.h"
#include "motion/block.h"
#include "motion/estop_port.h"
#include "motion/profile.h"
#include "motion/ramp.h"
#include "motion/segment.h"
#include "motion/step_port.h"
#include "settings.h"

#define TICKS_PER_US 16u
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

static profile_basis_t basis;
static uint16_t width_ticks; /* of a pulse */
static motion_command_t command; /* being emitted or played */
static profile_t profile;        /* what is left of it to be emitted */
static const motion_command_t *next; /* offered, not begun; null: nothing */
static bool playing; /* the timer runs (it may play silence) */
static stage_t stage;
static ramp_t ramp;
static motion_state_t ramp_state; /* the phase that `ramp` was begun for; MOTION_STANDBY: none */
static uint32_t *phase_left;       /* pulses of the phase being emitted, in `profile` */
static block_t block;             /* of that phase, while it has runs left */

static uint32_t silence_chunks;  /* still to be emitted before ... */
static uint16_t piece_ticks;     /* ... this period; 0: none */
static bool piece_pulse;
static uint16_t owed;            /* held pulses still to be left out */
static int32_t carry_q16;        /* 1/65536 ticks rounded off so far */
static uint16_t ahead_ticks;     /* part of the next interval that has been emitted as silence */
static bool dir_due;             /* the next single period sets the dir pin */
static uint32_t closing_chunks;  /* closing interval of the last command emitted: so many PROFILE_CHUNK_TICKS ... */
static uint16_t closing_ticks;   /* ... and these */
static uint8_t tail_offset;      /* its tail segment, while stage is REST, GAP or END */
static bool tail_valid;          /* a command can still be joined to it */
static bool tail_awaited;        /* it has not begun yet: its command has not ended */
static uint8_t joined;           /* the ring holds the end of so many commands and the beginning of the next one ... */
static uint8_t joined_offset;    /* ... which begins at the end of this segment */
static bool tail_fast;           /* too fast for a tail: a following command lengthens the last run instead */
static uint8_t last_run_offset;

static int32_t emitted; /* position, in pulses, when all that is in the ring has been played */
static uint8_t begun, ended, played; /* commands, modulo 256 */
static bool endless;           /* the command goes on until it is cut */
static uint8_t faults;
static uint32_t certain_centi; /* steepest linear ramp whose first interval is longer than AHEAD_LONG_TICKS */
static bool gap_on = true;
static uint32_t v_in_play;
static uint32_t in_play_cycle_us; /* 0: follows from v_in_play */
static bool single;               /* the ring plays single pulses */

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
    profile_basis(&basis, settings.steps_per_rev, settings.ustep, settings.slow_rpm);
    v_in_play = basis.v_slow;
    certain_centi = (130000000u >> basis.factor_log2) / basis.steps_per_rev;
    width_ticks = (uint16_t)settings.pulse_us * TICKS_PER_US;
    step_port_init();
}

/* -- the ring -------------------------------------------------------------------------------------------------- */

static NOINLINE uint8_t early_periods(uint8_t flags)
{
    return (uint8_t)((flags & SEGMENT_EARLY_MASK) >> SEGMENT_EARLY_SHIFT);
}

/* Which reload a period of top + 1 ticks needs. */
static NOINLINE uint8_t early_flags(uint16_t top)
{
    uint8_t periods = (uint8_t)((top < SEGMENT_EARLY1_BELOW_TICKS - 1) + (top < SEGMENT_EARLY2_BELOW_TICKS - 1) +
                                (top < SEGMENT_EARLY3_BELOW_TICKS - 1));
    return (uint8_t)(periods << SEGMENT_EARLY_SHIFT);
}

/* Periods that the interrupt counts: those waited for early are not among them. */
static uint16_t counted_periods(const segment_t *s)
{
    return (uint16_t)((uint16_t)(s->count_high << 8) + (s->count_low ? s->count_low : 256u));
}

static uint32_t period_ticks(const segment_t *s)
{
    return s->top + (uint32_t)1;
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

static uint8_t pulses_to_come(void)
{
    uint32_t left = profile_pulses_left();
    return left > 255 ? 254 : left ? (uint8_t)(left - 1) : 0;
}

static void add_pulses(uint8_t flags, uint16_t pulses)
{
    if (flags & (1 << SEGMENT_CCW_BIT))
        emitted -= pulses;
    else
        emitted += pulses;
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
    if (joined && has_begun(joined_offset)) {
        ended = (uint8_t)(ended + joined);
        played = (uint8_t)(played + joined);
        joined = 0;
    }
    if (tail_awaited && has_begun(tail_offset)) {
        tail_awaited = false;
        ended++;
        played++;
    }
}

static NOINLINE uint16_t give(uint32_t *phase, uint16_t pulses)
{
    uint16_t some = *phase < pulses ? (uint16_t)*phase : pulses;
    *phase -= some;
    return (uint16_t)(pulses - some);
}

/* The interrupt has repeated the last interval because the ring was empty: so many pulses fewer are to be made. Returns
 * how many of them the phases to come could not give. */
static uint16_t absorb_held(void)
{
    uint8_t lock = atomic_begin();
    uint16_t held = step_held;
    step_held = 0;
    atomic_end(lock);
    if (held == 0)
        return 0;
    faults |= ENGINE_FAULT_STARVED;
    add_pulses(step_flags, held);
    /* The cruise becomes shorter, or, where there is none, the ramps; the closing interval stays. */
    uint32_t left = profile_pulses_left();
    if (left == 0)
        return held;
    uint16_t given = left > held ? held : (uint16_t)(left - 1);
    held = (uint16_t)(held - given);
    given = give(&profile.cruise_pulses, given);
    given = give(&profile.accel_pulses, given);
    give(&profile.decel_pulses, given);
    return held;
}

/* So many pulses may be repeated from now on if the ring runs empty. */
static void allow_hold(uint8_t pulses)
{
    uint8_t lock = atomic_begin();
    step_hold = pulses > step_held ? (uint8_t)(pulses - step_held) : 0; /* those held meanwhile will be given back */
    atomic_end(lock);
}

/* Appends `periods` periods of `top` + 1 ticks. Runs too short to be reloaded in time (periods that need an early reload,
 * no more of them than are waited for) are stretched: their count stays exact. */
static void push(uint16_t periods, uint16_t top, bool pulse, motion_state_t state)
{
    segment_t *s = segment_at(step_head);
    bool turn = dir_due && periods == 1;
    uint8_t flags = (uint8_t)(state | direction_flags(&command, turn));
    dir_due = dir_due && !turn;
    look_for_end();
    allow_hold(pulse ? pulses_to_come() : 0); /* first, so that what is held from here on can be given back */
    if (step_held)
        owed = (uint16_t)(owed + absorb_held());
    if (pulse) {
        uint16_t given = owed < periods ? owed : periods;
        owed = (uint16_t)(owed - given);
        periods = (uint16_t)(periods - given);
        add_pulses(flags, periods);
    }
    uint8_t early = early_flags(top);
    uint16_t counted = periods;
    if (periods > early_periods(early)) {
        flags |= early;
        counted = (uint16_t)(periods - early_periods(early));
    } else if (early) {
        top = SEGMENT_EARLY1_BELOW_TICKS - 1;
    }
    s->top = top;
    s->match = pulse ? (uint16_t)(top - width_ticks) : SEGMENT_SILENT;
    s->count_low = (uint8_t)counted;
    s->count_high = (uint8_t)((uint16_t)(counted - 1) >> 8);
    s->flags = flags;
    if (periods)
        step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

/* The interval that ends with the pulse of the segment at `offset`: its period and the silence before it. */
static uint32_t interval_at(uint8_t offset)
{
    uint32_t ticks = period_ticks(segment_at(offset));
    const segment_t *before = segment_at((uint8_t)(offset - SEGMENT_BYTES));
    if (is_silent(before))
        ticks += period_ticks(before) * counted_periods(before);
    return ticks;
}

/* Ticks from the segment at `offset`, which has so many periods left, to the one at `end`, or more than
 * JOIN_SOON_TICKS. */
static uint32_t ticks_between(uint8_t offset, uint16_t periods, uint8_t end)
{
    uint32_t ticks = 0;
    while (offset != end && ticks <= JOIN_SOON_TICKS) {
        const segment_t *s = segment_at(offset);
        ticks += period_ticks(s) * periods;
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
        pulses += signed_pulses(s, (uint16_t)(counted_periods(s) + early_periods(s->flags)));
        offset = (uint8_t)(offset + SEGMENT_BYTES);
    }
    return pulses;
}

int32_t engine_position(void)
{
    if (!playing)
        return emitted;
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded_offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    const segment_t *loaded = segment_at(loaded_offset);
    const segment_t *running = loaded;
    uint16_t counted = counted_periods(loaded);
    int32_t to_come = pulses_from(at.tail);
    if (!step_idle) { /* otherwise its last period is running, or over */
        if (at.to_count == counted)
            running = segment_at((uint8_t)(loaded_offset - SEGMENT_BYTES));
        to_come += signed_pulses(loaded, (uint16_t)(at.to_count + early_periods(loaded->flags)));
    }
    if (!at.pulse_high && !at.period_over)
        to_come += signed_pulses(running, 1);
    return emitted - to_come;
}

/* -- emission -------------------------------------------------------------------------------------------------- */

/* Sets up an interval that ends with a pulse (or not); emit() turns it into segments. */
static void set_interval(uint32_t chunks, uint32_t ticks, bool pulse)
{
    if (ahead_ticks) {
        while (ticks < ahead_ticks + SHORTEST_PIECE_TICKS) {
            ticks += PROFILE_CHUNK_TICKS;
            chunks--;
        }
        ticks -= ahead_ticks;
        ahead_ticks = 0;
    }
    if (chunks && ticks < SHORTEST_PIECE_TICKS) {
        ticks += PROFILE_CHUNK_TICKS;
        chunks--;
    }
    if (chunks == 1 && ticks < PROFILE_CHUNK_TICKS) {
        ticks += PROFILE_CHUNK_TICKS;
        chunks = 0;
    }
    silence_chunks = chunks;
    piece_ticks = (uint16_t)ticks; /* below 65536 */
    piece_pulse = pulse;
}

/* Adds the carried fraction to a time; what remains is carried on. */
static NOINLINE uint32_t take_carry(uint32_t ticks, uint16_t frac_q16)
{
    int32_t carry = carry_q16 + frac_q16;
    carry_q16 = carry & 0xFFFF;
    return (uint32_t)((int32_t)ticks + (carry >> 16));
}

/* `pulses` intervals, `longer` of them of ticks + 1, the others of ticks. Too few of either kind for an early reload are
 * made like the others, and the difference is carried. */
static void push_run(uint16_t pulses, uint16_t longer, uint16_t ticks, bool faster, motion_state_t state)
{
    uint8_t early = early_periods(early_flags((uint16_t)(ticks - 1)));
    uint16_t ideal = longer;
    if (longer <= early)
        longer = 0;
    else if (pulses - longer <= early)
        longer = pulses;
    carry_q16 += (int32_t)(int16_t)(ideal - longer) * 65536;
    if (faster && longer)
        push(longer, ticks, true, state);
    if (pulses != longer)
        push((uint16_t)(pulses - longer), (uint16_t)(ticks - 1), true, state);
    if (!faster && longer)
        push(longer, ticks, true, state);
}

/* push() without its cases: pulses of at least SEGMENT_EARLY1_BELOW_TICKS, many more to come. */
static inline void append(uint16_t periods, uint16_t top, uint16_t width, uint8_t flags)
{
    segment_t *s = segment_at(step_head);
    s->top = top;
    s->match = (uint16_t)(top - width);
    s->count_low = (uint8_t)periods;
    s->count_high = 0;
    s->flags = flags;
    step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

static void append_silence(uint16_t periods, uint16_t top, uint8_t flags)
{
    append(periods, top, (uint16_t)(top - SEGMENT_SILENT), flags);
}

static void begin_ramp(motion_state_t state)
{
    if (ramp_state == state)
        return;
    ramp_state = state;
    if (state == MOTION_ACCEL)
        profile_begin_accel(&profile, &basis, &ramp);
    else
        profile_begin_decel(&profile, &basis, &ramp);
}

/* `pulses` intervals of a ramp that last `ticks` together. */
static void emit_flat(uint16_t pulses, uint32_t ticks, motion_state_t state, bool faster)
{
    if (pulses == 1) {
        if (ticks > 65535u || ahead_ticks)
            set_interval(ticks >> PROFILE_CHUNK_LOG2, ticks & (PROFILE_CHUNK_TICKS - 1), true);
        else
            push(1, (uint16_t)(ticks - 1), true, state);
        return;
    }
    uint32_t each = ticks / pulses;
    push_run(pulses, (uint16_t)((uint16_t)ticks - (uint16_t)each * pulses), (uint16_t)each, faster, state);
}

/* Appends what the ring has room for of the block. */
static void emit_block(void)
{
    uint32_t *left = phase_left;
    look_for_end();
    uint8_t pulses = block.pulses;
    uint8_t runs = block.runs;
    uint32_t spare = profile_pulses_left() - 1; /* the closing interval has one */
    uint16_t planned = (uint16_t)(runs * pulses);
    /* First, so that what is held from here on can be given back. */
    allow_hold(spare < planned ? 0 : spare - planned > 254 ? 254 : (uint8_t)(spare - planned));
    if (step_held) {
        owed = (uint16_t)(owed + absorb_held());
        spare = profile_pulses_left() - 1;
    }
    if (spare > *left)
        spare = *left;
    if (spare < planned) /* held pulses have been taken from it */
        block.runs = runs = (uint8_t)(spare / pulses);
    block_append(&block);
    uint16_t made = (uint16_t)((uint8_t)(runs - block.runs) * pulses);
    *left -= made;
    add_pulses(block.flags, made);
    if (block.runs == 0)
        carry_q16 += (int32_t)(block.shape & BLOCK_SPLIT ? block.carry_q16 : (uint32_t)block.carry_q16 * pulses);
}

/* What the block's runs do not say: the ticks carried so far, their segments' flags. */
static void begin_block(bool faster)
{
    bool split = block.top_q16 >> 16 >= BLOCK_SPLIT_TICKS - 1;
    block.shape = (uint8_t)((faster ? BLOCK_FASTER : 0) | (split ? BLOCK_SPLIT : 0));
    block.carry_q16 = 0;
    if (carry_q16 > 0) { /* otherwise it waits for a single interval */
        uint32_t carry = (uint32_t)carry_q16;
        carry_q16 = 0;
        if (!split || carry > UINT16_MAX) {
            carry /= block.pulses; /* of each interval */
            if (split || carry > UINT16_MAX) { /* left by runs of more pulses */
                block.top_q16 += carry / block.runs;
                carry = 0;
            }
        }
        block.carry_q16 = (uint16_t)carry;
    }
    block.width_ticks = width_ticks;
    block.flags = (uint8_t)(ramp_state | direction_flags(&command, false));
}

/* The next intervals of the ramp of `ramp_state`: pulses all alike, a block, or some of the former before a block. */
static void emit_ramp(uint32_t at_most, bool faster)
{
    if (ahead_ticks || dir_due || owed)
        at_most = 1;
    uint32_t ticks = 0;
    uint8_t pulses = 0;
    do {
        ramp_time_t sum;
        uint16_t group = ramp_next(&ramp, &basis.ramp, at_most, &sum, &block);
        if (block.runs) {
            begin_block(faster);
            break;
        }
        ticks += take_carry(sum.ticks, sum.frac_q16);
        pulses = (uint8_t)(pulses + group);
        at_most -= group;
    } while (ramp.rest && at_most);
    *phase_left -= pulses;
    if (pulses)
        emit_flat(pulses, ticks, ramp_state, faster);
}

static void emit_cruise(uint32_t at_most)
{
    const profile_interval_t *interval = &profile.cruise;
    uint32_t ticks = interval->ticks_q8 >> 8;
    uint8_t frac = (uint8_t)interval->ticks_q8;
    uint32_t chunks = interval->chunks;
    if (chunks == 1 && ticks < PROFILE_CHUNK_TICKS - 1) {
        ticks += PROFILE_CHUNK_TICKS;
        chunks = 0;
    }
    if (chunks || ahead_ticks) {
        (*phase_left)--;
        ticks = take_carry(ticks, (uint16_t)(frac << 8));
        set_interval(chunks, ticks, true);
        return;
    }
    uint16_t run = at_most > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)at_most;
    if (frac == 0 || run < 8) {
        *phase_left -= run;
        uint32_t fraction = (uint32_t)frac * run;
        emit_flat(run, take_carry(ticks * run + (fraction >> 8), (uint16_t)(fraction << 8)), MOTION_CRUISE, true);
        return;
    }
    /* Runs of two neighbouring values. */
    uint8_t run_log2 = 3;
    while (run_log2 < 7 && ticks << run_log2 < CRUISE_GROUP_TICKS && run >> run_log2 > 1)
        run_log2++;
    run = (uint16_t)(run >> run_log2);
    block.runs = (uint8_t)(run > 255u ? 255u : run);
    block.pulses = (uint8_t)(1u << run_log2);
    block.top_q16 = ((ticks - 1) << 16) | (uint32_t)frac << 8;
    block.slope_q16 = 0;
    block.curve_q16 = 0;
    begin_block(false);
}

/* The interval after the last pulse of the command: body, then tail. */
static void begin_closing(void)
{
    profile_t *p = &profile;
    uint32_t chunks = 0;
    uint32_t ticks;
    motion_state_t state = p->decel_pulses ? MOTION_DECEL : p->cruise_pulses ? MOTION_CRUISE : MOTION_ACCEL;
    if (state == MOTION_CRUISE) {
        chunks = p->cruise.chunks;
        ticks = take_carry(p->cruise.ticks_q8 >> 8, (uint16_t)(p->cruise.ticks_q8 << 8));
    } else {
        begin_ramp(state);
        ramp_time_t sum;
        (void)ramp_next(&ramp, &basis.ramp, 1, &sum, &block);
        ticks = take_carry(sum.ticks, sum.frac_q16);
        chunks = ticks >> PROFILE_CHUNK_LOG2;
        ticks &= PROFILE_CHUNK_TICKS - 1;
    }
    p->accel_pulses = p->cruise_pulses = p->decel_pulses = 0;
    ramp_state = state; /* the body belongs to the phase */
    closing_chunks = chunks;
    closing_ticks = (uint16_t)ticks;
    tail_fast = chunks == 0 && ticks < SEGMENT_EARLY1_BELOW_TICKS;
    stage = STAGE_TAIL;
    if (chunks || ticks >= 2 * TAIL_TICKS) {
        if (ticks < 2 * TAIL_TICKS) {
            ticks += PROFILE_CHUNK_TICKS;
            chunks--;
        }
        ticks -= TAIL_TICKS;
        set_interval(chunks, ticks, false);
    }
}

static void push_tail(void)
{
    uint16_t ticks = TAIL_TICKS;
    if (closing_chunks == 0 && closing_ticks < 2 * TAIL_TICKS) {
        ticks = closing_ticks;
        if (ahead_ticks)
            ahead_ticks = 0;
    }
    if (tail_fast)
        ticks = SHORTEST_PIECE_TICKS;
    tail_offset = step_head;
    last_run_offset = (uint8_t)(step_head - SEGMENT_BYTES);
    tail_valid = true;
    push(1, (uint16_t)(ticks - 1), false, MOTION_STOP);
    tail_awaited = true;
}

/* What comes next, but for a block, which is only begun. False if there is nothing. */
static bool emit_other(void)
{
    if (silence_chunks) {
        uint16_t periods = silence_chunks > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)silence_chunks;
        silence_chunks -= periods;
        push(periods, PROFILE_CHUNK_TICKS - 1, false, ramp_state);
        return true;
    }
    if (piece_ticks) {
        uint16_t ticks = piece_ticks;
        piece_ticks = 0;
        push(1, (uint16_t)(ticks - 1), piece_pulse, ramp_state);
        return true;
    }
    profile_t *p = &profile;
    switch (stage) {
    case STAGE_REST:
        return false;
    case STAGE_LEAD: {
        /* The start wait, then the first pulse: in a short period of its own, because the state changes when it begins. */
        uint32_t us = command.start_wait_us;
        command.start_wait_us = 0;
        ramp_state = MOTION_STANDBY;
        if (us) {
            set_interval(us >> (PROFILE_CHUNK_LOG2 - 4), (us & (PROFILE_CHUNK_TICKS / TICKS_PER_US - 1)) * TICKS_PER_US, false);
        } else {
            push(1, (uint16_t)(DIR_SETUP_TICKS + width_ticks - 1), true, MOTION_STANDBY);
            stage = STAGE_RUN;
        }
        return true;
    }
    case STAGE_RUN: {
        uint32_t after = p->decel_pulses;
        motion_state_t state = MOTION_DECEL;
        phase_left = &p->decel_pulses;
        if (p->accel_pulses) {
            after += p->cruise_pulses;
            phase_left = &p->accel_pulses;
            state = MOTION_ACCEL;
        } else if (p->cruise_pulses) {
            phase_left = &p->cruise_pulses;
            state = MOTION_CRUISE;
        } else {
            after = 0;
        }
        uint8_t kept = after == 0; /* for the closing interval */
        uint32_t at_most = *phase_left - kept;
        if (*phase_left <= kept) {
            begin_closing();
        } else if (state == MOTION_CRUISE) {
            ramp_state = state;
            if (endless && at_most < UINT32_MAX / 2)
                p->cruise_pulses += UINT32_MAX / 2;
            emit_cruise(at_most);
        } else {
            begin_ramp(state);
            emit_ramp(at_most, state == MOTION_ACCEL && p->faster);
        }
        return true;
    }
    case STAGE_TAIL:
        push_tail();
        v_in_play = p->v_exit;
        in_play_cycle_us = p->exit_cycle_us;
        stage = STAGE_GAP;
        return true;
    case STAGE_GAP:
        if (next)
            return false; /* it will be joined */
        ramp_state = MOTION_STANDBY;
        if (gap_on)
            set_interval(closing_chunks, tail_fast ? SHORTEST_PIECE_TICKS : closing_ticks, false);
        stage = STAGE_END;
        return true;
    case STAGE_END:
        push(1, SHORTEST_PIECE_TICKS - 1, false, MOTION_STANDBY);
        stage = STAGE_REST;
        return true;
    }
    return false;
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
    silence_chunks = 0;
    piece_ticks = 0;
    block.runs = 0;
    ahead_ticks = 0;
    ramp_state = MOTION_STANDBY;
    tail_awaited = false;
    tail_valid = false;
}

/* -- starting and joining ----------------------------------------------------------------------------------------- */

static void begin_ring(void)
{
    if (playing)
        step_port_halt();
    playing = false;
    step_head = step_tail = 0;
    step_hold = 0;
    step_held = 0;
    step_idle = 0;
    owed = 0;
    carry_q16 = 0;
    dir_due = false;
    joined = 0;
    single = false;
    drop_emission();
}

/* Takes the values of what is offered. */
static void take_next(void)
{
    command = *next;
    next = 0;
    begun++;
    endless = command.count == 0;
    if (endless) {
        command.count = UINT32_MAX; /* its cruise is made longer as it is played */
        command.extra_pulses = 0;
        command.flags |= MOTION_PULSES;
    }
}

static void plan(void)
{
    profile_plan(&profile, &basis, &command, v_in_play);
}

static void play(void)
{
    playing = true;
    if (command.flags & MOTION_SYNC)
        step_port_hold();
    else
        step_port_start();
}

/* The first interval of most profiles is long, whatever the rest turns out to be: then the first pulse need not wait for
 * the planning. Returns how much of that interval may certainly be begun, from few operations; 0: plan first. */
static uint16_t certain_ticks(void)
{
    if (v_in_play != basis.v_slow || command.flags & MOTION_SYNC)
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
    uint32_t ticks = 0;
    uint16_t periods = 0;
    uint8_t offset = step_head;
    while ((ticks < START_TICKS || periods < START_PERIODS ||
            (!playing && (ramp_state == MOTION_ACCEL || ramp_state == MOTION_DECEL) &&
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
    uint8_t factor_log2 = basis.factor_log2;
    if (command.accel != ACCEL_NONE || command.decel != ACCEL_NONE || command.flags & MOTION_SYNC)
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
    push(run, (uint16_t)(ticks - 1), true, MOTION_CRUISE);
    return run;
}

/* Starts the command, which is not planned yet, from standstill. */
static void start_now(void)
{
    begin_ring();
    step_port_dir(dir_level(is_ccw(&command)));
    uint8_t flags = direction_flags(&command, false);
    uint16_t certain = certain_ticks();
    uint16_t cruised = 0;
    if (command.start_wait_us < 3072u) {
        uint16_t wait = (uint16_t)(command.start_wait_us * TICKS_PER_US);
        uint16_t lead = (uint16_t)(DIR_SETUP_TICKS + width_ticks);
        uint8_t first_flags = flags;
        if (certain)
            flags = (uint8_t)(flags | (command.accel == ACCEL_NONE ? MOTION_CRUISE : MOTION_ACCEL));
        if (wait >= SHORTEST_PIECE_TICKS) {
            append_silence(1, (uint16_t)(wait - 1), first_flags);
        } else {
            lead = (uint16_t)(lead + wait);
            first_flags = flags; /* known at once, not only when the pulse is over */
        }
        append(1, (uint16_t)(lead - 1), width_ticks, first_flags);
        add_pulses(flags, 1);
        stage = STAGE_RUN;
        if (certain) {
            append_silence(AHEAD_PERIODS, (uint16_t)(certain / AHEAD_PERIODS - 1), flags);
            ahead_ticks = certain;
            play();
            engine_on_start();
        } else if ((cruised = begin_cruise()) != 0) {
            play();
        }
    } else {
        stage = STAGE_LEAD;
        for (uint8_t steps = 4; steps > 0; steps--)
            emit(); /* sets the interval up, then its silence, then the pulse */
        if (!(command.flags & MOTION_SYNC))
            play();
    }
    plan();
    engine_on_start();
    profile.cruise_pulses -= cruised;
    fill();
    if (!playing)
        play();
}

/* Is the velocity in play kept until now? */
static void expire_gap(void)
{
    if (gap_on) {
        v_in_play = basis.v_slow;
        in_play_cycle_us = 0;
    }
}

/* Ticks of the start wait, saturated. */
static NOINLINE uint32_t wait_ticks(uint32_t us)
{
    return us < UINT32_MAX / TICKS_PER_US ? us * TICKS_PER_US : UINT32_MAX;
}

/* Ticks until the tail begins, or more than JOIN_SOON_TICKS; 0: it has begun. */
static uint32_t ticks_to_tail(void)
{
    step_snapshot_t at = step_port_snapshot();
    uint8_t offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    look_for_end();
    if (!tail_valid || !tail_awaited)
        return 0;
    if (offset == tail_offset) {
        /* It is loaded: what is left of the period before it. */
        uint16_t top = segment_at((uint8_t)(offset - SEGMENT_BYTES))->top;
        uint16_t counter = step_port_counter();
        return at.period_over || counter > top ? 0 : top - counter;
    }
    return ticks_between(offset, at.to_count, tail_offset);
}

/* Has the segment after the tail begun? (An idle timer is dealt with by engine_poll.) */
static bool tail_is_over(void)
{
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded = (uint8_t)(at.tail - SEGMENT_BYTES);
    if (step_idle || !has_begun(tail_offset))
        return false;
    return loaded != (uint8_t)(tail_offset + SEGMENT_BYTES) || at.to_count != counted_periods(segment_at(loaded));
}

/* Lets the command in `next` follow the one that has been emitted: exactly one interval after its last pulse where there
 * is time to plan it and to emit its first intervals, otherwise as soon as possible after its end. Not long before, so
 * that the running command can still be cut without the next one. */
static void join_next(void)
{
    uint32_t ticks = ticks_to_tail();
    uint16_t needed = next->flags & MOTION_LINEAR ? JOIN_LINEAR_TICKS : JOIN_TICKS;
    if (next->accel == ACCEL_NONE && next->decel == ACCEL_NONE)
        needed = JOIN_FLAT_TICKS;
    bool timely = ticks >= needed && !(next->flags & MOTION_SYNC);
    if (ticks > JOIN_SOON_TICKS)
        return; /* later */
    if (!timely && !tail_is_over())
        return; /* at its end */
    bool turns = is_ccw(next) != is_ccw(&command);
    uint8_t flags = (uint8_t)(MOTION_STOP | direction_flags(next, turns));
    uint32_t wait = wait_ticks(next->start_wait_us);
    if (timely) {
        uint8_t offset = tail_offset;
        bool done;
        if (wait >= SHORTEST_PIECE_TICKS) {
            done = step_port_drop_after(offset);
        } else if (tail_fast && !turns && wait == 0) {
            offset = last_run_offset;
            done = step_port_extend(offset);
        } else {
            uint16_t top = (uint16_t)(segment_at(offset)->top + wait);
            if (turns && top < TURN_TICKS + width_ticks)
                top = (uint16_t)(TURN_TICKS + width_ticks);
            done = step_port_arm(offset, top, (uint16_t)(top - width_ticks), flags);
        }
        if (!done)
            return; /* not at this moment */
        joined_offset = offset;
    }
    take_next();
    if (!timely) {
        if (step_idle || command.flags & MOTION_SYNC) /* held, it stands still */
            expire_gap();
        start_now();
        return;
    }
    drop_emission();
    joined++;
    /* Longer than the gap the wait means a start from slow speed. */
    if (wait >> PROFILE_CHUNK_LOG2 >= closing_chunks && wait > (closing_chunks << PROFILE_CHUNK_LOG2) + closing_ticks)
        expire_gap();
    stage = STAGE_RUN;
    if (wait >= SHORTEST_PIECE_TICKS) {
        dir_due = turns;
        stage = STAGE_LEAD;
    } else {
        add_pulses(flags, 1);
    }
    plan();
    fill();
}

status_t engine_check(const motion_command_t *c)
{
    return profile_check(&basis, c, settings.pulse_us);
}

void engine_offer(const motion_command_t *offered)
{
    next = offered;
    if (next && !playing) {
        take_next();
        start_now();
    }
}

uint8_t engine_commands_begun(void)
{
    return begun;
}

void engine_release(void)
{
    step_port_release();
}

NOINLINE bool engine_poll(void)
{
    bool worked = false;
    look_for_end();
    if (step_late) {
        step_late = 0;
        faults |= ENGINE_FAULT_LATE;
    }
    if (playing && step_idle) {
        if (!step_port_snapshot().period_over) {
            /* The last period is not over. */
        } else if ((stage == STAGE_REST || stage == STAGE_GAP) && step_head == step_tail) {
            step_port_halt();
            playing = false;
            tail_valid = false;
            single = false;
            if (next) {
                take_next();
                start_now();
            } else {
                expire_gap();
            }
        } else if (step_head != step_tail) {
            /* The planner was so late that the timer ran out of segments: go on where it stopped. */
            if (stage == STAGE_RUN)
                faults |= ENGINE_FAULT_STARVED;
            step_port_start();
        }
        worked = true;
    }
    if (next && playing && !single && (stage == STAGE_GAP || stage == STAGE_END || stage == STAGE_REST))
        join_next();
    /* Until the ring is half full nothing else is as urgent, within reason; then a step at a time. */
    uint8_t rounds = 6;
    if (playing) {
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
    return ended;
}

uint8_t engine_commands_played(void)
{
    return played;
}

/* A command has been begun (its start wait included) and has not ended. */
static bool running(void)
{
    look_for_end();
    return tail_awaited || (playing && (stage == STAGE_LEAD || stage == STAGE_RUN || stage == STAGE_TAIL));
}

/* -- stopping ---------------------------------------------------------------------------------------------------- */

static void drop_next(void)
{
    look_for_end();
    ended = (uint8_t)(ended + joined);
    next = 0;
    joined = 0;
}

/* Freezes the pulse train where it is. */
static void halt(void)
{
    if (!playing)
        return;
    step_port_halt();
    if (running()) {
        ended++;
        if (motion_state != MOTION_STANDBY)
            played++;
    }
    emitted = engine_position();
    playing = false;
    drop_emission();
    stage = STAGE_REST;
    motion_state = MOTION_STANDBY;
}

void engine_stop(void)
{
    drop_next();
    halt();
    v_in_play = basis.v_slow;
    in_play_cycle_us = 0;
}

/* Ends the running command after what is to be played soon. Returns the interval there in ticks; 0: nothing to be cut
 * (it ends by itself now, or it stands in the middle of a wait or of an interval longer than that of slow speed). */
static uint32_t cut(void)
{
    allow_hold(0);
    step_snapshot_t at = step_port_snapshot();
    uint8_t offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    uint16_t left = at.to_count;
    uint32_t keep_ticks = CUT_KEEP_TICKS;
    const segment_t *s;
    for (;;) {
        s = segment_at(offset);
        uint32_t period = period_ticks(s);
        uint32_t ticks = period * left;
        if (is_silent(s)) {
            if ((s->flags & SEGMENT_STATE_MASK) == MOTION_STOP)
                return 0;
        } else if ((ticks >= keep_ticks && (left > 1 || offset != (uint8_t)(at.tail - SEGMENT_BYTES))) ||
                   (uint8_t)(offset + SEGMENT_BYTES) == step_head) {
            /* (Not the last period of the loaded segment: what follows it may be loaded meanwhile.) */
            uint16_t needed = (uint16_t)(keep_ticks / period + 4u);
            if (needed < left)
                left = needed;
            break;
        }
        keep_ticks = keep_ticks > ticks ? keep_ticks - ticks : 0;
        offset = (uint8_t)(offset + SEGMENT_BYTES);
        if (offset == step_head)
            return 0;
        left = counted_periods(segment_at(offset));
    }
    uint32_t interval_ticks = interval_at(offset);
    if (interval_ticks > basis.slow_ticks + 1)
        return 0;
    emitted -= pulses_from((uint8_t)(offset + SEGMENT_BYTES));
    emitted -= signed_pulses(s, step_port_shorten(offset, left));
    drop_emission();
    return interval_ticks;
}

/* Ends the running command with a deceleration, or none. */
static void end_command(accel_code_t decel, bool linear)
{
    if (!running())
        return;
    motion_state_t state = engine_state();
    if (state == MOTION_STOP || (state == MOTION_DECEL && decel != ACCEL_NONE))
        return; /* ending already */
    uint32_t ticks = state == MOTION_STANDBY ? 0 : cut();
    if (ticks == 0) {
        if (state == MOTION_STANDBY || stage == STAGE_RUN || silence_chunks || piece_ticks) {
            /* In a start wait or at slow speed: there is nothing to ramp down from. */
            halt();
            v_in_play = basis.v_slow;
            in_play_cycle_us = 0;
        }
        return;
    }
    profile_plan_decel(&profile, &basis, ramp_velocity(&basis.ramp, ticks), decel, linear);
    profile.cruise.chunks = ticks >> PROFILE_CHUNK_LOG2;
    profile.cruise.ticks_q8 = (ticks & (PROFILE_CHUNK_TICKS - 1)) << 8;
    if (profile.decel_pulses == 0)
        profile.cruise_pulses = 1; /* the closing interval */
    endless = false;
    ramp_state = MOTION_STANDBY;
    stage = STAGE_RUN;
}

void engine_stop_graceful(accel_code_t decel, bool linear)
{
    drop_next();
    end_command(decel, linear);
}

bool engine_next(void)
{
    look_for_end();
    if (joined) /* it ends within JOIN_SOON_TICKS */
        return false;
    end_command(ACCEL_NONE, false);
    return true;
}

bool engine_next_graceful(void)
{
    look_for_end();
    if (joined)
        return false;
    end_command(command.decel, (command.flags & MOTION_LINEAR) != 0);
    return true;
}

/* Needs no plan: a ring of one segment. A pulse takes 13 us and is waited for before the next one: all of them are made,
 * as fast as they can be typed at 250,000 Bd. */
void engine_single_pulse(bool ccw)
{
    if (single) {
        step_port_finish();
    } else if (running() || next) {
        return;
    }
    if (estop_port_active())
        return;
    begin_ring();
    stage = STAGE_REST;
    single = true;
    command.flags = ccw ? MOTION_CCW : 0;
    uint8_t flags = direction_flags(&command, true);
    uint16_t width = width_ticks;
    append(1, (uint16_t)(TURN_TICKS + width - 1), width, flags);
    add_pulses(flags, 1);
    play();
}

/* -- what others see ------------------------------------------------------------------------------------------------ */

motion_state_t engine_state(void)
{
    return (motion_state_t)motion_state;
}

void engine_velocity(uint32_t *rpm, uint32_t *cycle_us)
{
    uint32_t v = v_in_play;
    uint32_t exact_cycle_us = in_play_cycle_us;
    motion_state_t state = engine_state();
    if (playing && state == MOTION_CRUISE) {
        exact_cycle_us = profile.cycle_us;
        v = profile_rpm(&basis, &command) * 100u << basis.factor_log2;
    } else if (playing && (state == MOTION_ACCEL || state == MOTION_DECEL)) {
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
    gap_on = on;
}

bool engine_gap(void)
{
    return gap_on;
}

uint8_t engine_faults(void)
{
    return faults;
}

uint32_t command_rpm(const motion_command_t *c)
{
    return profile_rpm(&basis, c);
}

uint32_t command_cycle_us(const motion_command_t *c)
{
    return profile_cycle_us(&basis, c);
}
