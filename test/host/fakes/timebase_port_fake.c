#include "host/fakes/timebase_port_fake.h"
#include "cli/timebase_port.h"

bool timebase_fake_running;
uint32_t timebase_fake_us;
uint32_t timebase_fake_step_us;

void timebase_start(void)
{
    timebase_fake_running = true;
    timebase_fake_us = 0;
}

void timebase_stop(void)
{
    timebase_fake_running = false;
}

uint32_t timebase_us(void)
{
    timebase_fake_us += timebase_fake_step_us;
    return timebase_fake_us;
}
