#include "host/fakes/encoder_port_fake.h"
#include "queue/encoder_port.h"

int8_t encoder_port_fake_lines;

int8_t encoder_take(void)
{
    const int8_t lines = encoder_port_fake_lines;
    encoder_port_fake_lines = 0;
    return lines;
}
