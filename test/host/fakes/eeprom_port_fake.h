/* An EEPROM whose power can be cut at any write. */
#ifndef EEPROM_PORT_FAKE_H
#define EEPROM_PORT_FAKE_H

#include <stdbool.h>
#include "eeprom/eeprom_port.h"

typedef struct {
    unsigned char cells[EEPROM_BYTES];
    unsigned writes[EEPROM_BYTES];
    unsigned written;   /* writes in all */
    unsigned unchanged; /* of these, with the value that the cell had */
    unsigned slow;      /* a write is busy for so many questions; 0 at first */
    unsigned busy;      /* of these, how many are still to come */
    int stuck;          /* this cell keeps its value; -1 none */
    long cut_after;     /* the power fails in the write after so many; -1 never */
    unsigned char torn; /* the cell is left so */
    bool off;           /* it has failed: nothing is written any more */
} eeprom_fake_t;

extern eeprom_fake_t eeprom_fake;

void eeprom_fake_reset(void); /* erased; the power does not fail */

#endif
