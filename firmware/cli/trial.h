/* The minute in which a new path has to be confirmed, so that no typing error cuts a unit off.
 *
 * When settings are loaded whose path (E, M, m or n: settings.h) is not the one that is kept, they are in effect but on
 * trial. The first line that is executed without an error confirms them: they are kept. If none comes within 60 s the kept
 * path is in effect again, and stored. A reset begins the minute anew, with the same values: a terminal that is set to
 * another rate resets a Nano when it opens the port.
 * Units:   60.0 s, less 0.3 at most.
 * Context: main loop. Errors: none.
 * Tests:   test/host/test_trial.c, test/image/test_image_configure.c
 * Source:  decisions 0.3.7. */
#ifndef CLI_TRIAL_H
#define CLI_TRIAL_H

#include <stdbool.h>
#include <stdint.h>

void trial_begin(bool changed); /* with what store_load_settings() returned; false ends a trial */

/* Not 0: what is executed now came by the path on trial. */
uint8_t trial_on(void);

void trial_confirm(void);

/* To be called in each round, behind the terminal. True, once: the minute is over, and the settings in use have the path
 * that is kept; the ports are to be set to it. */
bool trial_failed(void);

#endif
