/* What boot needs of the hardware; implemented by hal/reset.c.
 *
 * Context: main loop. Errors: none. Tests: test/host/test_boot.c has a fake; test/image/test_image_boot.c */
#ifndef BOOT_PORT_H
#define BOOT_PORT_H

#include <stdbool.h>
#include <stdint.h>

/* MCUSR as the reset has left it; 0 if a bootloader has cleared it. */
extern uint8_t boot_port_flags;

/* RST reads low for 30 ms on end. Returns at once if it does not. */
bool boot_port_rst_low(void);

/* The main loop is alive: to be called every 120 ms at least, and nowhere else. */
void boot_port_alive(void);

#endif
