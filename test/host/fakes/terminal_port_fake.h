/* A serial port whose line the test drains: bytes sent stand in a buffer until terminal_port_fake_drain(). */
#ifndef TERMINAL_PORT_FAKE_H
#define TERMINAL_PORT_FAKE_H

#include <stddef.h>

void terminal_port_fake_reset(void);                   /* nothing typed, nothing sent, line drained at once */
void terminal_port_fake_type(const char *text);        /* appends to what will be received */
void terminal_port_fake_type_byte(unsigned char byte); /* likewise */
size_t terminal_port_fake_untaken(void);               /* how much of it has not been taken */
void terminal_port_fake_press(int press);              /* 1: what was typed counts as waiting in the ring */
void terminal_port_fake_hold(int hold);                /* 1: what is sent fills the 31 places until it is drained */
void terminal_port_fake_drain(size_t bytes);           /* the line has sent so many */
const char *terminal_port_fake_text(void);             /* everything sent since the reset, NUL-terminated */
unsigned terminal_port_fake_sent(void);
void terminal_port_fake_clear(void); /* forgets what was sent */

#endif
