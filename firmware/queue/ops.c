#include "queue/ops.h"
#include "motion/engine.h"
#include "net/bus.h"
#include "queue/ops_port.h"
#include "queue/session.h"
#include "settings.h"

static bool raised;
static uint8_t played; /* engine_commands_played() so far */

static void signal(uint8_t byte)
{
    raised = byte & 1u; /* OPS_BEGIN */
    if (settings.ops_mask != 0) {
        ops_port_set(raised);
    }
    if (session.options & SESSION_SOFT_OPS) {
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
            signal(OPS_BEGIN);
        }
        signal(OPS_END);
    }
    const uint8_t state = (uint8_t)engine_state();
    if (!raised && state >= MOTION_ACCEL && state <= MOTION_DECEL && engine_commands_begun() != engine_commands_ended()) {
        signal(OPS_BEGIN);
    }
}

void engine_on_start(void)
{
    ops_poll();
}
