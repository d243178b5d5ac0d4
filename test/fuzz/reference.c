#include "fuzz/reference.h"
#include <ctype.h>
#include <string.h>
#include "cli/terminal_port.h"
#include "settings.h"

/* -- the line editor -------------------------------------------------------------------------------------------------- */

void editor_next(editor_t *editor)
{
    editor->length = 0;
    editor->text[0] = '\0';
    editor->damaged = editor->too_long = false;
}

edit_t editor_take(editor_t *editor, uint8_t byte)
{
    const bool after_return = editor->after_return;
    editor->after_return = byte == '\r';
    const bool blank = editor->length == 0 && !editor->damaged && !editor->too_long;
    if (byte == TERMINAL_PORT_DAMAGED) {
        editor->damaged = true;
    } else if (blank && !editor->in_mode && (byte == '+' || byte == '-')) {
        editor->after_return = after_return; /* such a byte is no part of any line */
        return byte == '+' ? EDIT_PULSE_CW : EDIT_PULSE_CCW;
    } else if (byte == '\r' || (byte == '\n' && !after_return)) {
        return EDIT_ENDED;
    } else if (byte == 0x08 || byte == 0x7F) {
        if (editor->length > 0) {
            editor->text[--editor->length] = '\0';
        }
    } else if (byte == 0x1B && !blank) {
        editor_next(editor);
        return EDIT_CLEARED;
    } else if (byte >= 0x20) {
        if (editor->length == LINE_CHARACTERS) {
            editor->too_long = true;
        } else {
            editor->text[editor->length++] = (char)byte;
            editor->text[editor->length] = '\0';
        }
    }
    return EDIT_NOTHING;
}

/* -- motion commands -------------------------------------------------------------------------------------------------- */

/* One parameter: its letter, and the number behind it. */
typedef struct {
    char letter; /* in lower case; c for vc */
    bool minus, point;
    unsigned digits;   /* before and behind the point */
    double whole;      /* before it: exact far beyond 2^32 */
    unsigned hundreds; /* the first two digits behind it, as hundredths */
    bool not_zero;     /* any digit that is not 0 */
} word_t;

/* The next word; NULL if there is none such. */
static const char *read_word(const char *text, word_t *word)
{
    memset(word, 0, sizeof *word);
    if (!isalpha((unsigned char)*text)) {
        return NULL;
    }
    word->letter = (char)tolower((unsigned char)*text++);
    if (word->letter == 'v' && (*text == 'c' || *text == 'C')) {
        word->letter = 'c';
        text++;
    } else if (word->letter == 'c') {
        return NULL;
    }
    if (*text == '-') {
        word->minus = true;
        text++;
    }
    for (; isdigit((unsigned char)*text); text++, word->digits++) {
        word->whole = word->whole * 10 + (*text - '0');
        word->not_zero |= *text != '0';
    }
    if (*text == '.') {
        word->point = true;
        unsigned unit = 10;
        for (text++; isdigit((unsigned char)*text); text++, word->digits++) {
            word->hundreds += unit * (unsigned)(*text - '0');
            word->not_zero |= *text != '0';
            unit /= 10;
        }
    }
    return text;
}

static bool read_ramp(const word_t *word, accel_code_t system, accel_code_t *code)
{
    if (!word->not_zero) {
        *code = system;
        return true;
    }
    if (word->whole >= 1000) {
        return false;
    }
    const unsigned hundredths = (unsigned)word->whole * 100 + word->hundreds;
    *code = (accel_code_t)(hundredths < 10000 ? hundredths : ACCEL_CODE_WHOLE + (hundredths / 100 - 100));
    return hundredths > 0;
}

static bool set_flag(motion_command_t *command, uint8_t flag, bool on)
{
    command->flags = (uint8_t)(on ? command->flags | flag : command->flags & ~flag);
    return true;
}

/* Whether a word is right; what it sets, but ramp values, which depend on l. */
static bool apply(const word_t *word, motion_command_t *command)
{
    const bool number = word->digits > 0;
    if (word->whole > UINT32_MAX || (word->minus && word->letter != 'm') || (word->point && !number) ||
        (word->point && strchr("vad", word->letter) == NULL)) {
        return false;
    }
    const uint32_t value = (uint32_t)word->whole;
    switch (word->letter) {
    case 'm':
        command->count = value;
        return set_flag(command, MOTION_CCW, word->minus || (!number && settings.direction != 0));
    case 'v':
        command->velocity = number ? value : settings.cycle_us;
        return set_flag(command, MOTION_CYCLE, !number) && command->velocity > 0;
    case 'c': command->velocity = value; return set_flag(command, MOTION_CYCLE, true) && value > 0;
    case 'a':
    case 'd': return true;
    case 'l': return value <= 1 && set_flag(command, MOTION_LINEAR, value == 1 || !number);
    case 's': return value <= 1 && set_flag(command, MOTION_SYNC, value == 1 || !number);
    case 'u': command->extra_pulses = (uint8_t)value; return value <= 255;
    case 't': command->start_wait_us = value; return true;
    case 'f': return !number && set_flag(command, MOTION_PULSES, false);
    case 'p': return !number && set_flag(command, MOTION_PULSES, true);
    default: return false;
    }
}

read_t reference_read(const char *text, const session_t *before, reading_t *reading)
{
    motion_command_t *command = &reading->command;
    memset(reading, 0, sizeof *reading);
    if (*text == '\0' || strchr("mMvVaAdD", *text) == NULL) {
        return READ_OTHER;
    }
    char upto_space[LINE_CHARACTERS + 1];
    const size_t length = strcspn(text, " ");
    memcpy(upto_space, text, length);
    upto_space[length] = '\0';
    if (tolower((unsigned char)upto_space[0]) == 'v' && tolower((unsigned char)upto_space[1]) == 'd') {
        return READ_OTHER; /* a display, or an error */
    }
    command->velocity = before->velocity;
    command->accel = before->accel;
    command->decel = before->decel;
    command->flags = before->flags;
    word_t word, accel = {0}, decel = {0};
    bool ramp = false;
    char last = 0;
    const bool single = tolower((unsigned char)upto_space[0]) != 'm';
    unsigned words = 0;
    for (const char *at = upto_space; *at != '\0'; words++) {
        at = read_word(at, &word);
        if (at == NULL || (words > 0 && (single || word.letter == 'm')) || !apply(&word, command)) {
            return READ_REFUSED;
        }
        last = word.letter;
        ramp |= last == 'l';
        accel_code_t code = 0;
        if ((last == 'a' || last == 'd') && !read_ramp(&word, 1, &code)) {
            return READ_REFUSED;
        }
        if (last == 'a') {
            accel = word;
        } else if (last == 'd') {
            decel = word;
        }
    }
    const unsigned linear = (command->flags & MOTION_LINEAR) != 0;
    accel_code_t code = 0;
    if (ramp || accel.letter != 0) {
        (void)read_ramp(&accel, settings.accel[linear], &code);
        command->accel = code;
    }
    if (ramp || decel.letter != 0) {
        (void)read_ramp(&decel, settings.decel[linear], &code);
        command->decel = code;
    }
    reading->session.velocity = command->velocity;
    reading->session.accel = command->accel;
    reading->session.decel = command->decel;
    reading->session.flags = command->flags & SESSION_FLAGS;
    if (single) {
        command->count = 1;
        return last == 'a' || last == 'd' ? READ_RAMP : READ_VALUE;
    }
    return command->count == 0 ? READ_OPEN : READ_MOTION;
}

/* -- edits ------------------------------------------------------------------------------------------------------------ */

read_t reference_edit(const char *text, const motion_command_t *entry, motion_command_t *edited)
{
    char upto_space[LINE_CHARACTERS + 1];
    const size_t length = strcspn(text, " ");
    memcpy(upto_space, text, length);
    upto_space[length] = '\0';
    *edited = *entry;
    word_t word, accel = {0}, decel = {0};
    bool counted = false, unit = false, nothing = false;
    for (const char *at = upto_space; *at != '\0';) {
        at = read_word(at, &word);
        accel_code_t code = 0;
        if (at == NULL || !apply(&word, edited) || (word.letter == 'm' && !word.not_zero && !unit) ||
            ((word.letter == 'a' || word.letter == 'd') && !read_ramp(&word, 1, &code))) {
            return READ_REFUSED;
        }
        counted |= word.letter == 'm';
        nothing |= word.letter == 'm' && !word.not_zero;
        unit |= word.letter == 'f' || word.letter == 'p';
        if (word.letter == 'a') {
            accel = word;
        } else if (word.letter == 'd') {
            decel = word;
        }
    }
    const unsigned linear = (edited->flags & MOTION_LINEAR) != 0;
    if (accel.letter != 0) {
        accel_code_t code = 0;
        (void)read_ramp(&accel, settings.accel[linear], &code);
        edited->accel = code;
    }
    if (decel.letter != 0) {
        accel_code_t code = 0;
        (void)read_ramp(&decel, settings.decel[linear], &code);
        edited->decel = code;
    }
    if (counted && !unit) {
        set_flag(edited, MOTION_PULSES, false);
    }
    return nothing ? READ_OPEN : READ_MOTION;
}

/* -- the configuration ------------------------------------------------------------------------------------------------ */

bool reference_number(const char **text, double least, double most, uint32_t *number)
{
    double value = 0;
    const char *const first = *text;
    for (; isdigit((unsigned char)**text); ++*text) {
        value = value * 10 + (**text - '0');
    }
    if (*text == first || value < least || value > most) {
        return false;
    }
    *number = (uint32_t)value;
    return true;
}

static bool read_code(const char *text, accel_code_t *code)
{
    const char *const point = strchr(text, '.');
    const size_t whole = point == NULL ? strlen(text) : (size_t)(point - text);
    const size_t behind = point == NULL ? 0 : strlen(point + 1);
    double hundredths = 0;
    if (strspn(text, "0123456789") != whole || behind > 2 || whole + behind + (point != NULL) == 0 ||
        (point != NULL && strspn(point + 1, "0123456789") != behind)) {
        return false;
    }
    for (size_t i = 0; i < whole; i++) {
        hundredths = hundredths * 10 + 100 * (text[i] - '0');
    }
    for (size_t i = 0; i < behind; i++) {
        hundredths += (i == 0 ? 10 : 1) * (point[1 + i] - '0');
    }
    if (hundredths < 1 || hundredths > (point != NULL ? 9999 : 99900)) {
        return false;
    }
    *code = (accel_code_t)(hundredths < 10000 ? hundredths : hundredths / 100 - 100 + ACCEL_CODE_WHOLE);
    return true;
}

bool reference_setting(const char *text, settings_t *stored)
{
    char value[LINE_CHARACTERS + 1];
    const char letter = *text;
    const char *at = text + 1;
    if (letter == '\0' || letter == ' ') {
        return false;
    }
    uint8_t *map = NULL;
    if (letter == 'U') {
        if (*at < '0' || *at > '7') {
            return false;
        }
        map = &stored->driver_map[*at++ - '0'];
    }
    const size_t length = strcspn(at, " ");
    memcpy(value, at, length);
    value[length] = '\0';
    accel_code_t code = 0;
    if (strchr("defg", letter) != NULL) {
        if (!read_code(value, &code)) {
            return false;
        }
        switch (letter) {
        case 'd': stored->accel[0] = code; break;
        case 'e': stored->decel[0] = code; break;
        case 'f': stored->accel[1] = code; break;
        default: stored->decel[1] = code; break;
        }
        return true;
    }
    uint32_t number;
    const char *rest = value;
    if (!reference_number(&rest, 0, UINT32_MAX, &number) || *rest != '\0') {
        return false;
    }
    const uint8_t flag = number != 0, byte = (uint8_t)number;
    switch (letter) {
    case 'A': stored->autorun = number > 30 ? 30 : byte; return true;
    case 'B': stored->ramp = flag; return true;
    case 'C': stored->internal_clock = flag; return true;
    case 'D': stored->auto_microstep = flag; return true;
    case 'E': stored->network = flag; return true;
    case 'F': stored->cw_level = flag; return true;
    case 'G': stored->direction = flag; return true;
    case 'i': stored->soft_ops = flag; return true;
    case 'j': stored->acknowledge = flag; return true;
    case 'u': stored->full_step = flag; return true;
#define WITHIN(least, most, member, is)                \
    if (number - (least) > (most) - (least)) {         \
        return false;                                  \
    }                                                  \
    stored->member = (is);                             \
    return true
    case 'H': WITHIN(0, 255, ihd_counts, byte);
    case 'I': WITHIN(0, 255, xclk_counts, byte);
    case 'J': WITHIN(0, 7, ustep, byte);
    case 'K': WITHIN(1, 255, pulse_us, byte);
    case 'L': WITHIN(1, 255, slow_rpm, byte);
    case 'M': WITHIN(4, 255, device_id, byte);
    case 'N': WITHIN(0, 2, driver_id, byte);
    case 'k': WITHIN(0, 2, crc_mode, byte);
    case 'a': WITHIN(1, 65535, steps_per_rev, (uint16_t)number);
    case 'b': WITHIN(2, UINT32_MAX, cycle_us, number);
    case 'c': WITHIN(400000, 6400000, xclk_hz, number);
    case 'm': WITHIN(300, 2000000, hw_baud, number);
    case 'n': WITHIN(300, 38400, sw_baud, number);
    case 'h':
        if (number != 0 && number != 36) {
            return false;
        }
        stored->ops_mask = byte;
        return true;
    case 'U':
        if (number > 7) {
            return false;
        }
        *map = byte;
        return true;
    default: return false;
    }
}
