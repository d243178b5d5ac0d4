/* The reset's cause, the watchdog, and the RST post. start.S has begun with it. */
#include <avr/io.h>
#include <avr/wdt.h>
#include "boot_port.h"

/* Above .bss, which the start-up code clears after start.S has written this. */
uint8_t boot_port_flags __attribute__((section(".noinit")));

bool boot_port_rst_low(void)
{
    /* 8 cycles a sample, 33 ms: bouncing contacts, and a long cable whose pull-up has just been switched on. */
    uint16_t samples = 0;
    do {
        if (PINB & _BV(PB0)) {
            return false;
        }
    } while (++samples != 0);
    return true;
}

void boot_port_alive(void)
{
    wdt_reset();
}
