#include "queue/queue.h"
#include "motion/engine.h"
#include "settings.h"

static motion_command_t entries[QUEUE_POSITIONS];
static uint8_t next_available; /* 1..30 */
static uint8_t next_to_submit; /* 1..30; with nothing pending the same as next_available */
static uint8_t pending;        /* 0..30 */
static uint8_t submitted;      /* commands given to the engine since boot, modulo 256 */

static uint8_t position_after(uint8_t position)
{
    return position == QUEUE_LAST ? QUEUE_FIRST : (uint8_t)(position + 1);
}

void queue_init(void)
{
    motion_command_t seed = {
        .count = settings.steps_per_rev,
        .velocity = settings.cycle_us,
        .accel = settings.accel[settings.ramp],
        .decel = settings.decel[settings.ramp],
        .flags = MOTION_CYCLE,
    };
    if (settings.ramp != 0) {
        seed.flags |= MOTION_LINEAR; /* the ramp values are rad/s^2 then */
    }
    if (settings.direction != 0) {
        seed.flags |= MOTION_CCW;
    }
    for (uint8_t position = 0; position < QUEUE_POSITIONS; position++) {
        entries[position] = seed;
    }
    next_available = QUEUE_FIRST;
    next_to_submit = QUEUE_FIRST;
    pending = 0;
    submitted = engine_commands_ended();
}

status_t queue_add(const motion_command_t *command)
{
    if (pending == QUEUE_LAST) {
        return STATUS_QUEUE_FULL;
    }
    entries[next_available] = *command;
    next_available = position_after(next_available);
    pending++;
    return STATUS_OK;
}

bool queue_poll(void)
{
    if (pending == 0 || !engine_can_accept()) {
        return false;
    }
    engine_submit(&entries[next_to_submit]);
    next_to_submit = position_after(next_to_submit);
    pending--;
    submitted++;
    return true;
}

static void drop_pending(void)
{
    pending = 0;
    next_to_submit = next_available;
}

void queue_stop(void)
{
    drop_pending();
    engine_stop();
    submitted = engine_commands_ended();
}

void queue_stop_graceful(accel_code_t decel, bool linear)
{
    drop_pending();
    engine_stop_graceful(decel, linear);
    submitted = engine_commands_ended();
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
    return next_to_submit > not_ended ? (uint8_t)(next_to_submit - not_ended)
                                      : (uint8_t)(next_to_submit + QUEUE_LAST - not_ended);
}

const motion_command_t *queue_entry(uint8_t position)
{
    return &entries[position];
}
