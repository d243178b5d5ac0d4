#include "cli/motion_syntax.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "motion/engine.h"
#include "settings.h"

typedef enum { NUMBER_NONE, NUMBER_WHOLE, NUMBER_FLOOR, NUMBER_RAMP, NUMBER_SIGNED } number_kind_t;

typedef enum {
#define PARAMETER(name, letter, number) PARAMETER_##name,
#include "cli/motion_parameters.def"
#undef PARAMETER
    PARAMETERS
} parameter_t;

static const uint8_t parameter_number[PARAMETERS] FLASH = {
#define PARAMETER(name, letter, number) NUMBER_##number,
#include "cli/motion_parameters.def"
#undef PARAMETER
};

/* By letter, a..z: one look-up a letter, whatever its place in the table. 0 (the count's m) is not a parameter. */
static const uint8_t parameter_by_letter[26] FLASH = {
#define PARAMETER(name, letter, number) [(letter) - 'a'] = PARAMETER_##name,
#include "cli/motion_parameters.def"
#undef PARAMETER
};

/* motion_syntax_t.number */
enum {
    HAS_DIGIT = 1 << 0,
    HAS_POINT = 1 << 1,
    HAS_MINUS = 1 << 2,
    NOT_ZERO = 1 << 3,  /* a digit other than 0, even beyond the decimals that count */
    NO_MORE = 1 << 4,   /* further decimals do not count */
    NO_NUMBER = 1 << 5, /* none may follow */
};

/* motion_syntax_t.given */
enum {
    GIVEN_RAMP = 1 << 0,  /* l */
    GIVEN_ACCEL = 1 << 1, /* a with a value */
    GIVEN_DECEL = 1 << 2,
    DEFAULT_ACCEL = 1 << 3, /* a without one: the system default of the ramp that the command ends up with */
    DEFAULT_DECEL = 1 << 4,
    ENDED = 1 << 5, /* a space was met */
};

static const char range_flag[] FLASH = "0..1";
static const char range_byte[] FLASH = "0..255";
static const char range_ramp[] FLASH = "0.01..999";

static void refuse(motion_syntax_t *syntax, status_t status)
{
    if (syntax->status == STATUS_OK) {
        syntax->status = status;
    }
}

static void refuse_range(motion_syntax_t *syntax, const char *range)
{
    if (syntax->status == STATUS_OK) {
        syntax->status = STATUS_RANGE;
        syntax->range = range;
    }
}

static void open_parameter(motion_syntax_t *syntax, uint8_t parameter)
{
    syntax->parameter = parameter;
    syntax->value = 0;
    syntax->number = flash_u8(&parameter_number[parameter]) == NUMBER_NONE ? NO_NUMBER : 0;
    syntax->places = 0;
}

static void set_flag(motion_command_t *command, uint8_t flag, bool on)
{
    command->flags = on ? command->flags | flag : command->flags & (uint8_t)~flag;
}

/* A flag parameter: 0 or 1, 1 without a number. */
static void close_flag(motion_syntax_t *syntax, uint8_t flag)
{
    if (syntax->value > 1) {
        refuse_range(syntax, range_flag);
        return;
    }
    set_flag(&syntax->command, flag, syntax->value != 0 || !(syntax->number & HAS_DIGIT));
}

/* A ramp value: its code, or 0 for the system default. */
static accel_code_t close_ramp(motion_syntax_t *syntax)
{
    uint32_t value = syntax->value;
    if (syntax->places == 0 && value >= 100) {
        if (value > 999) {
            refuse_range(syntax, range_ramp);
            return 0;
        }
        return (accel_code_t)(value - 100 + ACCEL_CODE_WHOLE);
    }
    uint16_t hundredths = (uint16_t)value; /* below 10,000 here */
    for (uint8_t places = syntax->places; places < 2; places++) {
        hundredths = (uint16_t)(hundredths * 10u);
    }
    if (hundredths == 0 && (syntax->number & NOT_ZERO)) {
        refuse_range(syntax, range_ramp); /* not 0 itself, but below 0.01 */
    }
    return hundredths;
}

/* The last of two equal parameters wins. */
static void note_given(motion_syntax_t *syntax, uint8_t bit, uint8_t instead_of)
{
    syntax->given = (uint8_t)((syntax->given & ~instead_of) | bit);
}

static void close_accel(motion_syntax_t *syntax)
{
    const accel_code_t code = close_ramp(syntax);
    syntax->command.accel = code;
    note_given(syntax, code != 0 ? GIVEN_ACCEL : DEFAULT_ACCEL, GIVEN_ACCEL | DEFAULT_ACCEL);
}

static void close_decel(motion_syntax_t *syntax)
{
    const accel_code_t code = close_ramp(syntax);
    syntax->command.decel = code;
    note_given(syntax, code != 0 ? GIVEN_DECEL : DEFAULT_DECEL, GIVEN_DECEL | DEFAULT_DECEL);
}

static void close_count(motion_syntax_t *syntax)
{
    motion_command_t *command = &syntax->command;
    const bool minus = syntax->number & HAS_MINUS;
    const bool bare = !(syntax->number & (HAS_DIGIT | HAS_MINUS));
    command->count = syntax->value;
    set_flag(command, MOTION_CCW, bare ? settings.direction != 0 : minus);
}

static void close_velocity(motion_syntax_t *syntax)
{
    if (!(syntax->number & HAS_DIGIT)) {
        syntax->command.velocity = settings.cycle_us;
        set_flag(&syntax->command, MOTION_CYCLE, true);
        return;
    }
    if (syntax->value == 0) {
        refuse(syntax, STATUS_VELOCITY_ZERO);
    }
    syntax->command.velocity = syntax->value;
    set_flag(&syntax->command, MOTION_CYCLE, false);
}

static void close_cycle(motion_syntax_t *syntax)
{
    if (!(syntax->number & HAS_DIGIT)) {
        refuse(syntax, STATUS_NUMBER_MISSING);
    } else if (syntax->value == 0) {
        refuse(syntax, STATUS_PERIOD_TOO_SHORT);
    }
    syntax->command.velocity = syntax->value;
    set_flag(&syntax->command, MOTION_CYCLE, true);
}

static void close_extra(motion_syntax_t *syntax)
{
    if (syntax->value > UINT8_MAX) {
        refuse_range(syntax, range_byte);
        return;
    }
    syntax->command.extra_pulses = (uint8_t)syntax->value;
}

/* The number being read is complete. */
static void close_parameter(motion_syntax_t *syntax)
{
    if ((syntax->number & HAS_POINT) && !(syntax->number & HAS_DIGIT)) {
        refuse(syntax, STATUS_NUMBER_MISSING);
        return;
    }
    switch ((parameter_t)syntax->parameter) {
    case PARAMETER_COUNT: close_count(syntax); break;
    case PARAMETER_VELOCITY: close_velocity(syntax); break;
    case PARAMETER_CYCLE: close_cycle(syntax); break;
    case PARAMETER_ACCEL: close_accel(syntax); break;
    case PARAMETER_DECEL: close_decel(syntax); break;
    case PARAMETER_LINEAR:
        close_flag(syntax, MOTION_LINEAR);
        syntax->given |= GIVEN_RAMP;
        break;
    case PARAMETER_EXTRA: close_extra(syntax); break;
    case PARAMETER_WAIT: syntax->command.start_wait_us = syntax->value; break;
    case PARAMETER_SYNC: close_flag(syntax, MOTION_SYNC); break;
    case PARAMETER_FULL_STEP: set_flag(&syntax->command, MOTION_PULSES, false); break;
    case PARAMETER_PULSES: set_flag(&syntax->command, MOTION_PULSES, true); break;
    case PARAMETERS: break; /* not a parameter: the number of them */
    }
}

/* A digit that is not simply one more of a whole number. */
static NOINLINE void take_special_digit(motion_syntax_t *syntax, uint8_t digit)
{
    if (syntax->number & NO_NUMBER) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    if (syntax->number & NO_MORE) {
        return;
    }
    number_add_digit(&syntax->value, digit); /* at most 99.99 */
    syntax->places++;
    if (syntax->places == 2) {
        syntax->number |= NO_MORE;
    }
}

static void take_point(motion_syntax_t *syntax)
{
    const number_kind_t kind = (number_kind_t)flash_u8(&parameter_number[syntax->parameter]);
    if ((kind != NUMBER_FLOOR && kind != NUMBER_RAMP) || (syntax->number & HAS_POINT)) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    syntax->number |= HAS_POINT;
    if (kind == NUMBER_FLOOR || syntax->value >= 100) {
        syntax->number |= NO_MORE;
    }
}

static void take_minus(motion_syntax_t *syntax)
{
    if (syntax->parameter != PARAMETER_COUNT || syntax->number != 0) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    syntax->number |= HAS_MINUS;
}

static void take_letter(motion_syntax_t *syntax, uint8_t letter)
{
    const uint8_t parameter = letter < 26 ? flash_u8(&parameter_by_letter[letter]) : PARAMETER_COUNT;
    if (parameter == PARAMETER_COUNT) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    if (parameter == PARAMETER_CYCLE) {
        /* c only says how the number of v is meant. */
        if (syntax->parameter != PARAMETER_VELOCITY || syntax->number != 0) {
            refuse(syntax, STATUS_SYNTAX);
            return;
        }
        syntax->parameter = PARAMETER_CYCLE;
        return;
    }
    if (syntax->single) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    close_parameter(syntax);
    open_parameter(syntax, parameter);
}

void motion_syntax_begin(motion_syntax_t *syntax, char first_letter, const session_t *defaults)
{
    session_template(defaults, &syntax->command);
    syntax->status = STATUS_OK;
    syntax->range = 0;
    syntax->given = 0;
    open_parameter(syntax, flash_u8(&parameter_by_letter[(first_letter | 0x20) - 'a']));
    syntax->single = syntax->parameter != PARAMETER_COUNT;
}

static NOINLINE void take_other(motion_syntax_t *syntax, uint8_t c)
{
    if (c == '.') {
        take_point(syntax);
    } else if (c == '-') {
        take_minus(syntax);
    } else if (c == ' ') {
        syntax->given |= ENDED;
    } else {
        take_letter(syntax, (uint8_t)((c | 0x20) - 'a'));
    }
}

void motion_syntax_take(motion_syntax_t *syntax, char character)
{
    if (syntax->status != STATUS_OK || (syntax->given & ENDED)) {
        return;
    }
    const uint8_t digit = (uint8_t)(character - '0');
    if (digit >= 10) {
        take_other(syntax, (uint8_t)character);
        return;
    }
    const uint8_t before = syntax->number;
    syntax->number = (uint8_t)(before | (digit != 0 ? HAS_DIGIT | NOT_ZERO : HAS_DIGIT));
    if (before & (NO_NUMBER | HAS_POINT)) {
        take_special_digit(syntax, digit);
    } else if (!number_add_digit(&syntax->value, digit)) {
        syntax->status = STATUS_NUMBER_TOO_LARGE;
    }
}

/* What could only be decided with the whole command known: which ramp the defaults belong to (A-ACC-02). */
static void resolve_ramp(motion_syntax_t *syntax)
{
    motion_command_t *command = &syntax->command;
    const bool linear = command->flags & MOTION_LINEAR;
    const bool ramp_given = syntax->given & GIVEN_RAMP;
    if ((syntax->given & DEFAULT_ACCEL) || (ramp_given && !(syntax->given & GIVEN_ACCEL))) {
        command->accel = session_default_accel(linear);
    }
    if ((syntax->given & DEFAULT_DECEL) || (ramp_given && !(syntax->given & GIVEN_DECEL))) {
        command->decel = session_default_decel(linear);
    }
}

status_t motion_syntax_end(motion_syntax_t *syntax)
{
    motion_command_t *command = &syntax->command;
    if (syntax->status == STATUS_OK) {
        close_parameter(syntax);
    }
    if (syntax->status != STATUS_OK) {
        return syntax->status;
    }
    resolve_ramp(syntax);
    if (syntax->single) {
        command->count = 1; /* the engine checks commands: is this velocity possible at all? */
    } else if (command->count == 0) {
        return STATUS_NOT_YET; /* continuous motion */
    }
    const bool ramp_alone =
        syntax->single && (syntax->parameter == PARAMETER_ACCEL || syntax->parameter == PARAMETER_DECEL);
    return ramp_alone ? STATUS_OK : engine_check(command);
}

void motion_syntax_keep(const motion_syntax_t *syntax, session_t *defaults)
{
    defaults->velocity = syntax->command.velocity;
    defaults->accel = syntax->command.accel;
    defaults->decel = syntax->command.decel;
    defaults->flags = syntax->command.flags & SESSION_FLAGS;
}
