#include "eeprom_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "console.h"

static bool replace(const char *path, const uint8_t *cells)
{
    char *temporary;
    bool ok = false;
    int fd;

    if (asprintf(&temporary, "%s.XXXXXX", path) < 0) {
        return false;
    }
    fd = mkstemp(temporary);
    if (fd >= 0) {
        struct stat old;
        mode_t mode = 0644;

        if (stat(path, &old) == 0) {
            mode = old.st_mode & 07777;
        }
        ok = write(fd, cells, BOARD_EEPROM_BYTES) == BOARD_EEPROM_BYTES && fchmod(fd, mode) == 0 && fsync(fd) == 0;
        ok = close(fd) == 0 && ok;
        ok = ok && rename(temporary, path) == 0;
        if (!ok) {
            int reason = errno;

            unlink(temporary);
            errno = reason;
        }
    }
    if (!ok) {
        console_say("cannot save the EEPROM in %s: %s", path, strerror(errno));
    }
    free(temporary);
    return ok;
}

static bool load(eeprom_file_t *f, int fd)
{
    uint8_t more;
    ssize_t got = read(fd, f->saved, sizeof f->saved);

    if (got < 0) {
        console_say("cannot read %s: %s", f->path, strerror(errno));
        return false;
    }
    if (got != (ssize_t)sizeof f->saved || read(fd, &more, 1) != 0) {
        console_say("%s is no EEPROM file: it must have %d bytes", f->path, BOARD_EEPROM_BYTES);
        return false;
    }
    return true;
}

bool eeprom_file_open(eeprom_file_t *f, const char *path)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    bool ok;

    f->path = fd >= 0 ? realpath(path, NULL) : strdup(path);
    if (fd >= 0 && f->path != NULL) {
        ok = load(f, fd);
    } else if (errno == ENOENT) {
        memset(f->saved, 0xff, sizeof f->saved);
        ok = replace(path, f->saved);
    } else {
        console_say("cannot open %s: %s", path, strerror(errno));
        ok = false;
    }
    if (fd >= 0) {
        close(fd);
    }
    return ok;
}

bool eeprom_file_save(eeprom_file_t *f, const uint8_t *cells)
{
    if (memcmp(f->saved, cells, sizeof f->saved) == 0) {
        return true;
    }
    if (!replace(f->path, cells)) {
        return false;
    }
    memcpy(f->saved, cells, sizeof f->saved);
    return true;
}

void eeprom_file_close(eeprom_file_t *f)
{
    free(f->path);
    f->path = NULL;
}
