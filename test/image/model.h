/* What a motion command must look like on the oscilloscope, computed apart from the firmware: in double precision,
 * interval by interval, from the manual's formulas.
 *
 * Units:   ticks of 62.5 ns; velocities in hundredths of RPM; ramp values in hundredths.
 * Source:  manual lines 85-107, 159, 249-269, 1005-1015; decisions 0.2 and A-HAR, A-LIN, A-TRN. */
#ifndef TEST_IMAGE_MODEL_H
#define TEST_IMAGE_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint32_t steps_per_rev;
    unsigned ustep; /* power of two */
    uint32_t slow_rpm;
} machine_t;

#define FACTORY ((machine_t){200, 0, 10})
#define NO_RAMP 99900u

typedef struct {
    uint32_t count;
    uint32_t velocity;
    bool cycle;  /* velocity is a cycle in us */
    bool pulses; /* count is in pulses */
    bool linear;
    uint32_t accel, decel; /* hundredths; NO_RAMP: none */
    uint32_t extra;
    double from; /* velocity in play before it; 0: slow speed */
} request_t;

typedef struct {
    machine_t machine;
    request_t request;
    uint32_t accel, cruise, decel, total; /* pulses, each with the interval behind it */
    double start, peak, target;           /* velocities */
    double exit;                          /* the velocity that stays in play */
    bool truncated;
    bool uncertain; /* a count of steps lies so near a whole number that float and double may differ */
} plan_t;

plan_t model_plan(machine_t machine, request_t request);
uint32_t model_rpm(machine_t machine, request_t request);
double model_cruise(const plan_t *plan);
double model_slow(const plan_t *plan);
double model_interval(const plan_t *plan, uint32_t k);                /* behind pulse k */
double model_sum(const plan_t *plan, uint32_t first, uint32_t count); /* of so many intervals */

/* The command as it is typed. */
void model_line(char *line, size_t size, const request_t *request, bool ccw);

#endif
