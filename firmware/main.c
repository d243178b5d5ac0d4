/* Boot, then the polled loop: nothing else. */
#include "base/atomic.h"
#include "base/wake.h"
#include "boot.h"
#include "boot_port.h"
#include "cli/commands.h"
#include "cli/terminal.h"
#include "cli/terminal_port.h"
#include "cli/timebase_port.h"
#include "drivers.h"
#include "motion/engine.h"
#include "pins_port.h"
#include "queue/encoder.h"
#include "queue/encoder_port.h"
#include "queue/queue.h"
#include "settings.h"

void boot_start(void)
{
    const uint8_t ustep = drivers_ustep(settings.driver, settings.ustep);
    pins_microsteps(drivers_pins(settings.driver, ustep, settings.driver_map));
    engine_init();
    commands_init();
    queue_init();
    terminal_port_init(settings.hw_baud);
}

int main(void)
{
    pins_init();
    boot_init();
    boot_start();
    terminal_init(boot_cause());
    timebase_start();
    encoder_init();
    atomic_enable();

    for (;;) {
        /* Cleared before the polls: what an interrupt leaves to do meanwhile is seen in this round or the next. */
        wake_flag = 0;
        boot_port_alive();
        /* First: a line's end is what wakes a unit at rest, and its motion is awaited. */
        bool worked = boot_over() && terminal_poll();
        worked |= encoder_poll();
        worked |= queue_poll();
        worked |= engine_poll();
        if (!worked) {
            wake_sleep();
        }
    }
}
