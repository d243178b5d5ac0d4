#include "cli/commands.h"
#include "base/flash.h"
#include "base/inline.h"
#include "cli/display.h"
#include "cli/motion_syntax.h"
#include "cli/timebase_port.h"
#include "motion/engine.h"
#include "queue/ops.h"
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
    handler_t handler;
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
        /* it begins at once: everything else can wait */
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

/* 0 or 1; neither: no change (A-SYS-02). */
static status_t take_flag(const char *rest, void (*set)(bool on))
{
    static const char range_flag[] FLASH = "0..1";
    if (is_end(rest[0])) {
        return STATUS_OK;
    }
    if (rest[0] < '0' || rest[0] > '9') {
        return STATUS_SYNTAX;
    }
    if (rest[0] > '1' || !is_end(rest[1])) {
        refused_range = range_flag;
        return STATUS_RANGE;
    }
    set(rest[0] == '1');
    return STATUS_OK;
}

static status_t command_ramp(const char *rest)
{
    return take_flag(rest, session_set_linear);
}

static status_t command_soft_ops(const char *rest)
{
    return take_flag(rest, ops_set_soft);
}

static status_t command_release(const char *rest)
{
    (void)rest;
    engine_release();
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
#define COMMAND(name, first, second, case_rule, argument, handler, help) \
    {(first) | CASE_##case_rule, (second) | ARGUMENT_##argument, handler},
#include "cli/commands.def"
#undef COMMAND
};
enum {
#define COMMAND(name, first, second, case_rule, argument, handler, help) ROW_##name,
#include "cli/commands.def"
#undef COMMAND
    ROWS
};

const char commands_help[] FLASH =
#define HELP(form, words) form "\t" words "\r\n"
#define UNLISTED ""
#define COMMAND(name, first, second, case_rule, argument, handler, help) help
#include "cli/commands.def"
#undef COMMAND
    ;

static uint8_t lower(uint8_t c)
{
    return c >= 'A' && c <= 'Z' ? c | 0x20u : c;
}

static status_t dispatch(const char *line)
{
    const uint8_t exact = (uint8_t)line[0] | CASE_EXACT;
    const uint8_t any = lower((uint8_t)line[0]);
    status_t status = STATUS_UNKNOWN_COMMAND;
    if ((uint8_t)line[0] > LETTER) {
        return status;
    }
    const command_row_t *row = rows;
    const command_row_t *end = rows + ROW_RAMP;
    if (any == '$') {
        row = end;
        end = rows + ROWS;
    }
    for (; row < end; row++) {
        const uint8_t first = flash_u8(&row->first);
        if (first != any && first != exact) {
            continue; /* most rows: nothing more is read of them */
        }
        const char *rest = line + 1;
        const uint8_t second = flash_u8(&row->second);
        if ((second & LETTER) != 0) {
            const uint8_t typed = (uint8_t)*rest++;
            if ((second & LETTER) != (first == any ? lower(typed) : typed)) {
                continue;
            }
        }
        status = STATUS_SYNTAX;
        if (second >= ARGUMENT_REST || is_end(*rest)) {
            handler_t handler;
            FLASH_COPY(&handler, &row->handler, sizeof handler);
            return handler(rest);
        }
    }
    return status;
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
    const uint8_t letter = lower((uint8_t)first);
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
    const bool pulse = character == '+' || character == '-';
    if (pulse) {
        engine_single_pulse(character == '-');
    }
    return pulse;
}

bool commands_debugging(void)
{
    return debugging;
}
