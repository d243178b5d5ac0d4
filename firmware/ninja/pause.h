/* The pause of P: tenths of a second.
 *
 * Context: main loop. Errors: none. Source: seed lines N63-66. Tests: test/host/test_ninja_commands.c;
 *          test/image/test_ninja_image.c */
#ifndef NINJA_PAUSE_H
#define NINJA_PAUSE_H

#include <stdbool.h>
#include <stdint.h>

void pause_begin(uint16_t tenths); /* 0..65535: 6553.5 s */
void pause_stop(void);
bool pause_runs(void);
bool pause_poll(void); /* true while it lasts: who sleeps sees its end too late */

#endif
