/* A network port on the clock of timebase_port_fake: each byte takes its time on the line, in and out. */
#ifndef BUS_PORT_FAKE_H
#define BUS_PORT_FAKE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BUS_PORT_FAKE_CHARACTER_US 260u /* 38,400 Bd */

typedef struct {
    bool echo;        /* what is sent is received too */
    uint8_t framing_errors, overruns;
    unsigned begins;  /* bus_port_begin() so far */
    unsigned clashes; /* of these, while a byte was arriving */
    uint32_t begun_us, left_us; /* of the last packet: Tx En rose, its last stop bit left */
    uint32_t arrived_us;        /* the last byte that was received is whole */
} bus_port_fake_t;

extern bus_port_fake_t bus_port_fake;

void bus_port_fake_reset(void);
void bus_port_fake_receive(const void *bytes, size_t count); /* from now on, or behind what is arriving */
const uint8_t *bus_port_fake_sent(size_t *count);            /* everything since the reset, or bus_port_fake_clear() */
void bus_port_fake_clear(void);

#endif
