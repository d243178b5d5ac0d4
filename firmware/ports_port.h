/* Both serial ports, their rates and roles; implemented by hal/ports.c.
 *
 * Context: main loop. Errors: none. Tests: test/image/test_image_bus.c */
#ifndef PORTS_PORT_H
#define PORTS_PORT_H

#include <stdbool.h>

/* At boot and after $R: rates and roles as the settings say (hw_baud, sw_baud, network). A port that stays as it is goes
 * on undisturbed. */
void ports_init(void);

/* The software port awaits no start edge: since boot, or step_port_hurry(), or because a byte is being received. */
bool ports_deaf(void);
void ports_listen(void); /* it does again, after that byte */

#endif
