#include "queue/queue.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "eeprom/store.h"
#include "motion/engine.h"
#include "motion/estop_port.h"
#include "queue/session.h"
#include "settings.h"

enum { NONE = 0xFF }; /* no position */

typedef enum { RUN_NOTHING, RUN_LOOP, RUN_ARRAY } run_t;
typedef enum { END_NOT, END_NOW, END_GRACEFULLY } end_t;

static motion_command_t entries[QUEUE_POSITIONS];
static uint8_t array[QUEUE_ARRAY + 1]; /* the last one stays 0 */
static uint8_t next_available; /* 1..30 */
static uint8_t pending;        /* 0..30: the entries before it */
static uint8_t preempting;     /* position that comes before all others, or NONE */
static end_t due;              /* how what runs still has to be ended, as soon as it can be */
static uint8_t executing;      /* position of the command begun last */
static uint8_t begun;          /* engine_commands_begun() that `executing` belongs to */

static run_t run;
static uint8_t at;         /* of the loop the position begun last, of the array the entry after it; 0: none yet */
static uint8_t bounds[2];  /* of the loop, by queue_bound_t; 0: not known */
static uint16_t passes;    /* still to be made; 0: endless */
static bool last_of_loop;  /* one more command, then it ends */

static motion_command_t undo; /* what was at ... */
static uint8_t undo_position; /* ... before the last change; 0: nothing to be taken back */
static bool undo_added;       /* it was a new entry */

static void revolution(motion_command_t *seed)
{
    session_template(&session, seed);
    seed->count = settings.steps_per_rev;
    seed->flags &= (uint8_t)~MOTION_PULSES;
    if (settings.direction != 0) {
        seed->flags |= MOTION_CCW;
    }
}

static uint8_t after(uint8_t position)
{
    return position == QUEUE_LAST ? QUEUE_FIRST : (uint8_t)(position + 1);
}

static void end_loop(void)
{
    run = RUN_NOTHING;
    last_of_loop = false;
    bounds[QUEUE_LOOP_START] = bounds[QUEUE_LOOP_FINISH] = 0;
    passes = 0;
}

/* Is what has begun of the loop or the array the last one of a pass ... */
static NOINLINE bool ends_pass(void)
{
    return run == RUN_LOOP ? at == bounds[QUEUE_LOOP_FINISH] : array[at] == 0;
}

/* ... and of all? As bounds and array are now. */
static NOINLINE bool is_over(void)
{
    return ends_pass() && (passes == 1 || (run == RUN_ARRAY && array[0] == 0));
}

/* The command that comes next; NONE if there is none. */
static uint8_t choose(void)
{
    if (preempting != NONE) {
        return preempting;
    }
    if (run != RUN_NOTHING && !is_over()) {
        if (run == RUN_ARRAY) {
            return array[ends_pass() ? 0 : at];
        }
        return at == 0 || ends_pass() ? bounds[QUEUE_LOOP_START] : after(at);
    }
    if (pending == 0) {
        return NONE;
    }
    uint8_t position = (uint8_t)(next_available - pending);
    return position < QUEUE_FIRST || position > QUEUE_LAST ? (uint8_t)(position + QUEUE_LAST) : position;
}

/* What was chosen has begun. */
static NOINLINE void advance(void)
{
    executing = choose();
    due = END_NOT;
    if (preempting != NONE) {
        preempting = NONE;
    } else if (run != RUN_NOTHING && !is_over()) {
        if (ends_pass()) {
            if (passes != 0) {
                passes--;
            }
            at = 0;
        }
        at = run == RUN_LOOP ? executing : (uint8_t)(at + 1);
        if (last_of_loop) {
            end_loop();
        }
    } else {
        if (run != RUN_NOTHING) {
            end_loop();
        }
        pending--;
    }
}

/* Accounts for what the engine has begun; before anything changes what is chosen. */
static NOINLINE bool note_begun(void)
{
    if (begun == engine_commands_begun()) {
        return false;
    }
    begun++;
    advance();
    return true;
}

/* True if it has begun: at standstill that is at once. */
static NOINLINE bool offer(void)
{
    const uint8_t position = choose();
    engine_offer(position == NONE ? 0 : &entries[position]);
    return note_begun();
}

bool queue_poll(void)
{
    const bool changed = note_begun();
    if (due != END_NOT && engine_next(due == END_GRACEFULLY)) {
        due = END_NOT;
    }
    if (run != RUN_NOTHING && is_over() && !queue_is_executing()) {
        end_loop();
    }
    return offer() || changed;
}

void queue_init(void)
{
    queue_clear();
    revolution(&entries[QUEUE_CONTINUOUS]);
    revolution(&entries[QUEUE_ONE_SHOT]);
    AT_BOOT_ZERO(array);
    next_available = QUEUE_FIRST;
    AT_BOOT_ZERO(pending);
    preempting = NONE;
    AT_BOOT_ZERO(due);
    begun = engine_commands_begun();
    end_loop();
}

void queue_clear(void)
{
    for (uint8_t position = QUEUE_FIRST; position <= QUEUE_LAST; position++) {
        revolution(&entries[position]);
    }
    undo_position = 0;
}

_Static_assert(STORE_QUEUE_BYTES == QUEUE_LAST * sizeof(motion_command_t), "the snapshot holds the entries");

void queue_save(void)
{
    store_save_queue(&entries[QUEUE_FIRST]);
}

status_t queue_restore(bool *saved)
{
    *saved = false;
    if (store_busy()) {
        return STATUS_BUSY;
    }
    const store_queue_t found = store_load_queue(&entries[QUEUE_FIRST]);
    if (found == STORE_QUEUE_BROKEN) {
        return STATUS_SNAPSHOT;
    }
    if (found == STORE_QUEUE_NONE) {
        const session_t kept = session;
        session_init();
        queue_clear();
        session = kept;
    }
    *saved = found == STORE_QUEUE_SAVED;
    undo_position = 0;
    return STATUS_OK;
}

/* -- what is written --------------------------------------------------------------------------------------------- */

static void write(uint8_t position, const motion_command_t *command, bool added)
{
    undo_position = position;
    undo_added = added;
    /* Both copies in one loop: time counts. */
    uint8_t *to = (uint8_t *)&entries[position];
    uint8_t *kept = (uint8_t *)&undo;
    const uint8_t *from = (const uint8_t *)command;
    for (uint8_t left = sizeof undo; left > 0; left--) {
        *kept++ = *to;
        *to++ = *from++;
    }
}

status_t queue_add(const motion_command_t *command)
{
    if (estop_port_active()) {
        return STATUS_ESTOP;
    }
    if (pending == QUEUE_LAST) {
        return STATUS_QUEUE_FULL;
    }
    write(next_available, command, true);
    next_available = after(next_available);
    pending++;
    (void)offer();
    return STATUS_OK;
}

void queue_edit(uint8_t position, const motion_command_t *command)
{
    write(position, command, false);
}

status_t queue_undo(void)
{
    const uint8_t position = undo_position;
    if (position == 0 || position == queue_executing_position()) {
        return STATUS_NOTHING_TO_UNDO;
    }
    entries[position] = undo;
    undo_position = 0;
    if (undo_added) {
        next_available = position;
        if (pending != 0) { /* the newest one: still among them */
            pending--;
        }
    }
    (void)offer();
    return STATUS_OK;
}

/* -- preemption -------------------------------------------------------------------------------------------------- */

status_t queue_preempt(uint8_t position)
{
    const status_t status = engine_check(&entries[position]);
    return status == STATUS_OK ? queue_preempt_with(position, &entries[position]) : status;
}

status_t queue_preempt_with(uint8_t position, const motion_command_t *command)
{
    if (estop_port_active()) {
        return STATUS_ESTOP;
    }
    entries[position] = *command;
    preempting = position;
    due = END_NOW;
    (void)queue_poll();
    return STATUS_OK;
}

static bool is_continuous(void)
{
    return executing == QUEUE_CONTINUOUS && queue_is_executing();
}

/* It runs, or is about to. */
static NOINLINE bool becomes_continuous(void)
{
    return preempting == QUEUE_CONTINUOUS || is_continuous();
}

void queue_follow(const motion_command_t *command)
{
    NEAR(command);
    motion_command_t *continuous = &entries[QUEUE_CONTINUOUS];
    if (becomes_continuous()) {
        continuous->velocity = command->velocity;
        continuous->accel = command->accel;
        continuous->flags = (uint8_t)((continuous->flags & ~SESSION_FLAGS) | (command->flags & SESSION_FLAGS));
        (void)queue_preempt(QUEUE_CONTINUOUS);
    }
}

void queue_throttle(int8_t rpm)
{
    if (!becomes_continuous()) {
        return;
    }
    motion_command_t faster = entries[QUEUE_CONTINUOUS];
    const int32_t wanted = (int32_t)command_rpm(&faster) + rpm;
    faster.velocity = wanted < 1 ? 1u : (uint32_t)wanted;
    faster.flags &= (uint8_t)~MOTION_CYCLE;
    if (engine_check(&faster) == STATUS_OK) {
        (void)queue_preempt_with(QUEUE_CONTINUOUS, &faster);
    }
}

/* -- loops ------------------------------------------------------------------------------------------------------- */

/* Entries may be older than the settings in force, and impossible with them. */
static NOINLINE status_t may_run(uint8_t first, uint8_t last)
{
    status_t status = STATUS_OK;
    if (estop_port_active()) {
        return STATUS_ESTOP;
    }
    do {
        status = engine_check(&entries[first]);
        if (first == last) {
            break;
        }
        first = after(first);
    } while (status == STATUS_OK);
    return status;
}

static NOINLINE void begin_run(run_t what)
{
    run = what;
    at = 0;
    last_of_loop = false;
    (void)offer();
}

status_t queue_loop_bound(queue_bound_t bound, uint8_t position)
{
    const uint8_t other = bounds[1 - bound];
    if (position == other) {
        return STATUS_LOOP_BOUNDS;
    }
    if (other != 0) {
        const status_t status = bound == QUEUE_LOOP_START ? may_run(position, other) : may_run(other, position);
        if (status != STATUS_OK) {
            return status;
        }
    }
    bounds[bound] = position;
    if (other != 0 && run != RUN_LOOP) {
        begin_run(RUN_LOOP);
    }
    (void)offer();
    return STATUS_OK;
}

NOINLINE status_t queue_loop_from_first(uint8_t finish)
{
    const status_t status = may_run(QUEUE_FIRST, finish);
    if (status == STATUS_OK) {
        bounds[QUEUE_LOOP_START] = QUEUE_FIRST;
        bounds[QUEUE_LOOP_FINISH] = finish;
        begin_run(RUN_LOOP);
    }
    return status;
}

void queue_loop_passes(uint16_t count)
{
    passes = count;
    (void)offer();
}

status_t queue_array_set(uint8_t entry, uint8_t position)
{
    if (position != 0) {
        const status_t status = engine_check(&entries[position]);
        if (status != STATUS_OK) {
            return status;
        }
    }
    array[entry] = position;
    (void)offer();
    return STATUS_OK;
}

uint8_t queue_array(uint8_t entry)
{
    return array[entry];
}

NOINLINE status_t queue_array_run(uint16_t count)
{
    if (array[0] == 0) {
        return STATUS_ARRAY_EMPTY;
    }
    for (uint8_t entry = 0; entry < QUEUE_ARRAY && array[entry] != 0; entry++) {
        const status_t status = may_run(array[entry], array[entry]);
        if (status != STATUS_OK) {
            return status;
        }
    }
    end_loop();
    passes = count;
    begin_run(RUN_ARRAY);
    return STATUS_OK;
}

NOINLINE void queue_loop_end(void)
{
    end_loop();
    if (is_continuous()) {
        due = END_GRACEFULLY;
    }
    (void)queue_poll();
}

/* -- ends -------------------------------------------------------------------------------------------------------- */

static void forget(void)
{
    end_loop();
    pending = 0;
    preempting = NONE;
    due = END_NOT;
    engine_offer(0);
}

NOINLINE void queue_stop(void)
{
    forget();
    engine_stop();
}

void queue_stop_graceful(accel_code_t decel, bool linear)
{
    forget();
    engine_stop_graceful(decel, linear);
}

/* Where the engine cannot end the running command it ends by itself within 10 ms. If that is not the one begun last, but
 * continuous motion is, it shall end too; and a loop that it has interrupted executes one more command. */
static void end_running(end_t how)
{
    if (!engine_next(how == END_GRACEFULLY) && is_continuous()) {
        due = how;
    }
    last_of_loop = run != RUN_NOTHING && is_continuous();
}

void queue_next(void)
{
    end_running(END_NOW);
}

void queue_next_graceful(void)
{
    end_running(END_GRACEFULLY);
}

uint8_t queue_next_position(void)
{
    return next_available;
}

uint8_t queue_pending(void)
{
    return pending;
}

bool queue_is_executing(void)
{
    return engine_commands_ended() != engine_commands_begun();
}

NOINLINE uint8_t queue_executing_position(void)
{
    return queue_is_executing() ? executing : 0;
}

const motion_command_t *queue_entry(uint8_t position)
{
    return &entries[position];
}
