#include "queue/ops.h"
#include "motion/engine.h"
#include "queue/ops_port.h"

/* The mask of the two pins: 36, or 0 for none. */
#ifndef SETTINGS_OPS
#define SETTINGS_OPS 36
#endif

static bool soft;
static bool raised;
static uint8_t played; /* engine_commands_played() so far */

static void signal(bool executing)
{
    raised = executing;
    if (SETTINGS_OPS != 0) {
        ops_port_set(executing);
    }
    if (soft) {
        ops_port_send(executing ? OPS_BEGIN : OPS_END);
    }
}

void ops_poll(void)
{
    const uint8_t now = engine_commands_played();
    while (played != now) {
        played++;
        if (!raised) {
            signal(true);
        }
        signal(false);
    }
    const uint8_t state = (uint8_t)engine_state();
    if (!raised && state >= MOTION_ACCEL && state <= MOTION_DECEL && engine_commands_begun() != engine_commands_ended()) {
        signal(true);
    }
}

void engine_on_start(void)
{
    ops_poll();
}

void ops_set_soft(bool on)
{
    soft = on;
}

bool ops_soft(void)
{
    return soft;
}
