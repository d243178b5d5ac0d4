/* cli/trial: the minute of a new path, at any moment of the clock, and what is kept of it. Decisions 0.3.7. */
#include "cli/trial.h"
#include <stddef.h>
#include "cli/terminal_port.h"
#include "eeprom/store.h"
#include "host/fakes/eeprom_port_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "settings.h"
#include "unity.h"

#define PLACE(member) ((uint8_t)offsetof(settings_t, member))
#define MINUTE_US 60000000u

static void finish(void)
{
    while (store_poll()) {
        TEST_ASSERT_FALSE(trial_failed()); /* it waits for what is being written */
    }
}

static void change(uint8_t offset, uint8_t bytes, uint32_t value)
{
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(offset, bytes - 1, value));
    finish();
}

static void restart(void)
{
    trial_begin(store_load_settings());
}

void setUp(void)
{
    eeprom_fake_reset();
    terminal_port_fake_reset();
    terminal_port_fake_press(1);
    timebase_fake_us = 0;
    timebase_fake_step_us = 0;
    restart();
}

void tearDown(void) {}

/* Polled every millisecond, as the main loop is woken; returns when it failed, or 0. */
static uint32_t fails_after_us(uint32_t most_us)
{
    const uint32_t start = timebase_fake_us;
    while (timebase_fake_us - start < most_us) {
        if (trial_failed()) {
            return timebase_fake_us - start;
        }
        timebase_fake_us += 1000;
    }
    return 0;
}

static void assert_stored_and_in_effect(uint32_t hw_baud)
{
    finish();
    TEST_ASSERT_EQUAL_UINT32(hw_baud, settings.hw_baud);
    restart();
    TEST_ASSERT_EQUAL_UINT32(hw_baud, settings.hw_baud);
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_FALSE(trial_on());
}

static void test_without_a_new_path_there_is_no_trial(void)
{
    change(PLACE(ustep), 1, 3);
    restart();
    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(2 * MINUTE_US));
    TEST_ASSERT_FALSE(trial_on());
}

/* A change is none before it is in effect. */
static void test_there_is_no_trial_before_the_restart(void)
{
    change(PLACE(hw_baud), 4, 250000);
    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(2 * MINUTE_US));
    TEST_ASSERT_FALSE(trial_on());
}

/* Also across the wraps of the clock, which come every 67 s and every 72 minutes. */
static void test_an_unconfirmed_path_is_taken_back_after_a_minute_whenever_it_begins(void)
{
    for (uint32_t i = 0; i < 300; i++) {
        change(PLACE(hw_baud), 4, 250000);
        change(PLACE(slow_rpm), 1, 20);
        timebase_fake_us = 0u - 2 * MINUTE_US + i * 777777;
        restart();
        TEST_ASSERT_EQUAL_UINT32(250000, settings.hw_baud);
        const uint32_t us = fails_after_us(2 * MINUTE_US);
        TEST_ASSERT_UINT32_WITHIN(300000, MINUTE_US, us);
        assert_stored_and_in_effect(38400);
        TEST_ASSERT_EQUAL_UINT8(20, settings.slow_rpm);
    }
}

static void test_a_confirmed_path_stays(void)
{
    change(PLACE(hw_baud), 4, 250000);
    restart();
    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(MINUTE_US - 1000000));
    TEST_ASSERT_TRUE(trial_on());
    trial_confirm();
    TEST_ASSERT_FALSE(trial_on());
    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(2 * MINUTE_US));
    assert_stored_and_in_effect(250000);
}

/* What stood in the ring at the restart came by the path before. */
static void test_the_trial_begins_when_what_had_arrived_is_taken(void)
{
    change(PLACE(hw_baud), 4, 250000);
    terminal_port_fake_type("p\r");
    restart();
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_FALSE(trial_on());
    (void)terminal_port_get();
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_FALSE(trial_on());
    (void)terminal_port_get();
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_TRUE(trial_on());
}

/* ... and a line among it that waits for the EEPROM too. */
static void test_the_trial_does_not_begin_while_something_is_written(void)
{
    change(PLACE(hw_baud), 4, 250000);
    restart();
    TEST_ASSERT_EQUAL(STATUS_OK, store_change(PLACE(ustep), 0, 3));
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_FALSE(trial_on());
    finish();
    TEST_ASSERT_FALSE(trial_failed());
    TEST_ASSERT_TRUE(trial_on());
}

static void test_a_restart_begins_the_minute_anew(void)
{
    change(PLACE(hw_baud), 4, 250000);
    for (unsigned i = 0; i < 5; i++) {
        restart();
        TEST_ASSERT_EQUAL_UINT32(250000, settings.hw_baud);
        TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(MINUTE_US - 1000000));
    }
    TEST_ASSERT_NOT_EQUAL(0, fails_after_us(2 * MINUTE_US));
    assert_stored_and_in_effect(38400);
}

/* E, M, m and n alike, alone or together; all others stay. */
static void test_each_parameter_of_the_path_is_taken_back_and_no_other(void)
{
    static const struct {
        uint8_t place, bytes;
        uint32_t value;
    } path[] = {{PLACE(network), 1, 1}, {PLACE(device_id), 1, 99}, {PLACE(hw_baud), 4, 1234567}, {PLACE(sw_baud), 4, 9600}};
    for (unsigned which = 0; which < 16; which++) {
        for (uint8_t i = 0; i < PLACE(network); i++) {
            change(i, 1, which + i);
        }
        for (unsigned i = 0; i < 4; i++) {
            if (which & 1u << i) {
                change(path[i].place, path[i].bytes, path[i].value);
            }
        }
        restart();
        TEST_ASSERT_EQUAL(which != 0, fails_after_us(2 * MINUTE_US) != 0);
        finish();
        restart();
        TEST_ASSERT_EQUAL_MEMORY((const uint8_t *)&settings_factory + SETTINGS_PATH, (uint8_t *)&settings + SETTINGS_PATH,
                                 SETTINGS_PATH_BYTES);
        for (uint8_t i = 0; i < PLACE(network); i++) {
            TEST_ASSERT_EQUAL_UINT8(which + i, ((uint8_t *)&settings)[i]);
        }
    }
}

/* The line that confirms one path may be the one that sets the next; or that was set before, right behind the restart. */
static void test_a_path_that_is_set_before_the_last_one_is_kept_is_tried_next(void)
{
    for (unsigned before = 0; before < 2; before++) {
        change(PLACE(hw_baud), 4, 250000);
        restart();
        TEST_ASSERT_EQUAL(STATUS_OK, store_change(PLACE(hw_baud), 3, 9600));
        if (before) {
            finish();
        }
        trial_confirm();
        finish();
        restart();
        TEST_ASSERT_EQUAL_UINT32(9600, settings.hw_baud);
        TEST_ASSERT_NOT_EQUAL(0, fails_after_us(2 * MINUTE_US));
        assert_stored_and_in_effect(250000);
    }
}

static void test_restored_factory_settings_are_not_on_trial(void)
{
    change(PLACE(hw_baud), 4, 250000);
    restart();
    store_restore_factory();
    settings_to_factory();
    trial_begin(false);
    finish();
    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(2 * MINUTE_US));
    assert_stored_and_in_effect(38400);
}

/* What is left is tried for another minute, or is what it was to become. */
static void test_a_power_cut_at_any_write_leaves_no_path_that_nobody_confirmed(void)
{
    static const uint8_t torn[] = {0xFF, 0x00, 0x40, 0x55, 0x7F, 0x80};
    for (unsigned confirmed = 0; confirmed < 2; confirmed++) {
        eeprom_fake_reset();
        restart();
        change(PLACE(hw_baud), 4, 250000);
        change(PLACE(ustep), 1, 5);
        restart();
        static eeprom_fake_t before;
        before = eeprom_fake;
        unsigned cut = 0;
        for (bool all_written = false; !all_written; cut++) {
            for (unsigned i = 0; i < sizeof torn; i++) {
                eeprom_fake = before;
                restart();
                TEST_ASSERT_EQUAL_UINT32(250000, settings.hw_baud);
                eeprom_fake.cut_after = (long)(before.written + cut);
                eeprom_fake.torn = torn[i];
                if (confirmed) {
                    trial_confirm();
                } else {
                    store_take_back_path();
                }
                while (!eeprom_fake.off && store_poll()) {
                }
                all_written = !eeprom_fake.off;
                eeprom_fake.off = false;
                eeprom_fake.cut_after = -1;
                restart();
                TEST_ASSERT_EQUAL_UINT8(5, settings.ustep);
                const bool tried = settings.hw_baud == 250000 && !confirmed;
                TEST_ASSERT_EQUAL_UINT32(confirmed || tried ? 250000 : 38400, settings.hw_baud);
                if (tried) {
                    TEST_ASSERT_FALSE(all_written);
                    TEST_ASSERT_NOT_EQUAL(0, fails_after_us(2 * MINUTE_US));
                    assert_stored_and_in_effect(38400);
                } else if (!confirmed || all_written) {
                    TEST_ASSERT_EQUAL_UINT32(0, fails_after_us(2 * MINUTE_US));
                }
            }
        }
        TEST_ASSERT_GREATER_OR_EQUAL_UINT(1 + 3 + 2 + 1, cut); /* mark, the rate's bytes, checksum, mark */
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_new_path_there_is_no_trial);
    RUN_TEST(test_there_is_no_trial_before_the_restart);
    RUN_TEST(test_an_unconfirmed_path_is_taken_back_after_a_minute_whenever_it_begins);
    RUN_TEST(test_a_confirmed_path_stays);
    RUN_TEST(test_the_trial_begins_when_what_had_arrived_is_taken);
    RUN_TEST(test_the_trial_does_not_begin_while_something_is_written);
    RUN_TEST(test_a_restart_begins_the_minute_anew);
    RUN_TEST(test_each_parameter_of_the_path_is_taken_back_and_no_other);
    RUN_TEST(test_a_path_that_is_set_before_the_last_one_is_kept_is_tried_next);
    RUN_TEST(test_restored_factory_settings_are_not_on_trial);
    RUN_TEST(test_a_power_cut_at_any_write_leaves_no_path_that_nobody_confirmed);
    return UNITY_END();
}
