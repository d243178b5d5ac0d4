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
#define SETTING_KIND(kind, bytes, range) KIND_##kind,
#include "settings.def"
#undef SETTING_KIND
    /* a value's bytes, by the limits between the kinds */
    BYTES_1_BELOW = KIND_WORD,
    BYTES_2_BELOW = KIND_CYCLE,
};
#define SETTING_KIND(kind, bytes, range)                                                               \
    _Static_assert((bytes) == (KIND_##kind < BYTES_1_BELOW ? 1 : KIND_##kind < BYTES_2_BELOW ? 2 : 4), \
                   "kinds stand in the order of their bytes");
#include "settings.def"
#undef SETTING_KIND

/* One after the other, each with its NUL. */
static const char ranges[] FLASH =
#define SETTING_KIND(kind, bytes, range) range "\0"
#include "settings.def"
#undef SETTING_KIND
    ;

typedef struct {
    char letter;
    uint8_t offset; /* in settings_t */
    uint8_t kind;
} row_t;

static const row_t rows[] FLASH = {
#define SETTING(letter, type, member, kind, factory, name) \
    {letter, offsetof(settings_t, SETTING_PLACE_##type(member)), KIND_##kind},
#include "settings.def"
#undef SETTING
};
enum { ROWS = sizeof rows / sizeof rows[0] };

static const char names[] FLASH =
#define SETTING(letter, type, member, kind, factory, name) name "\0"
#include "settings.def"
#undef SETTING
    ;

static const char *nth(const char *text, uint8_t n)
{
    while (n > 0) {
        if (flash_u8(text++) == '\0') {
            n--;
        }
    }
    return text;
}

/* ROWS: there is none. */
static uint8_t find(char letter, row_t *row)
{
    uint8_t i = 0;
    for (; i < ROWS; i++) {
        FLASH_COPY(row, &rows[i], sizeof *row);
        if (row->letter == letter) {
            break;
        }
    }
    return i;
}

static uint8_t bytes_of(uint8_t kind)
{
    return kind < BYTES_1_BELOW ? 1 : kind < BYTES_2_BELOW ? 2 : 4;
}

/* -- values that are typed -------------------------------------------------------------------------------------------- */

static bool configuring;

static bool is_end(char c)
{
    return c == '\0' || c == ' ';
}

/* A number in hundredths as an accel code; places: of its decimals, NO_POINT or more without a point. */
enum { NO_POINT = 0x80 };

static bool to_accel_code(uint32_t *value, uint8_t places)
{
    if (places >= NO_POINT) {
        if (*value >= 100) {
            const bool valid = *value <= 999;
            *value += ACCEL_CODE_WHOLE - 100;
            return valid;
        }
        places = 0;
    }
    for (; places < 2; places++) {
        number_add_digit(value, 0); /* if there is no room for it it is out of range anyway */
    }
    return places == 2 && *value != 0 && *value < ACCEL_CODE_WHOLE;
}

/* The limits of its kind stand in the text that is told. */
static bool is_in_range(uint32_t value, uint8_t kind)
{
    uint32_t least = 0, most = 0;
    for (const char *range = nth(ranges, kind);; range++) {
        const uint8_t c = flash_u8(range);
        if (c == '\0') {
            break;
        }
        if (c >= '0') {
            number_add_digit(&most, (uint8_t)(c - '0'));
        } else if (most != 0) {
            least = most;
            most = 0;
        }
    }
    return value >= least && value <= most;
}

static status_t read_value(const char *text, uint8_t kind, uint32_t *value)
{
    uint8_t places = NO_POINT;
    *value = 0;
    if (is_end(*text)) {
        return STATUS_NUMBER_MISSING;
    }
    for (; !is_end(*text); text++) {
        const uint8_t digit = (uint8_t)(*text - '0');
        if (digit < 10) {
            if (!number_add_digit(value, digit)) {
                return STATUS_NUMBER_TOO_LARGE;
            }
            places++;
        } else if (*text == '.' && kind == KIND_RAMP && places >= NO_POINT) {
            places = 0;
        } else {
            return STATUS_SYNTAX;
        }
    }
    bool valid = true;
    if (kind <= KIND_DIRECTION) {
        *value = *value != 0;
    } else if (kind == KIND_AUTORUN) {
        if (*value > QUEUE_LAST) {
            *value = QUEUE_LAST;
        }
    } else if (kind == KIND_RAMP) {
        valid = to_accel_code(value, places);
    } else if (kind != KIND_OPS || *value != 0) {
        valid = is_in_range(*value, kind);
    }
    return valid ? STATUS_OK : STATUS_RANGE;
}

static status_t set(const char *text)
{
    row_t row;
    uint32_t value;
    status_t status = STATUS_RANGE;
    if (find(*text++, &row) == ROWS) {
        return STATUS_UNKNOWN_COMMAND;
    }
    if (row.kind == KIND_MAP) {
        const uint8_t entry = (uint8_t)(*text - '0');
        if (entry < 8) {
            text++;
            row.offset = (uint8_t)(row.offset + entry);
            status = STATUS_OK;
        }
    } else {
        status = STATUS_OK;
    }
    if (status == STATUS_OK) {
        status = read_value(text, row.kind, &value);
    }
    if (status == STATUS_OK) {
        status = store_change(row.offset, bytes_of(row.kind), value);
    } else {
        commands_refuse_range(nth(ranges, row.kind)); /* told with STATUS_RANGE only */
    }
    return status;
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

status_t configure_command(const char *rest)
{
    if (!is_end(*rest)) {
        return set(rest);
    }
    configuring = true;
    return display_request(DISPLAY_CONFIGURE);
}

status_t configure_line(const char *line)
{
    if (is_end(*line)) {
        return STATUS_OK;
    }
    if (!is_end(line[1])) {
        const status_t status = set(line);
        if (status == STATUS_OK) {
            (void)display_request(DISPLAY_CONFIGURE); /* it is stored, even if there is no room for one more display */
        }
        return status;
    }
    if (*line == 'S') {
        queue_stop();
    } else if ((*line | 0x20) == 'x') {
        configuring = false;
    } else {
        return set(line); /* says what is wrong */
    }
    return STATUS_OK;
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

static void put_value(const row_t *row)
{
    uint32_t value = 0;
    for (uint8_t i = bytes_of(row->kind); i-- > 0;) {
        ((uint8_t *)&value)[i] = store_setting((uint8_t)(row->offset + i));
    }
    if (row->kind == KIND_DIRECTION) {
        text_put_flash(value != 0 ? FLASH_TEXT("CCW") : FLASH_TEXT("CW"));
        return;
    }
    if (row->kind == KIND_RAMP) {
        display_put_accel((accel_code_t)value);
        return;
    }
    if (row->kind == KIND_OPS && value != 0) {
        value = 100100; /* in binary; there is no other */
    }
    if (row->kind == KIND_MAP) {
        for (uint8_t i = 1; i < 8; i++) {
            terminal_port_put((uint8_t)('0' + value));
            value = store_setting((uint8_t)(row->offset + i));
        }
    }
    text_put_u32(value);
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
static void put_name(uint8_t i)
{
    uint8_t column = 1;
    const char *name = nth(names, i);
    if (flash_u8(name) != '\0') {
        terminal_port_put(' ');
        for (uint8_t c; (c = flash_u8(name)) != '\0'; name++) {
            terminal_port_put(c);
            column++;
        }
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
    if (screen) {
        letter = (uint8_t)((at >> 1) + (at & 1 ? 'a' : 'A'));
    } else if (at >= LETTERS) {
        put_byte(at - LETTERS);
        return;
    }
    row_t row;
    const uint8_t i = find((char)letter, &row);
    if (i < ROWS) {
        if (screen && letter >= 'a') {
            terminal_port_put('\t');
        }
        terminal_port_put(letter);
        if (screen) {
            put_name(i);
        } else {
            terminal_port_put(' ');
        }
        if (!screen || row.kind != KIND_BLANK_FLAG || store_setting(row.offset) != 0) {
            put_value(&row);
        }
    }
    if (screen ? letter >= 'a' : i < ROWS) {
        text_new_line();
    }
}
