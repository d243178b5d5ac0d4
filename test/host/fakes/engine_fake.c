#include "host/fakes/engine_fake.h"
#include <string.h>
#include "boot.h"
#include "cli/terminal_port.h"
#include "host/fakes/terminal_port_fake.h"
#include "motion/estop_port.h"
#include "queue/ops_port.h"
#include "settings.h"

engine_fake_t engine_fake;

void engine_fake_reset(void)
{
    memset(&engine_fake, 0, sizeof engine_fake);
    engine_fake.accepts = true;
    engine_fake.gap = true;
    engine_fake.rpm = settings.slow_rpm;
    engine_fake.cycle_us = 30000;
}

uint32_t command_rpm(const motion_command_t *command)
{
    if (command->flags & MOTION_CYCLE) {
        return (uint32_t)(60000000ull / settings.steps_per_rev / command->velocity);
    }
    return command->velocity;
}

uint32_t command_cycle_us(const motion_command_t *command)
{
    if (command->flags & MOTION_CYCLE) {
        return command->velocity;
    }
    return (uint32_t)(60000000ull / settings.steps_per_rev / command->velocity);
}

status_t engine_check(const motion_command_t *command)
{
    const double period_us = (double)command_cycle_us(command) / (1 << settings.ustep);
    return period_us < 2 || period_us < settings.pulse_us + 1 ? STATUS_PERIOD_TOO_SHORT : STATUS_OK;
}

void engine_init(void) {}

uint8_t engine_poll(void)
{
    return false;
}

void engine_fake_begin(void)
{
    engine_fake.submitted[engine_fake.submitted_count++ % ENGINE_FAKE_COMMANDS] = *engine_fake.offered;
    engine_fake.sent_at_submit = terminal_port_fake_sent();
    engine_fake.offered = NULL;
    engine_fake.begun++;
}

void engine_offer(const motion_command_t *command)
{
    engine_fake.offered = command;
    if (engine_fake.accepts && command != NULL) {
        engine_fake_begin();
    }
}

void engine_release(void)
{
    engine_fake.releases++;
}

uint8_t engine_commands_begun(void)
{
    return engine_fake.begun;
}

uint8_t engine_commands_ended(void)
{
    return engine_fake.ended;
}

void engine_stop(void)
{
    engine_fake.stops++;
    engine_fake.ended = engine_fake.begun;
}

void engine_stop_graceful(accel_code_t decel, bool linear)
{
    engine_fake.stops_graceful++;
    engine_fake.graceful_decel = decel;
    engine_fake.graceful_linear = linear;
}

bool engine_next(bool graceful)
{
    if (graceful) {
        engine_fake.nexts_graceful++;
    } else {
        engine_fake.nexts++;
    }
    return !engine_fake.cannot_end;
}

void engine_single_pulse(bool ccw)
{
    if (ccw) {
        engine_fake.pulses_ccw++;
    } else {
        engine_fake.pulses_cw++;
    }
}

motion_state_t engine_state(void)
{
    return engine_fake.state;
}

int32_t engine_position(void)
{
    return engine_fake.position;
}

void engine_velocity(uint32_t *rpm, uint32_t *cycle_us)
{
    *rpm = engine_fake.rpm;
    *cycle_us = engine_fake.cycle_us;
}

void engine_set_gap(bool on)
{
    engine_fake.gap = on;
}

bool engine_gap(void)
{
    return engine_fake.gap;
}

uint8_t engine_faults(void)
{
    return engine_fake.faults;
}

void boot_restart(void)
{
    engine_fake.restarts++;
}

bool estop_port_active(void)
{
    return engine_fake.estop;
}

uint8_t engine_commands_played(void)
{
    return engine_fake.played;
}

void ops_port_set(bool executing)
{
    size_t length = strlen(engine_fake.ops);
    if (length + 1 < sizeof engine_fake.ops) {
        engine_fake.ops[length] = executing ? '1' : '0';
    }
}

void ops_port_send(uint8_t byte)
{
    if (terminal_port_free() != 0) {
        terminal_port_put(byte);
    }
}
