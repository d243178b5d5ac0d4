#include "cli/terminal.h"
#include "base/flash.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/line.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "cli/timebase_port.h"
#include "queue/queue.h"
#include "version.h"

/* The longest answer: CR LF, an error with its range, CR LF, the prompt. */
enum { ANSWER_BYTES = 36 };

static const char version_line[] FLASH = "SAC " VERSION_NUMBER " " VERSION_DATE "\r\n";
static const char prompt[] FLASH = "SAC>";

static line_t line;
static uint8_t echoed; /* how many characters of the line stand on the screen */

/* What is owed while answers are held back. */
static bool behind;             /* a prompt is owed; no echo until it is printed */
static bool owes_new_line;      /* the cursor stands behind the last line that was echoed */
static status_t owed_status;    /* the first error since, or STATUS_OK */
static const char *owed_range;  /* of that error */

/* Debug mode: how long the last line took. */
static bool owes_times;
static uint32_t line_begin_us;
static uint32_t received_us;
static uint32_t loaded_us;

static const char received_text[] FLASH = "received ";
static const char loaded_text[] FLASH = " us, loaded ";
static const char times_end[] FLASH = " us\r\n";
enum { TIMES_BYTES = 9 + 10 + 12 + 10 + 5 };

static void put_error(status_t status, const char *range)
{
    text_put("?");
    text_put_u32(status);
    text_put(" ");
    text_put_flash(status_words(status));
    if (status == STATUS_RANGE) {
        text_put(" ");
        text_put_flash(range);
    }
    text_new_line();
}

static void put_times(void)
{
    text_put_flash(received_text);
    text_put_u32(received_us);
    text_put_flash(loaded_text);
    text_put_u32(loaded_us);
    text_put_flash(times_end);
}

/* Sends the next part of what is owed, if it fits: the end of the echoed line, displays, times, error and prompt. */
static bool pay(void)
{
    if (!behind) {
        return false;
    }
    const uint8_t room = terminal_port_free();
    if (owes_new_line) {
        if (room < 2) {
            return false;
        }
        text_new_line();
        owes_new_line = false;
        return true;
    }
    if (display_active()) {
        return display_poll();
    }
    if (owes_times) {
        if (room < TIMES_BYTES) {
            return false;
        }
        put_times();
        owes_times = false;
        return true;
    }
    if (room < ANSWER_BYTES) {
        return false;
    }
    if (owed_status != STATUS_OK) {
        put_error(owed_status, owed_range);
        owed_status = STATUS_OK;
    }
    text_put_flash(prompt);
    behind = false;
    return true;
}

/* Brings the screen to what the line is: one character a call. */
static bool echo(void)
{
    if (behind || echoed == line.length) {
        return false;
    }
    if (echoed < line.length) {
        if (terminal_port_free() == 0) {
            return false;
        }
        terminal_port_put((uint8_t)line.text[echoed++]);
        return true;
    }
    if (terminal_port_free() < 3) {
        return false;
    }
    text_put("\b \b");
    echoed--;
    return true;
}

/* The answer to a line. */
static void owe(status_t status, const char *range)
{
    if (!behind) {
        behind = true;
        owes_new_line = true;
    }
    if (owed_status == STATUS_OK) {
        owed_status = status;
        owed_range = range;
    }
    echoed = 0;
}

static void end_line(void)
{
    const bool timed = commands_debugging();
    if (timed) {
        loaded_us = timebase_us();
        received_us = loaded_us - line_begin_us;
    }
    const char *range = 0;
    status_t status = line.status;
    if (status == STATUS_OK) {
        status = commands_execute(line.text, line.length, &range);
        queue_poll(); /* the motion first, then the answer */
    }
    if (timed && commands_debugging() && !line_is_blank(&line)) {
        loaded_us = timebase_us() - loaded_us;
        owes_times = true;
    }
    line_reset(&line);
    commands_read_ahead(line.text, 0);
    owe(status, range);
}

static void take(uint8_t byte)
{
    const bool blank = line_is_blank(&line);
    if (byte == TERMINAL_PORT_DAMAGED) {
        line_damage(&line);
        return;
    }
    if (blank && commands_at_once((char)byte)) {
        return;
    }
    switch (line_take(&line, byte)) {
    case LINE_UNCHANGED: break;
    case LINE_EDITED:
        if (blank && commands_debugging()) {
            line_begin_us = timebase_us();
        }
        commands_read_ahead(line.text, line.length);
        break;
    case LINE_CLEARED:
        commands_read_ahead(line.text, 0);
        owe(STATUS_OK, 0);
        break;
    case LINE_ENDED: end_line(); break;
    }
}

void terminal_init(void)
{
    line_reset(&line);
    echoed = 0;
    behind = false;
    owes_new_line = false;
    owes_times = false;
    owed_status = STATUS_OK;
    display_init();
    text_put_flash(version_line);
    text_put_flash(prompt);
}

bool terminal_poll(void)
{
    uint8_t byte;
    bool worked = terminal_port_get(&byte);
    if (worked) {
        take(byte);
    }
    worked |= pay();
    worked |= echo();
    return worked;
}
