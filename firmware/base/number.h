/* Numbers to text and back, without division, printf or floating point.
 *
 * Reading is done a digit at a time, so that a line can be parsed while it arrives.
 * Context: main loop; pure. Cost: number_add_digit() about 35 cycles; number_format() 400 a digit.
 * Errors:  an overflow is reported, never wrapped.
 * Tests:   test/host/test_number.c */
#ifndef BASE_NUMBER_H
#define BASE_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/* Room for the longest number, its point and the terminating NUL: "42949672.95". */
#define NUMBER_TEXT_BYTES 12

/* value = value * 10 + digit; false, and value unchanged, if the result does not fit 32 bits. digit: 0..9. */
bool number_add_digit(uint32_t *value, uint8_t digit);

/* value / 10^decimals, all its decimals and at least one digit before them: 1047, 2 -> "10.47". decimals: 0..8. It ends
 * with the last of the NUMBER_TEXT_BYTES of text; returns where it begins. */
char *number_format(char *text, uint32_t value, uint8_t decimals);

#endif
