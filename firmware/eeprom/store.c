#include "eeprom/store.h"
#include "base/crc16.h"
#include "base/flash.h"
#include "base/inline.h"
#include "eeprom/eeprom_port.h"
#include "settings.h"

enum {
    OTHER_COPY = 128, /* the bit in which the addresses of the copies differ: 0 and 128 */
    QUEUE_FIRST = 200,
    NOT_VALID = 0x00,
    ERASED = 0xFF, /* as every mark with the highest bit: not valid */
    QUEUE_MARK = 0x01, /* at both ends */
    SEQUENCE = 0x3F,   /* of the settings: counted in these bits, */
    SEQUENCE_MARK = 0x40, /* beside this one */
    PATH_KEPT = sizeof(settings_t), /* where in a copy the path stands a second time */
    SETTINGS_BYTES = PATH_KEPT + SETTINGS_PATH_BYTES,
    QUEUE_BYTES = STORE_QUEUE_BYTES + 1,
    CHECKSUM_BYTES = 2,
};
_Static_assert(1 + SETTINGS_BYTES + CHECKSUM_BYTES <= OTHER_COPY, "a copy ends before the next one");
_Static_assert(OTHER_COPY + 1 + SETTINGS_BYTES + CHECKSUM_BYTES <= QUEUE_FIRST, "and before the snapshot");
_Static_assert(QUEUE_FIRST + 1 + QUEUE_BYTES + CHECKSUM_BYTES <= EEPROM_BYTES, "all fits in");

static struct store {
    /* What is to be written: done in this order. */
    uint8_t jobs;
    uint8_t tries; /* to write this byte */
    uint16_t at;   /* how far the present job has come in its round */
    uint16_t sum;  /* until there */
    bool changed;  /* something was not right in this round */

    /* The newest valid copy of the settings. */
    uint8_t sequence; /* its mark; NOT_VALID: there is none */
    uint8_t newest;   /* its address: 0 or OTHER_COPY */

    uint8_t change_offset, change_more;
    uint32_t change_value;
    const uint8_t *queue;
    uint8_t path_first; /* from this byte on the record becomes the path in use: as the one kept, or as both */
} the_store;
enum { JOB_ERASE = 1 << 0, JOB_PATH = 1 << 1, JOB_CHANGE = 1 << 2, JOB_QUEUE = 1 << 3 };

/* To be asked for anew after a call, mostly: that is shorter than keeping it. */
static inline struct store *self(void)
{
    struct store *store;
    NEAR_TO(store, the_store);
    return store;
}

static NOINLINE uint16_t first_sum(uint8_t mark)
{
    return (uint16_t)(mark << 8 | STORE_LAYOUT);
}

/* The mark of the record at that address, or NOT_VALID. */
static NOINLINE uint8_t valid_mark(uint8_t first, uint16_t bytes)
{
    uint16_t address = first;
    const uint16_t end = (uint16_t)(first + bytes + CHECKSUM_BYTES);
    const uint8_t mark = eeprom_port_read(address);
    uint16_t crc = first_sum(mark);
    do {
        crc = crc16_add(crc, eeprom_port_read(++address));
    } while (address != end);
    return crc == 0 && mark < 0x80 ? mark : NOT_VALID;
}

/* A byte of a copy to where in settings_t it stands: the path is there once. */
static inline uint8_t in_settings(uint8_t i)
{
    return i < PATH_KEPT ? i : (uint8_t)(i - SETTINGS_PATH_BYTES);
}

/* The bytes of the newest copy from the last one down to that one; so the path kept comes first, then the one stored.
 * True: they differ. */
static NOINLINE bool load_down_to(uint8_t end)
{
    bool differ = false;
    uint8_t i = SETTINGS_BYTES;
    do {
        i--;
        const uint8_t stored = store_setting(i);
        uint8_t *member = (uint8_t *)&settings + in_settings(i);
        if ((uint8_t)(i - SETTINGS_PATH) < SETTINGS_PATH_BYTES && *member != stored) {
            differ = true;
        }
        *member = stored;
    } while (i != end);
    return differ;
}

static NOINLINE uint8_t next_sequence(void)
{
    return (uint8_t)(((the_store.sequence + 1) & SEQUENCE) | SEQUENCE_MARK);
}

#ifdef __AVR__
__attribute__((noinline, noclone, used, externally_visible)) /* the tests' board writes settings when it has returned */
#endif
bool store_load_settings(void)
{
    struct store *const store = self();
    store->jobs = 0;
    while (eeprom_port_busy()) {
        /* a reset other than a loss of power does not end a write: at most 3.4 ms */
    }
    store->sequence = valid_mark(OTHER_COPY, SETTINGS_BYTES);
    store->newest = OTHER_COPY;
    const uint8_t other = valid_mark(0, SETTINGS_BYTES);
    if (other != NOT_VALID && (store->sequence == NOT_VALID || other == next_sequence())) {
        store->sequence = other;
        store->newest = 0;
    }
    return load_down_to(0);
}

uint8_t store_setting(uint8_t i)
{
    struct store *const store = self();
    const uint8_t address = (uint8_t)(store->newest + 1 + i);
    if (store->sequence != NOT_VALID) {
        return eeprom_port_read(address);
    }
    return flash_u8((const uint8_t *)&settings_factory + in_settings(i));
}

/* The first of these jobs begins. */
static NOINLINE void begin(uint8_t jobs)
{
    struct store *const store = self();
    store->jobs = jobs;
    store->at = 0;
    store->tries = 0;
}

static NOINLINE void add_job(uint8_t job)
{
    begin(the_store.jobs | job);
}

status_t store_change(uint8_t offset, uint8_t more, uint32_t value)
{
    struct store *const store = self();
    if (store->jobs & (JOB_ERASE | JOB_CHANGE)) {
        return STATUS_WAIT;
    }
    store->change_offset = offset;
    store->change_more = more;
    store->change_value = value;
    add_job(JOB_CHANGE); /* a save of the queue begins anew afterwards: what it has written is not written twice */
    return STATUS_OK;
}

static NOINLINE void write_path(uint8_t first)
{
    the_store.path_first = first;
    add_job(JOB_PATH);
}

void store_keep_path(void)
{
    write_path(PATH_KEPT);
}

void store_take_back_path(void)
{
    (void)load_down_to(PATH_KEPT);
    write_path(SETTINGS_PATH);
}

void store_restore_factory(void)
{
    begin(JOB_ERASE);
}

void store_save_queue(const void *entries)
{
    the_store.queue = entries;
    add_job(JOB_QUEUE);
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
    return the_store.jobs;
}

/* Byte i of the record that the present job writes. */
static NOINLINE uint8_t wanted_byte(uint16_t i)
{
    struct store *const store = self();
    if (store->jobs == JOB_QUEUE) {
        return i < STORE_QUEUE_BYTES ? store->queue[i] : QUEUE_MARK;
    }
    const uint8_t at = (uint8_t)i;
    const uint8_t into_change = (uint8_t)(at - store->change_offset);
    if (store->jobs & JOB_PATH) {
        if (at >= store->path_first) {
            return ((const uint8_t *)&settings)[in_settings(at)];
        }
    } else if (into_change <= store->change_more) {
        return ((const uint8_t *)&store->change_value)[into_change];
    }
    return store_setting(at);
}

/* The present job is over. */
static void end_job(void)
{
    const uint8_t jobs = the_store.jobs;
    begin((uint8_t)(jobs & (jobs - 1))); /* without the lowest bit */
}

/* Brings a cell to its value: true, and the job goes on, if it has it. */
static bool put(uint16_t address, uint8_t value)
{
    const bool right = eeprom_port_read(address) == value;
    struct store *const store = self();
    if (right) {
        store->at++;
        store->tries = 0;
        return true;
    }
    store->changed = true;
    if (store->tries++ == STORE_TRIES) {
        end_job();
    } else {
        eeprom_port_write(address, value);
    }
    return false;
}

/* The older copy of the settings, then the newer one, each from its mark on; of the snapshot too, that comes first. */
static void erase_on(void)
{
    struct store *const store = self();
    if (store->at == EEPROM_BYTES) {
        store->sequence = NOT_VALID;
        end_job();
    } else {
        put(store->at ^ (store->newest ^ OTHER_COPY), ERASED);
    }
}

/* A round: at counts the mark (0: it only begins the sum), the bytes, the checksum; then the mark is written. */
static void save_on(void)
{
    struct store *const store = self();
    uint8_t first = QUEUE_FIRST, mark = QUEUE_MARK;
    uint16_t bytes = QUEUE_BYTES;
    if (store->jobs != JOB_QUEUE) {
        first = store->newest ^ OTHER_COPY;
        mark = next_sequence();
        bytes = SETTINGS_BYTES;
    }
    if (store->at == 0) {
        store->sum = first_sum(mark);
        store->changed = false;
        store->at++;
    } else if (store->at <= bytes + CHECKSUM_BYTES) {
        uint16_t address = first + store->at;
        uint8_t value = (uint8_t)(store->sum >> 8);
        if (store->at <= bytes) {
            value = wanted_byte(store->at - 1);
        }
        if (eeprom_port_read(address) != value && eeprom_port_read(first) != NOT_VALID) {
            address = first; /* first of all */
            value = NOT_VALID;
        }
        if (put(address, value)) {
            store->sum = crc16_add(store->sum, value);
        }
    } else if (store->changed) {
        store->at = 0; /* another round */
    } else if (put(first, mark)) {
        if (store->jobs != JOB_QUEUE) {
            store->sequence = mark;
            store->newest = first;
        }
        end_job();
    }
}

uint8_t store_poll(void)
{
    if (!store_busy()) {
        return false;
    }
    if (!eeprom_port_busy()) {
        if (the_store.jobs & JOB_ERASE) {
            erase_on();
        } else {
            save_on();
        }
    }
    return true;
}
