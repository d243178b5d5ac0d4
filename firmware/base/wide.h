/* 64-bit arithmetic through pointers: a few bytes a call where the compiler's own in-line code takes a hundred.
 *
 * Context: main loop; pure, all modulo 2^64. On AVR in wide.S (cycles there), elsewhere in C.
 * Tests:   test/host/test_wide.c, the same cases on the AVR. */
#ifndef BASE_WIDE_H
#define BASE_WIDE_H

#include <stdbool.h>
#include <stdint.h>

typedef uint64_t wide_t;

#ifdef __AVR__
void wide_set(wide_t *x, uint32_t value);
void wide_copy(wide_t *to, const wide_t *from);
void wide_add(wide_t *sum, const wide_t *x);           /* sum += x */
void wide_subtract(wide_t *difference, const wide_t *x); /* difference -= x */
void wide_change(wide_t *x, const wide_t *change, bool add); /* x += change or x -= change */
void wide_multiply(wide_t *x, uint32_t factor);    /* x *= factor */
uint32_t wide_divide(wide_t *x, uint32_t divisor); /* x /= divisor, truncated; returns the remainder. divisor >= 1 */
uint32_t wide_root(const wide_t *x);               /* sqrt(x), truncated; of a negative x 0 */
uint8_t wide_bits(const wide_t *x);                /* of x without its leading zeros: 0..64 */
void wide_shift(wide_t *x, int8_t bits);           /* x >>= bits, without sign; below 0: x <<= -bits; -64 < bits < 64 */
uint32_t wide_fraction(uint32_t x, uint32_t y_q32); /* x * y / 2^32, less up to 4: products of the low bytes are left out */
#else
static inline void wide_set(wide_t *x, uint32_t value)
{
    *x = value;
}
static inline void wide_copy(wide_t *to, const wide_t *from)
{
    *to = *from;
}
static inline void wide_add(wide_t *sum, const wide_t *x)
{
    *sum += *x;
}
static inline void wide_subtract(wide_t *difference, const wide_t *x)
{
    *difference -= *x;
}
static inline void wide_change(wide_t *x, const wide_t *change, bool add)
{
    *x = add ? *x + *change : *x - *change;
}
static inline void wide_multiply(wide_t *x, uint32_t factor)
{
    *x *= factor;
}
static inline uint32_t wide_divide(wide_t *x, uint32_t divisor)
{
    uint32_t remainder = (uint32_t)(*x % divisor);
    *x /= divisor;
    return remainder;
}
static inline uint32_t wide_root(const wide_t *x)
{
    uint64_t left = (int64_t)*x < 0 ? 0 : *x;
    uint64_t root = 0;
    for (uint64_t bit = (uint64_t)1 << 62; bit; bit >>= 2) {
        uint64_t trial = root + bit;
        root >>= 1;
        if (left >= trial) {
            left -= trial;
            root += bit;
        }
    }
    return (uint32_t)root;
}
static inline uint8_t wide_bits(const wide_t *x)
{
    uint8_t bits = 0;
    for (uint64_t rest = *x; rest; rest >>= 1)
        bits++;
    return bits;
}
static inline void wide_shift(wide_t *x, int8_t bits)
{
    *x = bits < 0 ? *x << -bits : *x >> bits;
}
static inline uint32_t wide_fraction(uint32_t x, uint32_t y_q32)
{
    uint64_t sum = 0; /* in 2^-8 */
    for (int i = 0; i < 4; i++)
        for (int j = 3 - i; j < 4; j++)
            sum += (uint64_t)((x >> 8 * i & 0xFF) * (y_q32 >> 8 * j & 0xFF)) << 8 * (i + j - 3);
    return (uint32_t)(sum >> 8);
}
#endif

/* Half of x: 0 the lower, 1 the upper 32 bits. */
static inline uint32_t wide_half(const wide_t *x, uint8_t half)
{
    uint32_t bits;
    __builtin_memcpy(&bits, (const uint8_t *)x + 4 * half, sizeof bits);
    return bits;
}

/* The upper 32 bits of x. */
static inline void wide_set_upper(wide_t *x, uint32_t bits)
{
    __builtin_memcpy((uint8_t *)x + 4, &bits, sizeof bits);
}

static inline bool wide_is_negative(const wide_t *x)
{
    return ((const uint8_t *)x)[7] >= 0x80;
}

/* x / 2^(8 * byte), signed, where that fits 32 bits. byte <= 4. */
static inline int32_t wide_from_byte(const wide_t *x, uint8_t byte)
{
    int32_t bits;
    __builtin_memcpy(&bits, (const uint8_t *)x + byte, sizeof bits);
    return bits;
}

#endif
