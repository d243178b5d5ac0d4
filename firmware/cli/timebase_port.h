/* A clock for the debug mode; implemented by hal/timebase.c with Timer0. Stopped it costs nothing.
 *
 * Units:   microseconds, modulo 2^32, resolution 0.5. Context: main loop. Errors: none.
 * Tests:   test/host/fakes/timebase_port_fake.c; test/image. */
#ifndef CLI_TIMEBASE_PORT_H
#define CLI_TIMEBASE_PORT_H

#include <stdint.h>

void timebase_start(void); /* from 0, also while it runs */
void timebase_stop(void);
uint32_t timebase_us(void);

#endif
