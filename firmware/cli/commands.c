#include "cli/commands.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "boot.h"
#include "cli/configure.h"
#include "cli/display.h"
#include "cli/motion_syntax.h"
#include "cli/network.h"
#include "cli/range.h"
#include "cli/terminal_port.h"
#include "cli/trial.h"
#include "eeprom/store.h"
#include "motion/engine.h"
#include "net/bus.h"
#include "queue/encoder.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"

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
static bool remote;  /* the line came from the network */
static bool restart; /* $R did */

/* What a line is read as. */
enum { /* in the order of the prompts */
    MODE_COMMANDS,
    MODE_QUEUE,
    MODE_ARRAY,
    MODE_CONFIGURE
};
static uint8_t mode;
static uint8_t other_mode; /* of the network's lines; while one is executed, the terminal's */

/* The motion command, or single value, being read ahead: how many characters of the line it has seen, 0 for none. */
static motion_syntax_t ahead;
static uint8_t characters_ahead;

/* -- handlers: rest is what follows the command's letters, up to the space or the end of the line --------------------- */

/* The number that the text begins with, to ahead.value: no motion command is being read meanwhile. */
static NOINLINE status_t read_number(const char *text, uint8_t range)
{
    const status_t status = motion_syntax_number(&ahead, text, false);
    return status == STATUS_OK ? range_check(&ahead, range) : status;
}

/* The same, and nothing follows it. */
static NOINLINE status_t read_only_number(const char *rest, uint8_t range)
{
    const status_t status = read_number(rest, range);
    return status == STATUS_OK && motion_syntax_more(*ahead.behind) ? STATUS_SYNTAX : status;
}

/* Where a number may be missing. */
static status_t optional(status_t status)
{
    return status == STATUS_NUMBER_MISSING ? STATUS_OK : status;
}

/* What has been read; 0 if there was no number. */
static inline uint8_t number_8(void)
{
    return (uint8_t)ahead.value;
}

static inline uint16_t number_16(void)
{
    return (uint16_t)ahead.value;
}

/* What has been read: a command for the queue, or the one-shot; or v, vc, a, d alone. */
static NOINLINE status_t execute_read(bool one_shot)
{
    motion_syntax_t *read = &ahead;
    status_t status = motion_syntax_end(&ahead);
    if (status != STATUS_OK) {
        return status;
    }
    if (!read->single) {
        const uint8_t endless = read->command.count == 0;
        if (endless || one_shot) { /* it keeps what it names for itself (line 588) */
            return queue_preempt_with(endless ? QUEUE_CONTINUOUS : QUEUE_ONE_SHOT, &ahead.command);
        }
        status = queue_add(&ahead.command); /* it begins at once: everything else can wait */
    }
    if (status == STATUS_OK) {
        motion_syntax_keep(&ahead, &session);
        if (read->single == MOTION_SYNTAX_VELOCITY) {
            queue_follow(&ahead.command);
        }
    }
    return status;
}

/* m, and v, vc, a, d alone: all of the line has been read ahead. */
static status_t command_read_ahead(const char *rest)
{
    (void)rest;
    return execute_read(false);
}

static NOINLINE void read_rest(const char *rest)
{
    while (*rest != '\0') {
        motion_syntax_take(&ahead, *rest++);
    }
}

/* xm...: a motion command that is not kept. */
static status_t command_one_shot(const char *rest)
{
    motion_syntax_begin(&ahead, 'm', &session);
    read_rest(rest);
    return execute_read(true);
}

/* x leaves a program mode; x<position> executes an entry. */
static status_t command_xref(const char *rest)
{
    const status_t status = read_only_number(rest, RANGE_POSITION);
    return status == STATUS_OK ? queue_preempt(number_8()) : optional(status);
}

static status_t command_run_array(const char *rest)
{
    (void)rest;
    return queue_array_run(0);
}

/* Unless the display is refused. */
static status_t enter(uint8_t new_mode, display_t display)
{
    const status_t status = display_request(display);
    if (status == STATUS_OK) {
        mode = new_mode;
    }
    return status;
}

static status_t command_program_array(const char *rest)
{
    (void)rest;
    return enter(MODE_ARRAY, DISPLAY_ARRAY);
}

/* In that mode: <entry>,<position>. */
static NOINLINE status_t program_array(const char *line)
{
    status_t status = read_number(line, RANGE_ENTRY);
    const uint8_t entry = number_8();
    if (status == STATUS_OK && *ahead.behind != ',') {
        status = STATUS_SYNTAX;
    }
    if (status == STATUS_OK) {
        status = read_only_number(ahead.behind + 1, RANGE_ENTRY);
    }
    if (status == STATUS_OK) {
        status = queue_array_set(entry, number_8());
    }
    if (status == STATUS_OK) {
        (void)display_request(DISPLAY_ARRAY); /* it is set, even if there is no room for one more display */
    }
    return status;
}

/* l ends, l<passes> runs the array. */
static status_t command_loop(const char *rest)
{
    const status_t status = read_only_number(rest, RANGE_COUNT);
    if (status == STATUS_OK) {
        return queue_array_run(number_16());
    }
    if (status == STATUS_NUMBER_MISSING) {
        queue_loop_end();
    }
    return optional(status);
}

/* ls and lf */
static status_t command_loop_bound(const char *rest)
{
    const queue_bound_t bound = (rest[-1] | 0x20) == 's' ? QUEUE_LOOP_START : QUEUE_LOOP_FINISH;
    const status_t status = read_only_number(rest, RANGE_POSITION);
    return status == STATUS_OK ? queue_loop_bound(bound, number_8()) : status;
}

static status_t command_loop_passes(const char *rest)
{
    const status_t status = optional(read_only_number(rest, RANGE_COUNT));
    if (status == STATUS_OK) {
        queue_loop_passes(number_16());
    }
    return status;
}

static status_t command_loop_all(const char *rest)
{
    (void)rest;
    return queue_loop_from_first(QUEUE_LAST);
}

static status_t command_program_queue(const char *rest)
{
    (void)rest;
    mode = MODE_QUEUE;
    return STATUS_OK;
}

static status_t command_clear_queue(const char *rest)
{
    (void)rest;
    if (store_busy()) {
        return STATUS_BUSY; /* it may be the queue that is being saved */
    }
    queue_clear();
    return STATUS_OK;
}

/* q<position>...: an entry is edited, or with nothing more shown. */
static status_t command_edit(const char *rest)
{
    status_t status = read_number(rest, RANGE_POSITION);
    const uint8_t position = number_8();
    if (status != STATUS_OK) {
        return status;
    }
    if (!motion_syntax_more(*ahead.behind)) {
        return display_request((display_t)(DISPLAY_ROW + position));
    }
    motion_syntax_begin_edit(&ahead, queue_entry(position));
    read_rest(ahead.behind);
    status = motion_syntax_end(&ahead);
    if (status == STATUS_OK) {
        queue_edit(position, &ahead.command);
    }
    return status;
}

static status_t command_configure(const char *rest)
{
    if (motion_syntax_more(*rest)) {
        return configure_set(&ahead, rest);
    }
    return enter(MODE_CONFIGURE, DISPLAY_CONFIGURE);
}

static status_t command_save(const char *rest)
{
    (void)rest;
    queue_save();
    return STATUS_OK;
}

static status_t command_clear_counters(const char *rest)
{
    (void)rest;
    bus_clear();
    return STATUS_OK;
}

static status_t command_restore(const char *rest)
{
    (void)rest;
    bool saved;
    return queue_restore(&saved);
}

static status_t command_undo(const char *rest)
{
    (void)rest;
    return queue_undo();
}

static status_t command_release(const char *rest)
{
    (void)rest;
    engine_release();
    return STATUS_OK;
}

static status_t command_pulse(const char *rest)
{
    engine_single_pulse(rest[-1] == '-');
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
    return STATUS_OK;
}

static status_t command_ramp(const char *rest)
{
    const status_t status = read_only_number(rest, RANGE_FLAG);
    if (status == STATUS_OK) {
        session_set_linear(number_8());
    }
    return optional(status); /* neither 0 nor 1: no change (A-SYS-02) */
}

/* $O, $H, $K: soft ops 0 or 1; CRC and acknowledgements off with 0, and on with anything else. */
static status_t command_option(const char *rest)
{
    const char letter = rest[-1];
    uint8_t option = SESSION_SOFT_OPS;
    uint8_t range = RANGE_FLAG;
    if (letter != 'O') {
        option = letter == 'H' ? SESSION_CRC : SESSION_ACK;
        range = RANGE_COUNT;
    }
    status_t status = read_only_number(rest, range);
    uint8_t on = number_16() != 0;
    if (status == STATUS_NUMBER_MISSING && letter != 'O') {
        status = STATUS_OK;
        on = 1;
    }
    if (status == STATUS_OK) {
        session_set_option(option, on);
    }
    return optional(status);
}

/* $F, $P, $U */
static status_t command_steps(const char *rest)
{
    session.flags ^= MOTION_PULSES;
    if (rest[-1] != 'U') {
        session_set_pulses(rest[-1] == 'P');
    }
    return STATUS_OK;
}

static status_t command_encoder(const char *rest)
{
    (void)rest;
    encoder_toggle();
    return STATUS_OK;
}

void commands_restart(void)
{
    restart = false;
    trial_begin(store_load_settings());
    boot_restart();
}

/* $R: the settings as they are stored, when all that is being written and sent is out. */
static status_t command_reset(const char *rest)
{
    (void)rest;
    if (store_busy() || !terminal_port_idle()) {
        return STATUS_WAIT;
    }
    restart = true;
    if (!remote) {
        commands_restart();
    }
    return STATUS_OK;
}

/* -- the table -------------------------------------------------------------------------------------------------------- */

static const command_row_t rows[] FLASH = {
#define COMMAND(name, first, second, case_rule, argument, action, help) \
    {(first) | CASE_##case_rule, (second) | ARGUMENT_##argument, (const void *)(action)},
#include "cli/commands.def"
#undef COMMAND
};

const char commands_help[] FLASH =
#define HELP(form, words) form "\t" words "\n"
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
    for (const command_row_t *row = rows; row < rows + sizeof rows / sizeof rows[0]; row++) {
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
        if (second >= ARGUMENT_REST || !motion_syntax_more(*rest)) {
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
    debugging = false; /* (a warm boot comes here too) */
    mode = MODE_COMMANDS;
    other_mode = MODE_COMMANDS;
    AT_BOOT_ZERO(characters_ahead);
}

void commands_read_ahead(const char *line, uint8_t length)
{
    uint8_t i = characters_ahead;
    if (i == 0 || i > length) {
        characters_ahead = 0;
        const uint8_t letter = (uint8_t)line[0] | 0x20u;
        if (length == 0 || mode != MODE_COMMANDS || (letter != 'm' && letter != 'v' && letter != 'a' && letter != 'd')) {
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
static status_t execute_by_table(const char *line)
{
    if (!motion_syntax_more(line[0])) {
        return STATUS_OK;
    }
    if (mode != MODE_COMMANDS) {
        const bool alone = !motion_syntax_more(line[1]);
        const char letter = line[0] | 0x20;
        if (alone && letter == 'x') {
            mode = MODE_COMMANDS;
            return STATUS_OK;
        }
        if (mode == MODE_CONFIGURE && (!alone || line[0] != 'S')) {
            return configure_line(&ahead, line);
        }
        if (!alone || (letter != 's' && letter != 'q' && letter != '?')) { /* nothing that would move the motor */
            return mode == MODE_QUEUE ? command_edit(line) : program_array(line);
        }
    }
    if (line[0] == '$') {
        queue_stop();
    }
    return dispatch(line);
}

/* Which node a line is for, and where its text begins. */
static status_t read_address(const char *line, uint8_t *node)
{
    ahead.behind = line + 1;
    *node = network_last_origin();
    if ((uint8_t)(line[0] - '0') <= 9) {
        const status_t status = read_number(line, RANGE_BYTE);
        *node = number_8();
        if (status != STATUS_OK) {
            return status;
        }
    } else if (*node == 0) {
        return STATUS_NOBODY;
    }
    return *ahead.behind == '\0' ? STATUS_SYNTAX : STATUS_OK;
}

NOINLINE status_t commands_execute(const char *line, uint8_t length)
{
    /* A digit, / or \ in front: a line for another node. (Between / and the digits there is nothing.) */
    if (mode == MODE_COMMANDS && ((uint8_t)(line[0] - '/') <= 10 || line[0] == '\\')) {
        uint8_t node;
        const status_t status = remote ? STATUS_SYNTAX : read_address(line, &node);
        if (status != STATUS_OK) {
            return status;
        }
        if (node != settings.device_id) {
            return network_send(node, ahead.behind);
        }
        length = (uint8_t)(length - (ahead.behind - line));
        line = ahead.behind;
    }
    commands_read_ahead(line, length);
    const uint8_t characters = characters_ahead;
    characters_ahead = 0;
    /* What was read ahead without an error needs no search: time counts. (vd is an error there.) */
    if (characters != 0 && ahead.status == STATUS_OK) {
        return execute_read(false);
    }
    return execute_by_table(line);
}

bool commands_at_once(char character)
{
    if (mode != MODE_COMMANDS || (character != '+' && character != '-')) {
        return false;
    }
    engine_single_pulse(character == '-');
    return true;
}

const char *commands_prompt(void)
{
    return flash_text(FLASH_TEXT("SAC>\0Q>\0X>\0SAC>"), mode);
}

static void exchange_modes(void)
{
    const uint8_t its_mode = mode;
    mode = other_mode;
    other_mode = its_mode;
    remote = !remote;
}

status_t commands_execute_remote(const char *line)
{
    uint8_t length = 0;
    while (line[length] != '\0') {
        length++;
    }
    exchange_modes();
    characters_ahead = 0; /* what is being typed will be read again */
    const status_t status = commands_execute(line, length);
    exchange_modes();
    return status;
}

bool commands_remote(void)
{
    return remote;
}

bool commands_restart_due(void)
{
    return restart;
}

bool commands_debugging(void)
{
    return debugging;
}
