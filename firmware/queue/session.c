#include "queue/session.h"
#include "settings.h"

session_t session;

void session_init(void)
{
    session.velocity = settings.cycle_us;
    session.flags = MOTION_CYCLE;
    session_set_linear(settings.ramp != 0);
    session_set_pulses(settings.full_step == 0);
}

void session_set_linear(bool linear)
{
    if (linear) {
        session.flags |= MOTION_LINEAR;
    } else {
        session.flags &= (uint8_t)~MOTION_LINEAR;
    }
    session.accel = settings.accel[linear];
    session.decel = settings.decel[linear];
}

void session_set_pulses(bool pulses)
{
    if (pulses) {
        session.flags |= MOTION_PULSES;
    } else {
        session.flags &= (uint8_t)~MOTION_PULSES;
    }
}

void session_template(const session_t *from, motion_command_t *command)
{
    command->count = 0;
    command->velocity = from->velocity;
    command->start_wait_us = 0;
    command->accel = from->accel;
    command->decel = from->decel;
    command->extra_pulses = 0;
    command->flags = from->flags;
}
