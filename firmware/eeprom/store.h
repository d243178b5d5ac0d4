/* What outlasts a loss of power: the settings, in two copies, and a snapshot of the queue. With the settings, the path
 * (settings.h) is kept a second time: as it was when somebody was last known to reach the unit.
 *
 * Nothing waits for the EEPROM: store_poll() writes a byte at a time. A byte that is right already is not written.
 *
 *   address   what                       as
 *   0, 128    two copies of the settings   mark, settings_t, path kept, checksum
 *   200       the snapshot                 mark, 30 entries of 18 bytes, end mark, checksum
 *
 * A mark of 0, 0x80 or more says that its record is not valid; it becomes 0 before anything else of the record is
 * written, and is written last. So whatever a loss of power leaves in the one byte being written, a record is either whole or known
 * not to be. The mark of the settings has their sequence number: the copy that was written last counts, the other one is
 * overwritten. The checksum begins with mark and STORE_LAYOUT: a record of another layout is not valid.
 * A save ends when a round over all its bytes found nothing to be written: what changed meanwhile is in it, entries are
 * whole, and all bytes have been read back.
 * Context: main loop.
 * Errors:  no valid copy: factory settings. A cell that does not take its value ends the save after STORE_TRIES; the
 *          record stays marked as not valid.
 * Tests:   test/host/test_store.c (power cut at every write), test/image/test_image_configure.c
 * Source:  manual lines 306, 347-353, 682, 846-850; decisions 0.3.6, 0.3.7. */
#ifndef EEPROM_STORE_H
#define EEPROM_STORE_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"

#define STORE_LAYOUT 2 /* counted up when a record changes */
#define STORE_QUEUE_BYTES (30u * 18u)
#define STORE_TRIES 4u

/* At boot and at a warm reset: the settings become what is stored, or the factory's without a valid copy. True: their
 * path is not the one that is kept. Drops what is being written; nothing else of this module may be called before. */
bool store_load_settings(void);

/* Byte i of the settings as they are stored, valid from the next reset on: not while store_busy(). */
uint8_t store_setting(uint8_t i);

/* Stores value at that offset in settings_t, the lowest byte first and so many more (0..3). STATUS_WAIT: not taken, a
 * change is being written. */
status_t store_change(uint8_t offset, uint8_t more, uint32_t value);

/* The path in use is the one to be kept. What is stored stays: it may be a next one. */
void store_keep_path(void);

/* The path becomes the one that is kept, in the settings in use and in the stored ones. Not while store_busy(). */
void store_take_back_path(void);

/* Erases everything: factory settings, no snapshot. What is being written is dropped. */
void store_restore_factory(void);

/* Saves STORE_QUEUE_BYTES from there, which stays where it is; called again during a save, it begins anew. */
void store_save_queue(const void *entries);

typedef enum {
    STORE_QUEUE_NONE,   /* none was ever saved */
    STORE_QUEUE_SAVED,
    STORE_QUEUE_BROKEN, /* damaged, or its save was interrupted */
} store_queue_t;

/* Fills entries if the snapshot is whole. Takes about 4 ms. Not while store_busy(). */
store_queue_t store_load_queue(void *entries);

uint8_t store_busy(void); /* not 0: something is being written */

uint8_t store_poll(void); /* writes on; not 0 while store_busy(): call again without sleeping */

#endif
