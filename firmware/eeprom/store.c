#include "eeprom/store.h"
#include "base/crc16.h"
#include "base/flash.h"
#include "base/inline.h"
#include "eeprom/eeprom_port.h"
#include "settings.h"

enum {
    OTHER_COPY = 64, /* the bit in which the addresses of the copies differ: 0 and 64 */
    QUEUE_FIRST = 192,
    NOT_VALID = 0x00,
    ERASED = 0xFF, /* as every mark with the highest bit: not valid */
    QUEUE_MARK = 0x01, /* at both ends */
    SEQUENCE = 0x3F,   /* of the settings: counted in these bits, */
    SEQUENCE_MARK = 0x40, /* beside this one */
    SETTINGS_BYTES = sizeof(settings_t),
    QUEUE_BYTES = STORE_QUEUE_BYTES + 1,
    CHECKSUM_BYTES = 2,
};
_Static_assert(1 + SETTINGS_BYTES + CHECKSUM_BYTES <= OTHER_COPY, "a copy ends before the next one");
_Static_assert(QUEUE_FIRST + 1 + QUEUE_BYTES + CHECKSUM_BYTES <= EEPROM_BYTES, "all fits in");

/* The newest valid copy of the settings. */
static uint8_t sequence; /* its mark; NOT_VALID: there is none */
static uint8_t newest;   /* its address: 0 or OTHER_COPY */

/* What is to be written: done in this order. */
enum { JOB_ERASE = 1 << 0, JOB_SETTINGS = 1 << 1, JOB_QUEUE = 1 << 2 };
static uint8_t jobs;
static uint16_t at;   /* how far the present job has come in its round */
static uint16_t sum;  /* until there */
static bool changed;  /* something was not right in this round */
static uint8_t tries; /* to write this byte */

static uint8_t change_offset, change_more;
static uint32_t change_value;
static const uint8_t *queue;

static uint16_t first_sum(uint8_t mark)
{
    return (uint16_t)(mark << 8 | STORE_LAYOUT);
}

/* The mark of the record at that address, or NOT_VALID. */
static NOINLINE uint8_t valid_mark(uint8_t first, uint16_t bytes)
{
    const uint8_t mark = eeprom_port_read(first);
    uint16_t crc = first_sum(mark);
    uint16_t address = first;
    for (uint16_t left = bytes + CHECKSUM_BYTES; left > 0; left--) {
        crc = crc16_add(crc, eeprom_port_read(++address));
    }
    return crc == 0 && mark < 0x80 ? mark : NOT_VALID;
}

static uint8_t next_sequence(void)
{
    return (uint8_t)(((sequence + 1) & SEQUENCE) | SEQUENCE_MARK);
}

#ifdef __AVR__
__attribute__((noinline, noclone, used, externally_visible)) /* the tests' board writes settings when it has returned */
#endif
uint8_t store_load_settings(void)
{
    jobs = 0;
    while (eeprom_port_busy()) {
        /* a reset other than a loss of power does not end a write: at most 3.4 ms */
    }
    sequence = valid_mark(OTHER_COPY, SETTINGS_BYTES);
    newest = OTHER_COPY;
    const uint8_t other = valid_mark(0, SETTINGS_BYTES);
    if (other != NOT_VALID && (sequence == NOT_VALID || other == next_sequence())) {
        sequence = other;
        newest = 0;
    }
    for (uint8_t i = 0; i < SETTINGS_BYTES; i++) {
        ((uint8_t *)&settings)[i] = store_setting(i);
    }
    return sequence;
}

uint8_t store_setting(uint8_t i)
{
    return sequence == NOT_VALID ? flash_u8((const uint8_t *)&settings_factory + i)
                                 : eeprom_port_read((uint8_t)(newest + 1 + i));
}

static void begin(uint8_t job)
{
    jobs |= job;
    at = 0;
    tries = 0;
}

status_t store_change(uint8_t offset, uint8_t more, uint32_t value)
{
    if (jobs & (JOB_ERASE | JOB_SETTINGS)) {
        return STATUS_WAIT;
    }
    change_offset = offset;
    change_more = more;
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
    if (mark == ERASED && eeprom_port_read(QUEUE_FIRST + QUEUE_BYTES) == ERASED) {
        return STORE_QUEUE_NONE;
    }
    if (valid_mark(QUEUE_FIRST, QUEUE_BYTES) == NOT_VALID) {
        return STORE_QUEUE_BROKEN;
    }
    uint8_t *bytes = entries;
    for (uint16_t i = QUEUE_FIRST + 1; i < QUEUE_FIRST + QUEUE_BYTES; i++) {
        *bytes++ = eeprom_port_read(i);
    }
    return STORE_QUEUE_SAVED;
}

uint8_t store_busy(void)
{
    return jobs;
}

/* Byte i of the record that the present job writes. */
static NOINLINE uint8_t wanted_byte(uint16_t i)
{
    if (!(jobs & JOB_SETTINGS)) {
        return i < STORE_QUEUE_BYTES ? queue[i] : QUEUE_MARK;
    }
    const uint8_t into_change = (uint8_t)(i - change_offset);
    return into_change <= change_more ? ((const uint8_t *)&change_value)[into_change] : store_setting((uint8_t)i);
}

/* The present job is over. */
static void end_job(void)
{
    jobs = (uint8_t)(jobs & (jobs - 1)); /* the lowest bit */
    at = 0;
    tries = 0;
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

/* The older copy of the settings, then the newer one, each from its mark on; of the snapshot too, that comes first. */
static void erase_on(void)
{
    if (at == EEPROM_BYTES) {
        sequence = NOT_VALID;
        end_job();
    } else {
        put(at ^ (newest ^ OTHER_COPY), ERASED);
    }
}

/* A round: at counts the mark (0: it only begins the sum), the bytes, the checksum; then the mark is written. */
static void save_on(void)
{
    uint8_t first = QUEUE_FIRST, mark = QUEUE_MARK;
    uint16_t bytes = QUEUE_BYTES;
    if (jobs & JOB_SETTINGS) {
        first = newest ^ OTHER_COPY;
        mark = next_sequence();
        bytes = SETTINGS_BYTES;
    }
    if (at == 0) {
        sum = first_sum(mark);
        changed = false;
        at++;
    } else if (at <= bytes + CHECKSUM_BYTES) {
        uint16_t address = first + at;
        uint8_t value = (uint8_t)(sum >> 8);
        if (at <= bytes) {
            value = wanted_byte(at - 1);
        }
        if (eeprom_port_read(address) != value && eeprom_port_read(first) != NOT_VALID) {
            address = first; /* first of all */
            value = NOT_VALID;
        }
        if (put(address, value)) {
            sum = crc16_add(sum, value);
        }
    } else if (changed) {
        at = 0; /* another round */
    } else if (put(first, mark)) {
        if (jobs & JOB_SETTINGS) {
            sequence = mark;
            newest = first;
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
