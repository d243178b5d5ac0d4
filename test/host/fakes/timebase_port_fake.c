#include "host/fakes/timebase_port_fake.h"
#include "base/timebase_port.h"

uint32_t timebase_fake_us;
uint32_t timebase_fake_step_us;

uint32_t timebase_us(void)
{
    timebase_fake_us += timebase_fake_step_us;
    return timebase_fake_us;
}

uint16_t timebase_128us(void)
{
    return (uint16_t)(timebase_fake_us >> 7);
}

uint8_t timebase_32ms(void)
{
    return (uint8_t)(timebase_fake_us >> 15);
}

uint8_t timebase_262ms(void)
{
    return (uint8_t)(timebase_fake_us >> 18);
}
