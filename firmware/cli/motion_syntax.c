#include "cli/motion_syntax.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "cli/range.h"
#include "motion/engine.h"
#include "settings.h"

typedef enum {
#define PARAMETER(name, letter, number) PARAMETER_##name,
#include "cli/motion_parameters.def"
#undef PARAMETER
    PARAMETERS
} parameter_t;

_Static_assert(PARAMETER_VELOCITY == MOTION_SYNTAX_VELOCITY, "others know it by this number");

/* motion_syntax_t.number: what the number being read consists of, and what it may */
enum {
    HAS_DIGIT = 1 << 0,
    HAS_POINT = 1 << 1,
    HAS_MINUS = 1 << 2,
    HAS_ANY = HAS_DIGIT | HAS_POINT | HAS_MINUS,
    NOT_ZERO = 1 << 3,  /* a digit other than 0, even beyond the decimals that count */
    NO_MORE = 1 << 4,   /* further decimals do not count */
    NO_NUMBER = 1 << 5, /* none may follow */
    POINT = 1 << 6,     /* a point may follow */
    DECIMALS = 1 << 7,  /* and decimals behind it count */
};

/* What a number begins with. */
enum {
    NUMBER_WHOLE = 0,
    NUMBER_SIGNED = 0,
    NUMBER_FLAG = 0,
    NUMBER_BYTE = 0,
    NUMBER_NONE = NO_NUMBER,
    NUMBER_FLOOR = POINT,
    NUMBER_RAMP = POINT | DECIMALS,
};

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

/* motion_syntax_t.given */
enum {
    GIVEN_RAMP = 1 << 0,  /* l */
    GIVEN_ACCEL = 1 << 1, /* a */
    GIVEN_DECEL = 1 << 2,
    ENDED = 1 << 3, /* a space was met */
    GIVEN_UNIT = 1 << 4, /* f or p */
    EDITS = 1 << 5, /* an entry of the queue: what is not given stays as it is */
};

/* Which of these bits the number being read has. */
static inline uint8_t has(const motion_syntax_t *syntax, uint8_t bits)
{
    return syntax->number & bits;
}

/* Nothing more is read after an error: the first one stands. */
static void refuse(motion_syntax_t *syntax, status_t status)
{
    syntax->status = status;
}

static void refuse_range(motion_syntax_t *syntax, uint8_t range)
{
    syntax->status = range_refuse(range);
}

static NOINLINE void open_parameter(motion_syntax_t *syntax, uint8_t parameter)
{
    syntax->parameter = parameter;
    syntax->value = 0;
    syntax->number = flash_u8(&parameter_number[parameter]);
    syntax->places = MOTION_SYNTAX_NO_POINT;
}

NOINLINE accel_code_t motion_syntax_ramp(const motion_syntax_t *syntax)
{
    NEAR(syntax);
    uint16_t code = (uint16_t)syntax->value;
    if (syntax->value >= ACCEL_CODE_WHOLE) {
        return 0;
    }
    uint8_t places = syntax->places;
    if (places == MOTION_SYNTAX_NO_POINT) {
        if (code >= 100) {
            code = (uint16_t)(code + (ACCEL_CODE_WHOLE - 100));
            return code <= ACCEL_NONE ? code : 0;
        }
        places = 0;
    }
    for (; places < 2; places++) {
        if (code > 999) {
            return 0;
        }
        code = (uint16_t)(code * 10u);
    }
    return code;
}

/* A ramp value: its code, or 0 for the system default, which resolve_ramp() puts in its place. */
static void close_ramp(motion_syntax_t *syntax)
{
    const accel_code_t code = motion_syntax_ramp(syntax);
    if (code == 0 && (syntax->number & NOT_ZERO)) {
        refuse_range(syntax, RANGE_RAMP); /* not 0 itself */
        return;
    }
    if (syntax->parameter == PARAMETER_ACCEL) {
        syntax->command.accel = code;
        syntax->given |= GIVEN_ACCEL;
    } else {
        syntax->command.decel = code;
        syntax->given |= GIVEN_DECEL;
    }
}

/* The number being read is complete. */
static NOINLINE void close_parameter(motion_syntax_t *syntax)
{
    NEAR(syntax);
    motion_command_t *command = &syntax->command;
    const uint8_t number = syntax->number;
    uint32_t value = syntax->value;
    uint8_t flag = 0; /* of the command, that this parameter sets */
    uint8_t on = 0;   /* or clears, if 0 */
    if (has(syntax, HAS_POINT | HAS_DIGIT) == HAS_POINT) {
        refuse(syntax, STATUS_NUMBER_MISSING);
        return;
    }
    switch ((parameter_t)syntax->parameter) {
    case PARAMETER_COUNT:
        command->count = value;
        flag = MOTION_CCW;
        on = has(syntax, HAS_DIGIT | HAS_MINUS) ? number & HAS_MINUS : settings.direction;
        if (syntax->given & EDITS) {
            if (value == 0) {
                refuse(syntax, STATUS_NUMBER_MISSING);
            }
            if (!(syntax->given & GIVEN_UNIT)) {
                command->flags &= (uint8_t)~MOTION_PULSES;
            }
        }
        break;
    case PARAMETER_VELOCITY:
    case PARAMETER_CYCLE:
        on = (uint8_t)(syntax->parameter - PARAMETER_VELOCITY);
        if (!(number & HAS_DIGIT)) {
            if (on) {
                refuse(syntax, STATUS_NUMBER_MISSING);
            }
            value = settings.cycle_us;
            on = 1;
        } else if (value == 0) {
            refuse(syntax, on ? STATUS_PERIOD_TOO_SHORT : STATUS_VELOCITY_ZERO);
        }
        flag = MOTION_CYCLE;
        command->velocity = value;
        break;
    case PARAMETER_ACCEL:
    case PARAMETER_DECEL: close_ramp(syntax); return;
    case PARAMETER_LINEAR:
        flag = MOTION_LINEAR;
        syntax->given |= GIVEN_RAMP;
        break;
    case PARAMETER_EXTRA:
        if (value > UINT8_MAX) {
            refuse_range(syntax, RANGE_BYTE);
            return;
        }
        command->extra_pulses = (uint8_t)value;
        break;
    case PARAMETER_WAIT: command->start_wait_us = value; break;
    case PARAMETER_SYNC: flag = MOTION_SYNC; break;
    case PARAMETER_FULL_STEP:
    case PARAMETER_PULSES:
        flag = MOTION_PULSES;
        on = (uint8_t)(syntax->parameter - PARAMETER_FULL_STEP);
        syntax->given |= GIVEN_UNIT;
        break;
    case PARAMETERS: return; /* not a parameter: the beginning of an edit */
    }
    if (flag & (MOTION_LINEAR | MOTION_SYNC)) { /* 0 or 1, 1 without a number */
        if (value > 1) {
            refuse_range(syntax, RANGE_FLAG);
            return;
        }
        on = (uint8_t)value;
        if (!(number & HAS_DIGIT)) {
            on = 1;
        }
    }
    command->flags |= flag;
    if (!on) {
        command->flags ^= flag;
    }
}

/* A digit that is not simply one more of a whole number. */
static void take_special_digit(motion_syntax_t *syntax, uint8_t digit)
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
    uint8_t number = syntax->number;
    if ((number & (POINT | HAS_POINT)) != POINT) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    number |= HAS_POINT;
    syntax->places = 0;
    if (!(number & DECIMALS) || syntax->value >= 100) {
        number |= NO_MORE;
        syntax->places = MOTION_SYNTAX_NO_POINT;
    }
    syntax->number = number;
}

static void take_minus(motion_syntax_t *syntax)
{
    if (syntax->parameter != PARAMETER_COUNT || has(syntax, HAS_ANY)) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    syntax->number |= HAS_MINUS;
}

static void take_letter(motion_syntax_t *syntax, uint8_t letter)
{
    const uint8_t parameter = letter < 26 ? flash_u8(&parameter_by_letter[letter]) : PARAMETER_COUNT;
    if (parameter == PARAMETER_COUNT && (letter != 'm' - 'a' || !(syntax->given & EDITS))) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    if (parameter == PARAMETER_CYCLE) {
        /* c only says how the number of v is meant. */
        if (syntax->parameter != PARAMETER_VELOCITY || has(syntax, HAS_ANY)) {
            refuse(syntax, STATUS_SYNTAX);
            return;
        }
        syntax->parameter = PARAMETER_CYCLE;
        syntax->number = NUMBER_WHOLE;
        return;
    }
    if (syntax->single) {
        refuse(syntax, STATUS_SYNTAX);
        return;
    }
    close_parameter(syntax);
    open_parameter(syntax, parameter);
}

NOINLINE void motion_syntax_begin(motion_syntax_t *syntax, char first_letter, const session_t *defaults)
{
    NEAR(syntax);
    session_template(defaults, &syntax->command);
    syntax->status = STATUS_OK;
    syntax->given = 0;
    open_parameter(syntax, flash_u8(&parameter_by_letter[(first_letter | 0x20) - 'a']));
    syntax->single = syntax->parameter; /* the count's number is 0 */
}

void motion_syntax_begin_edit(motion_syntax_t *syntax, const motion_command_t *entry)
{
    NEAR(syntax);
    syntax->command = *entry;
    syntax->status = STATUS_OK;
    syntax->given = EDITS;
    syntax->parameter = PARAMETERS;
    syntax->number = NO_NUMBER;
    syntax->single = 0;
}

static void take_other(motion_syntax_t *syntax, uint8_t c)
{
    if (c == '.') {
        take_point(syntax);
    } else if (c == ' ') {
        syntax->given |= ENDED;
    } else if (c == '-') {
        take_minus(syntax);
    } else {
        take_letter(syntax, (uint8_t)((c | 0x20) - 'a'));
    }
}

void motion_syntax_take(motion_syntax_t *syntax, char character)
{
    NEAR(syntax);
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
    if ((uint8_t)(before & (NO_NUMBER | HAS_POINT))) {
        take_special_digit(syntax, digit);
    } else if (!number_add_digit(&syntax->value, digit)) {
        syntax->status = STATUS_NUMBER_TOO_LARGE;
    }
}

/* What could only be decided with the whole command known: which ramp the defaults belong to (A-ACC-02). */
static void resolve_ramp(motion_syntax_t *syntax)
{
    motion_command_t *command = &syntax->command;
    uint8_t given = syntax->given;
    if (given & EDITS) {
        given = 0;
    }
    const uint8_t linear = command->flags & MOTION_LINEAR ? 1 : 0;
    if (command->accel == 0 || (given & (GIVEN_RAMP | GIVEN_ACCEL)) == GIVEN_RAMP) {
        command->accel = settings.accel[linear];
    }
    if (command->decel == 0 || (given & (GIVEN_RAMP | GIVEN_DECEL)) == GIVEN_RAMP) {
        command->decel = settings.decel[linear];
    }
}

status_t motion_syntax_end(motion_syntax_t *syntax)
{
    NEAR(syntax);
    motion_command_t *command = &syntax->command;
    if (syntax->status == STATUS_OK) {
        close_parameter(syntax);
    }
    if (syntax->status != STATUS_OK) {
        return syntax->status;
    }
    resolve_ramp(syntax);
    if (syntax->single) {
        if (syntax->parameter >= PARAMETER_ACCEL) {
            return STATUS_OK; /* a or d */
        }
        *(uint8_t *)&command->count = 1; /* it was 0. The engine checks commands: is this velocity possible at all? */
    }
    return engine_check(command);
}

NOINLINE status_t motion_syntax_number(motion_syntax_t *syntax, const char *text, bool decimals)
{
    NEAR(syntax);
    syntax->value = 0;
    syntax->places = MOTION_SYNTAX_NO_POINT;
    const char *const begin = text;
    for (;; text++) {
        const uint8_t c = (uint8_t)(*text - '0');
        if (c == (uint8_t)('.' - '0') && decimals && syntax->places == MOTION_SYNTAX_NO_POINT) {
            syntax->places = 0;
        } else if (c > 9 || syntax->places == 2) {
            break;
        } else if (!number_add_digit(&syntax->value, c)) {
            return STATUS_NUMBER_TOO_LARGE;
        } else if (syntax->places < 2) {
            syntax->places++;
        }
    }
    syntax->behind = text;
    return text != begin ? STATUS_OK : motion_syntax_more(*text) ? STATUS_SYNTAX : STATUS_NUMBER_MISSING;
}

void motion_syntax_keep(const motion_syntax_t *syntax, session_t *defaults)
{
    NEAR(defaults);
    NEAR(syntax);
    defaults->velocity = syntax->command.velocity;
    defaults->accel = syntax->command.accel;
    defaults->decel = syntax->command.decel;
    defaults->flags = syntax->command.flags & SESSION_FLAGS;
}
