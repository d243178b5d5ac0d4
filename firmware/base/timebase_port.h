/* The clock of debug mode, boot, trial and network; implemented by hal/timebase.c with Timer0, running always.
 *
 * Units:   microseconds, modulo 2^32, resolution 0.5. Context: main loop. Errors: none.
 * Tests:   test/host/fakes/timebase_port_fake.c; test/image. */
#ifndef BASE_TIMEBASE_PORT_H
#define BASE_TIMEBASE_PORT_H

#include <stdint.h>

void timebase_start(void); /* once, at boot */
uint32_t timebase_us(void);
uint16_t timebase_128us(void); /* units of 128 us, modulo 65,536: 8.4 s */
uint8_t timebase_32ms(void);  /* units of 32.768 ms, modulo 256 */
uint8_t timebase_262ms(void); /* units of 262.144 ms, modulo 256 */

#endif
