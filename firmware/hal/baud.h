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

static inline uint32_t baud_error(uint32_t baud, uint8_t samples, uint16_t divisor)
{
    const uint32_t real = (uint32_t)BOARD_CPU_HZ / samples / divisor;
    return real > baud ? real - baud : baud - real;
}

static inline uint16_t baud_nearest(uint32_t baud, uint8_t samples)
{
    const uint32_t clocks = (uint32_t)BOARD_CPU_HZ / samples;
    const uint32_t divisor = (clocks + baud / 2) / baud;
    return divisor < 1 ? 1 : divisor > 4096 ? 4096 : (uint16_t)divisor;
}

/* The closer of the two modes; if they are equal, 16 samples a bit, which tolerate more. baud: >= 1. */
static inline baud_divisor_t baud_divisor(uint32_t baud)
{
    const uint16_t normal = baud_nearest(baud, 16);
    const uint16_t twice = baud_nearest(baud, 8);
    const bool u2x = baud_error(baud, 8, twice) < baud_error(baud, 16, normal);
    return (baud_divisor_t){.ubrr = (uint16_t)((u2x ? twice : normal) - 1), .u2x = u2x};
}

#endif
