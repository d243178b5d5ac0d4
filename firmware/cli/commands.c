#include "cli/commands.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "cli/display.h"
#include "cli/motion_syntax.h"
#include "cli/timebase_port.h"
#include "motion/engine.h"
#include "queue/queue.h"
#include "queue/session.h"

typedef status_t (*handler_t)(const char *rest);

/* A letter in the table, with what else the row says in its highest bit: no such character is typed (ASCII). */
#define CASE_ANY 0x00u
#define CASE_EXACT 0x80u /* in first */
#define ARGUMENT_NONE 0x00u
#define ARGUMENT_REST 0x80u /* in second */
#define LETTER 0x7Fu

typedef struct {
    uint8_t first;
    uint8_t second; /* letter 0: one is enough */
    const void *action; /* a handler_t, or a display_t: no function stands at so low an address */
} command_row_t;

static bool debugging;

/* The motion command, or single value, being read ahead: how many characters of the line it has seen, 0 for none. */
static motion_syntax_t ahead;
static uint8_t characters_ahead;

/* 0 at the end of the command: of the line, or a space. */
static uint8_t more(char c)
{
    return (uint8_t)(c & ~' ');
}

/* -- handlers: rest is what follows the command's letters, up to the space or the end of the line --------------------- */

/* m, and v, vc, a, d alone: all of the line has been read ahead. */
static status_t command_read_ahead(const char *rest)
{
    (void)rest;
    status_t status = motion_syntax_end(&ahead);
    if (status == STATUS_OK && !ahead.single) {
        status = queue_add(&ahead.command);
        queue_poll(); /* at once: everything else can wait */
    }
    if (status == STATUS_OK) {
        motion_syntax_keep(&ahead, &session);
    }
    return status;
}

static status_t command_pulse_cw(const char *rest)
{
    (void)rest;
    engine_single_pulse(false);
    return STATUS_OK;
}

static status_t command_pulse_ccw(const char *rest)
{
    (void)rest;
    engine_single_pulse(true);
    return STATUS_OK;
}

static status_t command_stop(const char *rest)
{
    (void)rest;
    queue_stop();
    return STATUS_OK;
}

static status_t command_stop_graceful(const char *rest)
{
    (void)rest;
    queue_stop_graceful(session.decel, session.flags & MOTION_LINEAR);
    return STATUS_OK;
}

static status_t command_next(const char *rest)
{
    (void)rest;
    queue_next();
    return STATUS_OK;
}

static status_t command_next_graceful(const char *rest)
{
    (void)rest;
    queue_next_graceful();
    return STATUS_OK;
}

static status_t command_gap(const char *rest)
{
    (void)rest;
    engine_set_gap(!engine_gap());
    return STATUS_OK;
}

static status_t command_debug(const char *rest)
{
    (void)rest;
    debugging = !debugging;
    if (debugging) {
        timebase_start();
    } else {
        timebase_stop();
    }
    return STATUS_OK;
}

static status_t command_ramp(const char *rest)
{
    if (!more(rest[0])) {
        return STATUS_OK; /* neither 0 nor 1: no change (A-SYS-02) */
    }
    if (rest[0] < '0' || rest[0] > '9') {
        return STATUS_SYNTAX;
    }
    if (rest[0] > '1' || more(rest[1])) {
        ahead.range = motion_syntax_range_flag;
        return STATUS_RANGE;
    }
    session_set_linear((uint8_t)(rest[0] - '0'));
    return STATUS_OK;
}

static status_t command_full_steps(const char *rest)
{
    (void)rest;
    session_set_pulses(false);
    return STATUS_OK;
}

static status_t command_pulses(const char *rest)
{
    (void)rest;
    session_set_pulses(true);
    return STATUS_OK;
}

static status_t command_toggle_steps(const char *rest)
{
    (void)rest;
    session.flags ^= MOTION_PULSES;
    return STATUS_OK;
}

static status_t command_later(const char *rest)
{
    (void)rest;
    return STATUS_NOT_YET;
}

/* -- the table -------------------------------------------------------------------------------------------------------- */

static const command_row_t rows[] FLASH = {
#define COMMAND(name, first, second, case_rule, argument, action, help) \
    {(first) | CASE_##case_rule, (second) | ARGUMENT_##argument, (const void *)(action)},
#include "cli/commands.def"
#undef COMMAND
};
enum {
#define COMMAND(name, first, second, case_rule, argument, action, help) ROW_##name,
#include "cli/commands.def"
#undef COMMAND
    ROWS
};

const char commands_help[] FLASH =
#define HELP(form, words) form "\t" words "\r\n"
#define UNLISTED ""
#define COMMAND(name, first, second, case_rule, argument, action, help) help
#include "cli/commands.def"
#undef COMMAND
    ;

/* 0 if this is the letter; in either case unless the row is EXACT. */
static inline uint8_t differs(uint8_t letter, char typed, uint8_t first)
{
    letter ^= (uint8_t)typed;
    if (!(first & CASE_EXACT)) {
        letter &= (uint8_t)~0x20;
    }
    return letter;
}

static status_t dispatch(const char *line)
{
    status_t status = STATUS_UNKNOWN_COMMAND;
    for (const command_row_t *row = rows; row < rows + ROWS; row++) {
        const uint8_t first = flash_u8(&row->first);
        const char *rest = line;
        if (differs(first & LETTER, *rest++, first)) {
            continue;
        }
        const uint8_t second = flash_u8(&row->second);
        const uint8_t letter = second & LETTER;
        if (letter != 0 && differs(letter, *rest++, first)) {
            continue;
        }
        status = STATUS_SYNTAX;
        if (second >= ARGUMENT_REST || !more(*rest)) {
            const void *action = flash_pointer(&row->action);
            if ((uintptr_t)action < DISPLAYS) {
                return display_request((display_t)(uintptr_t)action);
            }
            return ((handler_t)action)(rest);
        }
    }
    return status;
}

void commands_init(void)
{
    session_init();
    AT_BOOT_ZERO(debugging);
    AT_BOOT_ZERO(characters_ahead);
}

void commands_read_ahead(const char *line, uint8_t length)
{
    uint8_t i = characters_ahead;
    if (i == 0 || i > length) {
        characters_ahead = 0;
        const uint8_t letter = (uint8_t)line[0] | 0x20u;
        if (length == 0 || (letter != 'm' && letter != 'v' && letter != 'a' && letter != 'd')) {
            return; /* not read by the rules of motion_syntax.h */
        }
        motion_syntax_begin(&ahead, line[0], &session);
        i = 1;
    }
    for (; i < length; i++) {
        motion_syntax_take(&ahead, line[i]);
    }
    characters_ahead = length;
}

/* By the table. */
static NOINLINE status_t execute_by_table(const char *line)
{
    if ((uint8_t)(line[0] - '0') <= 9) {
        return STATUS_NOT_YET; /* a network address: TRM-006 */
    }
    if (!more(line[0])) {
        return STATUS_OK;
    }
    if (line[0] == '$') {
        queue_stop();
    }
    return dispatch(line);
}

status_t commands_execute(const char *line, uint8_t length)
{
    commands_read_ahead(line, length);
    const uint8_t characters = characters_ahead;
    characters_ahead = 0;
    /* What was read ahead without an error needs no search: time counts. (vd is an error there.) */
    if (characters != 0 && ahead.status == STATUS_OK) {
        return command_read_ahead(line);
    }
    return execute_by_table(line);
}

const char *commands_refused_range(void)
{
    return ahead.range;
}

bool commands_at_once(char character)
{
    if (character != '+' && character != '-') {
        return false;
    }
    engine_single_pulse(character == '-');
    return true;
}

bool commands_debugging(void)
{
    return debugging;
}
