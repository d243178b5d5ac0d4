/* One run of a simulated Nano: from power-on to the reason to end.
 *
 * Units:   in the names.
 * Errors:  reported on stderr.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_SESSION_H
#define SACSIM_SESSION_H

#include "options.h"

/* Runs until the user, a signal, the end of the input or the time limit ends it. Returns the exit code, or minus the
 * number of the signal. */
int session_run(const options_t *o);

#endif
