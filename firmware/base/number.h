/* Numbers to text and back, without division, printf or floating point.
 *
 * Reading is done a digit at a time, so that a line can be parsed while it arrives.
 * Context: main loop; pure. Cost: number_add_digit() about 35 cycles; number_format_u32() up to 1,500.
 * Errors:  an overflow is reported, never wrapped.
 * Tests:   test/host/test_number.c */
#ifndef BASE_NUMBER_H
#define BASE_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/* Room for the longest number, sign and terminating NUL: "-2147483648". */
#define NUMBER_TEXT_BYTES 12

/* value = value * 10 + digit; false, and value unchanged, if the result does not fit 32 bits. digit: 0..9. */
bool number_add_digit(uint32_t *value, uint8_t digit);

/* Each returns the end of the text (its NUL). */
char *number_format_u32(char *text, uint32_t value);
char *number_format_i32(char *text, int32_t value);
char *number_format_centi(char *text, uint16_t hundredths); /* 1047 -> "10.47", always two decimals */

#endif
