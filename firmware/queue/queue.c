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

static struct queue {
    uint8_t next_available; /* 1..30 */
    uint8_t pending;        /* 0..30: the entries before it */
    uint8_t preempting;     /* position that comes before all others, or NONE */
    end_t due;              /* how what runs still has to be ended, as soon as it can be */
    uint8_t executing;      /* position of the command begun last */
    uint8_t begun;          /* engine_commands_begun() that `executing` belongs to */

    run_t run;
    uint8_t at;        /* of the loop the position begun last, of the array the entry after it; 0: none yet */
    uint8_t bounds[2]; /* of the loop, by queue_bound_t; 0: not known */
    uint16_t passes;   /* still to be made; 0: endless */
    bool last_of_loop; /* one more command, then it ends */

    bool undo_added;       /* the last change made a new entry */
    uint8_t undo_position; /* of that change; 0: nothing to be taken back */
    motion_command_t undo; /* what was there before */

    uint8_t array[QUEUE_ARRAY + 1]; /* the last one stays 0 */
} the_queue;

/* To be asked for anew after a call: that is shorter than keeping it. Where there is one access, the_queue is. */
static inline struct queue *self(void)
{
    struct queue *queue;
    NEAR_TO(queue, the_queue);
    return queue;
}

static uint8_t after(uint8_t position)
{
    return position == QUEUE_LAST ? QUEUE_FIRST : (uint8_t)(position + 1);
}

static NOINLINE motion_command_t *entry_at(uint8_t position)
{
    return &entries[position];
}

static NOINLINE void end_loop(void)
{
    struct queue *const queue = self();
    queue->run = RUN_NOTHING;
    queue->last_of_loop = false;
    queue->bounds[QUEUE_LOOP_START] = queue->bounds[QUEUE_LOOP_FINISH] = 0;
    queue->passes = 0;
}

/* Is what has begun of the loop or the array the last one of a pass ... */
static NOINLINE bool ends_pass(void)
{
    struct queue *const queue = self();
    return queue->run == RUN_LOOP ? queue->at == queue->bounds[QUEUE_LOOP_FINISH] : queue->array[queue->at] == 0;
}

/* ... and of all? As bounds and array are now; also where there is neither loop nor array. */
static NOINLINE bool is_over(void)
{
    if (the_queue.run == RUN_NOTHING) {
        return true;
    }
    if (!ends_pass()) {
        return false;
    }
    struct queue *const queue = self();
    return queue->passes == 1 || (queue->run == RUN_ARRAY && queue->array[0] == 0);
}

/* The command that comes next; NONE if there is none. */
static uint8_t choose(void)
{
    const uint8_t preempting = the_queue.preempting;
    if (preempting != NONE) {
        return preempting;
    }
    if (!is_over()) {
        const bool anew = ends_pass();
        struct queue *const queue = self();
        const uint8_t at = anew ? 0 : queue->at;
        if (queue->run == RUN_ARRAY) {
            return queue->array[at];
        }
        return at == 0 ? queue->bounds[QUEUE_LOOP_START] : after(at);
    }
    struct queue *const queue = self();
    if (queue->pending == 0) {
        return NONE;
    }
    uint8_t position = (uint8_t)(queue->next_available - queue->pending);
    return position < QUEUE_FIRST || position > QUEUE_LAST ? (uint8_t)(position + QUEUE_LAST) : position;
}

/* What was chosen has begun. */
static NOINLINE void advance(void)
{
    const uint8_t chosen = choose();
    struct queue *queue = self();
    queue->executing = chosen;
    queue->due = END_NOT;
    if (queue->preempting != NONE) {
        queue->preempting = NONE;
    } else if (!is_over()) {
        const bool ends = ends_pass();
        queue = self();
        if (ends) {
            if (queue->passes != 0) {
                queue->passes--;
            }
            queue->at = 0;
        }
        queue->at = queue->run == RUN_LOOP ? queue->executing : (uint8_t)(queue->at + 1);
        if (queue->last_of_loop) {
            end_loop();
        }
    } else {
        if (the_queue.run != RUN_NOTHING) {
            end_loop();
        }
        the_queue.pending--;
    }
}

/* Accounts for what the engine has begun; before anything changes what is chosen. */
static NOINLINE uint8_t note_begun(void)
{
    struct queue *const queue = self();
    if (queue->begun == engine_commands_begun()) {
        return false;
    }
    queue->begun++;
    advance();
    return true;
}

/* True if it has begun: at standstill that is at once. */
static NOINLINE uint8_t offer(void)
{
    const uint8_t position = choose();
    engine_offer(position == NONE ? 0 : entry_at(position));
    return note_begun();
}

uint8_t queue_poll(void)
{
    const uint8_t changed = note_begun();
    if (the_queue.due != END_NOT && engine_next(the_queue.due == END_GRACEFULLY)) {
        the_queue.due = END_NOT;
    }
    if (the_queue.run != RUN_NOTHING && is_over() && !queue_is_executing()) {
        end_loop();
    }
    return (uint8_t)(offer() | changed);
}

/* One revolution each, else the session defaults. */
static NOINLINE void seed(uint8_t position, uint8_t last)
{
    the_queue.undo_position = 0;
    for (; position <= last; position++) {
        motion_command_t *const entry = entry_at(position);
        session_template(&session, entry);
        entry->count = settings.steps_per_rev;
        entry->flags &= (uint8_t)~MOTION_PULSES;
        if (settings.direction != 0) {
            entry->flags |= MOTION_CCW;
        }
    }
}

void queue_init(void)
{
    AT_BOOT_ZERO(the_queue);
    seed(QUEUE_CONTINUOUS, QUEUE_ONE_SHOT);
    struct queue *const queue = self();
    queue->next_available = QUEUE_FIRST;
    queue->preempting = NONE;
    queue->begun = engine_commands_begun();
}

void queue_clear(void)
{
    seed(QUEUE_FIRST, QUEUE_LAST);
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
    the_queue.undo_position = 0;
    return STATUS_OK;
}

/* -- what is written --------------------------------------------------------------------------------------------- */

typedef uint16_t __attribute__((may_alias, aligned(1))) pair_t;
_Static_assert(sizeof(motion_command_t) % sizeof(pair_t) == 0, "write() copies all of it");

static void write(uint8_t position, const motion_command_t *command, bool added)
{
    struct queue *const queue = self();
    queue->undo_position = position;
    queue->undo_added = added;
    /* Both copies in one loop, two bytes at a time: time counts. */
    pair_t *to = (pair_t *)entry_at(position);
    pair_t *kept = (pair_t *)&queue->undo;
    const pair_t *from = (const pair_t *)command;
    for (uint8_t left = sizeof queue->undo / sizeof *to; left > 0; left--) {
        *kept++ = *to;
        *to++ = *from++;
    }
}

status_t queue_add(const motion_command_t *command)
{
    if (estop_port_active()) {
        return STATUS_ESTOP;
    }
    if (the_queue.pending == QUEUE_LAST) {
        return STATUS_QUEUE_FULL;
    }
    write(the_queue.next_available, command, true);
    struct queue *const queue = self();
    queue->next_available = after(queue->next_available);
    queue->pending++;
    (void)offer();
    return STATUS_OK;
}

void queue_edit(uint8_t position, const motion_command_t *command)
{
    write(position, command, false);
}

status_t queue_undo(void)
{
    const uint8_t position = the_queue.undo_position;
    if (position == 0 || position == queue_executing_position()) {
        return STATUS_NOTHING_TO_UNDO;
    }
    motion_command_t *const entry = entry_at(position);
    struct queue *const queue = self();
    *entry = queue->undo;
    queue->undo_position = 0;
    if (queue->undo_added) {
        queue->next_available = position;
        if (queue->pending != 0) { /* the newest one: still among them */
            queue->pending--;
        }
    }
    (void)offer();
    return STATUS_OK;
}

/* -- preemption -------------------------------------------------------------------------------------------------- */

status_t queue_preempt(uint8_t position)
{
    const motion_command_t *const command = entry_at(position);
    const status_t status = engine_check(command);
    return status == STATUS_OK ? queue_preempt_with(position, command) : status;
}

status_t queue_preempt_with(uint8_t position, const motion_command_t *command)
{
    if (estop_port_active()) {
        return STATUS_ESTOP;
    }
    *entry_at(position) = *command;
    struct queue *const queue = self();
    queue->preempting = position;
    queue->due = END_NOW;
    (void)queue_poll();
    return STATUS_OK;
}

static bool is_continuous(void)
{
    return the_queue.executing == QUEUE_CONTINUOUS ? queue_is_executing() : false;
}

/* It runs, or is about to. */
static NOINLINE bool becomes_continuous(void)
{
    return the_queue.preempting == QUEUE_CONTINUOUS ? true : is_continuous();
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
    motion_command_t *continuous = &entries[QUEUE_CONTINUOUS];
    NEAR(continuous);
    const uint32_t velocity = continuous->velocity;
    const uint8_t flags = continuous->flags;
    const int32_t wanted = (int32_t)command_rpm(continuous) + rpm;
    continuous->velocity = wanted < 1 ? 1u : (uint32_t)wanted;
    continuous->flags = flags & (uint8_t)~MOTION_CYCLE;
    if (queue_preempt(QUEUE_CONTINUOUS) != STATUS_OK) { /* too fast: it stays as it is */
        continuous->velocity = velocity;
        continuous->flags = flags;
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
        status = engine_check(entry_at(first));
        if (first == last) {
            break;
        }
        first = after(first);
    } while (status == STATUS_OK);
    return status;
}

static NOINLINE void begin_run(run_t what)
{
    struct queue *const queue = self();
    queue->run = what;
    queue->at = 0;
    queue->last_of_loop = false;
    (void)offer();
}

status_t queue_loop_bound(queue_bound_t bound, uint8_t position)
{
    struct queue *const queue = self();
    const uint8_t other = queue->bounds[bound ^ 1];
    const uint8_t before = queue->bounds[bound];
    if (position == other) {
        return STATUS_LOOP_BOUNDS;
    }
    queue->bounds[bound] = position;
    if (other != 0) {
        const status_t status = may_run(queue->bounds[QUEUE_LOOP_START], queue->bounds[QUEUE_LOOP_FINISH]);
        if (status != STATUS_OK) {
            queue->bounds[bound] = before;
            return status;
        }
        if (queue->run != RUN_LOOP) {
            begin_run(RUN_LOOP);
        }
    }
    (void)offer();
    return STATUS_OK;
}

NOINLINE status_t queue_loop_from_first(uint8_t finish)
{
    const status_t status = may_run(QUEUE_FIRST, finish);
    if (status == STATUS_OK) {
        the_queue.bounds[QUEUE_LOOP_START] = QUEUE_FIRST;
        the_queue.bounds[QUEUE_LOOP_FINISH] = finish;
        begin_run(RUN_LOOP);
    }
    return status;
}

void queue_loop_passes(uint16_t count)
{
    the_queue.passes = count;
    (void)offer();
}

status_t queue_array_set(uint8_t entry, uint8_t position)
{
    if (position != 0) {
        const status_t status = engine_check(entry_at(position));
        if (status != STATUS_OK) {
            return status;
        }
    }
    the_queue.array[entry] = position;
    (void)offer();
    return STATUS_OK;
}

uint8_t queue_array(uint8_t entry)
{
    return the_queue.array[entry];
}

NOINLINE status_t queue_array_run(uint16_t count)
{
    const uint8_t *array = the_queue.array;
    if (*array == 0) {
        return STATUS_ARRAY_EMPTY;
    }
    do {
        const status_t status = may_run(*array, *array);
        if (status != STATUS_OK) {
            return status;
        }
    } while (*++array != 0);
    end_loop();
    self()->passes = count;
    begin_run(RUN_ARRAY);
    return STATUS_OK;
}

NOINLINE void queue_loop_end(void)
{
    end_loop();
    if (is_continuous()) {
        the_queue.due = END_GRACEFULLY;
    }
    (void)queue_poll();
}

/* -- ends -------------------------------------------------------------------------------------------------------- */

static void forget(void)
{
    end_loop();
    struct queue *const queue = self();
    queue->pending = 0;
    queue->preempting = NONE;
    queue->due = END_NOT;
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
    const bool ended = engine_next(how == END_GRACEFULLY);
    const bool continuous = is_continuous();
    struct queue *const queue = self();
    if (!ended && continuous) {
        queue->due = how;
    }
    queue->last_of_loop = queue->run != RUN_NOTHING && continuous;
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
    return the_queue.next_available;
}

uint8_t queue_pending(void)
{
    return the_queue.pending;
}

bool queue_is_executing(void)
{
    return engine_commands_ended() != engine_commands_begun();
}

NOINLINE uint8_t queue_executing_position(void)
{
    return queue_is_executing() ? the_queue.executing : 0;
}

const motion_command_t *queue_entry(uint8_t position)
{
    return entry_at(position);
}
