/* The pins at boot; implemented by hal/pins.c from the table in board.h.
 *
 * Context: boot, before anything else. Errors: none. Tests: test/image. */
#ifndef PINS_PORT_H
#define PINS_PORT_H

void pins_init(void); /* directions, pull-ups and idle levels */

#endif
