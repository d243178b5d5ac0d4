/* Several simulated Nanos on one RS485 line: a pseudo terminal for each one's serial port, and one for the line.
 *
 * Units:   in the names.
 * Errors:  reported on stderr.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_NETWORK_H
#define SACSIM_NETWORK_H

#include "options.h"

/* Runs until a signal or the time limit ends it. Returns the exit code, or minus the number of the signal. */
int network_run(const options_t *o);

#endif
