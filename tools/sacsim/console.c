#include "console.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

/* ECMA-48 and DEC: what every terminal emulator of today knows. */
#define SAVE_CURSOR "\0337"
#define RESTORE_CURSOR "\0338"
#define WHOLE_SCREEN "\033[r" /* no scroll region; moves the cursor home */
#define CLEAR_BELOW "\033[J"  /* from the cursor on */
#define DOWN_OR_SCROLL "\033D"
#define UP "\033[A"

enum { ROWS_MIN = 4, COLUMNS_MIN = 20, COLUMNS_MAX = 300 };

static struct {
    bool keys, screen;
    bool hung_up;
    bool wanted; /* a status line, as soon as there is room */
    volatile sig_atomic_t raw, region, abandoned;
    struct termios before;
    unsigned rows, columns;
    /* Where the firmware's output stands in an escape sequence of its own: nothing may be put into the middle. */
    enum { PLAIN, AFTER_ESC, IN_CSI } sequence;
} console;

/* -- writing --------------------------------------------------------------------------------------------------- */

static void put(int fd, const char *bytes, size_t count)
{
    while (count > 0) {
        ssize_t done = write(fd, bytes, count);

        if (done < 0 && errno == EINTR && !console.abandoned) {
            continue;
        }
        if (done < 0 && errno == EAGAIN && !console.abandoned) {
            struct pollfd ask = {.fd = fd, .events = POLLOUT};

            poll(&ask, 1, 1000);
            continue;
        }
        if (done < 0) {
            console.hung_up = !console.abandoned;
            return;
        }
        bytes += done;
        count -= (size_t)done;
    }
}

static void put_text(const char *text)
{
    put(STDOUT_FILENO, text, strlen(text));
}

static void follow(const unsigned char *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        switch (console.sequence) {
        case PLAIN: console.sequence = bytes[i] == 033 ? AFTER_ESC : PLAIN; break;
        case AFTER_ESC: console.sequence = bytes[i] == '[' ? IN_CSI : PLAIN; break;
        case IN_CSI: console.sequence = bytes[i] >= 0x40 && bytes[i] <= 0x7e ? PLAIN : IN_CSI; break;
        }
    }
}

void console_write(const void *bytes, size_t count)
{
    follow(bytes, count);
    put(STDOUT_FILENO, bytes, count);
}

void console_print(const char *line)
{
    put_text(line);
    put_text(console.screen ? "\r\n" : "\n");
}

void console_say(const char *format, ...)
{
    char line[512];
    va_list arguments;
    bool terminal = isatty(STDERR_FILENO);

    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    dprintf(STDERR_FILENO, "%ssacsim: %s%s", terminal && console.raw ? "\r\n" : "", line, terminal ? "\r\n" : "\n");
}

/* -- status line ----------------------------------------------------------------------------------------------- */

bool console_has_status(void)
{
    return console.region;
}

unsigned console_columns(void)
{
    return console.columns;
}

static void leave_region(void)
{
    if (console.region) {
        console.region = 0;
        put_text(SAVE_CURSOR WHOLE_SCREEN RESTORE_CURSOR CLEAR_BELOW);
    }
}

/* Makes the bottom row ours: the cursor goes one row up if it stands there. */
static void enter_region(void)
{
    struct winsize size;
    char text[64];

    console.rows = console.columns = 0;
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
        console.rows = size.ws_row;
        console.columns = size.ws_col;
    }
    if (!console.wanted || console.rows < ROWS_MIN || console.columns < COLUMNS_MIN) {
        return;
    }
    console.region = 1;
    snprintf(text, sizeof text, CLEAR_BELOW DOWN_OR_SCROLL UP SAVE_CURSOR "\033[1;%ur" RESTORE_CURSOR,
             console.rows - 1);
    put_text(text);
}

void console_resized(void)
{
    leave_region();
    enter_region();
}

void console_set_status(bool on)
{
    leave_region();
    console.wanted = on && console.screen;
    enter_region();
}

void console_status(const char *text)
{
    char line[COLUMNS_MAX + 64];
    int width = (int)(console.columns < COLUMNS_MAX ? console.columns : COLUMNS_MAX);

    if (!console.region || console.sequence != PLAIN) {
        return;
    }
    /* reverse video, one write, so that it never flickers */
    snprintf(line, sizeof line, SAVE_CURSOR "\033[%u;1H\033[0;7m%-*.*s\033[0m" RESTORE_CURSOR, console.rows, width,
             width, text);
    put_text(line);
}

/* -- raw keys, and the way back ---------------------------------------------------------------------------------- */

static void raw_keys(void)
{
    struct termios raw = console.before;

    cfmakeraw(&raw);
    raw.c_cc[VMIN] = 0; /* reads never wait */
    raw.c_cc[VTIME] = 0;
    console.raw = tcsetattr(STDIN_FILENO, TCSADRAIN, &raw) == 0;
}

static void open_again(void)
{
    if (console.keys) {
        raw_keys();
    }
    if (console.screen) {
        enter_region();
    }
}

/* Only what a signal handler may call. */
void console_restore(void)
{
    if (console.region) {
        static const char back[] = "\033[0m" SAVE_CURSOR WHOLE_SCREEN RESTORE_CURSOR CLEAR_BELOW;

        console.region = 0;
        put(STDOUT_FILENO, back, sizeof back - 1);
    }
    if (console.raw) {
        console.raw = 0;
        tcsetattr(STDIN_FILENO, TCSANOW, &console.before);
    }
}

static void on_crash(int signal_number)
{
    console_restore();
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

void console_open(bool status)
{
    static const int crashes[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
    const char *term = getenv("TERM");

    console.keys = isatty(STDIN_FILENO) && tcgetattr(STDIN_FILENO, &console.before) == 0;
    console.screen = isatty(STDOUT_FILENO);
    console.wanted = status && console.screen && term != NULL && strcmp(term, "dumb") != 0;
    for (size_t i = 0; i < sizeof crashes / sizeof crashes[0]; i++) {
        signal(crashes[i], on_crash);
    }
    atexit(console_restore);
    open_again();
}

void console_reopen(void)
{
    open_again();
}

void console_abandon(void)
{
    console.abandoned = 1;
}

bool console_keys(void)
{
    return console.keys;
}

bool console_screen(void)
{
    return console.screen;
}

bool console_hung_up(void)
{
    return console.hung_up;
}
