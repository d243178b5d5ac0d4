/* The divisor of a serial port for any rate from 300 Bd to 2 MBd.
 *
 * Context: boot; pure. Errors: a rate outside is taken for the nearest that can be had.
 * Tests:   test/host/test_baud.c
 * Source:  ATmega328P datasheet DS40002061, table 20-1 (equations) and 20.11 (tables of errors). */
#ifndef HAL_BAUD_H
#define HAL_BAUD_H

#include <stdbool.h>
#include <stdint.h>
#include "board.h"

typedef struct {
    uint16_t ubrr; /* 0..4095 */
    bool u2x;      /* 8 samples a bit instead of 16 */
} baud_divisor_t;

/* Counted in eighths of a bit, an even divisor is the same rate with 16 samples a bit, which tolerate more; only an odd
 * one needs 8 samples. baud: >= 1. */
static inline baud_divisor_t baud_divisor(uint32_t baud)
{
    const uint32_t quotient = (uint32_t)BOARD_CPU_HZ / 4 / baud;
    const uint16_t sixteenths = quotient > 16384 ? 16384 : (uint16_t)quotient;
    uint16_t eighths = (uint16_t)(sixteenths + 1) / 2;
    if (eighths == 0) {
        eighths = 1;
    }
    const bool u2x = (eighths & 1) != 0 && eighths <= 4096;
    if (!u2x) {
        eighths /= 2;
    }
    return (baud_divisor_t){.ubrr = (uint16_t)(eighths - 1), .u2x = u2x};
}

#endif
