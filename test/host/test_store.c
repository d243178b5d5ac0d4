/* eeprom/store: what outlasts a loss of power at any write, wear, and what is damaged. */
#include "eeprom/store.h"
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "base/crc16.h"
#include "host/fakes/eeprom_port_fake.h"
#include "settings.h"
#include "unity.h"

#define PLACE(member) ((uint8_t)offsetof(settings_t, member))
enum { OTHER_COPY = 128, QUEUE_FIRST = 200, RECORD = 1 + sizeof(settings_t) + SETTINGS_PATH_BYTES + 2 };

static uint8_t entries[STORE_QUEUE_BYTES], loaded[STORE_QUEUE_BYTES];

void setUp(void)
{
    eeprom_fake_reset();
    store_load_settings();
    memset(entries, 0x11, sizeof entries);
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, eeprom_fake.unchanged, "an unchanged byte was written");
}

static void finish(void)
{
    for (int polls = 0; store_poll(); polls++) {
        TEST_ASSERT_LESS_THAN_INT(100000, polls);
    }
    TEST_ASSERT_FALSE(store_busy());
}

static void change(uint8_t offset, uint8_t bytes, uint32_t value)
{
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(offset, bytes - 1, value));
    finish();
}

static void save_queue(uint8_t fill)
{
    memset(entries, fill, sizeof entries);
    store_save_queue(entries);
    finish();
}

/* After a loss of power: the fake writes again. */
static void power_up(void)
{
    eeprom_fake.off = false;
    eeprom_fake.cut_after = -1;
    eeprom_fake.busy = 0;
    memset(&settings, 0xA5, sizeof settings);
    store_load_settings();
}

static void assert_settings(const settings_t *expected)
{
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, &settings, sizeof settings);
}

/* CFG-007, DEF-002, BOO-008 */
static void test_a_change_outlasts_a_loss_of_power(void)
{
    settings_t expected = settings_factory;
    for (uint32_t i = 0; i < 600; i++) { /* the sequence number runs around twice */
        change(PLACE(cycle_us), 4, 0x01020304 * (i & 0x3F) + i);
        change(PLACE(steps_per_rev), 2, 300 + i);
        change(PLACE(autorun), 1, i % 31);
        expected.cycle_us = 0x01020304 * (i & 0x3F) + i;
        expected.steps_per_rev = (uint16_t)(300 + i);
        expected.autorun = (uint8_t)(i % 31);
        power_up();
        assert_settings(&expected);
    }
}

/* CFG-008 */
static void test_a_change_is_read_back_at_once_and_effective_at_the_next_load(void)
{
    const settings_t before = settings;
    change(PLACE(cycle_us), 4, 0x12345678);
    assert_settings(&before);
    TEST_ASSERT_EQUAL_HEX8(0x78, store_setting(PLACE(cycle_us)));
    TEST_ASSERT_EQUAL_HEX8(0x12, store_setting(PLACE(cycle_us) + 3));
    TEST_ASSERT_EQUAL_UINT8(85, store_setting(PLACE(device_id)));
    store_load_settings();
    TEST_ASSERT_EQUAL_HEX32(0x12345678, settings.cycle_us);
}

static void test_a_second_change_is_not_taken_while_the_first_one_is_written(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(PLACE(ustep), 0, 3));
    TEST_ASSERT_EQUAL(STATUS_WAIT, store_change(PLACE(pulse_us), 0, 30));
    TEST_ASSERT_TRUE(store_busy());
    finish();
    store_load_settings();
    TEST_ASSERT_EQUAL_UINT8(3, settings.ustep);
    TEST_ASSERT_EQUAL_UINT8(2, settings.pulse_us);
}

static void test_a_poll_never_waits_for_the_eeprom(void)
{
    eeprom_fake.slow = 1000;
    store_change(PLACE(ustep), 0, 3);
    unsigned polls = 0;
    while (eeprom_fake.written == 0) {
        store_poll();
        polls++;
    }
    const unsigned before = eeprom_fake.busy;
    TEST_ASSERT_TRUE(store_poll());
    TEST_ASSERT_EQUAL_UINT(before - 1, eeprom_fake.busy); /* it asked once */
    TEST_ASSERT_EQUAL_UINT(1, eeprom_fake.written);
}

/* -- loss of power ---------------------------------------------------------------------------------------------------- */

/* Copies of the settings before the cut: how many changes came before, from a blank EEPROM on. */
static void prepare(unsigned changes)
{
    eeprom_fake_reset();
    store_load_settings();
    for (unsigned i = 0; i < changes; i++) {
        change(PLACE(xclk_hz), 4, 0x00A1B2C3 + 0x01010101 * (i & 0x1F));
        change(PLACE(ihd_counts), 1, i & 0x7F);
    }
}

/* CFG-007, BOO-010 */
static void test_a_power_cut_at_any_write_of_a_change_leaves_the_old_or_the_new_settings(void)
{
    static const unsigned starts[] = {0, 1, 2, 31, 32, 33, 62, 63};
    for (unsigned s = 0; s < sizeof starts / sizeof *starts; s++) {
        prepare(starts[s]);
        if (s & 1) {
            change(PLACE(ustep), 1, 1);
        }
        save_queue(0x22);
        store_load_settings();
        const settings_t old = settings;
        settings_t new = old;
        new.cycle_us = 0x7BADCAFE;
        static eeprom_fake_t before;
        before = eeprom_fake;
        change(PLACE(cycle_us), 4, new.cycle_us);
        const unsigned writes = eeprom_fake.written - before.written;
        static uint8_t after[EEPROM_BYTES];
        memcpy(after, eeprom_fake.cells, sizeof after);
        TEST_ASSERT_GREATER_THAN_UINT(7, writes);
        for (unsigned cut = 0; cut < writes; cut++) {
            for (unsigned torn = 0; torn < 256; torn++) { /* old, new, 0xFF and every other value */
                eeprom_fake = before;
                store_load_settings();
                eeprom_fake.cut_after = (long)(before.written + cut);
                eeprom_fake.torn = (uint8_t)torn;
                store_change(PLACE(cycle_us), 3, new.cycle_us);
                while (!eeprom_fake.off) {
                    TEST_ASSERT_TRUE(store_poll());
                }
                power_up();
                if (settings.cycle_us != new.cycle_us) {
                    assert_settings(&old);
                } else {
                    assert_settings(&new);
                }
                TEST_ASSERT_EQUAL(STORE_QUEUE_SAVED, store_load_queue(loaded));
                if (torn % 16 == 0) { /* and the next change goes well */
                    settings_t next = settings;
                    next.sw_baud = 0x1234;
                    change(PLACE(sw_baud), 4, next.sw_baud);
                    power_up();
                    assert_settings(&next);
                }
                eeprom_fake.unchanged = 0; /* what is torn may have been right by chance */
            }
        }
    }
}

static void assert_loaded(uint8_t fill)
{
    for (unsigned i = 0; i < sizeof loaded; i++) {
        TEST_ASSERT_EQUAL_HEX8(fill, loaded[i]);
    }
}

static const uint8_t torn_values[] = {0xFF, 0x00, 0x01, 0x02, 0x33, 0x44, 0x7E, 0x81};
enum { TORN_VALUES = sizeof torn_values };

/* QUE-014, QUE-017, BOO-008 */
static void test_a_power_cut_at_any_write_of_a_snapshot_leaves_the_old_or_the_new_one_or_is_detected(void)
{
    for (int first = 0; first < 2; first++) {
        eeprom_fake_reset();
        store_load_settings();
        change(PLACE(ustep), 1, 5);
        if (!first) {
            save_queue(0x33);
        }
        static eeprom_fake_t before;
        before = eeprom_fake;
        save_queue(0x44);
        const unsigned writes = eeprom_fake.written - before.written;
        TEST_ASSERT_GREATER_OR_EQUAL_UINT(STORE_QUEUE_BYTES, writes);
        unsigned old = 0, new = 0, broken = 0;
        for (unsigned cut = 0; cut < writes; cut++) {
            for (unsigned t = 0; t < TORN_VALUES + 1; t++) {
                eeprom_fake = before;
                store_load_settings();
                eeprom_fake.cut_after = (long)(before.written + cut);
                eeprom_fake.torn = t < TORN_VALUES ? torn_values[t] : (uint8_t)rand();
                store_save_queue(entries);
                while (!eeprom_fake.off) {
                    TEST_ASSERT_TRUE(store_poll());
                }
                power_up();
                TEST_ASSERT_EQUAL_UINT8(5, settings.ustep);
                memset(loaded, 0x99, sizeof loaded);
                const store_queue_t status = store_load_queue(loaded);
                if (status == STORE_QUEUE_SAVED) {
                    if (loaded[0] == 0x33) {
                        old++;
                        assert_loaded(0x33);
                        TEST_ASSERT_FALSE(first);
                    } else {
                        new ++;
                        assert_loaded(0x44);
                    }
                } else {
                    assert_loaded(0x99); /* nothing of it is taken */
                    if (status == STORE_QUEUE_BROKEN) {
                        broken++;
                    } else {
                        TEST_ASSERT_TRUE(first); /* what was saved once is never taken for nothing */
                    }
                }
                eeprom_fake.unchanged = 0;
            }
        }
        TEST_ASSERT_TRUE(first || old > 0);
        TEST_ASSERT_GREATER_THAN_UINT(0, new);
        TEST_ASSERT_GREATER_THAN_UINT(STORE_QUEUE_BYTES, broken);
    }
}

/* DEF-003, BOO-006 */
static void test_a_power_cut_at_any_write_of_a_restore_leaves_the_old_settings_or_the_factorys(void)
{
    for (unsigned copies = 2; copies < 4; copies++) { /* the newest one is either */
        prepare(copies);
        change(PLACE(network), 1, 1);
        if (copies & 1) {
            change(PLACE(ustep), 1, 4);
        }
        save_queue(0x33);
        store_load_settings();
        const settings_t old = settings;
        static eeprom_fake_t before;
        before = eeprom_fake;
        store_restore_factory();
        finish();
        const unsigned writes = eeprom_fake.written - before.written;
        for (unsigned cut = 0; cut < writes; cut++) {
            for (unsigned torn = 0; torn < 256; torn += cut < 2 ? 1 : 51) {
                eeprom_fake = before;
                store_load_settings();
                eeprom_fake.cut_after = (long)(before.written + cut);
                eeprom_fake.torn = (uint8_t)torn;
                store_restore_factory();
                while (!eeprom_fake.off) {
                    TEST_ASSERT_TRUE(store_poll());
                }
                power_up();
                if (settings.network == 1) {
                    assert_settings(&old);
                } else {
                    assert_settings(&settings_factory);
                }
                if (store_load_queue(loaded) == STORE_QUEUE_SAVED) {
                    assert_loaded(0x33);
                }
                eeprom_fake.unchanged = 0;
            }
        }
    }
}

/* DEF-001, DEF-003, BOO-006 */
static void test_a_restore_leaves_the_same_image_whatever_was_there(void)
{
    change(PLACE(network), 1, 1);
    save_queue(0x33);
    store_change(PLACE(ustep), 0, 5); /* dropped */
    store_save_queue(entries);
    store_poll();
    store_restore_factory();
    TEST_ASSERT_EQUAL(STATUS_WAIT, store_change(PLACE(ustep), 0, 5));
    finish();
    TEST_ASSERT_EQUAL_UINT8(0, store_setting(PLACE(network)));
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, eeprom_fake.cells, EEPROM_BYTES);
    TEST_ASSERT_EQUAL(STORE_QUEUE_NONE, store_load_queue(loaded));
    power_up();
    assert_settings(&settings_factory);
    change(PLACE(ustep), 1, 6);
    power_up();
    TEST_ASSERT_EQUAL_UINT8(6, settings.ustep);
}

/* -- damage ----------------------------------------------------------------------------------------------------------- */

/* BOO-010 */
static void test_a_blank_eeprom_and_one_full_of_anything_mean_factory_settings(void)
{
    for (unsigned round = 0; round < 2000; round++) {
        for (unsigned i = 0; i < EEPROM_BYTES; i++) {
            eeprom_fake.cells[i] = round < 256 ? (uint8_t)round : (uint8_t)rand();
        }
        power_up();
        assert_settings(&settings_factory);
        if (round != 0xFF) {
            TEST_ASSERT_EQUAL(STORE_QUEUE_BROKEN, store_load_queue(loaded));
        } else {
            TEST_ASSERT_EQUAL(STORE_QUEUE_NONE, store_load_queue(loaded));
        }
    }
}

/* BOO-010 */
static void test_a_damaged_byte_in_the_newer_copy_brings_the_older_one_in_both_the_factorys(void)
{
    change(PLACE(ustep), 1, 3);
    change(PLACE(ustep), 1, 4); /* in the other copy */
    static eeprom_fake_t before;
    before = eeprom_fake;
    for (unsigned i = 0; i < RECORD; i++) {
        for (unsigned bits = 1; bits < 256; bits++) {
            eeprom_fake = before;
            eeprom_fake.cells[OTHER_COPY + i] ^= (uint8_t)bits;
            power_up();
            TEST_ASSERT_EQUAL_UINT8(3, settings.ustep);
            eeprom_fake.cells[i] ^= (uint8_t)bits;
            power_up();
            assert_settings(&settings_factory);
        }
    }
}

static void test_a_damaged_byte_in_the_snapshot_is_found(void)
{
    save_queue(0x33);
    for (unsigned i = 0; i < 1 + STORE_QUEUE_BYTES + 1 + 2; i++) {
        for (unsigned bits = 1; bits < 256; bits++) {
            eeprom_fake.cells[QUEUE_FIRST + i] ^= (uint8_t)bits;
            TEST_ASSERT_EQUAL(STORE_QUEUE_BROKEN, store_load_queue(loaded));
            eeprom_fake.cells[QUEUE_FIRST + i] ^= (uint8_t)bits;
        }
    }
    TEST_ASSERT_EQUAL(STORE_QUEUE_SAVED, store_load_queue(loaded));
}

/* BOO-010 */
static void test_a_record_of_another_layout_means_factory_settings(void)
{
    change(PLACE(ustep), 1, 3);
    for (uint16_t layout = 0; layout < 256; layout++) {
        uint16_t sum = (uint16_t)(eeprom_fake.cells[0] << 8 | layout);
        for (unsigned i = 1; i < RECORD - 2; i++) {
            sum = crc16_add(sum, eeprom_fake.cells[i]);
        }
        eeprom_fake.cells[RECORD - 2] = (uint8_t)(sum >> 8);
        eeprom_fake.cells[RECORD - 1] = (uint8_t)sum;
        power_up();
        TEST_ASSERT_EQUAL_UINT8(layout == STORE_LAYOUT ? 3 : 0, settings.ustep);
    }
}

/* The checksum's definition, from its catalogue. */
static void test_the_checksum_is_ccitts(void)
{
    uint16_t sum = 0xFFFF;
    for (const char *c = "123456789"; *c != '\0'; c++) {
        sum = crc16_add(sum, (uint8_t)*c);
    }
    TEST_ASSERT_EQUAL_HEX16(0x29B1, sum);
    TEST_ASSERT_EQUAL_HEX16(0, crc16_add(crc16_add(sum, 0x29), 0xB1));
}

/* -- wear ------------------------------------------------------------------------------------------------------------- */

static void test_a_change_writes_what_differs_and_nothing_else(void)
{
    change(PLACE(ustep), 1, 3);
    change(PLACE(ustep), 1, 4);
    memset(eeprom_fake.writes, 0, sizeof eeprom_fake.writes);
    change(PLACE(ustep), 1, 5);
    TEST_ASSERT_EQUAL_UINT(2, eeprom_fake.writes[0]); /* the mark: not valid, then valid */
    TEST_ASSERT_EQUAL_UINT(1, eeprom_fake.writes[1 + PLACE(ustep)]);
    for (unsigned i = 1; i < EEPROM_BYTES; i++) {
        TEST_ASSERT_LESS_OR_EQUAL_UINT(i == 1u + PLACE(ustep) || i == RECORD - 2 || i == RECORD - 1, eeprom_fake.writes[i]);
    }
}

/* The cell that wears most: the mark, once for each save on average. */
static void test_the_copies_take_turns(void)
{
    prepare(1);
    memset(eeprom_fake.writes, 0, sizeof eeprom_fake.writes);
    for (unsigned i = 0; i < 1000; i++) {
        change(PLACE(ustep), 1, i & 7);
    }
    for (unsigned i = 0; i < EEPROM_BYTES; i++) {
        TEST_ASSERT_LESS_OR_EQUAL_UINT(1000, eeprom_fake.writes[i]);
    }
    TEST_ASSERT_EQUAL_UINT(1000, eeprom_fake.writes[0]);
    TEST_ASSERT_EQUAL_UINT(1000, eeprom_fake.writes[OTHER_COPY]);
}

static void test_a_snapshot_that_is_saved_again_writes_nothing_and_an_entry_that_changed_itself_alone(void)
{
    save_queue(0x33);
    const unsigned before = eeprom_fake.written;
    save_queue(0x33);
    TEST_ASSERT_EQUAL_UINT(before, eeprom_fake.written);
    entries[100] = 0x34;
    store_save_queue(entries);
    finish();
    TEST_ASSERT_LESS_OR_EQUAL_UINT(before + 1 + 2 + 2, eeprom_fake.written); /* it, checksum, mark twice */
    TEST_ASSERT_EQUAL(STORE_QUEUE_SAVED, store_load_queue(loaded));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(entries, loaded, sizeof loaded);
}

static void test_a_cell_that_is_worn_out_ends_the_save_and_is_no_valid_record(void)
{
    for (unsigned i = 0; i < RECORD; i++) {
        eeprom_fake_reset();
        store_load_settings();
        change(PLACE(ustep), 1, 3);
        change(PLACE(cycle_us), 4, 0x01020304);
        eeprom_fake.stuck = (int)i; /* in the copy to be written next */
        change(PLACE(cycle_us), 4, 0xF1F2F3F4);
        power_up();
        TEST_ASSERT_EQUAL_UINT8(3, settings.ustep);
        TEST_ASSERT_TRUE(settings.cycle_us == 0x01020304 || settings.cycle_us == 0xF1F2F3F4);
        TEST_ASSERT_TRUE(eeprom_fake.writes[i] <= 2 + STORE_TRIES);
        eeprom_fake.unchanged = 0;
    }
}

/* -- both ------------------------------------------------------------------------------------------------------------- */

/* QUE-017 */
static void test_an_entry_that_is_edited_while_it_is_saved_is_whole(void)
{
    enum { ENTRY = 18 };
    for (unsigned every = 1; every < 60; every++) {
        memset(entries, 0, sizeof entries);
        store_save_queue(entries);
        for (unsigned i = 0; i < 4000 && store_poll(); i++) {
            if (i % every == 0) {
                memset(entries + ENTRY * (rand() % 30), rand(), ENTRY);
            }
        }
        finish();
        TEST_ASSERT_EQUAL(STORE_QUEUE_SAVED, store_load_queue(loaded));
        for (unsigned i = 0; i < sizeof loaded; i += ENTRY) {
            for (unsigned k = 1; k < ENTRY; k++) {
                TEST_ASSERT_EQUAL_HEX8(loaded[i], loaded[i + k]);
            }
        }
    }
}

static void test_a_change_comes_before_the_rest_of_a_snapshot(void)
{
    memset(entries, 0x55, sizeof entries);
    store_save_queue(entries);
    for (int i = 0; i < 700; i++) {
        store_poll();
    }
    const unsigned before = eeprom_fake.written;
    TEST_ASSERT_GREATER_THAN_UINT(100, before);
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(PLACE(ustep), 0, 3));
    TEST_ASSERT_EQUAL(STATUS_WAIT, store_change(PLACE(ustep), 0, 4));
    while (store_change(PLACE(pulse_us), 0, 4) == STATUS_WAIT) {
        store_poll();
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT(before + RECORD + 1, eeprom_fake.written);
    finish();
    power_up();
    TEST_ASSERT_EQUAL_UINT8(3, settings.ustep);
    TEST_ASSERT_EQUAL_UINT8(4, settings.pulse_us);
    TEST_ASSERT_EQUAL(STORE_QUEUE_SAVED, store_load_queue(loaded));
    assert_loaded(0x55);
}

/* BOO-009 */
static void test_the_records_do_not_touch_each_other(void)
{
    static uint8_t by_settings[EEPROM_BYTES];
    for (unsigned i = 0; i < sizeof(settings_t); i++) {
        change((uint8_t)i, 1, 0xFFu ^ store_setting((uint8_t)i));
        change((uint8_t)i, 1, 0xFFu ^ store_setting((uint8_t)i));
    }
    for (unsigned i = 0; i < EEPROM_BYTES; i++) {
        by_settings[i] = eeprom_fake.writes[i] != 0;
        eeprom_fake.writes[i] = 0;
    }
    save_queue(0x12);
    save_queue(0xED);
    for (unsigned i = 0; i < EEPROM_BYTES; i++) {
        TEST_ASSERT_FALSE(by_settings[i] && eeprom_fake.writes[i]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_change_outlasts_a_loss_of_power);
    RUN_TEST(test_a_change_is_read_back_at_once_and_effective_at_the_next_load);
    RUN_TEST(test_a_second_change_is_not_taken_while_the_first_one_is_written);
    RUN_TEST(test_a_poll_never_waits_for_the_eeprom);
    RUN_TEST(test_a_power_cut_at_any_write_of_a_change_leaves_the_old_or_the_new_settings);
    RUN_TEST(test_a_power_cut_at_any_write_of_a_snapshot_leaves_the_old_or_the_new_one_or_is_detected);
    RUN_TEST(test_a_power_cut_at_any_write_of_a_restore_leaves_the_old_settings_or_the_factorys);
    RUN_TEST(test_a_restore_leaves_the_same_image_whatever_was_there);
    RUN_TEST(test_a_blank_eeprom_and_one_full_of_anything_mean_factory_settings);
    RUN_TEST(test_a_damaged_byte_in_the_newer_copy_brings_the_older_one_in_both_the_factorys);
    RUN_TEST(test_a_damaged_byte_in_the_snapshot_is_found);
    RUN_TEST(test_a_record_of_another_layout_means_factory_settings);
    RUN_TEST(test_the_checksum_is_ccitts);
    RUN_TEST(test_a_change_writes_what_differs_and_nothing_else);
    RUN_TEST(test_the_copies_take_turns);
    RUN_TEST(test_a_snapshot_that_is_saved_again_writes_nothing_and_an_entry_that_changed_itself_alone);
    RUN_TEST(test_a_cell_that_is_worn_out_ends_the_save_and_is_no_valid_record);
    RUN_TEST(test_an_entry_that_is_edited_while_it_is_saved_is_whole);
    RUN_TEST(test_a_change_comes_before_the_rest_of_a_snapshot);
    RUN_TEST(test_the_records_do_not_touch_each_other);
    return UNITY_END();
}
