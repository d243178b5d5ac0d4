/* The EEPROM's 1,024 bytes in a file of the same 1,024 bytes.
 *
 * Errors:  functions that fail print the reason on stderr and return false; the file then is as it was before.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_EEPROM_FILE_H
#define SACSIM_EEPROM_FILE_H

#include <stdbool.h>
#include <stdint.h>

#include "test/board/board.h"

typedef struct {
    char *path; /* with symbolic links followed, so that saving replaces the file and not the link */
    uint8_t saved[BOARD_EEPROM_BYTES];
} eeprom_file_t;

/* Reads the file into f->saved; a missing one is made, erased (all 0xFF). */
bool eeprom_file_open(eeprom_file_t *f, const char *path);

/* Writes the cells if they differ from what the file holds: into a new file beside it, which then takes its name, so
 * that the file is always complete. */
bool eeprom_file_save(eeprom_file_t *f, const uint8_t *cells);

void eeprom_file_close(eeprom_file_t *f);

#endif
