/* The Ninja's pins on an Arduino Nano, nowhere else. All others are inputs with their pull-up on.
 *
 *   D0     PD0       serial line, in
 *   D4-D7  PD4-PD7   azimuth's coils A, B, C, D: high is on (an ULN2003 or the like)
 *   A0-A3  PC0-PC3   altitude's coils A, B, C, D
 *   D8     PB0       azimuth's centre sensor, pull-up: low at the centre and beyond, on the positive side
 *   D9     PB1       altitude's centre sensor, likewise
 *
 * Source: decisions 0.5. */
#ifndef NINJA_HAL_PINS_H
#define NINJA_HAL_PINS_H

#define PINS_COILS_X 0xF0   /* of port D */
#define PINS_COILS_X_SHIFT 4
#define PINS_COILS_Y 0x0F   /* of port C */
#define PINS_SENSOR_X 0     /* bit of port B; that of Y follows */

#endif
