/* The watchdog; implemented by hal/watchdog.c. A program that hangs leaves no coil on: the reset switches all pins off.
 *
 * Context: main loop. Errors: none. Tests: test/image/test_ninja_image.c.
 * Source:  ATmega328P datasheet DS40002061, 11.8.2, 11.9. */
#ifndef NINJA_WATCHDOG_PORT_H
#define NINJA_WATCHDOG_PORT_H

void watchdog_port_init(void);  /* 120 ms. First of all: after its own reset it runs on with its shortest period, 16 ms */
void watchdog_port_alive(void); /* more often than that */

#endif
