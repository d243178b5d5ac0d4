/* A unit with the network, from the ports' fakes up, as main() starts it: factory settings but for these two.
 *
 * Context: host tests. Errors: none. */
#ifndef TEST_HOST_NETWORK_START_H
#define TEST_HOST_NETWORK_START_H

#include "cli/commands.h"
#include "cli/network.h"
#include "cli/terminal.h"
#include "cli/trial.h"
#include "eeprom/store.h"
#include "host/fakes/bus_port_fake.h"
#include "host/fakes/eeprom_port_fake.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "net/bus.h"
#include "queue/queue.h"
#include "settings.h"

static inline void network_start(uint8_t device_id, uint8_t crc_mode)
{
    terminal_port_fake_reset();
    engine_fake_reset();
    eeprom_fake_reset();
    trial_begin(store_load_settings());
    settings.device_id = device_id;
    settings.crc_mode = crc_mode;
    timebase_fake_step_us = 0;
    bus_port_fake_reset();
    commands_init();
    queue_init();
    terminal_init(STATUS_OK);
    network_init();
    bus_clear();
}

#endif
