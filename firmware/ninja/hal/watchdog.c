/* See watchdog_port.h. */
#include <avr/io.h>
#include <avr/wdt.h>
#include "ninja/watchdog_port.h"

void watchdog_port_init(void)
{
    MCUSR = 0; /* its reset's flag keeps it at the shortest period (11.9.1) */
    wdt_enable(WDTO_120MS);
}

void watchdog_port_alive(void)
{
    wdt_reset();
}
