/* Keeps simulated time in step with the host's clock, or so many times as fast.
 *
 * Units:   CPU cycles of 62.5 ns; nanoseconds of CLOCK_MONOTONIC.
 * Errors:  a host that is too slow makes simulated time fall behind: what cannot be caught up is given up, and
 *          pace_wait() says so once.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_PACE_H
#define SACSIM_PACE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double speed; /* simulated over the host's time; PACE_FAST: as fast as the host can */
    bool warned;
    uint64_t base_cycle;
    int64_t base_ns;
    int64_t lost_ns;   /* given up since window_ns */
    int64_t window_ns; /* start of the time over which losses are summed */
    uint64_t window_cycle;
} pace_t;

int64_t pace_now_ns(void);

#define PACE_FAST 0.0
void pace_start(pace_t *p, double speed, uint64_t cycle);

/* The cycle to run to next: one slice ahead, a larger one while behind. */
uint64_t pace_target(const pace_t *p, uint64_t cycle);

/* Sleeps until the host's clock has reached this cycle; a signal ends the sleep early. Returns, once per run, the
 * speed relative to real time if the host turns out to be too slow; otherwise 0. */
double pace_wait(pace_t *p, uint64_t cycle);

#endif
