#include "host/fakes/eeprom_port_fake.h"
#include <assert.h>
#include <string.h>

eeprom_fake_t eeprom_fake = {.stuck = -1, .cut_after = -1};

void eeprom_fake_reset(void)
{
    memset(&eeprom_fake, 0, sizeof eeprom_fake);
    memset(eeprom_fake.cells, 0xFF, sizeof eeprom_fake.cells);
    eeprom_fake.stuck = -1;
    eeprom_fake.cut_after = -1;
}

bool eeprom_port_busy(void)
{
    if (eeprom_fake.busy == 0) {
        return false;
    }
    eeprom_fake.busy--;
    return true;
}

uint8_t eeprom_port_read(uint16_t address)
{
    assert(address < EEPROM_BYTES);
    assert(eeprom_fake.busy == 0); /* the chip ignores it */
    return eeprom_fake.cells[address];
}

void eeprom_port_write(uint16_t address, uint8_t value)
{
    assert(address < EEPROM_BYTES);
    assert(eeprom_fake.busy == 0);
    if (eeprom_fake.off) {
        return;
    }
    if (eeprom_fake.cut_after == (long)eeprom_fake.written) {
        eeprom_fake.off = true;
        value = eeprom_fake.torn;
    }
    eeprom_fake.written++;
    eeprom_fake.writes[address]++;
    eeprom_fake.unchanged += eeprom_fake.cells[address] == value && !eeprom_fake.off;
    if (eeprom_fake.stuck != address) {
        eeprom_fake.cells[address] = value;
    }
    eeprom_fake.busy = eeprom_fake.slow;
}
