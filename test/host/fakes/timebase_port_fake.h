/* A clock that advances by a fixed amount at each reading. */
#ifndef TIMEBASE_PORT_FAKE_H
#define TIMEBASE_PORT_FAKE_H

#include <stdbool.h>
#include <stdint.h>

extern bool timebase_fake_running;
extern uint32_t timebase_fake_us;
extern uint32_t timebase_fake_step_us; /* added at each reading */

#endif
