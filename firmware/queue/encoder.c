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

uint8_t encoder_poll(void)
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
            do {
                const bool ccw = lines < 0;
                engine_single_pulse(ccw);
                lines = (int8_t)(ccw ? lines + 1 : lines - 1);
            } while (lines != 0);
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
