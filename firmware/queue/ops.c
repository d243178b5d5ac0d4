#include "queue/ops.h"
#include "motion/engine.h"
#include "net/bus.h"
#include "queue/ops_port.h"
#include "queue/session.h"
#include "settings.h"

static bool raised;
static uint8_t played; /* engine_commands_played() so far */

static void signal(bool executing)
{
    raised = executing;
    if (settings.ops_mask != 0) {
        ops_port_set(executing);
    }
    if (session.options & SESSION_SOFT_OPS) {
        const uint8_t byte = executing ? OPS_BEGIN : OPS_END;
        ops_port_send(byte);
        bus_ops(byte);
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
