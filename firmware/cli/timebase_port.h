/* The time since boot; implemented by hal/timebase.c with Timer0.
 *
 * Units:   microseconds, modulo 2^32, resolution 4; wraps of 262.144 ms, modulo 256. Context: main loop. Errors: none.
 * Tests:   test/host/fakes/timebase_port_fake.c; test/image. */
#ifndef CLI_TIMEBASE_PORT_H
#define CLI_TIMEBASE_PORT_H

#include <stdint.h>

void timebase_start(void); /* once, at boot */
uint32_t timebase_us(void);
uint8_t timebase_wraps(void); /* for times from a second on */

#endif
