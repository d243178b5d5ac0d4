/* The pins; implemented by hal/pins.c from the table in board.h.
 *
 * Context: main loop. Errors: none. Tests: test/image/test_image_pins.c */
#ifndef PINS_PORT_H
#define PINS_PORT_H

void pins_init(void); /* at boot, before anything else: directions, pull-ups and idle levels */

#endif
