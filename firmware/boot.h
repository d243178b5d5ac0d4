/* What follows a reset: its cause, the second in which a unit can be restored, and what is allowed after it.
 *
 * A cold start is a power-on or an external reset; a bootloader that hides the cause counts as one. Only then RST held
 * low restores the factory settings, at once, and ESC three times in a row, typed before the first prompt, at the end
 * of that window. What else is typed in the window is executed after it. After a watchdog or brown-out reset there is
 * no window, nothing is restored, nothing starts by itself, and the cause is reported.
 * Context: main loop. Errors: none.
 * Tests:   test/host/test_boot.c, test/image/test_image_boot.c
 * Source:  manual lines 674, 737-739, 999-1003; decisions on restoring and on motion after a reset. */
#ifndef BOOT_H
#define BOOT_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"

/* MCUSR's flags (datasheet 11.9.1) to what is reported: STATUS_OK for a cold start. Power-on may set others too. */
status_t boot_cause_of(uint8_t flags);

/* Before anything that depends on the settings, and after the pins. */
void boot_init(void);

status_t boot_cause(void);

/* Whether the terminal may be served: not as long as the window is open. Call it in each round of the main loop. */
bool boot_over(void);

/* Whether a saved queue may start by itself (once boot_over()): after a cold start. */
static inline bool boot_autorun_allowed(void)
{
    return boot_cause() == STATUS_OK;
}

/* -- what boot needs of others ------------------------------------------------------------------------------------ */

/* Brings up engine, commands, queue, ports from the settings; again after they were restored: nothing has been
 * executed yet then. In main.c. */
void boot_start(void);

/* All of that but the queue: $R, after the settings have been loaded. In main.c. */
void boot_restart(void);

/* The factory settings into RAM, at once; what is kept in EEPROM, the queue included, follows by and by. In main.c. */
void boot_restore_factory(void);

#endif
