/* Signals of a program that runs a simulation.
 *
 * Errors:  none.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_SIGNALS_H
#define SACSIM_SIGNALS_H

/* From now on the handler gets this signal, and ends sleeps and writes that are going on. A signal that is ignored, as
 * nohup wants it, stays so. */
void signals_handle(int number, void (*handler)(int));

/* The same for all signals that ask a program to end. */
void signals_handle_ends(void (*handler)(int));

/* Ends the process as its signal would have, so that a calling shell knows. */
void signals_end_by(int number);

#endif
