#include "cli/configure.h"
#include <stddef.h>
#include "base/flash.h"
#include "base/inline.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/range.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "eeprom/eeprom_port.h"
#include "eeprom/store.h"
#include "settings.h"

/* -- the table -------------------------------------------------------------------------------------------------------- */

/* Bytes, one row behind the other. A pointer to a row is to its letter; these follow. */
enum { ROW_PLACE = 1, ROW_KIND, ROW_NAME };

/* A place: offset in settings_t, and how many bytes follow it in the highest bits. */
enum { PLACE_OFFSET = 0x3F, PLACE_MORE_BIT = 6 };
_Static_assert(sizeof(settings_t) <= PLACE_OFFSET + 1, "offsets fit in");

static const struct {
#define SETTING(letter, type, member, kind, factory, name) \
    struct {                                               \
        char its_letter;                                   \
        uint8_t place, its_kind;                           \
        char its_name[sizeof name];                        \
    } type##_##member;
#include "settings.def"
#undef SETTING
    char end;
} rows FLASH = {
#define SETTING(letter, type, member, kind, factory, name) \
    {letter, offsetof(settings_t, SETTING_PLACE_##type(member)) | (SETTING_BYTES_##type - 1) << PLACE_MORE_BIT, \
     RANGE_##kind, name},
#include "settings.def"
#undef SETTING
    '\0',
};

/* The letter's row, in flash; 0: there is none. */
static NOINLINE const char *find(uint8_t letter)
{
    const char *row = (const char *)&rows;
    for (;;) {
        const uint8_t its_letter = flash_u8(row);
        if (its_letter == letter) {
            return row;
        }
        if (its_letter == '\0') {
            return 0;
        }
        row = flash_text(row + ROW_NAME, 1);
    }
}

/* -- values that are typed -------------------------------------------------------------------------------------------- */

NOINLINE status_t configure_set(motion_syntax_t *number, const char *text)
{
    const char *row = find((uint8_t)*text++);
    if (row == 0) {
        return STATUS_UNKNOWN_COMMAND;
    }
    const uint8_t kind = flash_u8(row + ROW_KIND);
    uint8_t place = flash_u8(row + ROW_PLACE);
    if (kind == RANGE_MAP) {
        const uint8_t entry = (uint8_t)(*text++ - '0');
        if (entry > 7) {
            return range_refuse(RANGE_MAP);
        }
        place = (uint8_t)(place + entry);
    }
    status_t status = motion_syntax_number(number, text, kind == RANGE_RAMP);
    if (status != STATUS_OK) {
        return status;
    }
    if (motion_syntax_more(*number->behind)) {
        return STATUS_SYNTAX;
    }
    if (kind == RANGE_RAMP) {
        const accel_code_t code = motion_syntax_ramp(number);
        if (code == 0) {
            return range_refuse(kind);
        }
        number->value = code;
    } else {
        status = range_check(number, kind);
        if (status != STATUS_OK && kind > RANGE_AUTORUN) {
            return status;
        }
    }
    return store_change(place & PLACE_OFFSET, place >> PLACE_MORE_BIT, number->value);
}

status_t configure_line(motion_syntax_t *number, const char *line)
{
    const status_t status = configure_set(number, line);
    if (status == STATUS_OK) {
        (void)display_request(DISPLAY_CONFIGURE); /* it is stored, even if there is no room for one more display */
    }
    return status;
}

/* -- screen and list -------------------------------------------------------------------------------------------------- */

/* Of the screen, or of the list: by letter, then the bytes of the EEPROM. */
enum { SCREEN_END = 28, LIST_BEGIN = 'A', LIST_END = 0x80, BYTES_END = LIST_END + EEPROM_BYTES };
static uint16_t cell; /* the next one */

void configure_first_cell(bool screen)
{
    cell = screen ? 0 : LIST_BEGIN;
}

NOINLINE bool configure_has_cell(void)
{
    const uint16_t next = cell;
    if (next == LIST_END) {
        return commands_debugging();
    }
    return next != SCREEN_END && next != BYTES_END;
}

/* The lowest byte of the value, which decides what is shown of it; the whole value to `value`. */
static uint8_t read_value(uint8_t place, uint32_t *value)
{
    uint8_t more = place >> PLACE_MORE_BIT;
    for (;;) {
        const uint8_t byte = store_setting((uint8_t)((place & PLACE_OFFSET) + more));
        *value = *value << 8 | byte;
        if (more-- == 0) {
            return byte;
        }
    }
}

static void put_value(uint8_t kind, uint8_t offset, uint32_t value)
{
    const uint8_t lowest = (uint8_t)value;
    if (kind == RANGE_DIRECTION) {
        const char *text = FLASH_TEXT("CCW");
        if (lowest == 0) {
            text++;
        }
        text_put_flash(text);
    } else if (kind == RANGE_MAP) {
        for (uint8_t left = 8; left > 0; left--) {
            terminal_port_put((uint8_t)('0' + store_setting(offset++)));
        }
    } else if (kind == RANGE_RAMP) {
        display_put_accel((accel_code_t)value);
    } else {
        if (kind == RANGE_OPS && lowest != 0) {
            value = 100100; /* in binary; there is no other */
        }
        text_put_u32(value);
    }
}

/* A byte of the EEPROM, sixteen a line. */
static void put_byte(uint16_t address)
{
    text_put_hex(eeprom_port_read(address));
    if ((uint8_t)(address + 1) % 16 == 0) {
        text_new_line();
    } else {
        terminal_port_put(' ');
    }
}

/* The name and the tabs behind it: values stand in column 16, or 40. Returns the length of the name. */
static uint8_t put_name(const char *name)
{
    if (flash_u8(name) != '\0') {
        terminal_port_put(' ');
    }
    const uint8_t length = text_put_flash(name);
    terminal_port_put('\t');
    if (length < 6) {
        terminal_port_put('\t');
    }
    return length;
}

/* A letter without a parameter has an empty cell. */
NOINLINE void configure_put_cell(void)
{
    const uint16_t at = cell++;
    if (at >= LIST_END) {
        put_byte(at - LIST_END);
        return;
    }
    const bool screen = at < SCREEN_END;
    uint8_t letter = (uint8_t)at;
    uint8_t ends = 0; /* the line */
    if (screen) {
        ends = letter & 1;
        letter = (uint8_t)((letter >> 1) + 'A');
        if (ends) {
            letter |= 0x20;
        }
    }
    const char *row = find(letter);
    if (row != 0) {
        if (ends) {
            terminal_port_put('\t');
        }
        terminal_port_put(letter);
        uint8_t shown = 1;
        if (screen) {
            shown = put_name(row + ROW_NAME);
        } else {
            terminal_port_put(' ');
            ends = 1;
        }
        const uint8_t place = flash_u8(row + ROW_PLACE);
        uint32_t value = 0;
        shown |= read_value(place, &value); /* what has no name is shown if it is not 0 */
        if (shown) {
            put_value(flash_u8(row + ROW_KIND), place & PLACE_OFFSET, value);
        }
    }
    if (ends) {
        text_new_line();
    }
}
