#include "cli/text.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "cli/terminal_port.h"

uint8_t *text_to;

NOINLINE void text_put_byte(uint8_t c)
{
    if (text_to != 0) {
        *text_to++ = c;
    } else {
        terminal_port_put(c);
    }
}

/* What characters from 0x80 on stand for: a character, and one that may be such a pair again. */
static const uint8_t pairs[][2] FLASH = {
#define PAIR(first, second) {first, second},
#include "cli/pairs.def"
#undef PAIR
};

NOINLINE uint8_t text_put(uint8_t c)
{
    uint8_t count = 1;
    for (; c >= 0x80; count++) {
        const uint8_t *pair = pairs[0] + (uint8_t)(c << 1);
        text_put_byte(flash_u8(pair));
        c = flash_u8(pair + 1);
    }
    text_put_byte(c);
    return count;
}

uint8_t text_put_flash(const char *text)
{
    uint8_t count = 0;
    for (uint8_t c; (c = flash_u8(text)) != '\0'; text++) {
        count = (uint8_t)(count + text_put(c));
    }
    return count;
}

void text_put_decimal(uint32_t value, uint8_t decimals)
{
    char text[NUMBER_TEXT_BYTES];
    for (const char *c = number_format(text, value, decimals); *c != '\0'; c++) {
        text_put_byte((uint8_t)*c);
    }
}

NOINLINE void text_put_u32(uint32_t value)
{
    text_put_decimal(value, 0);
}

static NOINLINE void put_hex_digit(uint8_t digit)
{
    text_put_byte((uint8_t)(digit + (digit < 10 ? '0' : 'A' - 10)));
}

void text_put_hex(uint8_t byte)
{
    put_hex_digit(byte >> 4);
    put_hex_digit(byte & 0x0F);
}

void text_new_line(void)
{
    text_put_byte('\r');
    text_put_byte('\n');
}
