#include "cli/configure.h"
#include <stddef.h>
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "eeprom/eeprom_port.h"
#include "eeprom/store.h"
#include "queue/queue.h"
#include "settings.h"

/* -- the table -------------------------------------------------------------------------------------------------------- */

enum {
#define SETTING_KIND(kind, range) KIND_##kind,
#include "settings.def"
#undef SETTING_KIND
};

/* One after the other, each with its NUL. */
static const char ranges[] FLASH =
#define SETTING_KIND(kind, range) range "\0"
#include "settings.def"
#undef SETTING_KIND
    ;

/* Bytes, one row behind the other. A pointer to a row is to its letter; these follow. */
enum { ROW_PLACE = 1, ROW_KIND, ROW_NAME };

/* A place: offset in settings_t, and the bytes of a value less one in the highest bits. */
enum { PLACE_OFFSET = 0x3F, PLACE_BYTES_BIT = 6 };
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
    {letter, offsetof(settings_t, SETTING_PLACE_##type(member)) | (SETTING_BYTES_##type - 1) << PLACE_BYTES_BIT, \
     KIND_##kind, name},
#include "settings.def"
#undef SETTING
    '\0',
};

/* Behind the NUL. */
static const char *next_text(const char *text)
{
    while (flash_u8(text++) != '\0') {
    }
    return text;
}

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
        row = next_text(row + ROW_NAME);
    }
}

/* -- values that are typed -------------------------------------------------------------------------------------------- */

static bool configuring;

static bool is_end(char c)
{
    return c == '\0' || c == ' ';
}

/* <letter><value> */
static NOINLINE status_t set(const char *text)
{
    enum { NO_POINT = 0x80 };
    const char *row = find((uint8_t)*text);
    if (row == 0) {
        return STATUS_UNKNOWN_COMMAND;
    }
    const uint8_t kind = flash_u8(row + ROW_KIND);
    uint8_t place = flash_u8(row + ROW_PLACE);
    const char *range = ranges;
    for (uint8_t i = kind; i > 0; i--) {
        range = next_text(range);
    }
    commands_refuse_range(range); /* told with STATUS_RANGE only */
    if (kind == KIND_MAP) {
        const uint8_t entry = (uint8_t)(*++text - '0');
        if (entry > 7) {
            return STATUS_RANGE;
        }
        place = (uint8_t)(place + entry);
    }

    /* The number: of a ramp value, the places behind its point are counted. */
    uint32_t value = 0;
    uint8_t places = NO_POINT;
    uint8_t c;
    while (!is_end((char)(c = (uint8_t)*++text))) {
        c = (uint8_t)(c - '0');
        if (c < 10 && places != 2) {
            if (!number_add_digit(&value, c)) {
                return STATUS_NUMBER_TOO_LARGE;
            }
            places++;
        } else if (c == (uint8_t)('.' - '0') && kind == KIND_RAMP && places >= NO_POINT) {
            places = 0;
        } else {
            return STATUS_SYNTAX;
        }
    }
    if (places == NO_POINT) {
        return STATUS_NUMBER_MISSING;
    }

    /* The limits stand in the text: of a ramp value, 1 hundredth and 999 wholes. */
    uint32_t least = 0, most = 0;
    while ((c = flash_u8(range++)) != '\0') {
        c = (uint8_t)(c - '0');
        if (c < 10) {
            number_add_digit(&most, c);
        } else if (most != 0) {
            least = most;
            most = 0;
        }
    }
    uint16_t to_code = 0;
    if (kind == KIND_RAMP) {
        if (places < NO_POINT || value < 100) {
            if (places >= NO_POINT) {
                places = 0;
            }
            for (; places < 2; places++) {
                number_add_digit(&value, 0); /* if there is no room for it it is out of range anyway */
            }
            most = ACCEL_CODE_WHOLE - 1;
        } else {
            to_code = ACCEL_CODE_WHOLE - 100;
        }
    } else if (kind == KIND_OPS && value != 0) {
        least = most;
    }
    if (value > most) {
        if (kind > KIND_AUTORUN) {
            return STATUS_RANGE;
        }
        value = most;
    }
    if (value < least) {
        return STATUS_RANGE;
    }
    return store_change(place & PLACE_OFFSET, (uint8_t)((place >> PLACE_BYTES_BIT) + 1), value + to_code);
}

/* -- commands --------------------------------------------------------------------------------------------------------- */

void configure_init(void)
{
    configuring = false;
}

bool configure_mode(void)
{
    return configuring;
}

status_t command_configure(const char *rest)
{
    if (!is_end(*rest)) {
        return set(rest);
    }
    configuring = true;
    return display_request(DISPLAY_CONFIGURE);
}

status_t configure_line(const char *line)
{
    if (is_end(line[1])) {
        if (*line == 'S') {
            queue_stop();
            return STATUS_OK;
        }
        if ((*line | 0x20) == 'x') {
            configuring = false;
            return STATUS_OK;
        }
    }
    const status_t status = set(line);
    if (status == STATUS_OK) {
        (void)display_request(DISPLAY_CONFIGURE); /* it is stored, even if there is no room for one more display */
    }
    return status;
}

/* -- screen and list -------------------------------------------------------------------------------------------------- */

enum { SCREEN_CELLS = 28, LETTERS = 64 };

static uint16_t cell; /* the next one; of the list: first the letters, then the bytes of the EEPROM */

void configure_first_cell(void)
{
    cell = 0;
}

bool configure_has_cell(bool screen)
{
    return cell < (screen ? SCREEN_CELLS : commands_debugging() ? LETTERS + EEPROM_BYTES : LETTERS);
}

static void put_value(const char *row, bool screen)
{
    const uint8_t place = flash_u8(row + ROW_PLACE);
    const uint8_t kind = flash_u8(row + ROW_KIND);
    uint8_t offset = place & PLACE_OFFSET;
    uint32_t value = 0;
    uint8_t *byte = (uint8_t *)&value;
    for (uint8_t left = (uint8_t)((place >> PLACE_BYTES_BIT) + 1); left > 0; left--) {
        *byte++ = store_setting(offset++);
    }
    if (screen && flash_u8(row) == 'D' && value == 0) {
        return;
    }
    if (kind == KIND_DIRECTION) {
        text_put_flash(FLASH_TEXT("CCW") + (value == 0));
    } else if (kind == KIND_RAMP) {
        display_put_accel((accel_code_t)value);
    } else {
        if (kind == KIND_OPS && value != 0) {
            value = 100100; /* in binary; there is no other */
        }
        if (kind == KIND_MAP) {
            for (uint8_t i = 1; i < 8; i++) {
                terminal_port_put((uint8_t)('0' + value));
                value = store_setting(offset++);
            }
        }
        text_put_u32(value);
    }
}

static void put_hex_digit(uint8_t digit)
{
    terminal_port_put((uint8_t)(digit + (digit < 10 ? '0' : 'A' - 10)));
}

/* A byte of the EEPROM, sixteen a line. */
static void put_byte(uint16_t address)
{
    const uint8_t byte = eeprom_port_read(address);
    put_hex_digit(byte >> 4);
    put_hex_digit(byte & 0x0F);
    if ((address & 0x0F) == 0x0F) {
        text_new_line();
    } else {
        terminal_port_put(' ');
    }
}

/* The name and the tabs behind it: values stand in column 16, or 40. */
static void put_name(const char *name)
{
    uint8_t column = 1;
    for (uint8_t c; (c = flash_u8(name++)) != '\0'; column++) {
        if (column == 1) {
            terminal_port_put(' ');
        }
        terminal_port_put(c);
    }
    terminal_port_put('\t');
    if (column < 7) {
        terminal_port_put('\t');
    }
}

/* A letter without a parameter has an empty cell. */
void configure_put_cell(bool screen)
{
    const uint16_t at = cell++;
    uint8_t letter = (uint8_t)(at + 'A');
    bool line_ends = !screen;
    if (screen) {
        letter = (uint8_t)((at >> 1) + 'A');
        line_ends = at & 1;
        if (line_ends) {
            letter |= 0x20;
        }
    } else if (at >= LETTERS) {
        put_byte(at - LETTERS);
        return;
    }
    const char *row = find(letter);
    if (row == 0 && !screen) {
        return;
    }
    if (row != 0) {
        if (screen && line_ends) {
            terminal_port_put('\t');
        }
        terminal_port_put(letter);
        if (screen) {
            put_name(row + ROW_NAME);
        } else {
            terminal_port_put(' ');
        }
        put_value(row, screen);
    }
    if (line_ends) {
        text_new_line();
    }
}
