#include "queue/encoder.h"
#include "motion/engine.h"
#include "queue/encoder_port.h"
#include "queue/queue.h"

static bool moving;
static bool overridden;

/* A change of state ends the override. */
static void look(void)
{
    const bool moves = engine_state() != MOTION_STANDBY;
    if (moves != moving) {
        moving = moves;
        overridden = false;
    }
}

bool encoder_poll(void)
{
    look();
    int8_t lines = encoder_take();
    if (lines == 0) {
        return false;
    }
    if (!overridden) {
        if (moving) {
            queue_throttle(lines);
        } else {
            const int8_t one = lines < 0 ? -1 : 1;
            for (; lines != 0; lines = (int8_t)(lines - one)) {
                engine_single_pulse(one < 0);
            }
        }
    }
    return true;
}

void encoder_toggle(void)
{
    look();
    overridden = !overridden;
}

bool encoder_throttles(void)
{
    look();
    return moving != overridden;
}
