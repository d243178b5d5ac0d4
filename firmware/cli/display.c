#include "cli/display.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/zeroed.h"
#include "cli/commands.h"
#include "cli/configure.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "eeprom/store.h"
#include "motion/engine.h"
#include "net/bus.h"
#include "net/bus_port.h"
#include "queue/encoder.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"

static struct shown {
    const char *text;      /* in flash: what is still to come of the present text; 0: nothing is printed */
    uint8_t ruled;         /* how many signs of a rule have been printed */
    uint8_t row;           /* of the queue */
    uint8_t current;       /* display_t */
    uint8_t waiting_count; /* how many wait behind it */
    uint8_t waiting[DISPLAY_WAITING];
    session_t session; /* what `cf` shows: as it was when the display began, and among its options whether GAP testing
                        * and debug mode were on */
} shown;

static inline struct shown *self(void)
{
    struct shown *s = &shown;
    NEAR(s);
    return s;
}

#define SHOWN_GAP (1u << 3)
#define SHOWN_DEBUG (1u << 4)
_Static_assert(((SHOWN_GAP | SHOWN_DEBUG) & (SESSION_SOFT_OPS | SESSION_CRC | SESSION_ACK)) == 0,
               "options that no session has");

/* -- the texts -------------------------------------------------------------------------------------------------------- */

/* Characters of a text that stand for a value: print_field() knows them by the names below, in the same order. The
 * first ones are of a row of the queue, or of a command with the session's defaults. */
#define COUNT "\013"
#define RPM "\014"
#define CYCLE "\015"
#define ACCEL "\016"
#define DECEL "\017"
#define EXTRA "\020"
#define WAIT "\021"
#define ROW "\022"
#define NEXT "\023"
#define EXECUTING "\024"
#define VELOCITY "\025"
#define POSITION "\026"
#define STATE "\027"
#define FAULTS "\030"
#define ENTRY "\031"
#define SETTING_CELL "\032"
#define OPS "\033"
#define COUNTER "\034" /* of the network: one after the other */
enum {
    FIELD_COUNT = 013,
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
    FIELD_ENTRY,
    FIELD_SETTING_CELL,
    FIELD_OPS,
    FIELD_COUNTER,
    FIELDS_END,
};

/* A choice between two texts: the first one if the command has the flag, or from CHOICE_OPTION on the session the option,
 * that is in the lowest bits of the character. */
#define CHOICE(flag, set, clear) flag set "\001" clear "\002"
#define CCW "\xC1"
#define PULSES "\xC2"
#define LINEAR "\xC4"
#define SYNC "\xC8"
#define THROTTLE CCW /* a session has no direction */
#define SOFT_OPS "\xE1"
#define CRC "\xE2"
#define ACK "\xE4"
#define GAP "\xE8"
#define DEBUG "\xF0"
enum { CHOICE_ELSE = 1, CHOICE_END = 2, CHOICE_BEGIN = 0xC0, CHOICE_OPTION = 0xE0, CHOICE_BITS = 0x1F };
_Static_assert(MOTION_CCW == 0x01 && MOTION_PULSES == 0x02 && MOTION_LINEAR == 0x04 && MOTION_SYNC == 0x08 &&
                   SESSION_SOFT_OPS == 0x01 && SESSION_CRC == 0x02 && SESSION_ACK == 0x04 && SHOWN_GAP == 0x08 &&
                   SHOWN_DEBUG == 0x10,
               "the flags stand in the characters");

/* Where a row ends; next_row() says how it goes on. */
#define NEXT_ROW "\003"
enum { TEXT_NEXT_ROW = 3 };

/* A rule of 70 signs of equality. */
#define RULE "=\n"
enum { RULE_CHARACTERS = 70 };

#define DISPLAY_TEXT(name, text) static const char name[] FLASH = text;
#include "cli/display.def"
#undef DISPLAY_TEXT

/* What each display begins with. */
static const char *const texts[] FLASH = {
    [DISPLAY_QUEUE] = queue_head,       [DISPLAY_DEFAULTS] = defaults_text, [DISPLAY_VELOCITY] = velocity_text,
    [DISPLAY_POSITION] = position_text, [DISPLAY_HELP] = commands_help,     [DISPLAY_NETWORK] = network_text,
    [DISPLAY_ARRAY] = array_text,       [DISPLAY_CONFIGURE] = configure_text, [DISPLAY_EEPROM] = cell_text,
};

/* -- printing --------------------------------------------------------------------------------------------------------- */

void display_put_accel(accel_code_t code)
{
    if (code < ACCEL_CODE_WHOLE) {
        text_put_decimal(code, 2);
    } else {
        text_put_u32(code - (ACCEL_CODE_WHOLE - 100u));
    }
}

/* In the order of the text: bus_counters_t, and those of the port. */
static uint16_t counter(uint8_t which)
{
    switch (which) {
    case 4: return bus_port_framing_errors();
    case 5: return bus_port_overruns();
    default: return (&bus_counters.good)[which];
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
    case FIELD_ACCEL: display_put_accel(command->accel); return;
    case FIELD_DECEL: display_put_accel(command->decel); return;
    case FIELD_EXTRA: number = command->extra_pulses; break;
    case FIELD_WAIT: number = command->start_wait_us; break;
    case FIELD_ROW: number = shown.row; break;
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
    case FIELD_COUNTER: number = counter(shown.row++); break;
    case FIELD_OPS: number = settings.ops_mask; break;
    case FIELD_SETTING_CELL: configure_put_cell(); return;
    case FIELD_STATE: text_put_flash(flash_text(state_words, engine_state())); return;
    case FIELD_ENTRY: number = queue_array(shown.row); break;
    default: number = engine_faults(); break;
    }
    text_put_u32(number);
}

static void begin(uint8_t display)
{
    struct shown *const s = self();
    s->current = display;
    if (display > DISPLAY_ROW) {
        s->row = (uint8_t)(display - DISPLAY_ROW);
        s->text = queue_text;
        return;
    }
    s->text = flash_pointer(&texts[display]);
    s->row = 0;
    configure_first_cell(display == DISPLAY_CONFIGURE);
    s->session = session;
    if (engine_gap()) {
        s->session.options |= SHOWN_GAP;
    }
    if (commands_debugging()) {
        s->session.options |= SHOWN_DEBUG;
        if (display == DISPLAY_QUEUE) {
            s->row = UINT8_MAX; /* positions 0 and 31 are shown in debug mode only */
        }
    }
    if (encoder_throttles()) {
        s->session.flags |= MOTION_CCW;
    }
}

/* The display is through: the next one. */
static void next_display(void)
{
    shown.text = 0;
    if (shown.waiting_count > 0) {
        begin(shown.waiting[0]);
        shown.waiting_count--;
        for (uint8_t i = 0; i < DISPLAY_WAITING - 1; i++) {
            shown.waiting[i] = shown.waiting[i + 1];
        }
    }
}

static uint8_t last_row(void)
{
    return shown.session.options & SHOWN_DEBUG ? QUEUE_ONE_SHOT : QUEUE_LAST;
}

/* How it goes on behind a row. */
static const char *next_row(const char *behind_it)
{
    const uint8_t before = shown.row++;
    if (shown.current == DISPLAY_QUEUE) {
        return shown.row <= last_row() ? queue_text : behind_it;
    }
    if (shown.current == DISPLAY_ARRAY && before < QUEUE_ARRAY - 1 && queue_array(before) != 0) {
        return array_text;
    }
    if (shown.current >= DISPLAY_CONFIGURE && shown.current < DISPLAY_ROW && configure_has_cell()) {
        return cell_text;
    }
    return array_text + sizeof array_text - 1; /* nothing */
}

static NOINLINE const char *behind(const char *text, uint8_t mark)
{
    while (flash_u8(text++) != mark) {
    }
    return text;
}

/* Some characters, or a field. */
static void print_piece(void)
{
    motion_command_t defaults; /* or a row of the queue: the command whose values are shown */
    const motion_command_t *command = &defaults;
    session_template(&shown.session, &defaults);
    if (shown.current > DISPLAY_ROW || shown.current == DISPLAY_QUEUE) {
        command = queue_entry(shown.row % QUEUE_POSITIONS); /* (also behind the last row, where no field is of a row) */
    }
    const char *text = shown.text;
    for (uint8_t put = 0; put < TEXT_PIECE_BYTES - TEXT_LONGEST;) {
        const uint8_t character = flash_u8(text);
        if (character == '\0') {
            next_display();
            return;
        }
        if (character >= FIELD_COUNT && character < FIELDS_END) {
            if (put == 0) {
                text++;
                print_field(character, command);
            }
            break;
        }
        if (character == TEXT_NEXT_ROW) {
            text = next_row(text + 1);
            break;
        }
        if (character != '=' || ++shown.ruled == RULE_CHARACTERS) {
            shown.ruled = 0;
            text++;
        }
        if (character == CHOICE_ELSE) {
            text = behind(text, CHOICE_END);
        } else if (character >= CHOICE_BEGIN) {
            uint8_t bits = character >= CHOICE_OPTION ? shown.session.options : command->flags;
            bits = (uint8_t)(bits & character & CHOICE_BITS);
            if (bits == 0) {
                text = behind(text, CHOICE_ELSE);
            }
        } else if (character == '\n') {
            text_new_line();
            break;
        } else if (character != CHOICE_END) {
            put = (uint8_t)(put + text_put(character));
        }
    }
    shown.text = text;
}

/* -- from outside ----------------------------------------------------------------------------------------------------- */

void display_init(void)
{
    AT_BOOT_ZERO(shown);
}

status_t display_request(display_t display)
{
    struct shown *const s = self();
    if (commands_remote()) {
        return STATUS_OK; /* full screens are the terminal's (manual line 181) */
    }
    if (s->text == 0) {
        begin(display);
        return STATUS_OK;
    }
    if (s->waiting_count == DISPLAY_WAITING) {
        return STATUS_BUSY;
    }
    s->waiting[s->waiting_count++] = display;
    return STATUS_OK;
}

bool display_active(void)
{
    return shown.text != 0;
}

bool display_poll(void)
{
    if (shown.text == 0 || terminal_port_free() < TEXT_PIECE_BYTES) {
        return false;
    }
    if (shown.current < DISPLAY_CONFIGURE || !store_busy()) { /* these are read from the EEPROM */
        print_piece();
    }
    return true;
}
