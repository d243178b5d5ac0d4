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
    1000000000u, 100000000u, 10000000u, 1000000u, 100000u, 10000u, 1000u, 100u, 10u, 1u,
};
enum { POWERS = sizeof powers_of_ten / sizeof powers_of_ten[0] };

char *number_format(char *text, uint32_t value, uint8_t decimals)
{
    bool started = false;
    for (uint8_t place = POWERS; place > 0; place--) {
        const uint32_t power = flash_u32(&powers_of_ten[POWERS - place]);
        char digit = '0';
        while (value >= power) {
            value -= power;
            digit++;
        }
        started = started || digit != '0' || place <= decimals + 1;
        if (started) {
            if (place == decimals) {
                *text++ = '.';
            }
            *text++ = digit;
        }
    }
    *text = '\0';
    return text;
}
