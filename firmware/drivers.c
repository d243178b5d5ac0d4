#include "drivers.h"
#include "base/inline.h"

NOINLINE uint8_t drivers_ustep(uint8_t driver, uint8_t ustep)
{
    const uint8_t most = (uint8_t)(driver + 4); /* A4988: 16 microsteps, DRV8825: 32 */
    return driver < DRIVER_MAPPED && ustep > most ? most : ustep;
}

uint8_t drivers_pins(uint8_t driver, uint8_t ustep, const uint8_t map[8])
{
    if (driver == DRIVER_MAPPED) {
        return map[ustep];
    }
    return driver == DRIVER_A4988 && ustep == 4 ? 7 : ustep; /* all others are the exponent itself */
}
