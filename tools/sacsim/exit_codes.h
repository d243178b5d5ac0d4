/* Exit codes of the simulator programs besides 0; a signal ends a program as that signal does. */
#ifndef SACSIM_EXIT_CODES_H
#define SACSIM_EXIT_CODES_H

enum {
    EXIT_TROUBLE = 1, /* a file, a terminal or the image could not be used */
    EXIT_USAGE = 2,   /* wrong command line */
    EXIT_CRASHED = 3, /* the image ran into an illegal instruction, out of flash or out of stack */
};

#endif
