/* A clock that advances by a fixed amount at each reading in microseconds. */
#ifndef TIMEBASE_PORT_FAKE_H
#define TIMEBASE_PORT_FAKE_H

#include <stdint.h>

extern uint32_t timebase_fake_us;
extern uint32_t timebase_fake_step_us; /* added at each reading */

#endif
