#include "queue/session.h"
#include "base/inline.h"
#include "settings.h"

session_t session;

void session_init(void)
{
    session_set_option(SESSION_SOFT_OPS, settings.soft_ops != 0);
    session_set_option(SESSION_CRC, settings.crc_mode != 0);
    session_set_option(SESSION_ACK, settings.acknowledge != 0);
    session.velocity = settings.cycle_us;
    session.flags = MOTION_CYCLE;
    session_set_linear(settings.ramp);
    session_set_pulses(settings.full_step == 0);
}

static void set_flag(uint8_t flag, uint8_t on)
{
    session.flags |= flag;
    if (!on) {
        session.flags ^= flag;
    }
}

NOINLINE void session_set_linear(uint8_t linear)
{
    set_flag(MOTION_LINEAR, linear);
    session.accel = settings.accel[linear];
    session.decel = settings.decel[linear];
}

void session_set_option(uint8_t option, bool on)
{
    session.options |= option;
    if (!on) {
        session.options ^= option;
    }
}

void session_set_pulses(bool pulses)
{
    set_flag(MOTION_PULSES, pulses);
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
