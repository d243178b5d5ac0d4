/* An encoder that the test turns by whole lines. */
#ifndef ENCODER_PORT_FAKE_H
#define ENCODER_PORT_FAKE_H

#include <stdint.h>

extern int8_t encoder_port_fake_lines; /* not taken yet */

#endif
