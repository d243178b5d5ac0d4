#include "meter.h"

#include "test/board/board.h"

void meter_init(meter_t *m, uint8_t cw_level, uint8_t dir_level)
{
    *m = (meter_t){.cw_level = cw_level, .dir_level = dir_level};
}

double meter_read(meter_t *m, uint64_t cycle, bool standing)
{
    uint64_t pulses = m->pulses - m->base_pulses;
    double pause = (double)(cycle - m->last_rise_cycle);

    if (pulses > 0) {
        uint64_t intervals = m->moving ? pulses : pulses - 1; /* the first pulse from standstill ends none */

        m->interval_cycles = intervals > 0 ? (double)(m->last_rise_cycle - m->base_cycle) / (double)intervals : 0.0;
        m->moving = true;
        m->base_cycle = m->last_rise_cycle;
        m->base_pulses = m->pulses;
    }
    if (standing || (pause > 4.0 * m->interval_cycles && pause > 0.5 * (double)BOARD_CPU_HZ)) {
        m->moving = false;
        m->interval_cycles = 0.0;
    }
    if (m->interval_cycles == 0.0) {
        return 0.0;
    }
    return (double)BOARD_CPU_HZ / (pause > m->interval_cycles ? pause : m->interval_cycles);
}
