/* avr-libc's own routines, as a program would use them. */
#include <avr/eeprom.h>
#include <avr/io.h>
#include <stdint.h>

volatile uint8_t r_block[8];
volatile uint8_t r_done;

int main(void)
{
    uint8_t block[8];
    for (uint8_t i = 0; i < sizeof block; i++) {
        eeprom_write_byte((uint8_t *)(uintptr_t)(0x3F0 + i), (uint8_t)(0x11 * i));
    }
    eeprom_update_byte((uint8_t *)0x3F1, 0x11); /* the same: no write */
    eeprom_read_block(block, (const void *)0x3F0, sizeof block);
    for (uint8_t i = 0; i < sizeof block; i++) {
        r_block[i] = block[i];
    }
    r_done = 1;
    for (;;) {
    }
}
