/* In place of cli/network.c and net/: an image without the network, as long as both do not fit the chip together (the
 * Makefile's NETWORK). A line for another node is refused, and nothing is sent or received as a packet.
 *
 * Context: main loop. Errors: STATUS_NOT_YET. Tests: test/image/test_image_terminal.c */
#include "cli/network.h"
#include "net/bus.h"

bus_counters_t bus_counters;

void network_init(void)
{
}

uint8_t network_poll(void)
{
    return 0;
}

status_t network_send(uint8_t destination, const char *text)
{
    (void)destination;
    (void)text;
    return STATUS_NOT_YET;
}

uint8_t network_last_origin(void)
{
    return 0; /* no message comes */
}

bool network_show(void)
{
    return false;
}

void bus_clear(void)
{
}

void bus_ops(uint8_t byte)
{
    (void)byte;
}
