/* The EEPROM of the chip (datasheet section 8.4 and 8.6.3). */
#include "base/atomic.h"
#include "eeprom/eeprom_port.h"
#include <avr/io.h>

bool eeprom_port_busy(void)
{
    return (EECR & 1 << EEPE) != 0;
}

uint8_t eeprom_port_read(uint16_t address)
{
    EEAR = address;
    EECR |= 1 << EERE;
    return EEDR;
}

/* EEPE counts within four cycles of EEMPE: nothing may come between (two SBI). */
void eeprom_port_write(uint16_t address, uint8_t value)
{
    EEAR = address;
    EEDR = value;
    const uint8_t state = atomic_begin();
    EECR |= 1 << EEMPE;
    EECR |= 1 << EEPE;
    atomic_end(state);
}
