/* A pseudo terminal in place of the Nano's USB port.
 *
 * Like the port of a real Nano it can be opened and closed by one program after the other while the board runs; what
 * the board sends while nobody listens is lost.
 *
 * Units:   bytes.
 * Errors:  pty_open() prints the reason on stderr and returns false.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_PTY_H
#define SACSIM_PTY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { PTY_BACKLOG_BYTES = 65536 };

typedef struct {
    int fd;
    char name[64];    /* e.g. /dev/pts/3 */
    const char *link; /* NULL: none */
    bool there;       /* a program has the port open */
    bool draining;    /* it has gone, what it sent is still being read */
    bool open;        /* there is somebody to read from */
    size_t backlog_count;
    uint8_t backlog[PTY_BACKLOG_BYTES]; /* sent by the board, not yet taken by the pseudo terminal */
} pty_t;

/* link: path of a symbolic link to make (an older link is replaced, any other file is an error), or NULL. */
bool pty_open(pty_t *p, const char *link);

/* Looks whether a program has the port open. True if it has been opened since the last call. */
bool pty_opened(pty_t *p);

/* Takes up to max bytes that were sent to the board; 0 if there are none. */
size_t pty_read(pty_t *p, uint8_t *bytes, size_t max);

/* Sends bytes of the board, or loses them if nobody listens or the listener is 64 KB behind. wait: first gives a slow
 * listener up to a tenth of a second to take what is due. */
void pty_write(pty_t *p, const uint8_t *bytes, size_t count, bool wait);

void pty_close(pty_t *p);

#endif
