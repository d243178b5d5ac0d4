#include "cli/terminal.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/line.h"
#include "cli/range.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "cli/timebase_port.h"
#include "version.h"

/* At a high rate so many bytes are taken in one round of the main loop, but not beyond the end of a line, ... */
enum { BYTES_AT_ONCE = 28 };

/* ... unless more than these wait to be taken: then the output rests, and so many lines are executed in one round. */
enum { PRESSED_BYTES = 16, PRESSED_LINES = 3 };

static const char version_line[] FLASH = "SAC " VERSION_NUMBER " " VERSION_DATE "\r\n";

static line_t line;

static struct terminal {
    bool held;      /* the line is whole, and waits for what is being stored */
    uint8_t echoed; /* how many characters of the line stand on the screen */

    /* What is owed while answers are held back. */
    bool behind;            /* a prompt is owed; no echo until it is printed */
    bool owes_new_line;     /* the cursor stands behind the last line that was echoed */
    status_t owed_status;   /* the first error since, or STATUS_OK */
    uint8_t owed_range;   /* of that error */

    /* Debug mode: how long the last line took. The clock starts with the line, and again at its end. */
    uint8_t owes_times; /* pieces of the report */
    bool timing;        /* this line is being timed: not while the times of the last one are owed */
    uint32_t received_us;
    uint32_t loaded_us;
} terminal;

static inline struct terminal *self(void)
{
    struct terminal *t = &terminal;
    NEAR(t);
    return t;
}

/* Each at most TEXT_PIECE_BYTES long. */
static void put_error(void)
{
    terminal_port_put('?');
    text_put_u32(terminal.owed_status);
    terminal_port_put(' ');
    text_put_flash(status_words(terminal.owed_status));
    if (terminal.owed_status == STATUS_RANGE) {
        terminal_port_put(' ');
        text_put_flash(range_text(terminal.owed_range));
    }
    text_new_line();
}

static void put_times(struct terminal *t)
{
    const char *words = FLASH_TEXT(", loaded ");
    uint32_t us = t->loaded_us;
    if (--t->owes_times != 0) {
        words = FLASH_TEXT("received ");
        us = t->received_us;
    }
    text_put_flash(words);
    text_put_u32(us);
    text_put_flash(FLASH_TEXT(" us"));
    if (t->owes_times == 0) {
        text_new_line();
    }
}

/* Sends the next piece of what is owed, if it fits: the end of the echoed line, displays, times, error, prompt. */
static NOINLINE bool pay(void)
{
    struct terminal *const t = self();
    if (terminal_port_free() < TEXT_PIECE_BYTES) {
        return false;
    }
    if (t->owes_new_line) {
        t->owes_new_line = false;
        text_new_line();
    } else if (display_poll()) {
        /* a piece of it */
    } else if (t->owes_times != 0) {
        put_times(t);
    } else if (t->owed_status != STATUS_OK) {
        put_error();
        t->owed_status = STATUS_OK;
    } else {
        text_put_flash(commands_prompt());
        t->behind = false;
    }
    return true;
}

/* The answer to a line. */
static void owe(status_t status)
{
    struct terminal *const t = self();
    if (!t->behind) {
        t->behind = true;
        t->owes_new_line = true;
    }
    if (t->owed_status == STATUS_OK) {
        t->owed_status = status;
        t->owed_range = range_refused();
    }
    t->echoed = 0;
}

/* Brings the screen to what the line is, as far as the port has room. */
static bool echo(void)
{
    bool worked = false;
    uint8_t room = terminal_port_free();
    while (terminal.echoed < line.length && room > 0) {
        terminal_port_put((uint8_t)line.text[terminal.echoed++]);
        room--;
        worked = true;
    }
    return worked;
}

/* A character was taken back: from the screen too, or the line is shown anew when there is room. */
static void erase(void)
{
    if (terminal.echoed <= line.length) {
        return; /* it had not been echoed */
    }
    if (terminal_port_free() < 3) {
        owe(STATUS_OK);
        return;
    }
    text_put_flash(FLASH_TEXT("\b \b"));
    terminal.echoed--;
}

static void end_line(void)
{
    struct terminal *const t = self();
    const uint8_t timed = line_begun(&line) ? t->timing : 0;
    if (timed) {
        t->loaded_us = timebase_us();
        t->received_us = t->loaded_us - t->received_us;
    }
    status_t status = line.status;
    if (status == STATUS_OK) {
        status = commands_execute(line.text, line.length); /* the motion first, then the answer */
    } else {
        commands_read_ahead(line.text, 0);
    }
    t->held = status == STATUS_WAIT;
    if (t->held) {
        t->timing = false;
        return;
    }
    if (timed && commands_debugging()) {
        t->loaded_us = timebase_us() - t->loaded_us;
        t->owes_times = 2;
    }
    line_reset(&line);
    owe(status);
}

/* The first character of a line: it may act at once, and the clock of the debug mode starts. */
static bool begin_line(uint8_t byte)
{
    if (commands_at_once((char)byte)) {
        return false;
    }
    terminal.timing = false;
    if (commands_debugging() && terminal.owes_times == 0) {
        terminal.timing = true;
        terminal.received_us = timebase_us();
    }
    return true;
}

void terminal_init(status_t reported)
{
    AT_BOOT_ZERO(line);
    AT_BOOT_ZERO(terminal);
    display_init();
    terminal.behind = true;
    terminal.owed_status = reported;
    text_put_flash(version_line);
}

/* Takes what has arrived, up to the first byte that ends or changes a line otherwise than by one more character. */
static line_event_t take(uint8_t *bytes)
{
    for (; *bytes > 0; --*bytes) {
        const int16_t byte = terminal_port_get();
        if (byte < 0) {
            break;
        }
        if (byte == TERMINAL_PORT_DAMAGED) {
            line_damage(&line);
        } else if (line_begun(&line) || begin_line((uint8_t)byte)) {
            const line_event_t event = line_take(&line, (uint8_t)byte);
            if (event > LINE_APPENDED) {
                --*bytes;
                return event;
            }
        }
    }
    return LINE_APPENDED;
}

NOINLINE bool terminal_poll(void)
{
    uint8_t bytes = BYTES_AT_ONCE; /* still to be taken in this round */
    bool worked = false;
    for (uint8_t lines = PRESSED_LINES; lines > 0; lines--) {
        const line_event_t event = terminal.held ? LINE_ENDED : take(&bytes);
        if (event == LINE_ERASED) {
            erase();
        }
        if (!terminal.behind) {
            worked |= echo();
        }
        if (event != LINE_ENDED) {
            if (bytes != BYTES_AT_ONCE) {
                commands_read_ahead(line.text, line.length);
            }
            if (event == LINE_CLEARED) {
                owe(STATUS_OK);
            }
            break;
        }
        end_line();
        if (terminal_port_waiting() <= PRESSED_BYTES) {
            break;
        }
    }
    if (terminal.behind && terminal_port_waiting() <= PRESSED_BYTES) {
        worked |= pay();
    }
    return worked || bytes != BYTES_AT_ONCE;
}
