/* The two centre sensors; implemented by hal/sensors.c.
 *
 * Context: main loop. Errors: none. Tests: test/host/test_ninja_centre.c has a fake; test/image/test_ninja_image.c.
 * Source:  seed lines N57-61; decisions 0.5. */
#ifndef NINJA_SENSOR_PORT_H
#define NINJA_SENSOR_PORT_H

#include <stdbool.h>
#include <stdint.h>

void sensor_port_init(void); /* and all other pins but the motors' */

/* The axis stands at its centre or beyond, on the positive side: the sensor's pin is low. */
bool sensor_port_beyond(uint8_t axis);

#endif
