/* The EEPROM, as its owner (store.c) needs it. Implemented by hal/eeprom.c; test/host/fakes/eeprom_port_fake.c.
 *
 * Context: main loop. A write takes 3.4 ms and goes on by itself; until it is over nothing else may be asked for.
 * Errors:  none; a write that a loss of power interrupts leaves any value in its cell. */
#ifndef EEPROM_PORT_H
#define EEPROM_PORT_H

#include <stdbool.h>
#include <stdint.h>

#define EEPROM_BYTES 1024u

bool eeprom_port_busy(void);                              /* a write is going on */
uint8_t eeprom_port_read(uint16_t address);               /* 0..EEPROM_BYTES - 1; not while it is busy */
void eeprom_port_write(uint16_t address, uint8_t value);  /* begins a write; not while it is busy */

#endif
