#include "cli/text.h"
#include "base/flash.h"
#include "base/number.h"
#include "cli/terminal_port.h"

/* In RAM. */
static void put(const char *text)
{
    while (*text != '\0') {
        terminal_port_put((uint8_t)*text++);
    }
}

void text_put_flash(const char *text)
{
    for (uint8_t c; (c = flash_u8(text)) != '\0'; text++) {
        terminal_port_put(c);
    }
}

void text_put_u32(uint32_t value)
{
    char text[NUMBER_TEXT_BYTES];
    number_format_u32(text, value);
    put(text);
}

void text_put_i32(int32_t value)
{
    char text[NUMBER_TEXT_BYTES];
    number_format_i32(text, value);
    put(text);
}

void text_put_accel(accel_code_t code)
{
    char text[NUMBER_TEXT_BYTES];
    if (code < ACCEL_CODE_WHOLE) {
        number_format_centi(text, code);
    } else {
        number_format_u32(text, code - ACCEL_CODE_WHOLE + 100u);
    }
    put(text);
}

void text_new_line(void)
{
    terminal_port_put('\r');
    terminal_port_put('\n');
}
