#include "queue/session.h"
#include "base/inline.h"
#include "settings.h"

session_t session;

void session_init(void)
{
    session_set_option(SESSION_SOFT_OPS, settings.soft_ops);
    session_set_option(SESSION_CRC, settings.crc_mode);
    session_set_option(SESSION_ACK, settings.acknowledge);
    session.velocity = settings.cycle_us;
    session.flags = MOTION_CYCLE;
    session_set_linear(settings.ramp);
    session_set_pulses(settings.full_step == 0);
}

static NOINLINE void set(uint8_t *bits, uint8_t bit, uint8_t on)
{
    uint8_t others = *bits | bit;
    if (!on) {
        others ^= bit;
    }
    *bits = others;
}

NOINLINE void session_set_linear(uint8_t linear)
{
    set(&session.flags, MOTION_LINEAR, linear);
    session.accel = settings.accel[linear];
    session.decel = settings.decel[linear];
}

NOINLINE void session_set_option(uint8_t option, uint8_t on)
{
    set(&session.options, option, on);
}

void session_set_pulses(bool pulses)
{
    set(&session.flags, MOTION_PULSES, pulses);
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
