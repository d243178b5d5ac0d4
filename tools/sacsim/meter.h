/* Position and speed as the driver sees them: counted and timed from the edges of clk and dir, never asked of the
 * firmware.
 *
 * Units:   pulses (clockwise positive), pulses per second, CPU cycles of 62.5 ns.
 * Context: the inline functions are called from the board at every edge: keep them short.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_METER_H
#define SACSIM_METER_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int64_t position_pulses;
    uint64_t pulses; /* both directions */
    uint64_t last_rise_cycle;
    uint8_t dir_level;
    uint8_t cw_level;

    /* since the previous meter_read() */
    bool moving; /* then base_cycle is the last rise before it, else the first one after it */
    uint64_t base_cycle;
    uint64_t base_pulses;
    double interval_cycles; /* mean; 0 while unknown */
} meter_t;

void meter_init(meter_t *m, uint8_t cw_level, uint8_t dir_level);

static inline void meter_clk_rise(meter_t *m, uint64_t cycle)
{
    m->position_pulses += m->dir_level == m->cw_level ? 1 : -1;
    if (!m->moving && m->pulses == m->base_pulses) {
        m->base_cycle = cycle;
    }
    m->pulses++;
    m->last_rise_cycle = cycle;
}

static inline void meter_dir(meter_t *m, uint8_t level)
{
    m->dir_level = level;
}

/* Pulses per second at this cycle: the mean since the previous call, or less if the pause since the last pulse says
 * so. standing: the motor is known to be at rest; where that is not known, half a second and four intervals without a
 * pulse count as rest. */
double meter_read(meter_t *m, uint64_t cycle, bool standing);

#endif
