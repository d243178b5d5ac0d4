#include "cli/display.h"
#include "base/flash.h"
#include "cli/commands.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "motion/engine.h"
#include "queue/ops.h"
#include "queue/queue.h"
#include "queue/session.h"

static uint8_t waiting[DISPLAY_WAITING]; /* display_t, the first one is next */
static uint8_t waiting_count;
static uint8_t current; /* display_t */

static const char *text; /* in flash: what is still to come of the present text; 0: nothing is printed */
static uint8_t ruled;    /* how many signs of a rule have been printed */
static uint8_t row;      /* of the queue; then what follows its rows */

/* What `cf` shows: as it was when the display began, and whether GAP testing and soft ops were on. */
static session_t shown_session;
#define SHOWN_GAP (1u << 5)
#define SHOWN_SOFT MOTION_SYNC
_Static_assert(((SHOWN_GAP | SHOWN_SOFT) & SESSION_FLAGS) == 0, "flags of their own");

/* -- the texts -------------------------------------------------------------------------------------------------------- */

/* Characters of a text that stand for a value: print_field() knows them by the names below, in the same order. The
 * first ones are of a row of the queue, or of a command with the session's defaults. */
#define COUNT "\x80"
#define RPM "\x81"
#define CYCLE "\x82"
#define ACCEL "\x83"
#define DECEL "\x84"
#define EXTRA "\x85"
#define WAIT "\x86"
#define ROW "\x87"
#define NEXT "\x88"
#define EXECUTING "\x89"
#define VELOCITY "\x8A"
#define POSITION "\x8B"
#define STATE "\x8C"
#define FAULTS "\x8D"
enum {
    FIELD_COUNT = 0x80,
    FIELD_RPM,
    FIELD_CYCLE,
    FIELD_ACCEL,
    FIELD_DECEL,
    FIELD_EXTRA,
    FIELD_WAIT,
    FIELD_ROW,
    FIELD_NEXT,
    FIELD_EXECUTING,
    FIELD_VELOCITY,
    FIELD_POSITION,
    FIELD_STATE,
    FIELD_FAULTS,
};

/* A choice between two texts: the first one if the command has the flag that is in these bits of the character. */
#define CHOICE(flag, set, clear) flag set "\xA0" clear "\xA1"
#define CCW "\xC1"
#define PULSES "\xC2"
#define LINEAR "\xC4"
#define SYNC "\xC8"
#define GAP "\xE0"
enum { CHOICE_ELSE = 0xA0, CHOICE_END = 0xA1, CHOICE_BEGIN = 0xC0 };
_Static_assert(MOTION_CCW == 0x01 && MOTION_PULSES == 0x02 && MOTION_LINEAR == 0x04 && MOTION_SYNC == 0x08 &&
                   SHOWN_GAP == 0x20,
               "the flags stand in the characters");

/* A rule of 70 signs of equality. */
#define RULE "=\r\n"
enum { RULE_CHARACTERS = 70 };

/* The queue: template of annex E, tab stops of 8. */
static const char queue_text[] FLASH = "Q\tSteps\t\tRPM\tCycle\t Acc\tDec\tusteps\t deltaT\r\n" RULE;
/* clang-format off */
static const char queue_row_text[] FLASH =
    ROW "\t" COUNT "\t" CHOICE(PULSES, "+", " ") CHOICE(CCW, "CCW", "CW") "\t" RPM "\t" CYCLE
    "\t" CHOICE(LINEAR, "*", " ") ACCEL "\t" DECEL "\t" EXTRA "\t" CHOICE(SYNC, "s", " ") " " WAIT "\r\n";
/* clang-format on */
static const char queue_end_text[] FLASH = RULE "Q is at " NEXT "\t+ pulse\t\t\t* linear\t\ts sync\r\n";
static const char queue_executing_text[] FLASH = "executing " EXECUTING "\r\n";

/* What EnF and the last line stand for is not built yet; they read as they will at its factory values. */
/* clang-format off */
static const char defaults_text[] FLASH =
    "v " RPM " cycle " CYCLE "\r\n"
    "a " ACCEL " d " DECEL " " CHOICE(LINEAR, "linear", "harmonic") "\r\n"
    "GAP " CHOICE(GAP, "on", "off") ", " CHOICE(PULSES, "pulses", "full step") ", EnF\r\n"
    "ops 36, soft_ops " CHOICE(SYNC, "on", "off") ", CRC 1, ACK on\r\n";
/* clang-format on */

static const char velocity_text[] FLASH = VELOCITY "\r\n";
static const char position_text[] FLASH = "position " POSITION " " STATE " faults " FAULTS "\r\n";

/* What each display begins with. */
static const char *const texts[] FLASH = {
    [DISPLAY_QUEUE] = queue_text,       [DISPLAY_DEFAULTS] = defaults_text, [DISPLAY_VELOCITY] = velocity_text,
    [DISPLAY_POSITION] = position_text, [DISPLAY_HELP] = commands_help,
};

/* Indexed by motion_state_t. */
static const char state_words[][8] FLASH = {"STANDBY", "ACCEL", "CRUISE", "DECEL", "STOP"};

/* -- printing --------------------------------------------------------------------------------------------------------- */

/* The command whose values are shown. */
static void shown_command(motion_command_t *command)
{
    if (current == DISPLAY_QUEUE && row < QUEUE_POSITIONS) {
        *command = *queue_entry(row);
    } else {
        session_template(&shown_session, command);
    }
}

static void put_accel(accel_code_t code)
{
    if (code < ACCEL_CODE_WHOLE) {
        text_put_decimal(code, 2);
    } else {
        text_put_u32(code - (ACCEL_CODE_WHOLE - 100u));
    }
}

/* At most 21 characters. */
static void print_field(uint8_t field, const motion_command_t *command)
{
    uint32_t number, second;
    switch (field) {
    case FIELD_COUNT: number = command->count; break;
    case FIELD_RPM: number = command_rpm(command); break;
    case FIELD_CYCLE: number = command_cycle_us(command); break;
    case FIELD_ACCEL: put_accel(command->accel); return;
    case FIELD_DECEL: put_accel(command->decel); return;
    case FIELD_EXTRA: number = command->extra_pulses; break;
    case FIELD_WAIT: number = command->start_wait_us; break;
    case FIELD_ROW: number = row; break;
    case FIELD_NEXT: number = queue_next_position(); break;
    case FIELD_EXECUTING: number = queue_executing_position(); break;
    case FIELD_VELOCITY:
        engine_velocity(&number, &second); /* both of the same moment */
        text_put_u32(number);
        terminal_port_put(' ');
        number = second;
        break;
    case FIELD_POSITION:
        number = (uint32_t)engine_position();
        if (number & 0x80000000u) {
            terminal_port_put('-');
            number = 0u - number;
        }
        break;
    case FIELD_STATE: text_put_flash(state_words[engine_state()]); return;
    default: number = engine_faults(); break;
    }
    text_put_u32(number);
}

static void begin(uint8_t display)
{
    current = display;
    text = flash_pointer(&texts[display]);
    row = commands_debugging() ? UINT8_MAX : 0; /* position 0 is shown in debug mode only */
    shown_session = session;
    if (engine_gap()) {
        shown_session.flags |= SHOWN_GAP;
    }
    if (ops_soft()) {
        shown_session.flags |= SHOWN_SOFT;
    }
}

/* The text is through: what follows it. */
static void next_text(void)
{
    text = 0;
    if (current == DISPLAY_QUEUE) {
        row++;
        if (row <= QUEUE_LAST) {
            text = queue_row_text;
        } else if (row == QUEUE_LAST + 1) {
            text = queue_end_text;
        } else if (row == QUEUE_LAST + 2 && commands_debugging()) {
            text = queue_executing_text;
        }
    }
    if (text == 0 && waiting_count > 0) {
        begin(waiting[0]);
        waiting_count--;
        for (uint8_t i = 0; i < waiting_count; i++) {
            waiting[i] = waiting[i + 1];
        }
    }
}

static void skip_behind(uint8_t mark)
{
    while (flash_u8(text++) != mark) {
    }
}

/* Some characters, or a field. */
static void print_piece(void)
{
    motion_command_t command;
    shown_command(&command);
    for (uint8_t room = TEXT_PIECE_BYTES; room > 0; room--) {
        const uint8_t character = flash_u8(text);
        if (character == '\0') {
            next_text();
            return;
        }
        if (character >= FIELD_COUNT && character < CHOICE_ELSE) {
            if (room == TEXT_PIECE_BYTES) {
                text++;
                print_field(character, &command);
            }
            return;
        }
        if (character != '=' || ++ruled == RULE_CHARACTERS) {
            ruled = 0;
            text++;
        }
        if (character == CHOICE_ELSE) {
            skip_behind(CHOICE_END);
        } else if (character >= CHOICE_BEGIN) {
            if (!(command.flags & character & ~CHOICE_BEGIN)) {
                skip_behind(CHOICE_ELSE);
            }
        } else if (character != CHOICE_END) {
            terminal_port_put(character);
        }
    }
}

/* -- from outside ----------------------------------------------------------------------------------------------------- */

void display_init(void)
{
    waiting_count = 0;
    ruled = 0;
    text = 0;
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
    return text != 0;
}

bool display_poll(void)
{
    if (!display_active() || terminal_port_free() < TEXT_PIECE_BYTES) {
        return false;
    }
    print_piece();
    return true;
}
