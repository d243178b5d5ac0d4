#include "queue/queue.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "motion/engine.h"
#include "queue/session.h"
#include "settings.h"

static motion_command_t entries[QUEUE_POSITIONS];
static uint8_t next_available; /* 1..30 */
static uint8_t pending;        /* 0..30: the entries before it */
static uint8_t submitted;      /* commands given to the engine since boot, modulo 256 */

/* So many entries before the next available one, at most 60. */
static NOINLINE uint8_t position_before(uint8_t entries_back)
{
    uint8_t position = (uint8_t)(next_available + 2 * QUEUE_LAST - entries_back);
    while (position > QUEUE_LAST) {
        position = (uint8_t)(position - QUEUE_LAST);
    }
    return position;
}

void queue_init(void)
{
    motion_command_t *seed = &entries[0];
    session_template(&session, seed);
    seed->count = settings.steps_per_rev;
    seed->flags &= (uint8_t)~MOTION_PULSES;
    if (settings.direction != 0) {
        seed->flags |= MOTION_CCW;
    }
    uint8_t *bytes = (uint8_t *)entries;
    for (uint16_t i = 0; i < sizeof entries - sizeof *seed; i++) {
        bytes[i + sizeof *seed] = bytes[i]; /* each entry from the one before it */
    }
    next_available = QUEUE_FIRST;
    AT_BOOT_ZERO(pending);
    submitted = engine_commands_ended();
}

status_t queue_add(const motion_command_t *command)
{
    if (pending == QUEUE_LAST) {
        return STATUS_QUEUE_FULL;
    }
    entries[next_available] = *command;
    next_available = next_available == QUEUE_LAST ? QUEUE_FIRST : (uint8_t)(next_available + 1);
    pending++;
    return STATUS_OK;
}

bool queue_poll(void)
{
    if (pending == 0 || !engine_can_accept()) {
        return false;
    }
    engine_submit(&entries[position_before(pending)]);
    pending--;
    submitted++;
    return true;
}

/* The engine has dropped what it had. */
static NOINLINE void forget(void)
{
    pending = 0;
    submitted = engine_commands_ended();
}

NOINLINE void queue_stop(void)
{
    engine_stop();
    forget();
}

void queue_stop_graceful(accel_code_t decel, bool linear)
{
    engine_stop_graceful(decel, linear);
    forget();
}

void queue_next(void)
{
    engine_next();
}

void queue_next_graceful(void)
{
    engine_next_graceful();
}

uint8_t queue_next_position(void)
{
    return next_available;
}

uint8_t queue_pending(void)
{
    return pending;
}

uint8_t queue_executing_position(void)
{
    /* The engine ends commands in the order in which it took them: the oldest one not ended is the one that runs. */
    const uint8_t not_ended = (uint8_t)(submitted - engine_commands_ended());
    if (not_ended == 0 || not_ended > QUEUE_LAST) {
        return 0;
    }
    return position_before((uint8_t)(pending + not_ended));
}

const motion_command_t *queue_entry(uint8_t position)
{
    return &entries[position];
}
