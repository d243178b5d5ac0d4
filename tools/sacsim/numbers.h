/* Numbers on a command line.
 *
 * Errors:  text that is no number of that range is reported by argp, which ends the program. */
#ifndef SACSIM_NUMBERS_H
#define SACSIM_NUMBERS_H

#include <argp.h>

/* what: the option's name as the user wrote it. */
double numbers_real(struct argp_state *state, const char *what, const char *text, double low, double high);
int numbers_whole(struct argp_state *state, const char *what, const char *text, int low, int high);

#endif
