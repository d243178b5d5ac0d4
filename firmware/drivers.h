/* The stepper drivers: what their three microstep inputs have to be.
 *
 * Units:   ustep is the binary exponent of the microstep factor, 0..7; pins are MS1 (bit 0), MS2, MS3.
 * Context: pure. Errors: none.
 * Tests:   test/host/test_drivers.c, test/image/test_image_pins.c
 * Source:  manual lines 761-782, 801; decisions on exponents that a driver does not have; the tables of the A4988 and
 *          DRV8825 data sheets ("Microstepping Resolution Truth Table", "Stepping Format"). */
#ifndef DRIVERS_H
#define DRIVERS_H

#include <stdint.h>

enum { DRIVER_A4988, DRIVER_DRV8825, DRIVER_MAPPED };

/* The exponent that is used: the driver's highest where it does not go so far. Pulses are counted by it, too. */
uint8_t drivers_ustep(uint8_t driver, uint8_t ustep);

/* ustep as drivers_ustep() has returned it; map: for DRIVER_MAPPED, the pins of each exponent. */
uint8_t drivers_pins(uint8_t driver, uint8_t ustep, const uint8_t map[8]);

#endif
