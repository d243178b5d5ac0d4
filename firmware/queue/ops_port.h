/* The pins OPSA and OPSB, and the terminal port for soft ops; implemented by hal/pins.c and hal/ports.c.
 *
 * Context: main loop. Tests: test/host/test_ops.c with a fake; test/image/test_image_ops.c. */
#ifndef QUEUE_OPS_PORT_H
#define QUEUE_OPS_PORT_H

#include <stdbool.h>
#include <stdint.h>

void ops_port_set(bool executing);
void ops_port_send(uint8_t byte); /* if there is room for it */

#endif
