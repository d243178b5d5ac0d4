/* The serial port that the terminal uses; implemented by hal/ports.c, set up by ports_init().
 *
 * Units:   bytes. Context: main loop.
 * Errors:  a lost or damaged byte is read as TERMINAL_PORT_DAMAGED in its place.
 * Tests:   test/host/test_terminal.c with test/host/fakes/terminal_port_fake.c; test/image. */
#ifndef CLI_TERMINAL_PORT_H
#define CLI_TERMINAL_PORT_H

#include <stdbool.h>
#include <stdint.h>

#define TERMINAL_PORT_DAMAGED 0xFFu

int16_t terminal_port_get(void);     /* -1: nothing has arrived */
uint8_t terminal_port_waiting(void); /* how many bytes have arrived and not been taken, 0..105 or 0..63 */

/* What terminal_port_get() will return after so many others; only as long as none has been taken since boot. */
uint8_t terminal_port_peek(uint8_t others);

bool terminal_port_idle(void);        /* all that was put has left the pin */
uint8_t terminal_port_free(void);     /* how many bytes terminal_port_put() would take now, 0..31 */
void terminal_port_put(uint8_t byte); /* only while terminal_port_free() is not 0 */

#endif
