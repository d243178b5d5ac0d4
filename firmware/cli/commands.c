#include "cli/commands.h"
#include "base/flash.h"
#include "base/inline.h"
#include "cli/display.h"
#include "cli/motion_syntax.h"
#include "cli/timebase_port.h"
#include "motion/engine.h"
#include "queue/queue.h"
#include "queue/session.h"

typedef enum { CASE_ANY, CASE_EXACT } case_rule_t;
typedef enum { ARGUMENT_NONE, ARGUMENT_REST } argument_t;

typedef status_t (*handler_t)(const char *rest);

typedef struct {
    char first;
    char second; /* 0: one letter is enough */
    uint8_t case_rule;
    uint8_t argument;
    handler_t handler;
    const char *form;
    const char *help;
} command_row_t;

static bool debugging;
static const char *refused_range; /* for STATUS_RANGE */

/* The motion command, or single value, being read ahead: how many characters of the line it has seen, 0 for none. */
static motion_syntax_t ahead;
static uint8_t characters_ahead;

/* The end of the command: of the line, or a space. */
static bool is_end(char c)
{
    return c == '\0' || c == ' ';
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
    } else {
        refused_range = ahead.range;
    }
    return status;
}

static status_t command_show_velocity(const char *rest)
{
    (void)rest;
    return display_request(DISPLAY_VELOCITY);
}

static status_t command_show_queue(const char *rest)
{
    (void)rest;
    return display_request(DISPLAY_QUEUE);
}

static status_t command_show_defaults(const char *rest)
{
    (void)rest;
    return display_request(DISPLAY_DEFAULTS);
}

static status_t command_show_position(const char *rest)
{
    (void)rest;
    return display_request(DISPLAY_POSITION);
}

static status_t command_help(const char *rest)
{
    (void)rest;
    return display_request(DISPLAY_HELP);
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
    static const char range_flag[] FLASH = "0..1";
    if (is_end(rest[0])) {
        return STATUS_OK; /* neither 0 nor 1: no change (A-SYS-02) */
    }
    if (rest[0] < '0' || rest[0] > '9') {
        return STATUS_SYNTAX;
    }
    if (rest[0] > '1' || !is_end(rest[1])) {
        refused_range = range_flag;
        return STATUS_RANGE;
    }
    session_set_linear(rest[0] == '1');
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
    session_set_pulses(!(session.flags & MOTION_PULSES));
    return STATUS_OK;
}

static status_t command_later(const char *rest)
{
    (void)rest;
    return STATUS_NOT_YET;
}

/* -- the table -------------------------------------------------------------------------------------------------------- */

#define COMMAND(name, first, second, case_rule, argument, handler, form, help) \
    static const char form_##name[] FLASH = form;                              \
    static const char help_##name[] FLASH = help;
#include "cli/commands.def"
#undef COMMAND

static const command_row_t rows[] FLASH = {
#define COMMAND(name, first, second, case_rule, argument, handler, form, help) \
    {first, second, CASE_##case_rule, ARGUMENT_##argument, handler, form_##name, help_##name},
#include "cli/commands.def"
#undef COMMAND
};
enum { ROWS = sizeof rows / sizeof rows[0] };

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c | 0x20) : c;
}

static status_t dispatch(const char *line)
{
    const char first = line[0];
    const char first_lower = lower(first);
    bool letter_known = false;

    for (const command_row_t *row = rows; row < rows + ROWS; row++) {
        const char row_first = (char)flash_u8(&row->first);
        if (row_first != first && row_first != first_lower) {
            continue; /* most rows: nothing more is read of them */
        }
        const bool exact = flash_u8(&row->case_rule) == CASE_EXACT;
        if (exact && row_first != first) {
            continue;
        }
        const char *rest = line + 1;
        const char row_second = (char)flash_u8(&row->second);
        if (row_second != '\0') {
            if (row_second != (exact ? *rest : lower(*rest))) {
                continue;
            }
            rest++;
        }
        letter_known = true;
        if (flash_u8(&row->argument) == ARGUMENT_NONE && !is_end(*rest)) {
            continue;
        }
        handler_t handler;
        FLASH_COPY(&handler, &row->handler, sizeof handler);
        return handler(rest);
    }
    return letter_known ? STATUS_SYNTAX : STATUS_UNKNOWN_COMMAND;
}

void commands_init(void)
{
    session_init();
    debugging = false;
    characters_ahead = 0;
}

/* The commands that are read by the rules of motion_syntax.h. */
static bool is_read_ahead(char first)
{
    const char letter = lower(first);
    return letter == 'm' || letter == 'v' || letter == 'a' || letter == 'd';
}

void commands_read_ahead(const char *line, uint8_t length)
{
    uint8_t i = characters_ahead;
    if (i == 0 || i > length) {
        characters_ahead = 0;
        if (length == 0 || !is_read_ahead(line[0])) {
            return;
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
    if (line[0] >= '0' && line[0] <= '9') {
        return STATUS_NOT_YET; /* a network address: TRM-006 */
    }
    if (is_end(line[0])) {
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
    const bool complete = characters_ahead != 0 && ahead.status == STATUS_OK;
    characters_ahead = 0;
    /* What was read ahead without an error needs no search: time counts. (vd is an error there.) */
    return complete ? command_read_ahead(line) : execute_by_table(line);
}

const char *commands_refused_range(void)
{
    return refused_range;
}

bool commands_at_once(char character)
{
    if (character == '+') {
        command_pulse_cw("");
    } else if (character == '-') {
        command_pulse_ccw("");
    } else {
        return false;
    }
    return true;
}

bool commands_next_help(uint8_t *row, const char **form, const char **help)
{
    for (uint8_t i = (uint8_t)(*row + 1); i < ROWS; i++) {
        const char *text = flash_pointer(&rows[i].help);
        if (flash_u8(text) != '\0') {
            *row = i;
            *form = flash_pointer(&rows[i].form);
            *help = text;
            return true;
        }
    }
    return false;
}

bool commands_debugging(void)
{
    return debugging;
}
