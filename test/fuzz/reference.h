/* What a line must come to, told in another way than the firmware does: the line editor byte by byte, the motion commands
 * (m, v, vc, a, d), edits of the queue and parameters of the configuration from the whole line with wide numbers.
 *
 * Source:  decisions 0.3 and A-TRM-02..03; manual lines 464-489, 499-549, 634-638. */
#ifndef FUZZ_REFERENCE_H
#define FUZZ_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>
#include "cli/line.h"
#include "motion/command.h"
#include "queue/session.h"
#include "settings.h"

typedef enum { EDIT_NOTHING, EDIT_PULSE_CW, EDIT_PULSE_CCW, EDIT_CLEARED, EDIT_ENDED } edit_t;

/* What a line is read as. */
typedef enum { MODE_COMMANDS, MODE_QUEUE, MODE_ARRAY, MODE_CONFIGURE } fuzz_mode_t;

typedef struct {
    char text[LINE_CHARACTERS + 1];
    unsigned length;
    bool damaged, too_long, after_return;
    bool in_mode; /* + and - are characters like others */
} editor_t;

/* After EDIT_ENDED the line stands until editor_next(). */
edit_t editor_take(editor_t *editor, uint8_t byte);
void editor_next(editor_t *editor);

typedef enum {
    READ_OTHER,   /* another command, not judged here */
    READ_REFUSED, /* must answer an error */
    READ_OPEN,    /* a motion without a count: continuous; command is complete, the session stays */
    READ_MOTION,  /* command is complete; the engine may still find it too fast */
    READ_VALUE,   /* session is what a single v, vc, a or d leaves; command as above */
    READ_RAMP,    /* the same for a and d: the engine is not asked */
} read_t;

typedef struct {
    motion_command_t command;
    session_t session; /* afterwards, if the line is taken */
} reading_t;

/* The number that *text begins with; *text is then what follows it. False: there is none, or it is out of its range. */
bool reference_number(const char **text, double least, double most, uint32_t *number);

/* <letter><value> of the configuration: *stored with this value. False: to be refused; *stored stays. */
bool reference_setting(const char *text, settings_t *stored);

/* What stands behind the position in an edit: READ_MOTION, and *edited is the entry afterwards; the engine may still find
 * it too fast. READ_OPEN: to be refused for its count, which stands behind f or p. */
read_t reference_edit(const char *text, const motion_command_t *entry, motion_command_t *edited);

read_t reference_read(const char *text, const session_t *before, reading_t *reading);

#endif
