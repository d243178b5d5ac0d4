/* Boot, then the polled loop: nothing else. */
#include "base/atomic.h"
#include "base/wake.h"
#include "cli/commands.h"
#include "cli/terminal.h"
#include "cli/terminal_port.h"
#include "motion/engine.h"
#include "motion/estop_port.h"
#include "pins_port.h"
#include "queue/ops.h"
#include "queue/queue.h"
#include "settings.h"

int main(void)
{
    pins_init();
    engine_init();
    commands_init();
    queue_init();
    terminal_port_init(settings.hw_baud);
    terminal_init();
    atomic_enable();

    for (;;) {
        /* Cleared before the polls: what an interrupt leaves to do meanwhile is seen in this round or the next. */
        wake_flag = 0;
        if (estop_port_poll()) {
            queue_stop();
        }
        bool worked = terminal_poll(); /* first: a line's end is what wakes a unit at rest, and its motion is awaited */
        worked |= queue_poll();
        worked |= engine_poll();
        ops_poll();
        if (!worked) {
            wake_sleep();
        }
    }
}
