#include "queue/session.h"
#include "base/inline.h"
#include "settings.h"

session_t session;

void session_init(void)
{
    session.flags = settings.full_step != 0 ? MOTION_CYCLE : MOTION_CYCLE | MOTION_PULSES;
    session.velocity = settings.cycle_us;
    session_set_option(SESSION_SOFT_OPS, settings.soft_ops);
    session_set_option(SESSION_CRC, settings.crc_mode);
    session_set_option(SESSION_ACK, settings.acknowledge);
    session_set_linear(settings.ramp);
}

/* In this order they are where the callers have them. */
static NOINLINE void set(uint8_t bit, uint8_t on, uint8_t *bits)
{
    NEAR(bits);
    uint8_t others = *bits | bit;
    if (!on) {
        others ^= bit;
    }
    *bits = others;
}

NOINLINE void session_set_linear(uint8_t linear)
{
    set(MOTION_LINEAR, linear, &session.flags);
    /* Both of a pair are reached through one pointer, as far behind the first ones. */
    const settings_t *values = (const settings_t *)((const uint8_t *)&settings + linear * sizeof(accel_code_t));
    NEAR(values);
    session.accel = values->accel[0];
    session.decel = values->decel[0];
}

NOINLINE void session_set_option(uint8_t option, uint8_t on)
{
    set(option, on, &session.options);
}

void session_set_pulses(bool pulses)
{
    set(MOTION_PULSES, pulses, &session.flags);
}

NOINLINE void session_template(const session_t *from, motion_command_t *command)
{
    command->count = 0;
    command->velocity = from->velocity;
    command->start_wait_us = 0;
    command->accel = from->accel;
    command->decel = from->decel;
    command->extra_pulses = 0;
    command->flags = from->flags;
}
