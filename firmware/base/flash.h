/* Constants that stay in flash: the one place that knows how they are read.
 *
 * On the target a FLASH object has a flash address: read it with the functions below, never directly. On the host it
 * is plain memory. FLASH_TEXT makes a flash string inside a function.
 * Context: any. Errors: none. Tests: test/host/test_status.c, test/host/test_display.c (through their users). */
#ifndef BASE_FLASH_H
#define BASE_FLASH_H

#include <stdint.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define FLASH PROGMEM
#define FLASH_TEXT(text) PSTR(text)
#define FLASH_COPY(to, from, bytes) memcpy_P((to), (from), (bytes))
static inline uint8_t flash_u8(const void *address)
{
    return pgm_read_byte(address);
}
static inline uint16_t flash_u16(const void *address)
{
    return pgm_read_word(address);
}
static inline uint32_t flash_u32(const void *address)
{
    return pgm_read_dword(address);
}
static inline const void *flash_pointer(const void *address)
{
    return pgm_read_ptr(address);
}
#else
#include <string.h>
#define FLASH
#define FLASH_TEXT(text) (text)
#define FLASH_COPY(to, from, bytes) memcpy((to), (from), (bytes))
static inline uint8_t flash_u8(const void *address)
{
    return *(const uint8_t *)address;
}
static inline uint16_t flash_u16(const void *address)
{
    return *(const uint16_t *)address;
}
static inline uint32_t flash_u32(const void *address)
{
    return *(const uint32_t *)address;
}
static inline const void *flash_pointer(const void *address)
{
    return *(const void *const *)address;
}
#endif

/* Text number `number` of several, each with its NUL behind it. */
const char *flash_text(const char *texts, uint8_t number);

#endif
