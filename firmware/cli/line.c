#include "cli/line.h"

enum { BACKSPACE = 0x08, LINE_FEED = 0x0A, CARRIAGE_RETURN = 0x0D, ESCAPE = 0x1B, SPACE = 0x20, DELETE = 0x7F };

void line_reset(line_t *line)
{
    line->length = 0;
    line->text[0] = '\0';
    line->status = STATUS_OK;
}

static line_event_t append(line_t *line, char character)
{
    if (line->length == LINE_CHARACTERS) {
        if (line->status == STATUS_OK) {
            line->status = STATUS_LINE_TOO_LONG;
        }
        return LINE_UNCHANGED;
    }
    char *end = &line->text[line->length++];
    end[0] = character;
    end[1] = '\0';
    return LINE_APPENDED;
}

line_event_t line_take(line_t *line, uint8_t byte)
{
    const uint8_t last = line->last;
    line->last = byte;

    if (byte >= SPACE && byte != DELETE) {
        return append(line, (char)byte);
    }
    if (byte == CARRIAGE_RETURN || (byte == LINE_FEED && last != CARRIAGE_RETURN)) {
        return LINE_ENDED;
    }
    if ((byte == BACKSPACE || byte == DELETE) && line->length > 0) {
        line->text[--line->length] = '\0';
        return LINE_ERASED;
    }
    if (byte == ESCAPE && line_begun(line)) {
        line_reset(line);
        return LINE_CLEARED;
    }
    return LINE_UNCHANGED;
}

line_event_t line_damage(line_t *line)
{
    line->last = 0;
    line->status = STATUS_LINE_DAMAGED;
    return LINE_UNCHANGED;
}
