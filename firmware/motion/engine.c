/* See engine.h; why it is built this way: docs/design.md. */
#include "motion/engine.h"
#include "base/atomic.h"
#include "base/inline.h"
#include "drivers.h"
#include "motion/block.h"
#include "motion/estop_port.h"
#include "motion/profile.h"
#include "motion/ramp.h"
#include "motion/segment.h"
#include "motion/step_port.h"
#include "settings.h"

#define TICKS_PER_US 16u
#define DIR_SETUP_CYCLES 80u      /* dir before the first pulse: 5 us, the slowest common drivers ask for it */
#define TURN_CYCLES (DIR_SETUP_CYCLES + 100u) /* the same where the step interrupt sets dir: its latency and cycles */
#define TAIL_TICKS 320u          /* the end of the closing interval, on which a following command is joined */
#define SHORTEST_PIECE_TICKS 128u
#define RUN_MAX_PERIODS 65000u
#define AHEAD_PERIOD_TICKS 2048u /* silence begun before planning; when its last period begins, the next segment is there */
#define AHEAD_PERIODS 12u        /* 1.5 ms, in which a harmonic profile is planned ... */
#define AHEAD_TICKS (AHEAD_PERIODS * AHEAD_PERIOD_TICKS)
#define AHEAD_LONG_PERIODS 24u   /* ... and 3 ms, for a linear one and wherever possible */
#define AHEAD_LONG_TICKS (AHEAD_LONG_PERIODS * AHEAD_PERIOD_TICKS)
#define CUT_KEEP_CYCLES 49152u    /* motion left to run while a deceleration is planned */
#define CRUISE_GROUP_TICKS 4096u /* shortest run of a cruise whose interval has a fraction */
#define JOIN_CYCLES 18000u         /* before the tail: to plan a command and emit its first intervals */
#define JOIN_LINEAR_CYCLES 40000u  /* the same for a linear one */
#define JOIN_FLAT_CYCLES 2500u     /* and for one without ramps */
#define JOIN_SOON_CYCLES 160000u   /* before the tail: when that is done at the earliest */
#define START_CYCLES 12000u       /* in the ring before the timer runs */
#define START_PERIODS 4u         /* and at least so many: a segment is loaded when the one before it begins */
#define GEAR_CYCLES 1600u        /* with auto-micro: no pulses nearer than these, if larger steps can help it */
#define HOLD_LEAST 64u           /* pulses that may be repeated if the ring runs empty; with fewer, more are allowed */
#define RING_REFILL (12u * SEGMENT_BYTES) /* free segments for a block to be gone on with, while no command waits */
#define RING_REFILL_SINGLE (8u * SEGMENT_BYTES) /* ... where each of them is one pulse: a full ring is soon played */
#define RING_RESERVE (4u * SEGMENT_BYTES) /* segments that one step of emission may need */

/* What comes next of the command being emitted. */
typedef enum {
    STAGE_LEAD, /* start wait and first pulse */
    STAGE_RUN,  /* the intervals between its pulses */
    STAGE_TAIL, /* the end of its closing interval */
    STAGE_GAP,  /* the interval in which the velocity stays in play */
    STAGE_END,
    STAGE_REST, /* nothing: all of it is in the ring or played */
} stage_t;

static struct {
    uint16_t width_ticks; /* of a pulse */
    uint8_t gear;         /* each pulse makes this power of two of the smallest steps, in which all that is planned counts */
    uint8_t running_gear; /* of the pulse being played when the position was last looked at */
    uint8_t origin;       /* a full step's position, modulo 256 */
    uint8_t gear_bits;    /* the gear, and MS1 to MS3, as segments have them */
    uint8_t part_mask;    /* the bits of a number of smallest steps that are less than a pulse in this gear ... */
    uint8_t step_mask;    /* ... and less than a full step */
    int32_t adjust_q16;   /* each interval is longer by so many ticks: xclk - ihd */
    bool plain;           /* it is not, and a tick is a cycle */
    const motion_command_t *next; /* offered, not begun; null: nothing */
    bool endless;                 /* the command goes on until it is cut */
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

    uint32_t closing_us;     /* closing interval of the last command emitted, whole microseconds */
    uint16_t tail_ticks;     /* its end */
    bool tail_fast;          /* too fast for a tail: a following command lengthens the last run instead */
    uint8_t tail_offset;     /* the tail's segment, while stage is REST, GAP or END */
    bool tail_awaited;       /* it has not begun: its command has not ended, and another one can be joined to it */
    uint8_t joined;          /* the ring holds the end of so many commands and the beginning of the next one ... */
    uint8_t joined_offset;   /* ... which begins at the end of this segment */

    int32_t emitted; /* position, in pulses, when all that is in the ring has been played */
    uint32_t v_in_play;
    uint32_t in_play_cycle_us; /* 0: follows from v_in_play */
    uint8_t begun; /* commands, modulo 256 */
    uint8_t ended;
    uint8_t played; /* those of them that were more than a start wait */
    uint8_t faults;
    bool gap_off;
    bool single; /* the ring plays single pulses */
} engine;
static profile_basis_t basis;
static uint16_t certain_accel;   /* steepest linear ramp to 100 RPM whose first interval is surely longer than that silence */
static motion_command_t command; /* being emitted or played */
static profile_t profile;        /* what is left of the command to be emitted */
static ramp_t ramp;
static block_t block; /* of the phase being emitted, while it has runs left */

static bool is_ccw(const motion_command_t *c)
{
    return (c->flags & MOTION_CCW) != 0;
}

static bool is_held(const motion_command_t *c)
{
    return (c->flags & MOTION_SYNC) != 0;
}

/* Not more ticks than such cycles, with an external clock. */
static NOINLINE uint16_t ticks_of_cycles(uint16_t cycles)
{
    return (uint16_t)(cycles >> basis.ramp.cycles_log2);
}

/* Whole microseconds of so many PROFILE_CHUNK_TICKS and ticks. */
static uint32_t us_of(uint32_t chunks, uint32_t ticks)
{
    if (basis.ramp.cycles_log2 == 0)
        return (chunks << (PROFILE_CHUNK_LOG2 - 4)) + ticks / TICKS_PER_US;
    wide_t us;
    wide_set(&us, (chunks << PROFILE_CHUNK_LOG2) + ticks);
    wide_multiply(&us, 1000000);
    wide_divide(&us, basis.ramp.clock_hz);
    return wide_half(&us, 0);
}

/* The first pulse comes so long after the start wait: with those that are released together, a fixed time. A wait too short
 * for a period of its own is part of it. */
static uint16_t setup_ticks(void)
{
    uint8_t wait_us = (uint8_t)command.start_wait_us;
    return (uint16_t)(ticks_of_cycles((uint16_t)(DIR_SETUP_CYCLES + wait_us * TICKS_PER_US)) + engine.width_ticks);
}

/* A period at whose beginning dir or MS1 to MS3 are set, at least. */
static NOINLINE uint16_t turn_ticks(void)
{
    return (uint16_t)(ticks_of_cycles(TURN_CYCLES) + 1 + engine.width_ticks);
}

static NOINLINE bool has_no_ramps(const motion_command_t *c)
{
    NEAR(c);
    return c->accel == ACCEL_NONE && c->decel == ACCEL_NONE;
}

/* Segment flags of a command's pulses, and with `turn` those that set the dir pin. */
static uint8_t direction_flags(const motion_command_t *c, bool turn)
{
    uint8_t flags = is_ccw(c) ? 1 << SEGMENT_CCW_BIT : 0;
    if (turn) {
        flags |= 1 << SEGMENT_SET_DIR_BIT;
        if (is_ccw(c) != (settings.cw_level != 0))
            flags |= 1 << SEGMENT_DIR_BIT;
    }
    return flags;
}

/* -- gears ------------------------------------------------------------------------------------------------------- */

static NOINLINE uint8_t mask_below(uint8_t log2)
{
    return (uint8_t)((1u << log2) - 1u);
}

static NOINLINE void set_gear(uint8_t gear)
{
    engine.gear = gear;
    engine.part_mask = mask_below(gear);
    engine.gear_bits = (uint8_t)(drivers_pins(settings.driver_id, (uint8_t)(basis.factor_log2 - gear), settings.driver_map)
                                     << SEGMENT_MS_SHIFT |
                                 gear);
}

static uint8_t gear_of(const segment_t *s)
{
    return s->gear & SEGMENT_GEAR_MASK;
}

/* Smallest steps to the next full one. */
static NOINLINE uint8_t to_full_step(void)
{
    uint8_t place = (uint8_t)((uint8_t)engine.emitted - engine.origin);
    if (!is_ccw(&command))
        place = (uint8_t)(0u - place);
    return place & engine.step_mask;
}

/* In standstill: the lowest, but within a step that of it is kept. */
static NOINLINE void reset_gear(void)
{
    set_gear(settings.auto_microstep && to_full_step() != 0 ? engine.gear : 0);
    step_port_microsteps(engine.gear_bits >> SEGMENT_MS_SHIFT);
}

static NOINLINE void forget_velocity(void)
{
    engine.v_in_play = basis.v_slow;
    engine.in_play_cycle_us = 0;
}

void engine_init(void)
{
    uint8_t factor_log2 = basis.factor_log2;
    uint32_t clock_hz = settings.internal_clock ? TICKS_PER_US * 1000000u : settings.xclk_hz;
    profile_basis(&basis, settings.steps_per_rev, drivers_ustep(settings.driver_id, settings.ustep),
                  settings.slow_rpm, clock_hz);
    engine.step_mask = mask_below(basis.factor_log2);
    forget_velocity();
    engine.gap_off = false;
    /* sqrt(3.217e15 / (sprf * F * accel)) ticks; with so many steps there is one at least. */
    certain_accel = (uint16_t)(basis.ramp.steps_per_rev < 200 ? 0 : (1300000u >> basis.factor_log2) / basis.ramp.steps_per_rev);
    profile_interval_t width;
    profile_interval(&basis, settings.pulse_us, 0, &width);
    engine.width_ticks = (uint16_t)((width.ticks_q8 + 255) >> 8);
    /* In half microseconds. */
    wide_t half_us_q20;
    wide_set(&half_us_q20, clock_hz);
    wide_multiply(&half_us_q20, 512u * 16u);
    wide_divide(&half_us_q20, 15625);
    engine.adjust_q16 = (int16_t)(settings.xclk_counts - settings.ihd_counts) * (int32_t)wide_half(&half_us_q20, 0) >> 4;
    engine.plain = settings.internal_clock && engine.adjust_q16 == 0;
    step_port_init();
    if (basis.factor_log2 != factor_log2) /* a position in other steps says nothing: the motor is taken to stand at a full one */
        engine.origin = (uint8_t)engine.emitted;
    reset_gear();
}

/* -- the ring -------------------------------------------------------------------------------------------------- */

/* So many periods before its end such a segment's reload is begun. */
static NOINLINE uint8_t early_periods(const segment_t *s)
{
    return (uint8_t)((s->flags & SEGMENT_EARLY_MASK) >> SEGMENT_EARLY_SHIFT);
}

_Static_assert(SEGMENT_EARLY1_BELOW_TICKS <= UINT8_MAX, "early_of() looks at the low byte of what is below it");

/* The same for periods of top + 1 ticks. */
static NOINLINE uint8_t early_of(uint16_t top)
{
    uint8_t early = 0;
    if (top < SEGMENT_EARLY1_BELOW_TICKS - 1 && !basis.ramp.cycles_log2) { /* no period of an external clock is so short */
        uint8_t low = (uint8_t)top;
        early = 1;
        if (low < SEGMENT_EARLY2_BELOW_TICKS - 1)
            early = 2;
        if (low < SEGMENT_EARLY3_BELOW_TICKS - 1)
            early = 3;
    }
    return early;
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

/* In bytes. One slot stays empty; the loaded segment and the one before it are still needed for the position. */
static NOINLINE uint8_t ring_free(void)
{
    return (uint8_t)((SEGMENT_COUNT - 3u) * SEGMENT_BYTES - (uint8_t)(step_head - step_tail));
}

/* So many of them in one run. */
static uint16_t run_of(uint32_t periods)
{
    return periods > RUN_MAX_PERIODS ? RUN_MAX_PERIODS : (uint16_t)periods;
}

/* Pulses of the running command that are not in the ring yet, the first RUN_MAX_PERIODS of them. */
static NOINLINE uint16_t pulses_left(void)
{
    return run_of(profile.accel_pulses + profile.cruise_pulses + profile.decel_pulses);
}

/* Those of them that are made in this gear: not the last one, which has the closing interval, and, where something is left
 * at the end that is no whole pulse, those up to the last full step only. */
static NOINLINE uint16_t pulses_in_gear(void)
{
    uint8_t part = engine.part_mask;
    uint16_t left = pulses_left();
    if (left <= part + 1u)
        return 0;
    left = (uint16_t)(left - part - 1u);
    if ((uint8_t)left & part)
        left = (uint16_t)(left - (uint8_t)((uint8_t)((uint8_t)left - to_full_step()) & engine.step_mask));
    return left;
}

/* Those of them that come after the next `planned` ones and may be repeated if the ring runs empty. */
static NOINLINE uint8_t pulses_to_come(uint16_t planned)
{
    uint16_t left = pulses_in_gear();
    if (left <= planned)
        return 0;
    left = (uint16_t)((uint16_t)(left - planned) >> engine.gear);
    return (uint8_t)(left > 254 ? 254 : left);
}

/* Clockwise positive. */
static NOINLINE int32_t signed_pulses(uint8_t flags, uint16_t pulses, uint8_t gear)
{
    int32_t steps = (int32_t)((uint32_t)pulses << gear);
    return flags & (1 << SEGMENT_CCW_BIT) ? -steps : steps;
}

static NOINLINE void add_pulses(uint8_t flags, uint16_t pulses)
{
    engine.emitted += signed_pulses(flags, pulses, engine.gear);
}

/* Of a segment, so many periods. */
static NOINLINE int32_t pulses_of(const segment_t *s, uint16_t periods)
{
    return is_silent(s) ? 0 : signed_pulses(s->flags, periods, gear_of(s));
}

/* Is the one-period segment at `offset` being played, or over? (It is loaded one period before it begins, and what comes
 * after it when it begins. With the timer idle, all that was loaded has begun.) */
static bool has_begun(uint8_t offset)
{
    return (uint8_t)(step_head - offset) > (uint8_t)(step_head - step_tail + (step_idle ? 0 : SEGMENT_BYTES));
}

static void end_joined(void)
{
    engine.ended = (uint8_t)(engine.ended + engine.joined);
    engine.played = (uint8_t)(engine.played + engine.joined);
    engine.joined = 0;
}

/* The command whose closing interval has begun its tail has ended. */
static void look_for_end(void)
{
    if (engine.joined && has_begun(engine.joined_offset))
        end_joined();
    if (engine.tail_awaited && has_begun(engine.tail_offset)) {
        engine.tail_awaited = false;
        engine.ended++;
        engine.played++;
    }
}

/* Takes pulses from the phase, while there are any; returns how many more there should have been. */
static NOINLINE uint16_t take(uint32_t *phase, uint16_t pulses)
{
    uint16_t some = *phase < pulses ? (uint16_t)*phase : pulses;
    *phase -= some;
    return (uint16_t)(pulses - some);
}

/* The interrupt has repeated the last interval because the ring was empty: so many pulses fewer are to be made. */
static void absorb_held(void)
{
    uint8_t lock = atomic_begin();
    uint8_t pulses = step_held;
    step_held = 0;
    atomic_end(lock);
    engine.faults |= ENGINE_FAULT_STARVED;
    const segment_t *last = segment_at((uint8_t)(step_head - SEGMENT_BYTES));
    engine.emitted += pulses_of(last, pulses);
    uint16_t held = (uint16_t)(pulses << gear_of(last));
    /* The cruise becomes shorter, or, where there is none, the ramps; the closing interval stays. */
    uint16_t left = pulses_left();
    uint16_t pulse = engine.part_mask + 1u;
    uint16_t given = left > held ? held : left > pulse ? (uint16_t)(left - pulse) : 0;
    engine.owed = (uint16_t)(engine.owed + held - given);
    take(&profile.decel_pulses, take(&profile.accel_pulses, take(&profile.cruise_pulses, given)));
}

/* So many pulses may be repeated from now on if the ring runs empty. */
static NOINLINE void allow_hold(uint8_t pulses)
{
    uint8_t left = 0;
    uint8_t lock = atomic_begin();
    uint8_t held = step_held; /* those held meanwhile will be given back */
    if (pulses > held)
        left = (uint8_t)(pulses - held);
    step_hold = left;
    atomic_end(lock);
}

/* Before segments are appended: takes account of what has been played. True if held pulses were among it. Until they are
 * appended no more pulses may be repeated than before: what a joined command's first pulse ends is a tail, not one of its
 * intervals. */
static NOINLINE uint8_t settle(uint8_t hold)
{
    look_for_end();
    if (hold < step_hold + step_held)
        allow_hold(hold); /* first, so that what is held from here on can be given back */
    uint8_t held = step_held;
    if (held != 0)
        absorb_held();
    return held;
}

/* Appends a segment as it is: no early reload, pulses not accounted for. */
static NOINLINE void append(uint16_t periods, uint16_t top, uint16_t match, uint8_t flags)
{
    segment_t *s = segment_at(step_head);
    s->top = top;
    s->match = match;
    s->count_low = (uint8_t)periods;
    s->count_high = (uint8_t)((uint16_t)(periods - 1) >> 8);
    s->flags = flags;
    s->gear = engine.gear_bits;
    step_head = (uint8_t)(step_head + SEGMENT_BYTES);
}

/* Appends so many periods of so many ticks (0: 65,536), of any length. Runs too short to be reloaded in time (periods that
 * need an early reload, no more of them than are waited for) are stretched: their count stays exact. */
static NOINLINE void append_run(uint16_t periods, uint16_t ticks, bool pulse, uint8_t flags)
{
    if (pulse)
        add_pulses(flags, periods);
    uint16_t top = (uint16_t)(ticks - 1);
    uint8_t early = early_of(top);
    if (periods > early) {
        periods = (uint16_t)(periods - early);
        early = (uint8_t)(early << SEGMENT_EARLY_SHIFT);
        flags |= early;
        if (early & 1 << SEGMENT_HURRIED_BIT)
            step_port_hurry();
    } else {
        top = SEGMENT_EARLY1_BELOW_TICKS - 1;
    }
    append(periods, top, pulse ? (uint16_t)(top - engine.width_ticks) : SEGMENT_SILENT, flags);
}

/* The same for periods of the phase, once what has been played is settled: pulses that were held are left out. */
static void push(uint16_t periods, uint16_t ticks, bool pulse)
{
    bool turn = false;
    if (periods == 1) {
        turn = engine.dir_due;
        engine.dir_due = false;
    }
    settle(pulse ? pulses_to_come(0) : 0);
    if (pulse) {
        uint16_t given = (uint16_t)(engine.owed >> engine.gear);
        if (given > periods)
            given = periods;
        periods = (uint16_t)(periods - given);
        engine.owed = (uint16_t)(engine.owed - (given << engine.gear));
    }
    if (periods)
        append_run(periods, ticks, pulse, (uint8_t)(engine.ramp_state | direction_flags(&command, turn)));
    if (pulse && !turn && step_hold < HOLD_LEAST) /* (a period before another gear is not one to be repeated in it) */
        allow_hold(pulses_to_come(0));
}

/* The interval that ends with the pulse of the segment at `offset`, as it was planned: its period and the silence before
 * it. */
static uint32_t interval_at(uint8_t offset)
{
    const segment_t *before = segment_at((uint8_t)(offset - SEGMENT_BYTES));
    const segment_t *s = segment_at(offset);
    uint32_t ticks = is_silent(before) ? ticks_of(before, counted_periods(before)) : 0;
    ticks += ticks_of(s, 1) - (uint32_t)(engine.adjust_q16 >> 16);
    return ticks >> gear_of(counted_periods(s) == 1 ? before : s); /* that of the pulse before it */
}

/* Ticks from the segment at `offset`, which has so many periods left, to the one at `end`, or more than
 * JOIN_SOON_CYCLES. */
static uint32_t ticks_between(uint8_t offset, uint16_t periods, uint8_t end)
{
    uint32_t ticks = 0;
    while (offset != end && ticks <= JOIN_SOON_CYCLES) {
        ticks += ticks_of(segment_at(offset), periods);
        offset = (uint8_t)(offset + SEGMENT_BYTES);
        periods = counted_periods(segment_at(offset));
    }
    return ticks;
}

/* Pulses in the segments from `offset` on, clockwise positive. */
static int32_t pulses_from(uint8_t offset)
{
    int32_t pulses = 0;
    while (offset != step_head) {
        const segment_t *s = segment_at(offset);
        pulses += pulses_of(s, (uint16_t)(counted_periods(s) + early_periods(s)));
        offset = (uint8_t)(offset + SEGMENT_BYTES);
    }
    return pulses;
}

int32_t engine_position(void)
{
    if (!engine.playing)
        return engine.emitted;
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded_offset = (uint8_t)(at.tail - SEGMENT_BYTES);
    const segment_t *loaded = segment_at(loaded_offset);
    const segment_t *running = loaded;
    uint16_t counted = counted_periods(loaded);
    int32_t to_come = pulses_from(at.tail);
    if (!step_idle) { /* otherwise its last period is running, or over */
        if (at.to_count == counted)
            running = segment_at((uint8_t)(loaded_offset - SEGMENT_BYTES));
        to_come += pulses_of(loaded, (uint16_t)(at.to_count + early_periods(loaded)));
    }
    if (!at.pulse_high && !at.period_over)
        to_come += pulses_of(running, 1);
    engine.running_gear = gear_of(running);
    return engine.emitted - to_come;
}

/* -- emission -------------------------------------------------------------------------------------------------- */

/* Sets up an interval of so many ticks (which may be negative) and the silence that is set up already, which ends with a
 * pulse (or not); emit() turns it into segments. */
static void set_interval(int32_t ticks, bool pulse)
{
    ticks -= engine.ahead_ticks;
    engine.ahead_ticks = 0;
    uint32_t chunks = engine.silence_chunks + (uint32_t)(ticks >> PROFILE_CHUNK_LOG2);
    uint16_t piece = (uint16_t)((uint16_t)ticks % PROFILE_CHUNK_TICKS);
    /* No piece too short, and what fits a period is one. */
    if (chunks == 1 || (chunks && piece < SHORTEST_PIECE_TICKS)) {
        piece = (uint16_t)(piece + PROFILE_CHUNK_TICKS);
        chunks--;
    }
    engine.silence_chunks = chunks;
    engine.piece_ticks = piece;
    engine.piece_pulse = pulse;
}

static NOINLINE void set_silence(uint32_t us)
{
    profile_interval_t silence;
    profile_interval(&basis, us, 0, &silence);
    engine.silence_chunks = silence.chunks;
    set_interval((int32_t)(silence.ticks_q8 >> 8), false);
}

/* Adds the carried fraction to a time; what remains is carried on. */
static uint32_t take_carry(uint32_t ticks, uint16_t frac_q16)
{
    int32_t carry = engine.carry_q16 + frac_q16;
    engine.carry_q16 = carry & 0xFFFF;
    return (uint32_t)((int32_t)ticks + (carry >> 16));
}

static void begin_phase(motion_state_t state)
{
    if (engine.ramp_state == state)
        return;
    engine.ramp_state = state;
    if (state != MOTION_CRUISE)
        profile_begin_ramp(&profile, &basis, state == MOTION_ACCEL, &ramp);
}

/* That of the next pulse. */
static NOINLINE void choose_phase(void)
{
    motion_state_t state = MOTION_ACCEL;
    uint32_t *left = &profile.accel_pulses;
    while (*left <= engine.part_mask && state != MOTION_DECEL) {
        left[1] += *left; /* part of a pulse */
        *left = 0;
        left++; /* cruise, deceleration */
        state++;
    }
    if (engine.endless && state == MOTION_CRUISE)
        *left = UINT32_MAX / 2;
    engine.phase_left = left;
    begin_phase(state);
}

/* Does the phase have its longer intervals first? */
static bool speeds_up(void)
{
    return engine.ramp_state == MOTION_ACCEL && profile.faster;
}

/* `pulses` intervals of the phase that last `ticks` together: of two neighbouring values. Too few of either kind for an
 * early reload are made like the others, and the difference is carried. */
static void emit_flat(uint16_t pulses, uint32_t ticks)
{
    if (pulses == 1) {
        if (ticks > 65535u || engine.ahead_ticks || engine.silence_chunks)
            set_interval((int32_t)ticks, true);
        else
            push(1, (uint16_t)ticks, true);
        return;
    }
    uint16_t each = (uint16_t)(ticks / pulses);
    uint16_t longer = (uint16_t)(ticks % pulses);
    uint16_t ideal = longer;
    uint8_t early = early_of((uint16_t)(each - 1));
    if (longer <= early)
        longer = 0;
    else if (pulses - longer <= early)
        longer = pulses;
    engine.carry_q16 += (int32_t)((uint32_t)(uint16_t)(ideal - longer) << 16);
    uint8_t more = engine.ramp_state == MOTION_CRUISE || speeds_up();
    for (uint8_t kinds = 2; kinds; kinds--) {
        uint16_t some = more ? longer : (uint16_t)(pulses - longer);
        if (some)
            push(some, (uint16_t)(each + more), true);
        more ^= 1;
    }
}

/* The phase's pulses that may be emitted, so many of them in one run. */
static NOINLINE uint16_t pulses_of_phase(void)
{
    uint16_t most = pulses_in_gear();
    uint32_t left = *engine.phase_left;
    if (left < most)
        most = (uint16_t)left;
    return most & (uint16_t)~engine.part_mask;
}

/* Appends what the ring has room for of the block. */
static void emit_block(void)
{
    uint8_t pulses = block.pulses;
    uint8_t runs = block.runs;
    uint16_t planned = (uint16_t)(runs * pulses << engine.gear);
    if (settle(pulses_to_come(planned))) {
        uint16_t most = pulses_of_phase();
        if (most < planned) /* held pulses have been taken from it */
            block.runs = runs = (uint8_t)((most >> engine.gear) / pulses);
    }
    block_append(&block);
    uint16_t made = (uint16_t)((uint8_t)(runs - block.runs) * pulses);
    take(engine.phase_left, (uint16_t)(made << engine.gear));
    add_pulses(block.flags, made);
    if (step_hold < HOLD_LEAST)
        allow_hold(pulses_to_come((uint16_t)(block.runs * pulses << engine.gear)));
    if (block.runs == 0)
        engine.carry_q16 += (int32_t)(block.shape & BLOCK_SPLIT ? block.carry_q16 : (uint32_t)block.carry_q16 * pulses);
}

/* What the block's runs do not say: the ticks carried so far, their segments' flags. */
static void begin_block(void)
{
    block_t *b = &block;
    NEAR(b);
    uint8_t split = (uint16_t)((uint16_t)(b->top_q16 >> 16) + 1u) >= basis.ramp.split_ticks ? BLOCK_SPLIT : 0;
    b->shape = speeds_up() ? split | BLOCK_FASTER : split;
    uint32_t carry = 0;
    if (engine.carry_q16 > 0) { /* otherwise it waits for a single interval */
        carry = (uint32_t)engine.carry_q16;
        engine.carry_q16 = 0;
        if (!split || carry > UINT16_MAX) {
            carry /= b->pulses; /* of each interval */
            if (split || carry > UINT16_MAX) { /* left by runs of more pulses */
                b->top_q16 += carry / b->runs;
                carry = 0;
            }
        }
    }
    b->carry_q16 = (uint16_t)carry;
    b->width_ticks = engine.width_ticks;
    b->flags = (uint8_t)(engine.ramp_state | direction_flags(&command, false));
    b->gear = engine.gear_bits;
}

/* Intervals of the cruise, as ramp_next() has those of a ramp: one, or as many as there are, or a block. */
static NOINLINE uint16_t cruise_next(uint16_t run, ramp_time_t *sum)
{
    uint32_t chunks = profile.cruise.chunks;
    uint8_t gear = engine.gear;
    uint32_t ticks_q8 = (profile.cruise.ticks_q8 << gear) + (uint32_t)(engine.adjust_q16 >> 8);
    run = (uint16_t)(run >> gear);
    ramp.rest = false;
    if (chunks) {
        engine.silence_chunks = chunks - 1;
        ticks_q8 += (uint32_t)PROFILE_CHUNK_TICKS << 8;
    }
    uint32_t ticks = ticks_q8 >> 8;
    uint8_t frac = (uint8_t)ticks_q8;
    if (chunks > 1 || ticks > 65535u)
        run = 1;
    if (frac == 0 || run < 8) {
        uint32_t fraction = (uint32_t)frac * run;
        sum->ticks = ticks * run + (fraction >> 8);
        sum->frac_q16 = (uint16_t)(fraction << 8);
        return (uint16_t)(run << gear);
    }
    /* Runs of two neighbouring values. */
    uint8_t pulses = 8;
    run /= 8;
    for (uint16_t least = CRUISE_GROUP_TICKS / 8; pulses < 128 && (uint16_t)ticks < least && run > 1; least /= 2) {
        pulses = (uint8_t)(pulses * 2);
        run /= 2;
    }
    block.runs = (uint8_t)(run > 255u ? 255u : run);
    block.pulses = pulses;
    block.top_q16 = (ticks_q8 - 256u) << 8;
    block.slope_q16 = 0;
    block.curve_q16 = 0;
    return 0;
}

/* The next intervals of the phase, as ramp_next() has them. */
static NOINLINE uint16_t next_group(uint16_t at_most, ramp_time_t *sum)
{
    if (engine.ramp_state == MOTION_CRUISE)
        return cruise_next(at_most, sum);
    uint8_t gear = engine.gear;
    ramp.least_run = (uint8_t)(engine.part_mask + 1);
    ramp.split_ticks = gear ? (uint8_t)0 : basis.ramp.split_ticks;
    uint8_t part = engine.part_mask;
    uint16_t steps = ramp_next(&ramp, at_most, sum, &block);
    while ((uint8_t)steps & part) { /* steep: in less than a pulse the velocity changes by much */
        ramp_time_t more;
        steps = (uint16_t)(steps + ramp_next(&ramp, (uint8_t)(0u - steps) & part, &more, &block));
        wide_add(&sum->q16, &more.q16);
        block.runs = 0;
    }
    uint16_t pulses = (uint16_t)(steps >> gear);
    if (pulses == 1)
        block.runs = 0;
    block_t *b = &block;
    NEAR(b);
    if (b->runs) {
        for (; gear; gear--) { /* from the smallest steps to pulses */
            b->pulses >>= 1;
            b->top_q16 += 65536u / 2;
            for (uint8_t i = 0; i < 3; i++)
                (&b->top_q16)[i] *= 2; /* slope and curve stand behind it */
        }
    }
    int32_t adjust_q16 = engine.adjust_q16;
    if (adjust_q16) {
        if (b->runs) {
            b->top_q16 += (uint32_t)adjust_q16;
        } else {
            sum->ticks += (uint32_t)(adjust_q16 >> 16) * pulses;
            engine.carry_q16 += (int32_t)((uint32_t)(uint16_t)adjust_q16 * pulses);
        }
    }
    return steps;
}

/* The interval after the last pulse of the command, of so many ticks and the silence that is set up: body, then tail. */
static void begin_closing(uint32_t ticks)
{
    engine.closing_us = us_of(engine.silence_chunks, ticks);
    uint16_t tail = TAIL_TICKS;
    if (engine.silence_chunks || ticks >= 2 * TAIL_TICKS)
        set_interval((int32_t)(ticks - TAIL_TICKS), false);
    else
        tail = (uint16_t)ticks;
    engine.tail_fast = early_of((uint16_t)(tail - 1)) != 0;
    engine.tail_ticks = engine.tail_fast ? SHORTEST_PIECE_TICKS : tail;
    engine.stage = STAGE_TAIL;
}

/* The gear for a pulse with which so much of the command is left: so that pulses are not nearer than GEAR_CYCLES, and no
 * part of a step is left. */
static NOINLINE uint8_t wanted_gear(uint16_t left)
{
    uint16_t ticks = ramp.ticks;
    if (engine.ramp_state == MOTION_CRUISE)
        ticks = profile.cruise.chunks ? UINT16_MAX : (uint16_t)(profile.cruise.ticks_q8 >> 8);
    uint8_t gear = 0;
    for (; gear < basis.factor_log2 && ticks < ticks_of_cycles(GEAR_CYCLES); gear++)
        ticks = (uint16_t)(ticks << 1);
    if (left <= engine.step_mask) {
        while ((uint8_t)left & mask_below(gear))
            gear--;
    }
    return gear;
}

/* The next intervals of the phase: pulses all alike, a block, or some of the former before a block. */
static NOINLINE void emit_phase(void)
{
    uint16_t at_most = pulses_of_phase();
    uint16_t pulse = engine.part_mask + 1u;
    uint8_t gear = engine.gear;
    bool closing = pulses_left() <= pulse;
    if (closing || engine.ahead_ticks || engine.owed >= pulse) {
        at_most = pulse;
    } else if (settings.auto_microstep) {
        uint8_t wanted = wanted_gear((uint16_t)(pulses_left() - pulse)); /* of the next pulse but one */
        if (wanted != gear) {
            /* At a full step: the pulse after the next interval is the first one of it. Nothing is held from here on, or it
             * would not begin there. */
            if (settle(0))
                return;
            uint16_t way = to_full_step();
            if (way == 0) {
                way = pulse;
                gear = wanted;
            }
            if (at_most == 0 || at_most > way)
                at_most = way;
        }
    }
    uint32_t ticks = 0;
    uint16_t pulses = 0;
    do {
        ramp_time_t sum;
        uint16_t group = next_group((uint16_t)(at_most - pulses), &sum);
        if (block.runs) {
            begin_block();
            break;
        }
        ticks += take_carry(sum.ticks, sum.frac_q16);
        pulses = (uint16_t)(pulses + group);
    } while (ramp.rest && pulses != at_most);
    take(engine.phase_left, pulses);
    if (closing) {
        begin_closing(ticks);
    } else if (pulses) {
        pulses = (uint16_t)(pulses >> engine.gear);
        if (gear != engine.gear) {
            set_gear(gear);
            engine.dir_due = true;
            if (ticks < turn_ticks()) /* from within a step, at speed */
                ticks = turn_ticks();
        }
        emit_flat(pulses, ticks);
    }
}

/* What comes next, but for a block, which is only begun. False if there is nothing. */
static bool emit_other(void)
{
    uint16_t silence = (uint16_t)(RUN_MAX_PERIODS - take(&engine.silence_chunks, RUN_MAX_PERIODS));
    if (silence) {
        push(silence, PROFILE_CHUNK_TICKS, false);
        return true;
    }
    if (engine.piece_ticks) {
        uint16_t ticks = engine.piece_ticks;
        engine.piece_ticks = 0;
        push(1, ticks, engine.piece_pulse);
        return true;
    }
    stage_t stage = engine.stage;
    if (stage == STAGE_RUN) {
        choose_phase();
        emit_phase();
        return true;
    }
    if (stage == STAGE_REST || (stage == STAGE_GAP && engine.next))
        return false; /* (it will be joined) */
    uint32_t us = command.start_wait_us;
    if (stage == STAGE_LEAD && us >= SHORTEST_PIECE_TICKS / TICKS_PER_US) {
        command.start_wait_us = 0;
        set_silence(us);
        return true;
    }
    engine.stage = (stage_t)(stage + 1);
    uint16_t ticks = SHORTEST_PIECE_TICKS;
    if (stage == STAGE_LEAD) {
        ticks = setup_ticks(); /* a short period of its own, because the state changes when it begins */
    } else if (stage == STAGE_TAIL) {
        engine.tail_offset = step_head;
        engine.tail_awaited = true;
        engine.ramp_state = MOTION_STOP;
        engine.v_in_play = profile.v_exit;
        engine.in_play_cycle_us = profile.exit_cycle_us;
        ticks = engine.tail_ticks;
    } else if (stage == STAGE_GAP) {
        engine.ramp_state = MOTION_STANDBY;
        if (!engine.gap_off)
            set_silence(engine.closing_us);
        return true;
    }
    push(1, ticks, stage == STAGE_LEAD);
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
    engine.silence_chunks = 0;
    engine.piece_ticks = 0;
    block.runs = 0;
    engine.ahead_ticks = 0;
    engine.ramp_state = MOTION_STANDBY;
    engine.tail_awaited = false;
    engine.dir_due = false;
}

/* -- starting and joining ----------------------------------------------------------------------------------------- */

static void begin_ring(void)
{
    if (engine.playing)
        step_port_halt();
    step_port_clock(!settings.internal_clock);
    engine.playing = false;
    step_head = step_tail = 0;
    step_hold = 0;
    step_held = 0;
    step_idle = 0;
    engine.owed = 0;
    engine.carry_q16 = 0;
    engine.joined = 0;
    engine.single = false;
    drop_emission();
    if (settings.auto_microstep)
        reset_gear();
}

/* Is the velocity in play kept until now? */
static void expire_gap(void)
{
    if (!engine.gap_off)
        forget_velocity();
}

static void plan(void)
{
    profile_plan(&profile, &basis, &command, engine.v_in_play);
}

static NOINLINE void play(void)
{
    engine.playing = true;
    step_port_start();
}

/* Takes the values of what is offered. */
static void take_next(void)
{
    command = *engine.next;
    engine.next = 0;
    engine.begun++;
    engine.endless = false;
    if (command.count == 0) {
        engine.endless = true;
        command.count = UINT32_MAX; /* its cruise is made longer as it is played */
        command.extra_pulses = 0;
        command.flags |= MOTION_PULSES;
    }
}

/* The first interval of most profiles is long, whatever the rest turns out to be: then the first pulse need not wait for
 * the planning. Returns the state it belongs to if it is surely longer than the silence that planning takes, from few
 * operations, otherwise MOTION_STANDBY. */
static motion_state_t certain_state(void)
{
    const motion_command_t *c = &command;
    NEAR(c);
    uint32_t velocity = c->velocity;
    uint8_t is_cycle = c->flags & MOTION_CYCLE;
    uint16_t accel = c->accel;
    if (!engine.plain || engine.v_in_play != basis.v_slow)
        return MOTION_STANDBY;
    if (accel == ACCEL_NONE) { /* the cruise interval, or that of the deceleration from there */
        if (is_cycle && velocity >> basis.factor_log2 >= AHEAD_LONG_TICKS / TICKS_PER_US + 8)
            return MOTION_CRUISE;
        return MOTION_STANDBY;
    }
    if (basis.slow_ticks < AHEAD_TICKS + SHORTEST_PIECE_TICKS)
        return MOTION_STANDBY;
    uint16_t least_rpm = 100;
    /* At most. */
    uint16_t whole = (uint16_t)(accel < ACCEL_CODE_WHOLE ? accel / 64u : accel - (ACCEL_CODE_WHOLE - 100u));
    if (!(c->flags & MOTION_LINEAR))
        least_rpm = (uint16_t)(settings.slow_rpm + 2u + whole); /* at least one step, at slow speed */
    else if (whole > certain_accel || accel > c->decel)
        return MOTION_STANDBY; /* (steeper than the deceleration: truncated, it may have no step) */
    if (!is_cycle) {
        if (velocity < least_rpm)
            return MOTION_STANDBY;
    } else if (velocity > UINT16_MAX || (uint32_t)least_rpm * (uint16_t)velocity > basis.us_rpm) {
        return MOTION_STANDBY;
    }
    return MOTION_ACCEL;
}

/* Emits enough to be played until the next round of the main loop, and where a ramp begins steeply, before the timer
 * runs, until the intervals that are slow to plan, one by one, are over. */
static void fill(void)
{
    uint32_t ticks = 0;
    uint16_t periods = 0;
    uint8_t offset = step_head;
    while ((ticks < ticks_of_cycles(START_CYCLES) || periods < START_PERIODS ||
            (!engine.playing && (((engine.ramp_state == MOTION_ACCEL || engine.ramp_state == MOTION_DECEL) &&
                                  (ramp.steep > 1 || ramp.group_log2 == 0)) ||
                                 (profile.cruise_pulses == 0 && ticks < ticks_of_cycles(CUT_KEEP_CYCLES))))) &&
           ring_free() >= RING_RESERVE && emit()) {
        uint16_t first = counted_periods(segment_at(offset));
        ticks += ticks_between(offset, first, step_head);
        periods = (uint16_t)(first + (uint8_t)(step_head - offset) / SEGMENT_BYTES); /* at least */
        offset = step_head;
    }
}

/* Without ramps a command is all cruise: it need not be planned either, if its interval is of whole ticks and the pulses
 * last for long enough. Emits them and returns how many; 0: plan first. */
static uint16_t begin_cruise(uint8_t flags)
{
    if (!has_no_ramps(&command) || !engine.plain)
        return 0;
    uint32_t cycle_us = profile_cycle_us(&basis, &command);
    if (cycle_us > UINT16_MAX / TICKS_PER_US)
        return 0;
    uint16_t full_ticks = (uint16_t)(cycle_us * TICKS_PER_US);
    uint16_t ticks = (uint16_t)(full_ticks >> basis.factor_log2);
    uint16_t run = run_of(command.count - 1); /* at least: full steps have more */
    if ((uint16_t)(ticks << basis.factor_log2) != full_ticks || (uint32_t)run * ticks < START_CYCLES)
        return 0;
    engine.ramp_state = MOTION_CRUISE;
    append_run(run, ticks, true, (uint8_t)(MOTION_CRUISE | flags));
    play();
    return run;
}

/* The start wait and the first pulse. */
static NOINLINE void emit_lead(void)
{
    for (uint8_t steps = 4; steps > 0 && engine.stage == STAGE_LEAD; steps--)
        emit(); /* sets the wait up, then its silence, then the pulse */
}

/* In standstill, before the first pulse of what has been planned. */
static void choose_start_gear(void)
{
    if (to_full_step() == 0) {
        choose_phase();
        set_gear(wanted_gear(pulses_left()));
        engine.ramp_state = MOTION_STANDBY;
    } else if (!engine.endless && (command.flags & MOTION_PULSES || command.extra_pulses)) {
        set_gear(0); /* as it was stopped within a step, so it is within a step that the ratio changes */
    }
    step_port_microsteps(engine.gear_bits >> SEGMENT_MS_SHIFT);
}

/* Starts the next command, which is not planned yet, from standstill. */
static void start_next(void)
{
    begin_ring();
    take_next();
    bool held = is_held(&command);
    if (held)
        expire_gap();
    uint8_t flags = direction_flags(&command, true);
    step_port_dir(flags & 1 << SEGMENT_DIR_BIT);
    flags &= 1 << SEGMENT_CCW_BIT;
    uint16_t cruised = 0;
    engine.stage = STAGE_LEAD;
    bool at_once = command.start_wait_us < 3072u;
    bool simple = settings.internal_clock && !settings.auto_microstep;
    if (!simple) {
        /* Planned before anything moves. */
    } else if (at_once) {
        uint16_t wait = (uint16_t)(command.start_wait_us * TICKS_PER_US);
        motion_state_t state = held ? MOTION_STANDBY : certain_state();
        uint8_t lead_flags = flags;
        engine.stage = STAGE_RUN;
        flags |= (uint8_t)state;
        uint16_t lead = DIR_SETUP_CYCLES - 1;
        if (wait >= SHORTEST_PIECE_TICKS) {
            append(1, wait - 1, SEGMENT_SILENT, lead_flags);
        } else {
            lead = (uint16_t)(lead + wait);
            lead_flags = flags; /* known at once, not only when the pulse is over */
        }
        append(1, (uint16_t)(lead + engine.width_ticks), lead, lead_flags);
        if (state) {
            uint8_t periods = AHEAD_LONG_PERIODS;
            if (!(command.flags & MOTION_LINEAR) && basis.slow_ticks < AHEAD_LONG_TICKS + SHORTEST_PIECE_TICKS)
                periods = AHEAD_PERIODS;
            engine.ahead_ticks = (uint16_t)(periods * AHEAD_PERIOD_TICKS);
            append(periods, AHEAD_PERIOD_TICKS - 1, SEGMENT_SILENT, flags);
            play();
            engine_on_start();
        } else if (!held) {
            cruised = begin_cruise(flags);
        }
        add_pulses(flags, 1);
    } else {
        emit_lead();
        if (!held)
            play();
    }
    plan();
    engine_on_start();
    profile.cruise_pulses -= cruised;
    if (!simple) {
        if (settings.auto_microstep)
            choose_start_gear();
        emit_lead();
    }
    fill();
    if (held) {
        engine.playing = true;
        step_port_hold();
    } else if (!engine.playing) {
        play();
    }
}

/* Lets the next command follow the one that has been emitted: exactly one interval after its last pulse where there
 * is time to plan it and to emit its first intervals, otherwise as soon as possible after its end. Not long before, so
 * that the running command can still be cut without the next one. */
static void join_next(void)
{
    look_for_end();
    step_snapshot_t at = step_port_snapshot();
    uint8_t loaded = (uint8_t)(at.tail - SEGMENT_BYTES);
    uint8_t offset = engine.tail_offset;
    if (!engine.tail_awaited) {
        /* Not before the segment after the tail has begun. (An idle timer is dealt with by engine_poll.) */
        if (step_idle || ((uint8_t)(loaded - offset) == SEGMENT_BYTES && at.to_count == counted_periods(segment_at(loaded))))
            return;
        start_next();
        return;
    }
    const motion_command_t *next = engine.next;
    if (engine.gear && (next->flags & MOTION_PULSES || next->extra_pulses))
        return; /* parts of its pulses are to be made */
    if (is_held(next) || step_port_held())
        return; /* after its end; not before the running one may begin */
    uint8_t before = (uint8_t)(offset - SEGMENT_BYTES);
    uint32_t ticks = ticks_between(loaded, at.to_count, offset); /* until the tail begins */
    if (loaded == offset) {
        /* It is loaded: what is left of the period before it. */
        uint16_t top = segment_at(before)->top;
        uint16_t counter = step_port_counter();
        if (at.period_over || counter > top)
            return;
        ticks = top - counter;
    }
    uint16_t needed = JOIN_CYCLES;
    if (has_no_ramps(next))
        needed = JOIN_FLAT_CYCLES;
    else if (next->flags & MOTION_LINEAR)
        needed = JOIN_LINEAR_CYCLES;
    ticks <<= basis.ramp.cycles_log2;
    if (ticks > JOIN_SOON_CYCLES || ticks < needed)
        return; /* later, or after its end */
    bool turns = is_ccw(next) != is_ccw(&command);
    uint32_t wait_us = next->start_wait_us;
    bool waits = wait_us >= SHORTEST_PIECE_TICKS / TICKS_PER_US;
    uint8_t flags = (uint8_t)(MOTION_STOP | direction_flags(next, turns));
    bool done;
    if (engine.tail_fast && !turns && wait_us == 0) {
        offset = before; /* the last run */
        done = step_port_extend(offset);
    } else {
        const segment_t *tail = segment_at(offset);
        uint16_t top = tail->top;
        uint16_t match = SEGMENT_SILENT;
        if (waits) {
            flags = tail->flags;
        } else {
            uint16_t least = turn_ticks();
            top = (uint16_t)(top + ticks_of_cycles((uint8_t)wait_us * TICKS_PER_US));
            if (turns && top < least)
                top = least;
            match = (uint16_t)(top - engine.width_ticks);
        }
        done = step_port_arm(offset, top, match, flags);
    }
    if (!done)
        return; /* not at this moment */
    engine.joined_offset = offset;
    take_next();
    drop_emission();
    engine.joined++;
    if (wait_us > engine.closing_us) /* longer than the gap: a start from slow speed */
        expire_gap();
    engine.stage = STAGE_LEAD;
    if (waits) {
        engine.dir_due = turns;
    } else {
        add_pulses(flags, 1);
        engine.stage = STAGE_RUN;
    }
    plan();
    fill();
}

status_t engine_check(const motion_command_t *c)
{
    uint16_t pulse_us = settings.pulse_us;
    if (settings.ihd_counts > settings.xclk_counts) /* as if pulses were longer by what is taken away */
        pulse_us = (uint16_t)(pulse_us + (uint16_t)(settings.ihd_counts - settings.xclk_counts + 1) / 2);
    return profile_check(&basis, c, pulse_us);
}

void engine_offer(const motion_command_t *offered)
{
    engine.next = offered;
    if (offered && !engine.playing)
        start_next();
}

uint8_t engine_commands_begun(void)
{
    return engine.begun;
}

void engine_release(void)
{
    step_port_release();
}

static NOINLINE uint8_t play_on(void)
{
    uint8_t worked = 0;
    look_for_end();
    if (step_late) {
        step_late = 0;
        engine.faults |= ENGINE_FAULT_LATE;
    }
    if (engine.playing && step_idle) {
        worked = 1;
        if (!step_port_snapshot().period_over) {
            /* The last period is not over. */
        } else if (step_head != step_tail) {
            /* The planner was so late that the timer ran out of segments: go on where it stopped. */
            if (engine.stage == STAGE_RUN)
                engine.faults |= ENGINE_FAULT_STARVED;
            step_port_start();
        } else if (engine.stage == STAGE_REST || engine.stage == STAGE_GAP) {
            step_port_halt();
            engine.playing = false;
            engine.single = false;
            if (engine.next)
                start_next();
            else
                expire_gap();
        }
    }
    if (engine.next && engine.playing && !engine.single && engine.stage > STAGE_TAIL)
        join_next();
    /* Until the ring is three quarters full nothing else is as urgent, within reason; then a step at a time. (A timer that
     * has run out of segments is started again as soon as there is one.) */
    uint8_t rounds = 6;
    if (engine.playing) {
        do {
            /* A command that waits is joined as soon as this one is in the ring: as far ahead of its end as it can be. */
            uint8_t least = RING_RESERVE;
            if (block.runs && !engine.next)
                least = block.pulses == 1 ? RING_REFILL_SINGLE : RING_REFILL;
            if (ring_free() < least || !emit())
                break;
            worked = 1;
        } while (ring_free() > SEGMENT_COUNT / 4 * SEGMENT_BYTES && !step_idle && --rounds);
    }
    return worked;
}

NOINLINE uint8_t engine_poll(void) /* (the benchmark measures it) */
{
    /* In standstill a line's end must not wait for all those registers to be saved. */
    return (engine.playing || step_late) && play_on();
}

bool engine_plays(void)
{
    return engine.playing;
}

uint8_t engine_hurries(void)
{
    return engine.playing ? step_port_hurries() : 0;
}

uint8_t engine_commands_ended(void)
{
    return engine.ended;
}

uint8_t engine_commands_played(void)
{
    return engine.played;
}

/* A command has been begun (its start wait included) and has not ended. */
static bool running(void)
{
    look_for_end();
    return engine.tail_awaited || (engine.playing && engine.stage <= STAGE_TAIL);
}

/* -- stopping ---------------------------------------------------------------------------------------------------- */

/* Freezes the pulse train where it is. */
static void halt(void)
{
    if (!engine.playing)
        return;
    step_port_halt();
    settle(0); /* what was repeated counts */
    if (running() && motion_state != MOTION_STANDBY)
        engine.played++;
    engine.ended = engine.begun;
    engine.joined = 0;
    engine.emitted = engine_position();
    set_gear(engine.running_gear);
    engine.playing = false;
    drop_emission();
    engine.stage = STAGE_REST;
    motion_state = MOTION_STANDBY;
}

void engine_stop(void)
{
    engine.next = 0;
    halt();
    forget_velocity();
}

/* Ends the running command after what is to be played soon. Returns the interval there in ticks; 0: nothing to be cut
 * (it ends by itself now, or it stands in the middle of a wait or of an interval longer than that of slow speed). */
static NOINLINE uint32_t cut(void)
{
    settle(0);
    engine.owed = 0;
    step_snapshot_t at = step_port_snapshot();
    uint8_t first = (uint8_t)(at.tail - SEGMENT_BYTES);
    uint8_t offset = first;
    uint16_t left = at.to_count;
    uint16_t keep_ticks = ticks_of_cycles(CUT_KEEP_CYCLES);
    const segment_t *s;
    for (;;) {
        s = segment_at(offset);
        uint32_t ticks = ticks_of(s, left);
        bool enough = ticks >= keep_ticks;
        uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
        bool last = after == step_head;
        if (is_silent(s)) {
            if ((s->flags & SEGMENT_STATE_MASK) == MOTION_STOP)
                return 0;
        } else if (last || (enough && (left > 1 || after != at.tail))) {
            break; /* (Not the last period of the loaded segment: what follows it may be loaded meanwhile.) */
        }
        if (last)
            return 0;
        keep_ticks = enough ? 0 : (uint16_t)(keep_ticks - (uint16_t)ticks);
        offset = after;
        left = counted_periods(segment_at(offset));
    }
    uint32_t interval_ticks = interval_at(offset);
    if (interval_ticks > basis.slow_ticks + 1)
        return 0;
    uint16_t needed = (uint16_t)(keep_ticks / (uint16_t)(s->top + 1u) + 4u);
    if (needed > left)
        needed = left;
    int32_t dropped = pulses_from((uint8_t)(offset + SEGMENT_BYTES));
    engine.emitted -= dropped + pulses_of(s, step_port_shorten(offset, needed));
    drop_emission();
    if ((uint8_t)(offset - first) < (uint8_t)(engine.joined_offset - first)) { /* what was joined never begins */
        engine.ended = (uint8_t)(engine.ended + engine.joined);
        engine.joined = 0;
    }
    uint8_t flags = command.flags & (uint8_t)~MOTION_CCW;
    if (s->flags & 1 << SEGMENT_CCW_BIT)
        flags |= MOTION_CCW;
    command.flags = flags;
    set_gear(gear_of(s));
    return interval_ticks;
}

/* The next command shall not begin: the running one, which ends soon, is not joined any more, if there is time. */
static NOINLINE bool part(void)
{
    uint8_t offset = engine.joined_offset;
    int32_t dropped = pulses_from(offset);
    if (!engine.joined || (segment_at(offset)->flags & SEGMENT_STATE_MASK) != MOTION_STOP ||
        !step_port_arm(offset, (uint16_t)(engine.tail_ticks - 1), SEGMENT_SILENT, MOTION_STOP))
        return false;
    engine.emitted -= dropped;
    drop_emission();
    engine.tail_offset = offset;
    engine.tail_awaited = true;
    engine.joined--;
    engine.ended++;
    engine.stage = STAGE_GAP;
    forget_velocity();
    return true;
}

/* Ends the running command with a deceleration, or none. */
static void end_command(accel_code_t decel, bool linear)
{
    if (!running())
        return;
    motion_state_t state = engine_state();
    if (state == MOTION_DECEL && decel != ACCEL_NONE && (!engine.joined || part()))
        return; /* ending already */
    uint32_t ticks = state == MOTION_STANDBY ? 0 : cut();
    if (ticks == 0) {
        if (part())
            return;
        if (state == MOTION_STANDBY || engine.joined || !engine.tail_awaited) {
            /* In a start wait or at slow speed: there is nothing to ramp down from. */
            halt();
            forget_velocity();
        }
        return;
    }
    profile_plan_decel(&profile, &basis, ramp_velocity(&basis.ramp, ticks), decel, linear);
    profile.cruise.chunks = ticks >> PROFILE_CHUNK_LOG2;
    profile.cruise.ticks_q8 = (ticks & (PROFILE_CHUNK_TICKS - 1)) << 8;
    if (settings.auto_microstep) /* to a full step; the closing interval */
        profile.cruise_pulses = (uint8_t)((uint8_t)(to_full_step() + engine.part_mask) & engine.step_mask) + 1u;
    else if (profile.decel_pulses == 0)
        profile.cruise_pulses = 1; /* the closing interval */
    engine.endless = false;
    engine.ramp_state = MOTION_STANDBY;
    engine.stage = STAGE_RUN;
}

void engine_stop_graceful(accel_code_t decel, bool linear)
{
    engine.next = 0;
    end_command(decel, linear);
}

bool engine_next(bool graceful)
{
    look_for_end();
    if (engine.joined || engine_state() == MOTION_STOP) /* (also that of the command before) */
        return false;
    end_command(graceful ? command.decel : ACCEL_NONE, (command.flags & MOTION_LINEAR) != 0);
    return true;
}

/* Needs no plan: a ring of one segment. A pulse takes 13 us and is waited for before the next one: all of them are made,
 * as fast as they can be typed at 250,000 Bd. */
void engine_single_pulse(bool ccw)
{
    if (engine.single) {
        step_port_finish();
    } else if (running() || engine.next) {
        return;
    }
    if (estop_port_active())
        return;
    begin_ring();
    engine.stage = STAGE_REST;
    engine.single = true;
    command.flags = ccw ? MOTION_CCW : 0;
    uint8_t flags = direction_flags(&command, true);
    step_port_clock(false); /* it is waited for */
    append(1, (uint16_t)(TURN_CYCLES + settings.pulse_us * TICKS_PER_US - 1), TURN_CYCLES - 1, flags);
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
    motion_state_t state = engine_state();
    uint32_t v = engine.v_in_play;
    uint32_t exact_cycle_us = engine.in_play_cycle_us;
    if (engine.playing && state == MOTION_CRUISE) {
        *rpm = profile_rpm(&basis, &command);
        *cycle_us = profile.cycle_us;
        return;
    }
    if (engine.playing && (state == MOTION_ACCEL || state == MOTION_DECEL)) {
        uint8_t offset = (uint8_t)(step_tail - SEGMENT_BYTES);
        if (is_silent(segment_at(offset)))
            offset = (uint8_t)(offset + SEGMENT_BYTES);
        v = ramp_velocity(&basis.ramp, interval_at(offset));
        exact_cycle_us = 0;
    }
    *rpm = (v >> basis.factor_log2) / 100u;
    if (exact_cycle_us == 0) {
        ramp_time_t interval;
        ramp_interval_q16(&interval.q16, &basis.ramp, v);
        exact_cycle_us = us_of(0, interval.ticks << basis.factor_log2);
    }
    *cycle_us = exact_cycle_us;
}

void engine_set_gap(bool on)
{
    engine.gap_off = !on;
}

bool engine_gap(void)
{
    return !engine.gap_off;
}

uint8_t engine_faults(void)
{
    return engine.faults;
}

uint32_t command_rpm(const motion_command_t *c)
{
    return profile_rpm(&basis, c);
}

uint32_t command_cycle_us(const motion_command_t *c)
{
    return profile_cycle_us(&basis, c);
}
