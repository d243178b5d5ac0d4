#include "cli/terminal.h"
#include "base/flash.h"
#include "base/inline.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/line.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "cli/timebase_port.h"
#include "version.h"

/* At a high rate so many bytes are taken in one round of the main loop, but not beyond the end of a line, ... */
enum { BYTES_AT_ONCE = 28 };

/* ... unless more than these wait to be taken: then the output rests, and so many lines are executed in one round. */
enum { PRESSED_BYTES = 16, PRESSED_LINES = 3 };

static const char version_line[] FLASH = "SAC " VERSION_NUMBER " " VERSION_DATE "\r\n";
static const char prompt[] FLASH = "SAC>";

static line_t line;
static uint8_t echoed; /* how many characters of the line stand on the screen */

/* What is owed while answers are held back. */
static bool behind;            /* a prompt is owed; no echo until it is printed */
static bool owes_new_line;     /* the cursor stands behind the last line that was echoed */
static status_t owed_status;   /* the first error since, or STATUS_OK */
static const char *owed_range; /* of that error */

/* Debug mode: how long the last line took. */
static uint8_t owes_times;   /* pieces of the report */
static bool timing;          /* this line is being timed: not while the times of the last one are owed */
static uint32_t received_us; /* while a line is typed: when it began */
static uint32_t loaded_us;

/* Each at most TEXT_PIECE_BYTES long. */
static void put_error(void)
{
    terminal_port_put('?');
    text_put_u32(owed_status);
    terminal_port_put(' ');
    text_put_flash(status_words(owed_status));
    if (owed_status == STATUS_RANGE) {
        terminal_port_put(' ');
        text_put_flash(owed_range);
    }
    text_new_line();
}

static void put_time(const char *before, uint32_t us)
{
    text_put_flash(before);
    text_put_u32(us);
    text_put_flash(FLASH_TEXT(" us"));
}

/* Sends the next piece of what is owed, if it fits: the end of the echoed line, displays, times, error, prompt. */
static NOINLINE bool pay(void)
{
    if (terminal_port_free() < TEXT_PIECE_BYTES) {
        return false;
    }
    if (owes_new_line) {
        owes_new_line = false;
        text_new_line();
    } else if (display_poll()) {
        /* a piece of it */
    } else if (owes_times == 2) {
        owes_times = 1;
        put_time(FLASH_TEXT("received "), received_us);
    } else if (owes_times == 1) {
        owes_times = 0;
        put_time(FLASH_TEXT(", loaded "), loaded_us);
        text_new_line();
    } else if (owed_status != STATUS_OK) {
        put_error();
        owed_status = STATUS_OK;
    } else {
        text_put_flash(prompt);
        behind = false;
    }
    return true;
}

/* The answer to a line. */
static void owe(status_t status)
{
    if (!behind) {
        behind = true;
        owes_new_line = true;
    }
    if (owed_status == STATUS_OK) {
        owed_status = status;
        owed_range = commands_refused_range();
    }
    echoed = 0;
}

/* Brings the screen to what the line is, as far as the port has room. */
static NOINLINE bool echo(void)
{
    bool worked = false;
    uint8_t room = terminal_port_free();
    while (echoed < line.length && room > 0) {
        terminal_port_put((uint8_t)line.text[echoed++]);
        room--;
        worked = true;
    }
    return worked;
}

/* A character was taken back: from the screen too, or the line is shown anew when there is room. */
static NOINLINE void erase(void)
{
    if (echoed <= line.length) {
        return; /* it had not been echoed */
    }
    if (terminal_port_free() < 3) {
        owe(STATUS_OK);
        return;
    }
    text_put_flash(FLASH_TEXT("\b \b"));
    echoed--;
}

/* Debug mode: the line has been received, or executed. */
static NOINLINE void note_received(void)
{
    loaded_us = timebase_us();
    received_us = loaded_us - received_us;
}

static NOINLINE void note_loaded(void)
{
    loaded_us = timebase_us() - loaded_us;
    owes_times = 2;
}

static NOINLINE void end_line(void)
{
    const bool timed = timing && !line_is_blank(&line);
    if (timed) {
        note_received();
    }
    status_t status = line.status;
    if (status == STATUS_OK) {
        status = commands_execute(line.text, line.length); /* the motion first, then the answer */
    } else {
        commands_read_ahead(line.text, 0);
    }
    if (timed && commands_debugging()) {
        note_loaded();
    }
    line_reset(&line);
    owe(status);
}

/* The first character of a line: it may act at once, and the clock of the debug mode starts. */
static NOINLINE bool begin_line(uint8_t byte)
{
    if (commands_at_once((char)byte)) {
        return false;
    }
    timing = commands_debugging() && owes_times == 0;
    if (timing) {
        received_us = timebase_us();
    }
    return true;
}

void terminal_init(status_t reported)
{
    line_reset(&line);
    echoed = 0;
    behind = true;
    owes_new_line = false;
    owes_times = 0;
    timing = false;
    owed_status = reported;
    display_init();
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
        } else if (!line_is_blank(&line) || begin_line((uint8_t)byte)) {
            const line_event_t event = line_take(&line, (uint8_t)byte);
            if (event > LINE_APPENDED) {
                --*bytes;
                return event;
            }
        }
    }
    return LINE_APPENDED;
}

bool terminal_poll(void)
{
    uint8_t bytes = BYTES_AT_ONCE; /* still to be taken in this round */
    bool worked = false;
    for (uint8_t lines = PRESSED_LINES; lines > 0; lines--) {
        const line_event_t event = take(&bytes);
        if (event == LINE_ERASED) {
            erase();
        }
        if (!behind) {
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
    if (behind && terminal_port_waiting() <= PRESSED_BYTES) {
        worked |= pay();
    }
    return worked || bytes != BYTES_AT_ONCE;
}
