#include "base/number.h"

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

/* value = value / 10; the remainder. On the target 370 cycles, half of what the library's division takes. */
static inline uint8_t take_digit(uint32_t *value)
{
    uint8_t digit = 0;
#ifdef __AVR__
    uint8_t bits = 32;
    __asm__("1: lsl %A0\n\t"
            "rol %B0\n\t"
            "rol %C0\n\t"
            "rol %D0\n\t"
            "rol %1\n\t"
            "cpi %1, 10\n\t"
            "brcs 2f\n\t"
            "subi %1, 10\n\t"
            "inc %A0\n"
            "2: dec %2\n\t"
            "brne 1b"
            : "+r"(*value), "+d"(digit), "+r"(bits));
#else
    digit = (uint8_t)(*value % 10u);
    *value /= 10u;
#endif
    return digit;
}

char *number_format(char *text, uint32_t value, uint8_t decimals)
{
    text += NUMBER_TEXT_BYTES - 1;
    *text = '\0';
    for (uint8_t point = decimals;; point--) {
        *--text = (char)('0' + take_digit(&value));
        if (point == 1) {
            *--text = '.';
        } else if (value == 0 && (int8_t)point <= 0) {
            return text;
        }
    }
}
