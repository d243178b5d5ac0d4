#include "cli/terminal.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/timebase_port.h"
#include "base/zeroed.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/line.h"
#include "cli/motion_syntax.h"
#include "cli/network.h"
#include "cli/range.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "cli/trial.h"
#include "version.h"

/* At a high rate so many bytes are taken in one round of the main loop, but not beyond the end of a line, ... */
enum { BYTES_AT_ONCE = 28 };

/* ... unless more than these wait to be taken: then the output rests, and so many lines are executed in one round. */
enum { PRESSED_BYTES = 16, PRESSED_LINES = 3 };

static const char version_line[] FLASH = "SAC " VERSION_NUMBER " " VERSION_DATE "\r\n";

static struct terminal {
    bool held;      /* the line is whole, and waits for what is being stored */
    uint8_t echoed; /* how many characters of the line stand on the screen */

    /* What is owed while answers are held back. */
    bool behind;          /* a prompt is owed; no echo until it is printed */
    bool owes_new_line;   /* the cursor stands behind the last line that was echoed */
    status_t owed_status; /* the first error since, or STATUS_OK */
    uint8_t owed_range;   /* of that error */

    /* Debug mode: how long the last line took. The clock starts with the line, and again at its end. */
    uint8_t owes_times; /* pieces of the report */
    bool timing;        /* this line is being timed: not while the times of the last one are owed */
    uint32_t loaded_us;
    uint32_t received_us;

    line_t line;
} terminal;

static inline struct terminal *self(void)
{
    struct terminal *t = &terminal;
    NEAR(t);
    return t;
}

/* From a point in time to the time since: from 0 to now. */
static NOINLINE void since(uint32_t *us)
{
    *us = timebase_us() - *us;
}

NOINLINE void terminal_put_error(status_t status, uint8_t range)
{
    text_put('?');
    text_put_u32(status);
    text_put(' ');
    text_put_flash(status_words(status));
    if (status == STATUS_RANGE) {
        text_put(' ');
        text_put_flash(range_text(range));
    }
}

/* At most TEXT_PIECE_BYTES. */
static void put_times(struct terminal *t)
{
    const char *words = FLASH_TEXT(", loaded ");
    const uint32_t *us = &t->loaded_us;
    if (--t->owes_times != 0) {
        words = FLASH_TEXT("received ");
        us = &t->received_us;
    }
    text_put_flash(words);
    text_put_u32(*us);
    text_put_flash(FLASH_TEXT(" us"));
    if (us == &t->loaded_us) {
        text_new_line();
    }
}

/* Sends the next piece of what is owed, if it fits: the end of the echoed line, displays, times, error, prompt. */
static NOINLINE uint8_t pay(void)
{
    struct terminal *const t = self();
    if (terminal_port_free() < TEXT_PIECE_BYTES) {
        return 0;
    }
    if (t->owes_new_line) {
        t->owes_new_line = false;
        text_new_line();
    } else if (display_poll() || network_show()) {
        /* a piece of it */
    } else if (t->owes_times != 0) {
        put_times(t);
    } else if (t->owed_status != STATUS_OK) {
        if (terminal_port_free() < TEXT_ERROR_BYTES) {
            return 0;
        }
        terminal_put_error(t->owed_status, t->owed_range);
        text_new_line();
        t->owed_status = STATUS_OK;
    } else {
        text_put_flash(commands_prompt());
        t->behind = false;
    }
    return 1;
}

/* The answer to a line. */
static void owe(struct terminal *t, status_t status)
{
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

void terminal_report(status_t status)
{
    terminal.owed_status = status; /* before any other error */
    owe(&terminal, status);
}

void terminal_announce(void)
{
    owe(&terminal, STATUS_OK);
}

/* Brings the screen to what the line is, as far as the port has room. */
static uint8_t echo(struct terminal *t)
{
    uint8_t worked = 0;
    while (t->echoed < t->line.length && terminal_port_free() != 0) {
        terminal_port_put((uint8_t)t->line.text[t->echoed++]);
        worked = 1;
    }
    return worked;
}

/* A character was taken back: from the screen too, or the line is shown anew when there is room. */
static void erase(struct terminal *t)
{
    if (t->echoed <= t->line.length) {
        return; /* it had not been echoed */
    }
    if (terminal_port_free() < 3) {
        owe(t, STATUS_OK);
        return;
    }
    text_put_flash(FLASH_TEXT("\b \b"));
    t->echoed--;
}

static void end_line(struct terminal *t)
{
    if (!line_begun(&t->line)) {
        t->timing = false;
    }
    if (t->timing) {
        since(&t->received_us);
        t->loaded_us = 0;
        since(&t->loaded_us);
    }
    status_t status = t->line.status;
    if (status == STATUS_OK) {
        const uint8_t tried = trial_on(); /* asked before: $R comes by the path before */
        status = commands_execute(terminal.line.text, t->line.length); /* the motion first, then the answer */
        if (status == STATUS_OK && tried && motion_syntax_more(t->line.text[0])) {
            trial_confirm();
        }
    } else {
        commands_read_ahead(terminal.line.text, 0);
    }
    t->held = false;
    if (status == STATUS_WAIT) {
        t->held = true;
        t->timing = false;
        return;
    }
    if (t->timing && commands_debugging()) {
        since(&t->loaded_us);
        t->owes_times = 2;
    }
    line_reset(&t->line);
    owe(t, status);
}

/* The first character of a line: it may act at once, and the clock of the debug mode starts. */
static bool begin_line(struct terminal *t, uint8_t byte)
{
    if (commands_at_once((char)byte)) {
        return false;
    }
    t->timing = false;
    if (commands_debugging() && t->owes_times == 0) {
        t->timing = true;
        t->received_us = 0;
        since(&t->received_us);
    }
    return true;
}

void terminal_init(status_t reported)
{
    AT_BOOT_ZERO(terminal);
    display_init();
    terminal.behind = true;
    terminal.owed_status = reported;
    text_put_flash(version_line);
}

/* Takes what has arrived, up to the first byte that ends or changes a line otherwise than by one more character. */
static line_event_t take(struct terminal *t, uint8_t *bytes)
{
    while (*bytes > 0) {
        const int16_t byte = terminal_port_get();
        if (byte < 0) {
            break;
        }
        --*bytes;
        if (byte == TERMINAL_PORT_DAMAGED) {
            line_damage(&t->line);
        } else if (line_begun(&t->line) || begin_line(t, (uint8_t)byte)) {
            const line_event_t event = line_take(&t->line, (uint8_t)byte);
            if (event > LINE_APPENDED) {
                return event;
            }
        }
    }
    return LINE_APPENDED;
}

NOINLINE uint8_t terminal_poll(void)
{
    struct terminal *const t = self();
    uint8_t bytes = BYTES_AT_ONCE; /* still to be taken in this round */
    uint8_t worked = 0;
    for (uint8_t lines = PRESSED_LINES; lines > 0; lines--) {
        const line_event_t event = t->held ? LINE_ENDED : take(t, &bytes);
        if (event == LINE_ERASED) {
            erase(t);
        }
        if (!t->behind) {
            worked |= echo(t);
        }
        if (event != LINE_ENDED) {
            if (bytes != BYTES_AT_ONCE) {
                commands_read_ahead(terminal.line.text, t->line.length);
            }
            if (event == LINE_CLEARED) {
                owe(t, STATUS_OK);
            }
            break;
        }
        end_line(t);
        if (terminal_port_waiting() <= PRESSED_BYTES) {
            break;
        }
    }
    if (t->behind && terminal_port_waiting() <= PRESSED_BYTES) {
        worked |= pay();
    }
    return (uint8_t)(worked | (bytes ^ BYTES_AT_ONCE));
}
