#include "eeprom/store.h"
#include "base/crc16.h"
#include "base/flash.h"
#include "base/inline.h"
#include "eeprom/eeprom_port.h"
#include "settings.h"

/* A record is addressed by an index that counts upward; the copy at the end of the EEPROM lies mirrored. */
#define MIRROR (EEPROM_BYTES - 1u)

enum {
    NOT_VALID = 0x00,
    ERASED = 0xFF,
    QUEUE_MARK = 1, /* at both ends */
    SETTINGS_BYTES = sizeof(settings_t),
    QUEUE_FIRST = 64,
    QUEUE_BYTES = STORE_QUEUE_BYTES + 1,
    QUEUE_END = QUEUE_FIRST + QUEUE_BYTES, /* of its end mark */
    CHECKSUM_BYTES = 2,
};
_Static_assert(1 + SETTINGS_BYTES + CHECKSUM_BYTES <= QUEUE_FIRST, "the first copy ends before the snapshot");
_Static_assert(QUEUE_END + CHECKSUM_BYTES < EEPROM_BYTES - QUEUE_FIRST, "the snapshot ends before the other copy");

/* The newest valid copy of the settings. */
static uint8_t sequence; /* its mark; NOT_VALID: there is none */
static uint16_t mirror;  /* what its indexes are mirrored by: 0 or MIRROR */

/* What is to be written: done in this order. */
enum { JOB_ERASE = 1 << 0, JOB_SETTINGS = 1 << 1, JOB_QUEUE = 1 << 2 };
static uint8_t jobs;
static uint16_t at;   /* how far the present job has come in its round */
static uint16_t sum;  /* until there */
static bool changed;  /* something was not right in this round */
static uint8_t tries; /* to write this byte */

static uint8_t change_offset, change_bytes;
static uint32_t change_value;
static const uint8_t *queue;

static uint8_t read(uint16_t index, uint16_t mirrored)
{
    return eeprom_port_read(index ^ mirrored);
}

/* The mark of a record, or NOT_VALID. */
static NOINLINE uint8_t valid_mark(uint16_t first, uint16_t bytes, uint16_t mirrored)
{
    uint16_t crc = STORE_LAYOUT;
    for (uint16_t i = 0; i < 1 + bytes + CHECKSUM_BYTES; i++) {
        crc = crc16_add(crc, read(first + i, mirrored));
    }
    const uint8_t mark = read(first, mirrored);
    return crc == 0 && mark != ERASED ? mark : NOT_VALID;
}

static uint8_t next_sequence(void)
{
    const uint8_t next = (uint8_t)(sequence + 1);
    return next == ERASED ? 1 : next;
}

#ifdef __AVR__
__attribute__((noinline, noclone, used, externally_visible)) /* the tests' board writes settings when it has returned */
#endif
bool store_load_settings(void)
{
    jobs = 0;
    while (eeprom_port_busy()) {
        /* a reset other than a loss of power does not end a write: at most 3.4 ms */
    }
    sequence = valid_mark(0, SETTINGS_BYTES, MIRROR);
    mirror = MIRROR;
    const uint8_t other = valid_mark(0, SETTINGS_BYTES, 0);
    if (other != NOT_VALID && (sequence == NOT_VALID || other == next_sequence())) {
        sequence = other;
        mirror = 0;
    }
    for (uint8_t i = 0; i < SETTINGS_BYTES; i++) {
        ((uint8_t *)&settings)[i] = store_setting(i);
    }
    return sequence != NOT_VALID;
}

uint8_t store_setting(uint8_t i)
{
    return sequence == NOT_VALID ? flash_u8((const uint8_t *)&settings_factory + i) : read(1u + i, mirror);
}

static void begin(uint8_t job)
{
    jobs |= job;
    at = 0;
    tries = 0;
}

status_t store_change(uint8_t offset, uint8_t bytes, uint32_t value)
{
    if (jobs & (JOB_ERASE | JOB_SETTINGS)) {
        return STATUS_WAIT;
    }
    change_offset = offset;
    change_bytes = bytes;
    change_value = value;
    begin(JOB_SETTINGS); /* a save of the queue begins anew afterwards: what it has written is not written twice */
    return STATUS_OK;
}

void store_restore_factory(void)
{
    jobs = 0;
    begin(JOB_ERASE);
}

void store_save_queue(const void *entries)
{
    queue = entries;
    begin(JOB_QUEUE);
}

store_queue_t store_load_queue(void *entries)
{
    const uint8_t mark = eeprom_port_read(QUEUE_FIRST);
    if (mark == ERASED && eeprom_port_read(QUEUE_END) == ERASED) {
        return STORE_QUEUE_NONE;
    }
    if (valid_mark(QUEUE_FIRST, QUEUE_BYTES, 0) == NOT_VALID) {
        return STORE_QUEUE_BROKEN;
    }
    uint8_t *bytes = entries;
    for (uint16_t i = QUEUE_FIRST + 1; i < QUEUE_END; i++) {
        *bytes++ = eeprom_port_read(i);
    }
    return STORE_QUEUE_SAVED;
}

bool store_busy(void)
{
    return jobs != 0;
}

/* Byte i of the record that the present job writes. */
static uint8_t wanted_byte(uint16_t i)
{
    if (!(jobs & JOB_SETTINGS)) {
        return i < STORE_QUEUE_BYTES ? queue[i] : QUEUE_MARK;
    }
    const uint8_t into_change = (uint8_t)(i - change_offset);
    return into_change < change_bytes ? ((const uint8_t *)&change_value)[into_change] : store_setting((uint8_t)i);
}

/* The present job is over. */
static void end_job(void)
{
    jobs = (uint8_t)(jobs & (jobs - 1)); /* the lowest bit */
    at = 0;
    tries = 0;
}

/* From both ends toward the middle, so that the marks of the settings come first: that of the older copy, then the other
 * one. */
static uint16_t erase_address(uint16_t step)
{
    const uint16_t address = step >> 1;
    return address ^ (step & 1 ? mirror : mirror ^ MIRROR);
}

/* Brings a cell to its value: true, and the job goes on, if it has it. */
static bool put(uint16_t address, uint8_t value)
{
    if (eeprom_port_read(address) == value) {
        at++;
        tries = 0;
        return true;
    }
    changed = true;
    if (tries++ == STORE_TRIES) {
        end_job();
    } else {
        eeprom_port_write(address, value);
    }
    return false;
}

static void erase_on(void)
{
    if (at == EEPROM_BYTES) {
        sequence = NOT_VALID;
        end_job();
    } else {
        put(erase_address(at), ERASED);
    }
}

/* A round: at counts the mark (0: it only begins the sum), the bytes, the checksum; then the mark is written. */
static void save_on(void)
{
    uint16_t first = QUEUE_FIRST, mirrored = 0, bytes = QUEUE_BYTES;
    uint8_t mark = QUEUE_MARK;
    if (jobs & JOB_SETTINGS) {
        first = 0;
        mirrored = mirror ^ MIRROR;
        bytes = SETTINGS_BYTES;
        mark = next_sequence();
    }
    const uint16_t mark_address = first ^ mirrored;
    if (at == 0) {
        sum = crc16_add(STORE_LAYOUT, mark);
        changed = false;
        at++;
    } else if (at <= bytes + CHECKSUM_BYTES) {
        uint16_t address = (first + at) ^ mirrored;
        uint8_t value = (uint8_t)(sum >> 8);
        if (at <= bytes) {
            value = wanted_byte(at - 1);
        }
        if (eeprom_port_read(address) != value && eeprom_port_read(mark_address) != NOT_VALID) {
            address = mark_address; /* first of all */
            value = NOT_VALID;
        }
        if (put(address, value)) {
            sum = crc16_add(sum, value);
        }
    } else if (changed) {
        at = 0; /* another round */
    } else if (put(mark_address, mark)) {
        if (jobs & JOB_SETTINGS) {
            sequence = mark;
            mirror = mirrored;
        }
        end_job();
    }
}

bool store_poll(void)
{
    if (!store_busy()) {
        return false;
    }
    if (!eeprom_port_busy()) {
        if (jobs & JOB_ERASE) {
            erase_on();
        } else {
            save_on();
        }
    }
    return true;
}
