/* The Estop pin; implemented by hal/step_timer.c and hal/step_isr.S, faked in the host tests.
 *
 * At its falling edge the interrupt ends the pulse train by itself: a pulse that has begun is completed, none begins
 * within 3 us or later (docs/design.md). The main loop does the rest.
 * Context: main loop. Errors: none. Tests: test/image/test_image_estop.c. */
#ifndef MOTION_ESTOP_PORT_H
#define MOTION_ESTOP_PORT_H

#include <stdbool.h>

bool estop_port_active(void); /* the pin is low, or has been since estop_port_poll(): no pulse can begin */

/* The same; with the pin high again it is ready for the next edge afterwards. When it has returned true the engine has to
 * be stopped, before anything else is done with it. */
bool estop_port_poll(void);

#endif
