/* CFG, DEF, BOO on the whole image: what is configured outlasts resets and losses of power. */
#include "image.h"

#include <stdio.h>
#include <string.h>

#define WRITTEN (250 * MS) /* by then a change has been stored, even in a blank copy: 66 bytes of 3.4 ms */

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
    cells[128 + 20] ^= 0x10; /* the newer copy */
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

/* -- decisions 0.3.7: a new path is tried for a minute ---------------------------------------------------------------- */

#define NEW_BAUD 250000u
static const char taken_back[] = "\r\n?20 E M m n taken back\r\nSAC>";

static void peer(uint32_t baud)
{
    image_sent();
    board_uart_baud(board, baud);
    image_run(20 * MS);
    image_take_text();
}

/* To the new rate, with a second parameter that is not of the path. */
static void restart_at_the_new_rate(void)
{
    image_do("$Cm250000");
    image_do("$CL20");
    image_run(WRITTEN);
    image_send("$R\r");
    peer(NEW_BAUD);
}

static void power_on_at(uint32_t baud)
{
    board_uart_baud(board, baud);
    power_cycle();
}

static void assert_rate_stored(uint32_t baud)
{
    char shown[30];
    snprintf(shown, sizeof shown, "m hw\t\t%u\r\n", baud);
    assert_shown(shown);
    assert_shown("L slow\t\t20\r\n");
    image_assert_holds(image_display("vd"), "20 15000\r\n"); /* in effect, whatever became of the rate */
}

/* The unit speaks again at the rate before, so many cycles from `start` on. */
static void assert_taken_back(uint64_t start, uint64_t least, uint64_t most)
{
    peer(BAUD);
    image_run(start + least - board_cycle(board));
    TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
    image_run(most - least);
    TEST_ASSERT_EQUAL_STRING(taken_back, board_uart_text(board));
    image_run(WRITTEN);
    assert_rate_stored(BAUD);
    power_cycle();
    assert_rate_stored(BAUD);
}

/* CFG-036 */
static void test_a_rate_that_is_confirmed_stays(void)
{
    restart_at_the_new_rate();
    image_run(58 * SECOND);
    image_do("v30");
    image_run(62 * SECOND);
    TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
    for (unsigned i = 0; i < 3; i++) {
        assert_rate_stored(NEW_BAUD);
        power_on_at(NEW_BAUD);
        TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
    }
    image_run(62 * SECOND);
    assert_rate_stored(NEW_BAUD);
}

static void test_a_rate_that_nobody_confirms_is_taken_back_after_a_minute(void)
{
    restart_at_the_new_rate();
    assert_taken_back(board_cycle(board), 59 * SECOND, 61 * SECOND);
}

/* What is typed and refused, what nobody typed, and what is typed at the rate before. */
static void test_refused_lines_and_noise_confirm_nothing(void)
{
    restart_at_the_new_rate();
    const uint64_t start = board_cycle(board);
    image_refused("k", "?1 unknown command");
    image_refused("m200z", "?2 syntax");
    image_do("");
    image_do(" ");
    uint32_t noise = 1;
    for (unsigned i = 0; i < 2000; i++) {
        noise = noise * 1664525u + 1013904223u;
        const uint8_t byte = (uint8_t)(noise >> 24);
        if (byte == '\r' || byte == '\n' || noise & 0x800000)
            board_uart_send_bad(board, byte);
        else
            board_uart_send(board, &byte, 1);
        if (i % 50 == 49)
            image_send("\r");
        image_run(MS);
    }
    peer(BAUD);
    for (unsigned i = 0; i < 20; i++) {
        image_send("v30\r");
        image_sent();
        image_run(SECOND);
    }
    board_uart_baud(board, NEW_BAUD);
    image_send("\r"); /* what came as noise is refused */
    image_sent();
    assert_taken_back(start, 59 * SECOND, 61 * SECOND);
}

/* The transmitter is at work at that moment, and goes on by itself. */
static void test_a_rate_is_taken_back_while_answers_are_being_sent(void)
{
    restart_at_the_new_rate();
    uint16_t hw_baud = 0;
    TEST_ASSERT_TRUE(board_symbol(board, "settings", &hw_baud));
    hw_baud = (uint16_t)(hw_baud + offsetof(settings_t, hw_baud));
    image_run(59 * SECOND);
    while (board_peek32(board, hw_baud) == NEW_BAUD) {
        image_send("k\r");
        image_run(MS);
    }
    TEST_ASSERT_FALSE(board_uart_sending(board));
    board_uart_baud(board, BAUD);
    image_take_text();
    image_run(100 * MS);
    image_assert_holds(image_take_text(), taken_back + 2);
    image_do("S");
    assert_rate_stored(BAUD);
}

/* Who opens the port of a Nano resets it: so a reset begins the minute anew. */
static void test_a_reset_or_a_loss_of_power_in_that_minute_begins_another_one(void)
{
    restart_at_the_new_rate();
    image_run(40 * SECOND);
    reset();
    image_run(40 * SECOND);
    power_on_at(NEW_BAUD);
    const uint64_t start = board_cycle(board);
    assert_taken_back(start, 58 * SECOND, 60 * SECOND); /* the minute began a second before the prompt */

    restart_at_the_new_rate();
    image_run(20 * SECOND);
    reset();
    assert_rate_stored(NEW_BAUD);
    image_run(WRITTEN);
    power_on_at(NEW_BAUD);
    image_run(62 * SECOND);
    assert_rate_stored(NEW_BAUD);
}

/* Power is switched off instead of typing $R. */
static void test_a_new_rate_is_tried_after_a_loss_of_power_as_well(void)
{
    image_do("$CL20");
    image_do("$Cm250000");
    image_run(WRITTEN);
    power_on_at(NEW_BAUD);
    assert_taken_back(board_cycle(board), 58 * SECOND, 60 * SECOND);
}

/* $R came through the new path. */
static void test_a_restart_confirms_as_any_command(void)
{
    restart_at_the_new_rate();
    image_do("$R");
    image_run(62 * SECOND);
    assert_rate_stored(NEW_BAUD);
}

/* E, M and n: without effect on the terminal, tried all the same. */
static void test_the_networks_parameters_are_tried_alike(void)
{
    image_do("$CM99");
    image_do("$Cn9600");
    image_do("$CL20");
    image_do("$R");
    assert_shown("M d_id\t\t99\t"); /* which confirms */
    image_run(WRITTEN);
    image_do("$CM100");
    image_do("$Cn300");
    image_do("$R");
    assert_taken_back(board_cycle(board), 59 * SECOND, 61 * SECOND);
    assert_shown("M d_id\t\t99\t");
    assert_shown("n sw\t\t9600\r\n");
}

/* The motor runs at 33 kHz, by autorun: nobody types a command. */
static void test_what_is_taken_back_disturbs_no_motion(void)
{
    enum { SLOW_STEPS = 116, FAST_STEPS = 70000, LOOKED_AT = 45000 };
    image_do("m116vc500000a999d999"); /* 58 s */
    image_do("m70000v10000a10d10"); /* 2.5 s */
    image_do("S");
    image_do("qs");
    image_do("$CA2");
    image_do("$CL20");
    image_do("$Cm250000");
    image_run(5 * SECOND);
    power_on_at(NEW_BAUD);
    const uint64_t start = board_cycle(board);
    board_uart_baud(board, BAUD);
    image_take_text();
    image_run(58 * SECOND + SECOND / 2);
    TEST_ASSERT_EQUAL_STRING("", board_uart_text(board));
    board_measures_clear(board);
    image_run(SECOND * 3 / 2);
    if (board_measures(board)->masked_max > 20)
        image_fail("interrupts were off for %u cycles, up to 0x%x", board_measures(board)->masked_max,
                   board_measures(board)->masked_max_pc);
    TEST_ASSERT_EQUAL_STRING(taken_back, board_uart_text(board));
    TEST_ASSERT_GREATER_THAN_size_t(LOOKED_AT, train.count);
    const size_t first = train.count - LOOKED_AT;
    TEST_ASSERT_LESS_THAN_UINT64(start + 58 * SECOND + SECOND * 3 / 4, train.pulse[first].cycle);
    image_assert_intervals(first, LOOKED_AT - 1, 30 * US, 0);
    image_do("l");
    image_idle(5 * SECOND);
    image_assert_pulses(SLOW_STEPS + FAST_STEPS - 1); /* the first one stands before the prompt */
    TEST_ASSERT_EQUAL_INT32(SLOW_STEPS + FAST_STEPS, image_position());
    assert_rate_stored(BAUD);
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
    RUN_TEST(test_a_rate_that_is_confirmed_stays);
    RUN_TEST(test_a_rate_that_nobody_confirms_is_taken_back_after_a_minute);
    RUN_TEST(test_refused_lines_and_noise_confirm_nothing);
    RUN_TEST(test_a_rate_is_taken_back_while_answers_are_being_sent);
    RUN_TEST(test_a_reset_or_a_loss_of_power_in_that_minute_begins_another_one);
    RUN_TEST(test_a_new_rate_is_tried_after_a_loss_of_power_as_well);
    RUN_TEST(test_a_restart_confirms_as_any_command);
    RUN_TEST(test_the_networks_parameters_are_tried_alike);
    RUN_TEST(test_what_is_taken_back_disturbs_no_motion);
    return UNITY_END();
}
