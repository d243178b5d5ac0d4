/* The status table: every error by number and words (status.def).
 *
 * Context: main loop; pure. Tests: test/host/test_status.c */
#ifndef BASE_STATUS_H
#define BASE_STATUS_H

#include <stdint.h>

typedef enum {
    STATUS_OK = 0,
#define STATUS(name, number, words, remedy) STATUS_##name = (number),
#include "base/status.def"
#undef STATUS
    STATUS_WAIT = 0xFF, /* never answered: the line waits and is executed again (cli/terminal.c) */
} status_t;

/* The words of an error, in flash (base/flash.h); an empty text for STATUS_OK. */
const char *status_words(status_t status);

#endif
