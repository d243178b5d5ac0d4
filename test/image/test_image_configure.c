/* CFG, DEF, BOO on the whole image: what is configured outlasts resets and losses of power. */
#include "image.h"

#include <stdio.h>
#include <string.h>

#define WRITTEN (250 * MS) /* by then a change has been stored, even in a blank copy: 56 bytes of 3.4 ms */

static const char factory_screen[] = "Config:\r\n"
                                     "A autorun\t0\ta sprf\t\t200\r\n"
                                     "B ramp\t\t0\tb cycle\t\t3000\r\n"
                                     "C clock\t\t1\tc xfreq\t\t1000000\r\n"
                                     "D\t\t\td acc\t\t1.00\r\n"
                                     "E network\t0\te dec\t\t1.00\r\n"
                                     "F cw\t\t0\tf l_acc\t\t10.47\r\n"
                                     "G dir\t\tCW\tg l_dec\t\t10.47\r\n"
                                     "H ihd\t\t0\th ops\t\t100100\r\n"
                                     "I xclk\t\t0\ti soft_ops\t0\r\n"
                                     "J ustep\t\t0\tj ACK\t\t1\r\n"
                                     "K pulse\t\t2\tk CRC\t\t1\r\n"
                                     "L slow\t\t10\r\n"
                                     "M d_id\t\t85\tm hw\t\t38400\r\n"
                                     "N r_id\t\t0\tn sw\t\t38400\r\n";

void setUp(void)
{
    image_boot();
}

void tearDown(void)
{
    image_off();
}

/* Off and on again after so many cycles; the EEPROM keeps what it holds, a write that is going on is torn. */
static void power_cycle_after(uint64_t cycles)
{
    board_eeprom_cut_at(board, board_cycle(board) + cycles);
    image_run(cycles + 1);
    image_boot_again();
}

static void power_cycle(void)
{
    power_cycle_after(1);
}

static void reset(void)
{
    board_reset(board, BOARD_RESET_EXTERNAL);
    image_boot_again();
}

static void boot_with(const uint8_t *eeprom)
{
    image_off();
    image_power_on_with(eeprom);
    image_prompt();
}

static void assert_shown(const char *part)
{
    image_assert_holds(image_display("cc"), part);
}

/* CFG-001, CFG-002, CFG-016, CFG-032, CFG-040, SYS-003 */
static void test_the_screen_of_a_blank_unit_is_that_of_the_annex(void)
{
    TEST_ASSERT_EQUAL_STRING(factory_screen, image_display("$C"));
}

/* CFG-003, CFG-004, CFG-005 */
static void test_in_the_screen_values_are_set_until_x(void)
{
    image_ask("$C");
    image_assert_holds(image_display("a400"), "A autorun\t0\ta sprf\t\t400\r\n");
    image_assert_holds(image_display("A8"), "A autorun\t8\ta sprf\t\t400\r\n");
    image_refused("m200z", "?2 syntax");
    image_refused("K0", "?12 range 1..255");
    image_do("S");
    image_do("x");
    image_train_clear();
    image_do("m7v2000a999d999");
    image_idle(SECOND);
    image_assert_pulses(7);
}

/* CFG-006, CFG-007, CFG-008, CFG-012, CFG-027, DEF-002, SYS-003 */
static void test_a_value_is_stored_at_once_and_effective_after_a_reset(void)
{
    image_do("$CA8");
    image_do("$Ca400");
    image_do("$Cd1.25");
    image_run(WRITTEN);
    image_assert_holds(image_display("cf"), "a 1.00 d 1.00"); /* not yet */
    assert_shown("A autorun\t8\ta sprf\t\t400\r\n");
    reset();
    assert_shown("A autorun\t8\ta sprf\t\t400\r\n");
    assert_shown("d acc\t\t1.25\r\n");
    image_assert_holds(image_display("cf"), "a 1.25 d 1.00");
    image_train_clear();
    image_do("m50v100a999d999");
    image_idle(SECOND);
    image_assert_intervals(0, 48, 1500 * US, 1); /* 400 steps a revolution */
}

/* BOO-008, DEF-002 */
static void test_settings_outlast_many_losses_of_power(void)
{
    for (unsigned i = 1; i < 10; i++) {
        char line[30], shown[30];
        snprintf(line, sizeof line, "$CA%u", i);
        image_do(line);
        snprintf(line, sizeof line, "$Cc%u", 1000000 + i);
        image_do(line);
        image_run(WRITTEN);
        power_cycle();
        snprintf(shown, sizeof shown, "A autorun\t%u\t", i);
        assert_shown(shown);
        snprintf(shown, sizeof shown, "c xfreq\t\t%u\r\n", 1000000 + i);
        assert_shown(shown);
    }
}

/* CFG-006: lines that come faster than a byte is written wait for each other; none is lost */
static void test_values_that_come_at_once_are_all_stored(void)
{
    image_send("$CA8\r$CB1\r$CJ3\r$CK4\r$CL11\r$Cb2000\r$CM99\r$Ce7.5\r");
    image_sent();
    image_run(8 * WRITTEN);
    image_take_text();
    power_cycle();
    assert_shown("A autorun\t8\t");
    assert_shown("B ramp\t\t1\tb cycle\t\t2000\r\n");
    assert_shown("J ustep\t\t3\t");
    assert_shown("K pulse\t\t4\t");
    assert_shown("L slow\t\t11\r\n");
    assert_shown("M d_id\t\t99\t");
    assert_shown("e dec\t\t7.50\r\n");
    TEST_ASSERT_EQUAL_UINT32(0, board_uart_overruns(board));
}

/* The engine and the port go on while a value is stored. */
static void test_storing_delays_no_pulse_and_loses_no_character(void)
{
    image_do("$CA8");
    board_measures_clear(board);
    image_train_clear();
    image_do("m2000v10000a999d999"); /* 33.3 kHz */
    image_idle(SECOND);
    image_assert_pulses(2000);
    image_assert_intervals(0, 1999, 30 * US, 1);
    if (board_measures(board)->masked_max > 20)
        image_fail("interrupts were off for %u cycles, up to 0x%x", board_measures(board)->masked_max,
                   board_measures(board)->masked_max_pc);
    assert_shown("A autorun\t8\t");
}

/* BOO-010 */
static void test_a_blank_or_damaged_eeprom_brings_factory_settings(void)
{
    static uint8_t cells[BOARD_EEPROM_BYTES];
    for (unsigned fill = 0; fill < 256; fill += 51) {
        memset(cells, (int)fill, sizeof cells);
        boot_with(cells);
        TEST_ASSERT_EQUAL_STRING(factory_screen, image_display("cc"));
    }
    image_do("$CA8");
    image_do("$CA9");
    image_run(WRITTEN);
    memcpy(cells, board_eeprom(board), sizeof cells);
    boot_with(cells);
    assert_shown("A autorun\t9\t");
    cells[64 + 20] ^= 0x10; /* the newer copy */
    boot_with(cells);
    assert_shown("A autorun\t8\t");
    cells[20] ^= 0x10; /* the older one */
    boot_with(cells);
    TEST_ASSERT_EQUAL_STRING(factory_screen, image_display("cc"));
    image_do("$CA7");
    image_run(WRITTEN);
    power_cycle();
    assert_shown("A autorun\t7\t");
}

/* CFG-007, BOO-010 */
static void test_a_loss_of_power_while_a_value_is_stored_leaves_the_old_or_the_new_ones(void)
{
    static uint8_t before[BOARD_EEPROM_BYTES];
    image_do("$CA8");
    image_do("$Cc1111111");
    image_run(WRITTEN);
    memcpy(before, board_eeprom(board), sizeof before);
    unsigned old = 0, new = 0;
    for (unsigned i = 0; i < 60; i++) { /* 11 bytes are written */
        boot_with(before);
        board_eeprom_torn_byte(board, (uint8_t)(i * 37));
        image_send("$Cc2222222\r");
        image_sent();
        power_cycle_after(1 + i * MS + i * 13);
        const char *shown = image_display("cc");
        image_assert_holds(shown, "A autorun\t8\ta sprf\t\t200\r\n");
        if (strstr(shown, "c xfreq\t\t1111111\r\n") != NULL)
            old++;
        else if (strstr(shown, "c xfreq\t\t2222222\r\n") != NULL)
            new ++;
        else
            image_fail("cut %u: neither the old nor the new settings: \"%s\"", i, shown);
    }
    TEST_ASSERT_GREATER_THAN_UINT(5, old);
    TEST_ASSERT_GREATER_THAN_UINT(5, new);
}

/* An external reset does not end the write of a byte: what is read meanwhile would be wrong. */
static void test_a_reset_while_a_value_is_stored_leaves_the_old_or_the_new_ones(void)
{
    image_do("$Cc1111111");
    image_run(WRITTEN);
    for (unsigned i = 0; i < 40; i++) {
        char line[30];
        snprintf(line, sizeof line, "$Cc22222%02u", i);
        image_send(line);
        image_send("\r");
        image_sent();
        image_run(i * MS);
        reset();
        const char *shown = image_display("cc");
        if (strstr(shown, "c xfreq\t\t1111111\r\n") == NULL && strstr(shown, "c xfreq\t\t22222") == NULL)
            image_fail("reset %u: neither the old nor the new settings: \"%s\"", i, shown);
    }
}

/* SYS-004, TRM-010 */
static void test_the_list_of_what_is_stored_and_all_bytes_in_debug_mode(void)
{
    image_do("$CU21");
    image_assert_holds(image_display("$E"), "N 0\r\nU 01134567\r\na 200\r\n");
    image_run(WRITTEN);
    image_ask("b");
    const char *shown = image_display("$E");
    const char *at = strstr(shown, "u 1\r\n");
    TEST_ASSERT_NOT_NULL(at);
    at += 5;
    for (unsigned i = 0; i < BOARD_EEPROM_BYTES; i++) {
        char expected[8];
        int length = snprintf(expected, sizeof expected, "%02X%s", board_eeprom(board)[i], i % 16 == 15 ? "\r\n" : " ");
        if (strncmp(at, expected, (size_t)length) != 0)
            image_fail("byte %u: expected \"%s\", saw \"%.6s\"", i, expected, at);
        at += length;
    }
}

/* SYS-002: even if what is configured is refused */
static void test_configuring_stops_the_motor(void)
{
    image_do("m100000v300");
    image_run(300 * MS);
    image_refused("$CA", "?3 number missing");
    size_t pulses = train.count;
    image_assert_no_pulse_for(100 * MS);
    TEST_ASSERT_LESS_THAN_size_t(2000, pulses);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_screen_of_a_blank_unit_is_that_of_the_annex);
    RUN_TEST(test_in_the_screen_values_are_set_until_x);
    RUN_TEST(test_a_value_is_stored_at_once_and_effective_after_a_reset);
    RUN_TEST(test_settings_outlast_many_losses_of_power);
    RUN_TEST(test_values_that_come_at_once_are_all_stored);
    RUN_TEST(test_storing_delays_no_pulse_and_loses_no_character);
    RUN_TEST(test_a_blank_or_damaged_eeprom_brings_factory_settings);
    RUN_TEST(test_a_loss_of_power_while_a_value_is_stored_leaves_the_old_or_the_new_ones);
    RUN_TEST(test_a_reset_while_a_value_is_stored_leaves_the_old_or_the_new_ones);
    RUN_TEST(test_the_list_of_what_is_stored_and_all_bytes_in_debug_mode);
    RUN_TEST(test_configuring_stops_the_motor);
    return UNITY_END();
}
