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
    } else if (blank && (byte == '+' || byte == '-')) {
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
    case 'm': command->count = value; return set_flag(command, MOTION_CCW, word->minus);
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
        accel_code_t code;
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
    if (ramp || accel.letter != 0) {
        (void)read_ramp(&accel, settings.accel[linear], &command->accel);
    }
    if (ramp || decel.letter != 0) {
        (void)read_ramp(&decel, settings.decel[linear], &command->decel);
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
