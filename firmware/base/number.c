#include "base/number.h"
#include "base/flash.h"

/* Byte by byte: one 8-bit multiplication each, and what the last one carries out is the overflow. */
bool number_add_digit(uint32_t *value, uint8_t digit)
{
    _Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the bytes are taken from the lowest");
    uint8_t *bytes = (uint8_t *)value;
    const uint16_t product_0 = (uint16_t)(bytes[0] * 10u + digit);
    const uint16_t product_1 = (uint16_t)(bytes[1] * 10u + (product_0 >> 8));
    const uint16_t product_2 = (uint16_t)(bytes[2] * 10u + (product_1 >> 8));
    const uint16_t product_3 = (uint16_t)(bytes[3] * 10u + (product_2 >> 8));
    if (product_3 >> 8) {
        return false;
    }
    bytes[0] = (uint8_t)product_0;
    bytes[1] = (uint8_t)product_1;
    bytes[2] = (uint8_t)product_2;
    bytes[3] = (uint8_t)product_3;
    return true;
}

static const uint32_t powers_of_ten[] FLASH = {
    1000000000u, 100000000u, 10000000u, 1000000u, 100000u, 10000u, 1000u, 100u, 10u,
};
enum { POWERS = sizeof powers_of_ten / sizeof powers_of_ten[0] };

/* All digits from the first that is not zero, or from the one that stands for 10^(least_digits - 1). */
static char *format_digits(char *text, uint32_t value, uint8_t least_digits)
{
    bool started = false;
    for (uint8_t i = 0; i < POWERS; i++) {
        const uint32_t power = flash_u32(&powers_of_ten[i]);
        char digit = '0';
        while (value >= power) {
            value -= power;
            digit++;
        }
        started = started || digit != '0' || POWERS - i < least_digits;
        if (started) {
            *text++ = digit;
        }
    }
    *text++ = (char)('0' + value);
    *text = '\0';
    return text;
}

char *number_format_u32(char *text, uint32_t value)
{
    return format_digits(text, value, 1);
}

char *number_format_i32(char *text, int32_t value)
{
    if (value < 0) {
        *text++ = '-';
        return format_digits(text, 0u - (uint32_t)value, 1);
    }
    return format_digits(text, (uint32_t)value, 1);
}

char *number_format_centi(char *text, uint16_t hundredths)
{
    char *end = format_digits(text, hundredths, 3);
    end[1] = '\0';
    end[0] = end[-1];
    end[-1] = end[-2];
    end[-2] = '.';
    return end + 1;
}
