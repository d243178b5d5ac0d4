/* The quadrature encoder on EnA and EnB; implemented by hal/encoder.c.
 *
 * Units:   lines: one for each whole period of the two signals (x1), clockwise positive: then EnA goes before EnB. A
 *          line counts when its fourth edge is through, and the one back likewise: edges that bounce count nothing.
 * Context: main loop. An edge raises wake_flag.
 * Errors:  none. Two edges at once are none. Lines are lost where more than 31 come between two calls.
 * Tests:   test/host/fakes/encoder_port_fake.c; test/image/test_image_encoder.c
 * Source:  manual lines 375, 642-648. */
#ifndef QUEUE_ENCODER_PORT_H
#define QUEUE_ENCODER_PORT_H

#include <stdint.h>

void encoder_init(void); /* from where it stands */

int8_t encoder_take(void); /* the lines since the last call */

#endif
