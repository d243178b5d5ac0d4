#include "processor_model.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define US 16ull
#define MS (1000 * US)

/* Bounds in time, each with a margin above what was measured. */
#define TAKES (3 * MS)    /* what goes in has taken effect, unless a command ends meanwhile */
#define STOPS (3 * MS)    /* S and Estop; the planner may be at work when they come */
#define JOINS (14 * MS)   /* a command that ends within this time may be over first, and the next one taken up */
#define TAIL (4 * MS)     /* pulses that were planned when a command was cut: those of this time, and some more */
#define TAIL_PULSES 13
#define LATE_START (1000 * US)
#define STARTS (12 * MS)  /* a command begins within this time */
#define SLACK (6 * MS)    /* a pulse is missing when it is this late */
#define ENDLESS UINT32_MAX
#define NEVER UINT64_MAX

enum { ONE_SHOT = 31, POSITIONS = 32, ARRAY = 31, MOST_INPUTS = 400, MOST_WORLDS = 4000 };

/* -- what goes in ------------------------------------------------------------------------------------------------ */

typedef struct {
    uint32_t count; /* 0: continuous */
    uint32_t velocity;
    uint32_t accel, decel; /* hundredths */
    uint32_t wait;         /* us */
    uint8_t extra, ccw, cycle, pulses, linear, sync;
    uint8_t unused[2];
} entry_t;

enum {
    HAS_COUNT = 1 << 0,
    HAS_VELOCITY = 1 << 1,
    HAS_ACCEL = 1 << 2,
    HAS_DECEL = 1 << 3,
    HAS_LINEAR = 1 << 4,
    HAS_EXTRA = 1 << 5,
    HAS_WAIT = 1 << 6,
    HAS_SYNC = 1 << 7,
    HAS_UNIT = 1 << 8,
};

typedef struct {
    entry_t value;
    unsigned has;
} change_t;

typedef enum {
    MOTION,     /* m20... */
    CONTINUOUS, /* m, m- */
    SESSION,    /* v, a, d alone */
    THROW_AWAY, /* xm20... */
    EXECUTE,    /* x5 */
    EDIT,       /* q5... */
    CLEAR,      /* qc */
    STOP_NOW,
    STOP_RAMP,
    NEXT_NOW,
    NEXT_RAMP,
    SINGLE, /* + - */
    LOOP_START,
    LOOP_FINISH,
    LOOP_NUMBER,
    LOOP_ALL,
    LOOP_END,
    ARRAY_RUN,
    ARRAY_SET,
    RELEASE, /* y, or the pin */
    ESTOP,
    NOTHING /* displays, mode changes */
} kind_t;

typedef struct {
    kind_t kind;
    uint64_t cycle;
    uint64_t takes, joins; /* later than cycle + takes only where a command has ended; never later than + joins */
    uint32_t number, second;
    change_t change;
} input_t;

/* -- a state ----------------------------------------------------------------------------------------------------- */

typedef struct {
    entry_t entry;
    uint64_t not_before, due; /* of the next pulse */
    uint64_t until;           /* of a cut: no pulse later */
    uint32_t made, least, most;
    uint32_t fastest; /* interval: the shortest that its ramps may have */
    uint8_t present, held, ending, continuous, loose, single;
    uint8_t unused[6];
} current_t;

typedef struct {
    entry_t entry[POSITIONS];
    entry_t session;
    current_t now;
    uint64_t ready_min, ready_max; /* when what comes next may begin */
    uint64_t moving_until;         /* a command that is over may still count as motion */
    uint64_t completed;            /* when a command made its last pulse, or was cut */
    uint32_t passes, passes_made;  /* LS, LF */
    uint32_t array_passes, array_passes_made;
    uint32_t inputs; /* that have taken effect */
    uint8_t array[ARRAY + 1];
    uint8_t next, pending;
    uint8_t start, finish, looping, executing;   /* executing 0: not begun */
    uint8_t array_looping, array_index, last;    /* index 0: not begun, otherwise one more; last: one more command */
    uint8_t preempting;                          /* 0 none, 1 continuous, 2 position, 3 throw-away */
    uint8_t preempting_position, estop, unused[4];
} world_t;

struct processor {
    machine_t machine;
    input_t input[MOST_INPUTS];
    size_t inputs;
    world_t *world;
    uint32_t *hash;
    size_t count;
    world_t *other; /* the next set */
    uint32_t *other_hash;
    size_t other_count;
    bool gave_up;
    uint64_t last_rise, interval; /* of the pulses seen */
    uint8_t mode;                 /* program mode: 'q', 'x' or 0 */
    char states[2000];
};

/* -- sets of states ---------------------------------------------------------------------------------------------- */

static uint32_t hash_of(const world_t *w)
{
    uint32_t words[sizeof *w / 4];
    memcpy(words, w, sizeof words);
    uint32_t hash = 2166136261u;
    for (size_t i = 0; i < sizeof words / 4; i++)
        hash = (hash ^ words[i]) * 16777619u;
    return hash;
}

static void add(processor_t *p, const world_t *w)
{
    uint32_t hash = hash_of(w);
    for (size_t i = 0; i < p->count; i++)
        if (p->hash[i] == hash && memcmp(&p->world[i], w, sizeof *w) == 0)
            return;
    if (p->count == MOST_WORLDS) {
        p->gave_up = true;
        return;
    }
    p->world[p->count] = *w;
    p->hash[p->count++] = hash;
}

/* The set becomes the other one; add() fills an empty one. */
static void turn(processor_t *p)
{
    world_t *world = p->world;
    uint32_t *hash = p->hash;
    p->world = p->other;
    p->hash = p->other_hash;
    p->other = world;
    p->other_hash = hash;
    p->other_count = p->count;
    p->count = 0;
}

/* -- intervals --------------------------------------------------------------------------------------------------- */

static double factor(const processor_t *p)
{
    return (double)(1u << p->machine.ustep);
}

/* A velocity in hundredths of RPM, from an interval, and the other way round. */
static double velocity_of(const processor_t *p, double ticks)
{
    return 16 * 60e8 / (p->machine.steps_per_rev * factor(p) * ticks);
}

static uint32_t cruise_ticks(const processor_t *p, const entry_t *e)
{
    uint32_t us = e->cycle ? e->velocity : 60000000u / p->machine.steps_per_rev / e->velocity;
    return (uint32_t)(16.0 * us / factor(p));
}

static uint32_t slow_ticks(const processor_t *p)
{
    return (uint32_t)velocity_of(p, p->machine.slow_rpm * 100.0);
}

static bool has_ramps(const entry_t *e)
{
    return e->accel != NO_RAMP || e->decel != NO_RAMP;
}

static uint32_t longest_ticks(const processor_t *p, const current_t *now)
{
    if (!now->present)
        return slow_ticks(p);
    uint32_t cruise = cruise_ticks(p, &now->entry);
    if (!has_ramps(&now->entry) && !now->loose)
        return cruise;
    uint32_t slow = slow_ticks(p);
    uint32_t longest = cruise > slow ? cruise : slow;
    if (now->entry.linear && now->entry.accel != NO_RAMP) /* its first interval begins at standstill */
        longest += (uint32_t)(16e6 * sqrt(4 * M_PI / p->machine.steps_per_rev / factor(p) /
                                          (now->entry.accel / 100.0)));
    return longest;
}

/* Pulses from a velocity (hundredths of RPM) down to slow speed. */
static double ramp_pulses(const processor_t *p, double velocity, uint32_t decel, bool linear)
{
    double slow = p->machine.slow_rpm * 100.0;
    if (decel == NO_RAMP || velocity <= slow)
        return 0;
    if (!linear)
        return (velocity - slow) / decel * factor(p);
    double speed = velocity / 100 * 2 * M_PI / 60;
    return speed * speed / (2 * 2 * M_PI / p->machine.steps_per_rev * decel / 100.0) * factor(p);
}

/* -- one state's steps ------------------------------------------------------------------------------------------- */

static uint64_t later(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

static void begin(const processor_t *p, world_t *w, const entry_t *entry)
{
    uint32_t before = w->now.fastest;
    current_t *now = &w->now;
    memset(now, 0, sizeof *now);
    now->entry = *entry;
    now->present = 1;
    now->held = entry->sync;
    now->until = NEVER;
    uint32_t made = (uint32_t)(entry->count * (entry->pulses ? 1 : factor(p)));
    now->continuous = entry->count == 0;
    now->most = now->continuous ? ENDLESS : made + entry->extra;
    now->least = now->continuous ? ENDLESS : has_ramps(entry) ? made : made + entry->extra;
    now->fastest = cruise_ticks(p, entry);
    if (before && before < now->fastest)
        now->fastest = before;
    now->not_before = w->ready_min + entry->wait * US;
    now->due = w->ready_max + entry->wait * US + STARTS + now->fastest;
}

static void forget_loop(world_t *w)
{
    w->looping = w->start = w->finish = w->executing = w->array_looping = w->array_index = w->last = 0;
    w->passes = w->passes_made = w->array_passes = w->array_passes_made = 0;
}

static bool in_loop(const world_t *w)
{
    return w->looping || w->array_looping;
}

/* The position that the loop executes next; 0: it is over. */
static unsigned next_of_loop(world_t *w)
{
    if (w->looping) {
        if (w->executing == 0) {
            w->executing = w->start;
        } else if (w->executing == w->finish) {
            if (w->passes && ++w->passes_made == w->passes)
                return 0;
            w->executing = w->start;
        } else {
            w->executing = (uint8_t)(w->executing % 30 + 1);
        }
        return w->executing;
    }
    if (w->array[w->array_index] == 0) {
        if (w->array_index == 0 || (w->array_passes && ++w->array_passes_made == w->array_passes))
            return 0;
        w->array_index = 0;
    }
    return w->array[w->array_index++];
}

/* Takes up what comes next, if anything does; where a loop is over, forgets it. */
static bool take_up(const processor_t *p, world_t *w)
{
    if (w->preempting) {
        entry_t entry = w->entry[w->preempting_position];
        w->preempting = w->preempting_position = 0;
        begin(p, w, &entry);
        return true;
    }
    if (in_loop(w)) {
        bool last = w->last;
        unsigned position = next_of_loop(w);
        if (position) {
            begin(p, w, &w->entry[position]);
            if (last)
                forget_loop(w);
            return true;
        }
        forget_loop(w);
    }
    if (w->pending == 0)
        return false;
    unsigned position = (unsigned)(w->next - 1 + 30 - w->pending) % 30 + 1;
    w->pending--;
    begin(p, w, &w->entry[position]);
    return true;
}

static bool something_follows(const processor_t *p, const world_t *w)
{
    world_t trial = *w;
    return take_up(p, &trial);
}

/* What it leaves is the velocity in play. */
static void drop_current(const processor_t *p, world_t *w)
{
    uint32_t fastest = w->now.present ? cruise_ticks(p, &w->now.entry) : w->now.fastest;
    memset(&w->now, 0, sizeof w->now);
    w->now.fastest = fastest;
}

static void end_current(const processor_t *p, world_t *w)
{
    const current_t *now = &w->now;
    uint32_t slow = slow_ticks(p), cruise = cruise_ticks(p, &now->entry);
    uint64_t end = later(p->last_rise + (slow > cruise ? slow : cruise), now->until == NEVER ? 0 : now->until);
    if (now->single)
        end = p->last_rise;
    if (!now->ending)
        w->ready_min = p->last_rise;
    else
        w->completed = p->last_rise;
    w->ready_max = later(w->ready_max, end);
    w->moving_until = now->single ? 0 : end + 2 * longest_ticks(p, now) + MS;
    drop_current(p, w);
}

/* No further pulse after `until`. */
static void cut(const processor_t *p, world_t *w, uint64_t from, uint64_t until)
{
    current_t *now = &w->now;
    if (!now->present)
        return;
    if (now->held) {
        drop_current(p, w);
        return;
    }
    now->least = now->made;
    now->ending = 1;
    if (until < now->until)
        now->until = until;
    w->ready_min = from;
}

/* The same, by what lets pulses come that have been planned; all of them, if they end soon (design.md, JOIN_SOON). */
static void cut_soon(const processor_t *p, world_t *w, uint64_t from, uint64_t until)
{
    const current_t *now = &w->now;
    if (now->present) {
        uint32_t longest = longest_ticks(p, now);
        until += (uint64_t)TAIL_PULSES * longest;
        if (now->most != ENDLESS && (uint64_t)(now->most - now->made) * now->fastest <= JOINS)
            until = later(until, from + JOINS + longest);
    }
    cut(p, w, from, until);
}

/* Ramps down; cut somewhere between now and `until`. beyond: also where that takes more pulses than the command has. */
static void ramp_down(const processor_t *p, world_t *w, uint64_t from, uint64_t until, uint32_t decel, bool linear,
                      bool beyond)
{
    current_t *now = &w->now;
    if (!now->present)
        return;
    if (decel == NO_RAMP || now->held || now->single) {
        cut_soon(p, w, from, until);
        return;
    }
    uint32_t cruise = cruise_ticks(p, &now->entry);
    double target = velocity_of(p, cruise);
    double slow = p->machine.slow_rpm * 100.0;
    double more = ceil((double)(TAIL + TAKES) / now->fastest) + TAIL_PULSES; /* pulses until it is cut */
    double low = slow, high = velocity_of(p, now->fastest);
    if (now->made >= 2) {
        double seen = velocity_of(p, (double)p->interval);
        double up = now->entry.accel == NO_RAMP ? target : now->entry.accel / factor(p) * more;
        high = seen < target ? fmin(target, seen + up) : seen;
        low = seen > target ? fmax(target, seen - up) : seen;
        if (now->entry.linear)
            low = slow, high = fmax(seen, target);
        /* Its own deceleration may have begun. */
        if (now->ending || (now->entry.decel != NO_RAMP &&
                            now->made + more + ramp_pulses(p, high, now->entry.decel, now->entry.linear) + 2 >= now->most))
            low = slow;
    }
    double least = now->made + fmax(0, floor(ramp_pulses(p, low * 0.99, decel, linear)) - 2);
    double most = now->made + more + ceil(ramp_pulses(p, high * 1.01, decel, linear)) + 2;
    if (least < now->most && least < now->least)
        now->least = (uint32_t)least;
    if (most < now->most || beyond)
        now->most = (uint32_t)most;
    now->ending = 1;
    now->loose = 1;
    now->due = later(now->due, until + longest_ticks(p, now) + SLACK);
    w->ready_min = from;
}

/* -- what goes in takes effect ----------------------------------------------------------------------------------- */

static void apply_change(entry_t *e, const change_t *change)
{
    const entry_t *v = &change->value;
    if (change->has & HAS_COUNT)
        e->count = v->count, e->ccw = v->ccw, e->pulses = 0;
    if (change->has & HAS_UNIT)
        e->pulses = v->pulses;
    if (change->has & HAS_VELOCITY)
        e->velocity = v->velocity, e->cycle = v->cycle;
    if (change->has & HAS_ACCEL)
        e->accel = v->accel;
    if (change->has & HAS_DECEL)
        e->decel = v->decel;
    if (change->has & HAS_LINEAR)
        e->linear = v->linear;
    if (change->has & HAS_EXTRA)
        e->extra = v->extra;
    if (change->has & HAS_WAIT)
        e->wait = v->wait;
    if (change->has & HAS_SYNC)
        e->sync = v->sync;
}

static entry_t with_session(const world_t *w, const change_t *change)
{
    entry_t e = w->session;
    e.count = 0;
    e.ccw = e.extra = e.sync = 0;
    e.wait = 0;
    uint8_t pulses = e.pulses;
    apply_change(&e, change);
    if (!(change->has & HAS_UNIT))
        e.pulses = pulses; /* of the session; an edit with a count clears it */
    return e;
}

static void keep_in_session(world_t *w, const entry_t *e)
{
    uint32_t count = w->session.count;
    w->session = *e;
    w->session.count = count;
    w->session.ccw = w->session.extra = w->session.sync = 0;
    w->session.wait = 0;
}

static void stop(world_t *w)
{
    w->pending = 0;
    w->preempting = w->preempting_position = 0;
    forget_loop(w);
}

static void preempt(const processor_t *p, world_t *w, const entry_t *by, uint64_t from, uint64_t until)
{
    bool turns = w->now.present && by->count == 0 && by->ccw != w->now.entry.ccw && w->now.entry.decel != NO_RAMP &&
                 !w->now.held && w->now.made;
    uint64_t longer = 0;
    if (turns) {
        uint32_t made = w->now.made;
        ramp_down(p, w, from, until, w->now.entry.decel, w->now.entry.linear, false);
        w->now.least = made;
        longer = (uint64_t)(w->now.most - made) * longest_ticks(p, &w->now);
    } else {
        cut_soon(p, w, from, until);
    }
    w->ready_min = from;
    w->ready_max = later(w->ready_max, until + longer);
}

static void begin_loop_if_bounded(world_t *w)
{
    if (w->start && w->finish && !w->looping) {
        w->array_looping = 0;
        w->looping = 1;
        w->executing = 0;
        w->passes_made = 0;
    }
}

static void apply(const processor_t *p, world_t *w, const input_t *in, uint64_t until)
{
    uint64_t from = in->cycle;
    bool busy = w->now.present || something_follows(p, w);
    bool continuous = w->preempting ? w->preempting == 1 : w->now.present && w->now.continuous && !w->now.ending;
    entry_t entry;
    switch (in->kind) {
    case MOTION:
        if (w->estop || w->pending == 30)
            break;
        entry = with_session(w, &in->change);
        keep_in_session(w, &entry);
        w->entry[w->next] = entry;
        w->next = (uint8_t)(w->next % 30 + 1);
        w->pending++;
        break;
    case SESSION:
        apply_change(&w->session, &in->change);
        if (w->now.present && w->now.continuous && (in->change.has & HAS_VELOCITY)) {
            w->now.entry.velocity = in->change.value.velocity;
            w->now.entry.cycle = in->change.value.cycle;
            w->now.loose = 1;
            uint32_t cruise = cruise_ticks(p, &w->now.entry);
            w->now.fastest = cruise < w->now.fastest ? cruise : w->now.fastest;
        }
        break;
    case CONTINUOUS:
    case THROW_AWAY:
    case EXECUTE:
        if (w->estop)
            break;
        w->preempting = in->kind == CONTINUOUS ? 1 : in->kind == EXECUTE ? 2 : 3;
        w->preempting_position = in->kind == CONTINUOUS ? 0 : in->kind == EXECUTE ? (uint8_t)in->number : ONE_SHOT;
        if (in->kind != EXECUTE)
            w->entry[w->preempting_position] = with_session(w, &in->change);
        preempt(p, w, &w->entry[w->preempting_position], from, until);
        break;
    case EDIT:
        apply_change(&w->entry[in->number], &in->change);
        break;
    case CLEAR:
        entry = w->session;
        for (unsigned i = 1; i <= 30; i++)
            w->entry[i] = entry;
        break;
    case STOP_NOW:
        stop(w);
        cut(p, w, from, from + STOPS);
        break;
    case ESTOP:
        w->estop = in->number == 0;
        if (w->estop) {
            stop(w);
            cut(p, w, from, from + STOPS);
        }
        break;
    case STOP_RAMP:
        stop(w);
        ramp_down(p, w, from, until, w->session.decel, w->session.linear, true);
        break;
    case NEXT_NOW:
    case NEXT_RAMP:
        if (continuous && in_loop(w))
            w->last = 1;
        if (w->preempting)
            w->preempting = w->preempting_position = 0;
        else if (in->kind == NEXT_NOW)
            cut_soon(p, w, from, until);
        else if (!w->now.ending)
            ramp_down(p, w, from, until, w->now.entry.decel, w->now.entry.linear, false);
        break;
    case LOOP_END:
        forget_loop(w);
        if (!continuous)
            break;
        if (w->preempting)
            w->preempting = w->preempting_position = 0;
        else
            ramp_down(p, w, from, until, w->now.entry.decel, w->now.entry.linear, false);
        break;
    case SINGLE:
        if (busy || w->estop)
            break;
        memset(&entry, 0, sizeof entry);
        entry = w->session;
        entry.count = entry.pulses = 1;
        entry.ccw = (uint8_t)in->number;
        entry.wait = entry.sync = entry.extra = 0;
        w->ready_min = from;
        w->ready_max = until;
        begin(p, w, &entry);
        w->now.single = 1;
        return;
    case LOOP_START:
        if (in->number != w->finish)
            w->start = (uint8_t)in->number;
        begin_loop_if_bounded(w);
        break;
    case LOOP_FINISH:
        if (in->number != w->start)
            w->finish = (uint8_t)in->number;
        begin_loop_if_bounded(w);
        break;
    case LOOP_ALL:
        w->start = 1;
        w->finish = 30;
        begin_loop_if_bounded(w);
        break;
    case LOOP_NUMBER:
        w->passes = in->number;
        break;
    case ARRAY_SET:
        w->array[in->number] = (uint8_t)in->second;
        break;
    case ARRAY_RUN:
        if (w->array[0]) {
            w->looping = 0;
            w->array_looping = 1;
            w->array_index = 0;
            w->array_passes = in->number;
            w->array_passes_made = 0;
        }
        break;
    case RELEASE:
        if (w->now.present && w->now.held) {
            w->now.held = 0;
            w->now.not_before = from + w->now.entry.wait * US;
            w->now.due = until + w->now.entry.wait * US + STARTS;
        }
        break;
    case NOTHING:
        break;
    }
    if (!busy)
        w->ready_min = from;
    if (!w->now.present || w->now.ending)
        w->ready_max = later(w->ready_max, until);
}

/* -- all states -------------------------------------------------------------------------------------------------- */

/* What may have happened, without a pulse, up to this cycle: inputs, ends of commands, beginnings. */
static void close_set(processor_t *p, uint64_t cycle)
{
    for (size_t i = 0; i < p->count && !p->gave_up; i++) {
        world_t w = p->world[i];
        const input_t *in = w.inputs < p->inputs ? &p->input[w.inputs] : NULL;
        if (in && in->cycle <= cycle) {
            bool early = p->last_rise <= in->cycle + in->takes;
            bool between = (!w.now.present || w.now.made == 0) && w.completed + MS >= in->cycle &&
                           p->last_rise <= in->cycle + in->joins;
            if (early || between) {
                world_t applied = w;
                applied.inputs++;
                if (early || in->kind != RELEASE) /* (that is not late, but it may stand behind a line that is) */
                    apply(p, &applied, in, (early ? in->cycle : p->last_rise) + in->takes + TAIL);
                add(p, &applied);
                if ((in->kind == NEXT_NOW || in->kind == NEXT_RAMP) && between && w.now.present && !w.now.continuous) {
                    applied = w; /* it was for the one before, which ended soon */
                    applied.inputs++;
                    add(p, &applied);
                }
                if (in->kind == SINGLE && !w.now.present && in->cycle <= w.moving_until) {
                    applied = w; /* ignored */
                    applied.inputs++;
                    add(p, &applied);
                }
            }
        }
        if (w.now.present && !w.now.held && w.now.made >= w.now.least) {
            world_t ended = w;
            end_current(p, &ended);
            add(p, &ended);
        }
        if (!w.now.present) {
            world_t begun = w;
            take_up(p, &begun); /* or the loop is over and forgotten */
            add(p, &begun);
        }
    }
}

/* What cannot be true any more at this cycle, before which no pulse came. */
static bool is_over(const processor_t *p, world_t *w, uint64_t cycle)
{
    const input_t *in = w->inputs < p->inputs ? &p->input[w->inputs] : NULL;
    if (in && cycle > in->cycle + (in->joins > in->takes ? in->joins : in->takes))
        return true;
    const current_t *now = &w->now;
    if (now->present)
        return !now->held && (cycle > now->due || cycle > now->until);
    if (cycle <= w->ready_max + STARTS)
        return false;
    world_t trial = *w;
    if (take_up(p, &trial))
        return true;
    *w = trial; /* a loop that was over is forgotten */
    return false;
}

static void drop_what_is_over(processor_t *p, uint64_t cycle)
{
    turn(p);
    for (size_t i = 0; i < p->other_count; i++)
        if (!is_over(p, &p->other[i], cycle))
            add(p, &p->other[i]);
}

static bool makes_pulse(processor_t *p, world_t *w, uint64_t cycle, uint8_t dir)
{
    current_t *now = &w->now;
    if (!now->present || now->held || now->made >= now->most || now->entry.ccw != dir || cycle < now->not_before)
        return false;
    uint32_t cruise = cruise_ticks(p, &now->entry);
    uint64_t gap = cycle - p->last_rise;
    if (now->made == 0) {
        if (p->interval && p->interval < now->fastest)
            now->fastest = (uint32_t)p->interval;
        if (p->last_rise && gap < now->fastest)
            now->fastest = (uint32_t)gap;
    } else if (!has_ramps(&now->entry) && !now->loose) {
        /* The first interval of a command that comes at the end of another one may be longer. */
        if (gap + 2 < cruise || gap > cruise + (now->made == 1 ? LATE_START : 2))
            return false;
    } else if (gap + 8 < now->fastest * 0.97 || gap > longest_ticks(p, now) * 1.03 + 8) {
        return false;
    }
    now->made++;
    now->due = cycle + longest_ticks(p, now) + SLACK;
    return true;
}

bool processor_pulse(processor_t *p, uint64_t cycle, uint8_t dir)
{
    close_set(p, cycle);
    drop_what_is_over(p, cycle);
    turn(p);
    uint64_t before = p->last_rise;
    for (size_t i = 0; i < p->other_count; i++) {
        world_t w = p->other[i];
        p->last_rise = before;
        if (!makes_pulse(p, &w, cycle, dir))
            continue;
        p->last_rise = cycle;
        if (!w.now.ending && w.now.made == w.now.most && w.now.least == w.now.most) {
            end_current(p, &w);
            w.completed = cycle;
        }
        add(p, &w);
    }
    if (p->count == 0) {
        p->last_rise = before;
        return p->gave_up;
    }
    p->interval = cycle - before;
    p->last_rise = cycle;
    return true;
}

bool processor_silence(processor_t *p, uint64_t cycle)
{
    close_set(p, cycle);
    drop_what_is_over(p, cycle);
    return p->count > 0 || p->gave_up;
}

static bool rests(const processor_t *p, const world_t *w)
{
    if (w->inputs < p->inputs)
        return false;
    return w->now.present ? w->now.held : !something_follows(p, w);
}

bool processor_rests(processor_t *p, uint64_t cycle)
{
    close_set(p, cycle);
    turn(p);
    for (size_t i = 0; i < p->other_count; i++)
        if (rests(p, &p->other[i]))
            add(p, &p->other[i]);
    return p->count > 0 || p->gave_up;
}

/* -- lines ------------------------------------------------------------------------------------------------------- */

static bool digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool number(const char **s, uint32_t *value)
{
    bool any = false;
    *value = 0;
    for (; digit(**s); (*s)++, any = true)
        *value = *value * 10 + (uint32_t)(**s - '0');
    return any;
}

static uint32_t hundredths(const char **s)
{
    uint32_t whole = 0, part = 0, weight = 10;
    number(s, &whole);
    if (**s == '.')
        for ((*s)++; digit(**s); (*s)++, weight /= 10)
            part += weight * (uint32_t)(**s - '0');
    uint32_t value = whole >= 100 ? whole * 100 : whole * 100 + part;
    return value >= 99900 ? NO_RAMP : value;
}

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Parameters of a motion: "m-20v100a1d1...", from the m on. */
static bool parse_change(const char *s, change_t *change)
{
    entry_t *v = &change->value;
    while (*s) {
        char letter = lower(*s++);
        bool present;
        uint32_t value = 0;
        switch (letter) {
        case 'm':
            if (*s == '-')
                v->ccw = 1, s++;
            number(&s, &v->count);
            change->has |= HAS_COUNT;
            break;
        case 'v':
            v->cycle = lower(*s) == 'c';
            if (v->cycle)
                s++;
            if (!number(&s, &v->velocity) || v->velocity == 0)
                return false;
            change->has |= HAS_VELOCITY;
            break;
        case 'a':
            v->accel = hundredths(&s);
            change->has |= HAS_ACCEL;
            break;
        case 'd':
            v->decel = hundredths(&s);
            change->has |= HAS_DECEL;
            break;
        case 'l':
            present = number(&s, &value);
            v->linear = !present || value;
            change->has |= HAS_LINEAR;
            break;
        case 'u':
            number(&s, &value);
            v->extra = (uint8_t)value;
            change->has |= HAS_EXTRA;
            break;
        case 't':
            number(&s, &v->wait);
            change->has |= HAS_WAIT;
            break;
        case 's':
            present = number(&s, &value);
            v->sync = !present || value;
            change->has |= HAS_SYNC;
            break;
        case 'f':
        case 'p':
            v->pulses = letter == 'p';
            change->has |= HAS_UNIT;
            break;
        default:
            return false;
        }
    }
    return true;
}

static bool parse_loop(const char *s, input_t *in)
{
    char letter = lower(*s);
    if (letter == '\0') {
        in->kind = LOOP_END;
    } else if (letter == 'a' && s[1] == '\0') {
        in->kind = LOOP_ALL;
    } else if (digit(letter)) {
        in->kind = ARRAY_RUN;
        return number(&s, &in->number) && *s == '\0';
    } else {
        in->kind = letter == 's' ? LOOP_START : letter == 'f' ? LOOP_FINISH : LOOP_NUMBER;
        if (!strchr("sfn", letter))
            return false;
        s++;
        number(&s, &in->number);
        return *s == '\0';
    }
    return true;
}

static bool parse(processor_t *p, const char *s, input_t *in)
{
    char first = lower(*s);
    if (p->mode && first == 'x' && s[1] == '\0') {
        p->mode = 0;
        return true;
    }
    if (p->mode == 'x') {
        in->kind = ARRAY_SET;
        return number(&s, &in->number) && *s++ == ',' && number(&s, &in->second) && in->number < ARRAY &&
               in->second <= 30;
    }
    if (p->mode == 'q' || (first == 'q' && digit(s[1]))) {
        s += p->mode != 'q';
        in->kind = EDIT;
        return number(&s, &in->number) && in->number >= 1 && in->number <= 30 && parse_change(s, &in->change);
    }
    if (strcmp(s, "S") == 0)
        in->kind = STOP_NOW;
    else if (strcmp(s, "s") == 0)
        in->kind = STOP_RAMP;
    else if (strcmp(s, "N") == 0)
        in->kind = NEXT_NOW;
    else if (strcmp(s, "n") == 0)
        in->kind = NEXT_RAMP;
    else if (strcmp(s, "y") == 0)
        in->kind = RELEASE;
    else if (strcmp(s, "+") == 0 || strcmp(s, "-") == 0)
        in->kind = SINGLE, in->number = *s == '-';
    else if (strcmp(s, "q") == 0 || strcmp(s, "p") == 0 || strcmp(s, "cf") == 0 || strcmp(s, "xd") == 0)
        in->kind = NOTHING;
    else if (strcmp(s, "qc") == 0)
        in->kind = CLEAR;
    else if (strcmp(s, "qp") == 0 || strcmp(s, "xp") == 0)
        p->mode = (uint8_t)*s;
    else if (first == 'l')
        return parse_loop(s + 1, in);
    else if (strcmp(s, "xl") == 0)
        in->kind = ARRAY_RUN;
    else if (first == 'x' && digit(s[1])) {
        in->kind = EXECUTE;
        s++;
        return number(&s, &in->number) && in->number >= 1 && in->number <= 30 && *s == '\0';
    } else if (first == 'x' && lower(s[1]) == 'm') {
        in->kind = THROW_AWAY;
        return parse_change(s + 1, &in->change) && in->change.value.count;
    } else if (first == 'm') {
        if (!parse_change(s, &in->change))
            return false;
        in->kind = in->change.value.count ? MOTION : CONTINUOUS;
    } else if (first == 'v' || first == 'a' || first == 'd') {
        in->kind = SESSION;
        return parse_change(s, &in->change);
    } else
        return false;
    return true;
}

static void put_in(processor_t *p, const input_t *in)
{
    if (p->inputs == MOST_INPUTS)
        p->gave_up = true;
    else
        p->input[p->inputs++] = *in;
}

bool processor_line(processor_t *p, uint64_t cycle, const char *line)
{
    input_t in;
    memset(&in, 0, sizeof in);
    in.kind = NOTHING;
    in.cycle = cycle;
    in.takes = TAKES;
    in.joins = JOINS;
    if (!parse(p, line, &in))
        return false;
    if (in.kind == STOP_NOW)
        in.joins = 0;
    if (in.kind == STOP_NOW)
        in.takes = STOPS;
    put_in(p, &in);
    return true;
}

void processor_sync_edge(processor_t *p, uint64_t cycle)
{
    input_t in;
    memset(&in, 0, sizeof in);
    in.kind = RELEASE;
    in.cycle = cycle;
    in.takes = TAKES;
    in.joins = JOINS;
    put_in(p, &in);
}

void processor_estop(processor_t *p, uint64_t cycle, int level)
{
    input_t in;
    memset(&in, 0, sizeof in);
    in.kind = ESTOP;
    in.cycle = cycle;
    in.takes = STOPS;
    in.number = level != 0;
    put_in(p, &in);
}

processor_t *processor_new(machine_t machine, const char *session)
{
    processor_t *p = calloc(1, sizeof *p);
    p->machine = machine;
    p->world = calloc(MOST_WORLDS, sizeof *p->world);
    p->other = calloc(MOST_WORLDS, sizeof *p->other);
    p->hash = calloc(MOST_WORLDS, sizeof *p->hash);
    p->other_hash = calloc(MOST_WORLDS, sizeof *p->other_hash);
    world_t w;
    memset(&w, 0, sizeof w);
    change_t change;
    memset(&change, 0, sizeof change);
    if (!parse_change(session, &change))
        p->gave_up = true;
    apply_change(&w.session, &change);
    for (unsigned i = 0; i < POSITIONS; i++)
        w.entry[i] = w.session;
    w.next = 1;
    add(p, &w);
    return p;
}

void processor_free(processor_t *p)
{
    if (p == NULL)
        return;
    free(p->world);
    free(p->other);
    free(p->hash);
    free(p->other_hash);
    free(p);
}

/* -- what is known ----------------------------------------------------------------------------------------------- */

static bool is(const processor_t *p, const world_t *w, processor_condition_t condition)
{
    switch (condition) {
    case PROCESSOR_AT_REST:
        return w->inputs == p->inputs && !w->now.present && !something_follows(p, w);
    case PROCESSOR_RUNS:
        return w->now.present && !w->now.held;
    case PROCESSOR_WAITS:
        return w->now.present && !w->now.held && w->now.made == 0;
    case PROCESSOR_ENDS_SOON: {
        world_t trial = *w;
        drop_current(p, &trial);
        return !w->now.continuous && something_follows(p, &trial) &&
               (uint64_t)(w->now.most - w->now.made) * longest_ticks(p, &w->now) <= 30 * MS;
    }
    case PROCESSOR_HELD:
        return w->now.present && w->now.held;
    case PROCESSOR_LOOPS:
        return in_loop(w);
    case PROCESSOR_ARRAY:
        return w->array_looping;
    case PROCESSOR_CONTINUOUS:
        return w->preempting == 1 || (w->now.present && w->now.continuous);
    case PROCESSOR_ENDING:
        return w->now.present && w->now.ending;
    case PROCESSOR_HALF_LOOP:
        return !w->looping && (w->start || w->finish);
    case PROCESSOR_ESTOPPED:
        return w->estop;
    }
    return false;
}

bool processor_may_be(processor_t *p, processor_condition_t condition)
{
    for (size_t i = 0; i < p->count; i++)
        if (is(p, &p->world[i], condition))
            return true;
    return false;
}

bool processor_must_be(processor_t *p, processor_condition_t condition)
{
    for (size_t i = 0; i < p->count; i++)
        if (!is(p, &p->world[i], condition))
            return false;
    return p->count > 0;
}

unsigned processor_pending_most(processor_t *p)
{
    unsigned most = 0;
    for (size_t i = 0; i < p->count; i++)
        most = p->world[i].pending > most ? p->world[i].pending : most;
    return most;
}

unsigned processor_next_position(const processor_t *p)
{
    return p->count ? p->world[0].next : 0;
}

void processor_row(const processor_t *p, unsigned position, char *row, size_t size)
{
    const entry_t *e = &p->world[0].entry[position];
    uint32_t us = e->cycle ? e->velocity : 60000000u / p->machine.steps_per_rev / e->velocity;
    snprintf(row, size, "%" PRIu32 " %s %" PRIu32, e->count, e->ccw ? "CCW" : "CW", us);
}

static void say(char *out, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void say(char *out, size_t size, const char *format, ...)
{
    size_t n = strlen(out);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(out + n, size - n, format, arguments);
    va_end(arguments);
}

const char *processor_states(const processor_t *p)
{
    char *out = ((processor_t *)(uintptr_t)p)->states;
    size_t size = sizeof p->states;
    const world_t *world = p->count ? p->world : p->other;
    size_t count = p->count ? p->count : p->other_count;
    snprintf(out, size, "%zu states:", count);
    for (size_t i = 0; i < count && i < 12; i++) {
        const world_t *w = &world[i];
        const current_t *now = &w->now;
        say(out, size, "\n  %" PRIu32 " of %zu inputs; ", w->inputs, p->inputs);
        if (!now->present)
            say(out, size, "no command");
        else
            say(out, size, "%s%s %s %" PRIu32 " us, %" PRIu32 " pulses of %" PRId32 "..%" PRId32 "%s, due %" PRIu64,
                now->held ? "held " : "", now->continuous ? "continuous" : "command", now->entry.ccw ? "CCW" : "CW",
                cruise_ticks(p, &now->entry) / 16, now->made, (int32_t)now->least, (int32_t)now->most,
                now->ending ? " ending" : "", now->due);
        if (w->looping)
            say(out, size, "; loop %u..%u, pass %" PRIu32 " of %" PRIu32 ", at %u", w->start, w->finish,
                w->passes_made + 1, w->passes, w->executing);
        if (w->array_looping)
            say(out, size, "; array, pass %" PRIu32 " of %" PRIu32 ", at %u", w->array_passes_made + 1, w->array_passes,
                w->array_index);
        say(out, size, "%s; %u pending, next %u", w->preempting ? "; one preempts" : "", w->pending, w->next);
    }
    return out;
}

size_t processor_state_count(const processor_t *p)
{
    return p->count;
}

bool processor_gave_up(const processor_t *p)
{
    return p->gave_up;
}
