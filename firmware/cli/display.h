/* The displays: tables and lists, printed piece by piece as the port takes them, so that nothing waits for the line.
 *
 * Nothing is displayed for a line from the network. A display that is asked for while another is printed waits for its
 * turn; up to DISPLAY_WAITING can wait. What a display shows of the session and the time is that of the moment it begins;
 * the queue is read row by row.
 * Every row ends with CR LF; the prompt is the terminal's business.
 * Context: main loop. Cost: one piece, at most 24 characters, each call.
 * Errors:  STATUS_BUSY: too many are waiting; this one is not taken.
 * Tests:   test/host/test_display.c
 * Source:  requirements, annex E (queue); manual lines 286, 624, 929-935. */
#ifndef CLI_DISPLAY_H
#define CLI_DISPLAY_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"
#include "motion/command.h"

typedef enum {
    DISPLAY_QUEUE,    /* q */
    DISPLAY_DEFAULTS, /* cf */
    DISPLAY_VELOCITY, /* vd */
    DISPLAY_POSITION, /* p */
    DISPLAY_HELP,     /* ? */
    DISPLAY_ARRAY,    /* xd */
    DISPLAY_NETWORK,  /* cn */
    DISPLAY_CONFIGURE, /* $C, cc; from here on: what is stored, when nothing is being written */
    DISPLAY_EEPROM,    /* $E */
    DISPLAY_ROW = 32, /* and a position: one row of the queue */
    DISPLAYS
} display_t;

#define DISPLAY_WAITING 4

void display_init(void);
status_t display_request(display_t display);
bool display_active(void); /* something is being printed or waits */
void display_put_accel(accel_code_t code);
bool display_poll(void);   /* prints the next piece; true if it did, or waits for what is being stored */

#endif
