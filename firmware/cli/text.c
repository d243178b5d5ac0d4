#include "cli/text.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "cli/terminal_port.h"

void text_put_flash(const char *text)
{
    for (uint8_t c; (c = flash_u8(text)) != '\0'; text++) {
        terminal_port_put(c);
    }
}

void text_put_decimal(uint32_t value, uint8_t decimals)
{
    char text[NUMBER_TEXT_BYTES];
    for (const char *c = number_format(text, value, decimals); *c != '\0'; c++) {
        terminal_port_put((uint8_t)*c);
    }
}

NOINLINE void text_put_u32(uint32_t value)
{
    text_put_decimal(value, 0);
}

void text_new_line(void)
{
    terminal_port_put('\r');
    terminal_port_put('\n');
}
