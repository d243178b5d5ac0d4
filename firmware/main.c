/* Boot, then the polled loop: nothing else. */
#include "base/atomic.h"
#include "base/timebase_port.h"
#include "base/wake.h"
#include "boot.h"
#include "boot_port.h"
#include "cli/commands.h"
#include "cli/network.h"
#include "cli/terminal.h"
#include "cli/trial.h"
#include "drivers.h"
#include "eeprom/store.h"
#include "motion/engine.h"
#include "motion/estop_port.h"
#include "pins_port.h"
#include "ports_port.h"
#include "queue/encoder.h"
#include "queue/encoder_port.h"
#include "queue/ops.h"
#include "queue/queue.h"
#include "settings.h"

static status_t snapshot; /* what became of the saved queue ... */
static bool saved;        /* ... and whether there is one */

void boot_restart(void)
{
    ports_init(); /* first: what is typed meanwhile is heard */
    engine_init();
    commands_init();
}

void boot_start(void)
{
    boot_restart();
    queue_init();
    snapshot = queue_restore(&saved);
}

void boot_restore_factory(void)
{
    store_restore_factory();
    settings_to_factory();
    trial_begin(false);
}

/* Where the start-up code ends (hal/start.S), and never left. */
__attribute__((OS_main, section(".init9"))) int main(void)
{
    pins_init();
    trial_begin(store_load_settings());
    boot_init();
    boot_start();
    terminal_init(boot_cause() != STATUS_OK ? boot_cause() : snapshot == STATUS_SNAPSHOT ? snapshot : STATUS_OK);
    network_init();
    timebase_start();
    encoder_init();
    atomic_enable();

    for (;;) {
        /* Cleared before the polls: what an interrupt leaves to do meanwhile is seen in this round or the next. */
        wake_flag = 0;
        boot_port_alive();
        uint8_t worked = 0;
        const bool stopped = estop_port_poll();
        if (stopped) {
            queue_stop();
        }
        if (ports_deaf() && !engine_hurries()) {
            ports_listen();
        }
        if (boot_over()) {
            if (saved) {
                saved = false; /* once */
                if (boot_autorun_allowed() && settings.autorun != 0) {
                    (void)queue_loop_from_first(settings.autorun);
                }
            }
            worked |= terminal_poll(); /* first: a line's end is what wakes a unit at rest, and its motion is awaited */
            worked |= network_poll();
        }
        if (trial_failed()) {
            ports_init();
            terminal_report(STATUS_TAKEN_BACK);
        }
        worked |= encoder_poll();
        worked |= engine_poll();
        if (worked || stopped || engine_plays()) { /* else nothing has begun or ended, and a line's end need not wait */
            worked |= queue_poll(); /* it knows what has begun before anybody asks or changes it */
            ops_poll();
        }
        worked |= store_poll();
        if (!worked) {
            wake_sleep();
        }
    }
}
