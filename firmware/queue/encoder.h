/* What the encoder does: in STANDBY the motor follows it, a pulse for each line; in continuous motion it is a throttle,
 * 1 RPM for each line. In other motion it does nothing.
 *
 * $n overrides that until the next change between STANDBY and motion: the mode is then the one that does nothing here.
 * Context: main loop. Errors: none.
 * Tests:   test/host/test_encoder.c, test/image/test_image_encoder.c
 * Source:  manual lines 375-377, 642-648, 991; decisions A-ENC-01 to A-ENC-05. */
#ifndef QUEUE_ENCODER_H
#define QUEUE_ENCODER_H

#include <stdbool.h>
#include <stdint.h>

uint8_t encoder_poll(void); /* call often; not 0 if there was something to do */

void encoder_toggle(void); /* $n */

bool encoder_throttles(void); /* the mode in force: throttle (EnT), or follow (EnF) */

#endif
