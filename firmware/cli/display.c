#include "cli/display.h"
#include "base/flash.h"
#include "cli/commands.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "motion/engine.h"
#include "queue/queue.h"
#include "queue/session.h"

enum { PIECE_BYTES = 24 }; /* no piece is longer */

static uint8_t waiting[DISPLAY_WAITING]; /* display_t, the first one is next */
static uint8_t waiting_count;
static bool printing;
static uint8_t current; /* display_t */

/* Where the current display stands; each display counts its own way. */
static uint8_t row;
static uint8_t column;

/* A long text in flash on its way out, 0 for none. */
static const char *streamed;

/* What `cf` shows: as it was when the display began. */
static session_t shown_session;
static bool shown_gap;

/* -- the queue: template of annex E, tab stops of 8 ------------------------------------------------------------------- */

static const char queue_header[] FLASH = "Q\tSteps\t\tRPM\tCycle\t Acc\tDec\tusteps\t deltaT\r\n"
                                         "======================================================================\r\n";
static const char queue_footer[] FLASH = "======================================================================\r\n"
                                         "Q is at ";
static const char queue_legend[] FLASH = "\t+ pulse\t\t\t* linear\t\ts sync\r\n";
static const char queue_cw[] FLASH = "CW\t";
static const char queue_ccw[] FLASH = "CCW\t";
static const char queue_executing[] FLASH = "executing ";

/* Values of row. */
enum {
    QUEUE_HEADER,
    QUEUE_ENTRIES, /* and on: position 0, shown in debug mode only, to 30 */
    QUEUE_FOOTER = QUEUE_ENTRIES + QUEUE_LAST + 1,
    QUEUE_LEGEND,
    QUEUE_EXECUTING,
    QUEUE_END,
};

/* One cell; false after the last one of the row. */
static bool queue_cell(uint8_t position)
{
    const motion_command_t *entry = queue_entry(position);
    switch (column++) {
    case 0:
        text_put_u32(position);
        terminal_port_put('\t');
        text_put_u32(entry->count);
        terminal_port_put('\t');
        return true;
    case 1:
        terminal_port_put(entry->flags & MOTION_PULSES ? '+' : ' ');
        text_put_flash(entry->flags & MOTION_CCW ? queue_ccw : queue_cw);
        text_put_u32(command_rpm(entry));
        terminal_port_put('\t');
        return true;
    case 2:
        text_put_u32(command_cycle_us(entry));
        terminal_port_put('\t');
        return true;
    case 3:
        terminal_port_put(entry->flags & MOTION_LINEAR ? '*' : ' ');
        text_put_accel(entry->accel);
        terminal_port_put('\t');
        return true;
    case 4:
        text_put_accel(entry->decel);
        terminal_port_put('\t');
        return true;
    case 5:
        text_put_u32(entry->extra_pulses);
        terminal_port_put('\t');
        terminal_port_put(entry->flags & MOTION_SYNC ? 's' : ' ');
        terminal_port_put(' ');
        return true;
    default:
        text_put_u32(entry->start_wait_us);
        text_new_line();
        return false;
    }
}

static bool queue_piece(void)
{
    if (row >= QUEUE_ENTRIES && row < QUEUE_FOOTER) {
        if (!queue_cell((uint8_t)(row - QUEUE_ENTRIES))) {
            column = 0;
            row++;
        }
        return true;
    }
    switch (row++) {
    case QUEUE_HEADER:
        streamed = queue_header;
        if (!commands_debugging()) {
            row++;
        }
        return true;
    case QUEUE_FOOTER: streamed = queue_footer; return true;
    case QUEUE_LEGEND:
        text_put_u32(queue_next_position());
        streamed = queue_legend;
        return true;
    case QUEUE_EXECUTING:
        if (commands_debugging()) {
            text_put_flash(queue_executing);
            text_put_u32(queue_executing_position());
            text_new_line();
        }
        return false;
    default: return false;
    }
}

/* -- the session defaults and flags ----------------------------------------------------------------------------------- */

static const char defaults_velocity[] FLASH = "v ";
static const char defaults_cycle[] FLASH = " cycle ";
static const char defaults_accel[] FLASH = "\r\na ";
static const char defaults_decel[] FLASH = " d ";
static const char defaults_harmonic[] FLASH = " harmonic\r\nGAP ";
static const char defaults_linear[] FLASH = " linear\r\nGAP ";
static const char defaults_full_step[] FLASH = ", full step, ";
static const char defaults_pulses[] FLASH = ", pulses, ";
static const char text_on[] FLASH = "on";
static const char text_off[] FLASH = "off";
/* What these stand for is not built yet; they read as they will at its factory values. */
static const char defaults_fixed[] FLASH = "EnF\r\nops 36, soft_ops off, CRC 1, ACK on\r\n";

static bool defaults_piece(void)
{
    motion_command_t command;
    session_template(&shown_session, &command);
    switch (row++) {
    case 0:
        text_put_flash(defaults_velocity);
        text_put_u32(command_rpm(&command));
        return true;
    case 1:
        text_put_flash(defaults_cycle);
        text_put_u32(command_cycle_us(&command));
        return true;
    case 2:
        text_put_flash(defaults_accel);
        text_put_accel(command.accel);
        text_put_flash(defaults_decel);
        text_put_accel(command.decel);
        return true;
    case 3:
        text_put_flash(command.flags & MOTION_LINEAR ? defaults_linear : defaults_harmonic);
        text_put_flash(shown_gap ? text_on : text_off);
        return true;
    case 4:
        text_put_flash(command.flags & MOTION_PULSES ? defaults_pulses : defaults_full_step);
        streamed = defaults_fixed;
        return true;
    default: return false;
    }
}

/* -- velocity and position -------------------------------------------------------------------------------------------- */

static bool velocity_piece(void)
{
    uint32_t rpm, cycle_us;
    engine_velocity(&rpm, &cycle_us);
    text_put_u32(rpm);
    terminal_port_put(' ');
    text_put_u32(cycle_us);
    text_new_line();
    return false;
}

static const char position_text[] FLASH = "position ";
static const char faults_text[] FLASH = " faults ";

/* Indexed by motion_state_t. */
static const char state_words[][8] FLASH = {"STANDBY", "ACCEL", "CRUISE", "DECEL", "STOP"};

static bool position_piece(void)
{
    switch (row++) {
    case 0:
        text_put_flash(position_text);
        text_put_i32(engine_position());
        terminal_port_put(' ');
        return true;
    default:
        text_put_flash(state_words[engine_state()]);
        text_put_flash(faults_text);
        text_put_u32(engine_faults());
        text_new_line();
        return false;
    }
}

/* -- the list of commands --------------------------------------------------------------------------------------------- */

static bool help_piece(void)
{
    const char *form, *help;
    if (column == 0) {
        uint8_t next = row;
        if (!commands_next_help(&next, &form, &help)) {
            return false;
        }
        text_put_flash(form);
        terminal_port_put('\t');
        column = 1;
        return true;
    }
    if (column == 1) {
        commands_next_help(&row, &form, &help);
        streamed = help;
        column = 2;
        return true;
    }
    text_new_line();
    column = 0;
    return true;
}

/* -- all of them ------------------------------------------------------------------------------------------------------ */

static void begin(uint8_t display)
{
    current = display;
    printing = true;
    row = display == DISPLAY_HELP ? COMMANDS_BEFORE_FIRST : 0;
    column = 0;
    shown_session = session;
    shown_gap = engine_gap();
}

void display_init(void)
{
    waiting_count = 0;
    printing = false;
    streamed = 0;
}

status_t display_request(display_t display)
{
    if (!display_active()) {
        begin(display);
        return STATUS_OK;
    }
    if (waiting_count == DISPLAY_WAITING) {
        return STATUS_BUSY;
    }
    waiting[waiting_count++] = display;
    return STATUS_OK;
}

bool display_active(void)
{
    return printing || streamed != 0;
}

/* The next piece of the current display; false if it was the last. */
static bool print_piece(void)
{
    switch ((display_t)current) {
    case DISPLAY_QUEUE: return queue_piece();
    case DISPLAY_DEFAULTS: return defaults_piece();
    case DISPLAY_VELOCITY: return velocity_piece();
    case DISPLAY_POSITION: return position_piece();
    case DISPLAY_HELP: return help_piece();
    }
    return false;
}

/* A piece of the streamed text. */
static void print_streamed(void)
{
    for (uint8_t i = 0; i < PIECE_BYTES; i++) {
        const uint8_t character = flash_u8(streamed);
        if (character == '\0') {
            streamed = 0;
            return;
        }
        terminal_port_put(character);
        streamed++;
    }
}

static void next_waiting(void)
{
    begin(waiting[0]);
    waiting_count--;
    for (uint8_t i = 0; i < waiting_count; i++) {
        waiting[i] = waiting[i + 1];
    }
}

bool display_poll(void)
{
    if (!display_active() || terminal_port_free() < PIECE_BYTES) {
        return false;
    }
    if (streamed != 0) {
        print_streamed();
    } else {
        printing = print_piece();
    }
    if (!display_active() && waiting_count > 0) {
        next_waiting();
    }
    return true;
}
