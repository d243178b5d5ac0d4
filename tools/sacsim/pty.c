#include "pty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "console.h"

/* The kernel reports "nobody there" (POLLHUP) only once the other end has been opened and closed: this does it, and
 * makes the port raw, as a serial port without line editing. */
static bool open_and_close(const char *name)
{
    struct termios raw;
    int fd = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    bool ok;

    if (fd < 0) {
        return false;
    }
    ok = tcgetattr(fd, &raw) == 0;
    if (ok) {
        cfmakeraw(&raw);
        ok = tcsetattr(fd, TCSANOW, &raw) == 0;
    }
    return close(fd) == 0 && ok;
}

static bool make_link(const char *target, const char *path)
{
    struct stat old;
    char *temporary;
    bool ok;

    if (lstat(path, &old) == 0 && !S_ISLNK(old.st_mode)) {
        errno = EEXIST;
        return false;
    }
    if (asprintf(&temporary, "%s.%ld", path, (long)getpid()) < 0) {
        return false;
    }
    ok = symlink(target, temporary) == 0;
    if (ok && rename(temporary, path) != 0) {
        int reason = errno;

        unlink(temporary);
        errno = reason;
        ok = false;
    }
    free(temporary);
    return ok;
}

bool pty_open(pty_t *p, const char *link)
{
    memset(p, 0, sizeof *p);
    p->fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (p->fd < 0 || grantpt(p->fd) != 0 || unlockpt(p->fd) != 0 || ptsname_r(p->fd, p->name, sizeof p->name) != 0 ||
        !open_and_close(p->name)) {
        console_say("cannot open a pseudo terminal: %s", strerror(errno));
        return false;
    }
    if (link != NULL && !make_link(p->name, link)) {
        console_say("cannot make the link %s: %s", link, strerror(errno));
        return false;
    }
    p->link = link;
    return true;
}

bool pty_opened(pty_t *p)
{
    struct pollfd ask = {.fd = p->fd, .events = POLLIN};
    bool there, bytes, opened;

    poll(&ask, 1, 0);
    there = !(ask.revents & POLLHUP);
    bytes = ask.revents & POLLIN;
    if (there) {
        opened = !p->there;
    } else {
        /* Bytes, though nobody is there: left by the last program, or by one that came and went between two looks. */
        opened = bytes && !p->there && !p->draining;
        p->draining = bytes;
        p->backlog_count = 0;
    }
    p->there = there;
    p->open = there || bytes;
    return opened;
}

size_t pty_read(pty_t *p, uint8_t *bytes, size_t max)
{
    ssize_t got = read(p->fd, bytes, max);

    return got > 0 ? (size_t)got : 0;
}

static void flush(pty_t *p)
{
    ssize_t done = p->backlog_count > 0 ? write(p->fd, p->backlog, p->backlog_count) : 0;

    if (done > 0) {
        p->backlog_count -= (size_t)done;
        memmove(p->backlog, p->backlog + done, p->backlog_count);
    }
}

void pty_write(pty_t *p, const uint8_t *bytes, size_t count, bool wait)
{
    if (!p->there) {
        return;
    }
    if (count > PTY_BACKLOG_BYTES - p->backlog_count) {
        count = PTY_BACKLOG_BYTES - p->backlog_count;
    }
    memcpy(p->backlog + p->backlog_count, bytes, count);
    p->backlog_count += count;
    flush(p);
    if (wait && p->backlog_count > 0) {
        struct pollfd ask = {.fd = p->fd, .events = POLLOUT};

        poll(&ask, 1, 100);
        flush(p);
    }
}

void pty_close(pty_t *p)
{
    if (p->link != NULL) {
        char target[sizeof p->name];
        ssize_t length = readlink(p->link, target, sizeof target);

        /* another sacsim may have taken the link over */
        if (length == (ssize_t)strlen(p->name) && memcmp(target, p->name, (size_t)length) == 0) {
            unlink(p->link);
        }
    }
    if (p->fd >= 0) {
        close(p->fd);
    }
}
