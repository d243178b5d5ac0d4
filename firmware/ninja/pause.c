/* See pause.h. */
#include "ninja/pause.h"
#include "base/timebase_port.h"

#define TENTH_US 100000u

static uint16_t left_tenths;
static uint32_t begun_us; /* the present tenth */

void pause_begin(uint16_t tenths)
{
    left_tenths = tenths;
    begun_us = timebase_us();
}

void pause_stop(void)
{
    left_tenths = 0;
}

bool pause_runs(void)
{
    return left_tenths != 0;
}

bool pause_poll(void)
{
    if (left_tenths == 0) {
        return false;
    }
    if (timebase_us() - begun_us >= TENTH_US) {
        begun_us += TENTH_US;
        left_tenths--;
    }
    return true;
}
