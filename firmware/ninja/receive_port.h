/* The serial line, 4,800 baud, 8N1; implemented by hal/receive.c with USART0, whose transmitter stays off.
 *
 * Context: main loop. Errors: a damaged byte reads as 0xFF, which is no character of any command.
 * Tests:   test/image/test_ninja_image.c. Source: seed lines N1-4, N11-13; decisions 0.5. */
#ifndef NINJA_RECEIVE_PORT_H
#define NINJA_RECEIVE_PORT_H

#include <stdbool.h>
#include <stdint.h>

#define RECEIVE_BACKSPACE 0x08
#define RECEIVE_CTRL_R 0x12

void receive_port_init(void);

/* The oldest byte received, or -1. Where a backspace or Ctrl-R waits among them, motion has been halted on return. */
int16_t receive_port_get(void);

/* One of these waits. In the step interrupt, too. */
bool receive_port_halts(void);

#endif
