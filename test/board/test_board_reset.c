/* Resets, watchdog and sleep against DS40002061 chapters 10 and 11, for the programs reset_* and wdt_*. */
#include "program.h"

enum { PORF = 0x01, EXTRF = 0x02, BORF = 0x04, WDRF = 0x08 };                         /* MCUSR */
enum { WDE = 0x08, WDIE = 0x40, WDP0 = 0x01, WDP1 = 0x02, WDP2 = 0x04, WDP3 = 0x20 }; /* WDTCSR */

#define TIME_OUT 256000u /* 16 ms: 2,048 periods of 128 kHz, table 11-2 */
#define START_UP 2000u   /* cycles from a reset to main(), at most */

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    board_free(board);
}

/* -- causes, what a reset keeps and what it clears ------------------------------------------------------------------------ */

static void start_flags(bool keep)
{
    start(PROGRAM("reset_flags"));
    set("p_keep_flags", 0, keep);
    set("r_boots", 0, 0);
    run(10000);
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
}

static void reset_and_boot(board_reset_t cause)
{
    board_reset(board, cause);
    run(10000);
}

static void test_each_reset_sets_its_flag(void)
{
    start_flags(false);
    TEST_ASSERT_EQUAL_HEX8(PORF, get("r_mcusr", 0));
    reset_and_boot(BOARD_RESET_EXTERNAL);
    TEST_ASSERT_EQUAL_HEX8(EXTRF, get("r_mcusr", 0));
    reset_and_boot(BOARD_RESET_BROWN_OUT);
    TEST_ASSERT_EQUAL_HEX8(BORF, get("r_mcusr", 0));
    reset_and_boot(BOARD_RESET_WATCHDOG);
    TEST_ASSERT_EQUAL_HEX8(WDRF, get("r_mcusr", 0));
    TEST_ASSERT_EQUAL(4, get("r_boots", 0));
}

static void test_flags_stay_until_cleared_or_power_on(void)
{
    start_flags(true);
    reset_and_boot(BOARD_RESET_EXTERNAL);
    reset_and_boot(BOARD_RESET_BROWN_OUT);
    TEST_ASSERT_EQUAL_HEX8(PORF | EXTRF | BORF, get("r_mcusr", 0));
    reset_and_boot(BOARD_RESET_POWER_ON);
    TEST_ASSERT_EQUAL_HEX8(PORF, get("r_mcusr", 0));
}

static void test_reset_gives_io_registers_their_initial_values(void)
{
    static const uint8_t initial[] = {0, 0, 0x20, 0, 0x06, 0, 0, 0}; /* as listed in the program */
    const board_reset_t cause[] = {BOARD_RESET_EXTERNAL, BOARD_RESET_BROWN_OUT, BOARD_RESET_POWER_ON};
    start_flags(false);
    for (unsigned i = 0; i < 3; i++) {
        for (unsigned k = 0; k < sizeof initial; k++)
            set("r_io", k, 0xEE);
        reset_and_boot(cause[i]);
        for (unsigned k = 0; k < sizeof initial; k++)
            TEST_ASSERT_EQUAL_HEX8(initial[k], get("r_io", k));
    }
}

static void test_reset_lets_pins_float(void)
{
    start_flags(false);
    TEST_ASSERT_EQUAL(1, board_pin_level(board, BOARD_PIN('B', 2)));
    TEST_ASSERT_EQUAL_MESSAGE(1, board_pin_level(board, BOARD_PIN('D', 1)), "TXD");
    board_reset(board, BOARD_RESET_EXTERNAL);
    TEST_ASSERT_EQUAL(0, board_pin_level(board, BOARD_PIN('B', 2)));
    TEST_ASSERT_EQUAL(0, board_pin_level(board, BOARD_PIN('D', 1)));
}

static void test_reset_cuts_the_byte_being_sent(void)
{
    size_t count;
    start(PROGRAM("usart_echo"));
    run(10000);
    board_uart_send_text(board, "x");
    run_until("r_sent", 1, 10000);
    run(4 * 416 + 208); /* the start bit lies at most one bit ahead, so three or four bits of 0x78 are out */
    board_reset(board, BOARD_RESET_EXTERNAL);
    run(20000);
    const board_uart_byte_t *byte = board_uart_received(board, &count);
    TEST_ASSERT_EQUAL(1, count);
    TEST_ASSERT_BITS_MESSAGE(0xF0, 0xF0, byte[0].byte, "the rest is an idle line");
    TEST_ASSERT_EQUAL_MESSAGE(0, get16("r_completed"), "nothing pending has survived");
}

static void test_ram_survives_all_resets_but_power_on(void)
{
    const board_reset_t cause[] = {BOARD_RESET_EXTERNAL, BOARD_RESET_BROWN_OUT, BOARD_RESET_WATCHDOG};
    uint8_t before[0x400], after[0x400];

    start_flags(false);
    for (unsigned i = 0; i < 3; i++) {
        set("r_kept", 0, (uint8_t)(0x5A + i));
        reset_and_boot(cause[i]);
        TEST_ASSERT_EQUAL_HEX8(0x5A + i, get("r_kept", 0));
    }
    for (unsigned i = 0; i < sizeof before; i++)
        before[i] = board_peek8(board, (uint16_t)(0x300 + i));
    reset_and_boot(BOARD_RESET_POWER_ON);
    unsigned same = 0, zero = 0;
    for (unsigned i = 0; i < sizeof after; i++) {
        after[i] = board_peek8(board, (uint16_t)(0x300 + i));
        same += after[i] == before[i];
        zero += after[i] == 0;
    }
    TEST_ASSERT_LESS_THAN_MESSAGE(40, same, "another noise");
    TEST_ASSERT_LESS_THAN_MESSAGE(40, zero, "noise, not zeros");
}

static void test_power_on_noise_is_the_same_in_every_run(void)
{
    start(PROGRAM("reset_flags"));
    board_t *first = board;
    start(PROGRAM("reset_flags"));
    for (uint16_t a = 0x100; a < 0x900; a++)
        TEST_ASSERT_EQUAL_HEX8(board_peek8(first, a), board_peek8(board, a));
    board_free(first);
}

static void test_time_goes_on_through_a_reset(void)
{
    start_flags(false);
    uint64_t before = board_cycle(board);
    board_reset(board, BOARD_RESET_POWER_ON);
    TEST_ASSERT_EQUAL_UINT64(before, board_cycle(board));
}

/* -- watchdog ----------------------------------------------------------------------------------------------------------------- */

static void start_watchdog(uint8_t wdtcsr, bool plain, bool feed, bool rearm)
{
    start(PROGRAM("wdt_modes"));
    set("p_wdtcsr", 0, wdtcsr);
    set("p_plain", 0, plain);
    set("p_feed", 0, feed);
    set("p_rearm", 0, rearm);
    set("r_boots", 0, 0);
    run_until("r_boots", 1, START_UP);
    run_until("r_ready", 1, START_UP);
}

static void test_watchdog_resets_after_each_of_its_periods(void)
{
    for (uint8_t select = 0; select <= 9; select++) {
        uint8_t bits = (uint8_t)((select & 7) | (select & 8 ? WDP3 : 0));
        start_watchdog((uint8_t)(WDE | bits), false, false, false);
        TEST_ASSERT_EQUAL_HEX8(WDE | bits, get("r_wdtcsr", 0));
        uint64_t armed = board_cycle(board);
        run_until("r_boots", 2, 200000000);
        TEST_ASSERT_UINT64_WITHIN(START_UP / 2, armed + ((uint64_t)TIME_OUT << select) + START_UP / 2,
                                  board_cycle(board));
        TEST_ASSERT_EQUAL_HEX8(WDRF, get("r_mcusr", 0));
        board_free(board);
        board = NULL;
    }
}

static void test_wdr_restarts_the_period(void)
{
    start_watchdog(WDE, false, true, false);
    run(10 * TIME_OUT);
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
    set("p_feed", 0, 0);
    run(TIME_OUT - 100);
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
    run(START_UP);
    TEST_ASSERT_EQUAL(2, get("r_boots", 0));
}

static void test_interrupt_mode_interrupts_every_period(void)
{
    start_watchdog(WDIE, false, false, false);
    run(10 * TIME_OUT + TIME_OUT / 2);
    TEST_ASSERT_EQUAL(10, get("r_interrupts", 0));
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(WDIE, get("r_wdtcsr", 0), "WDIF cleared by the vector");
}

static void test_interrupt_and_reset_mode_interrupts_once_then_resets(void)
{
    start_watchdog(WDIE | WDE, false, false, false);
    run(TIME_OUT + TIME_OUT / 2);
    TEST_ASSERT_EQUAL(1, get("r_interrupts", 0));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(WDE, get("r_wdtcsr", 0), "the vector clears WDIE");
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
    run(TIME_OUT);
    TEST_ASSERT_EQUAL(2, get("r_boots", 0));
    TEST_ASSERT_EQUAL_HEX8(WDRF, get("r_mcusr", 0));
}

static void test_setting_wdie_again_keeps_the_reset_away(void)
{
    start_watchdog(WDIE | WDE, false, false, true);
    run(5 * TIME_OUT + TIME_OUT / 2);
    TEST_ASSERT_EQUAL(5, get("r_interrupts", 0));
    TEST_ASSERT_EQUAL(1, get("r_boots", 0));
}

static void test_prescaler_needs_the_timed_sequence_but_wde_does_not(void)
{
    start_watchdog(WDE | WDP3, true, false, false);
    TEST_ASSERT_EQUAL_HEX8(WDE, get("r_wdtcsr", 0));
    run(TIME_OUT + START_UP);
    TEST_ASSERT_EQUAL(2, get("r_boots", 0));
}

static void test_sequence_ends_four_cycles_after_wdce(void)
{
    start(PROGRAM("wdt_sequence"));
    run_until("r_done", 1, 10000);
    for (unsigned nops = 0; nops < 5; nops++) {
        bool in_time = nops + 2 <= 4; /* STS takes two cycles */
        TEST_ASSERT_EQUAL_HEX8(in_time ? WDP2 | WDP1 : WDE, get("r_csr", nops));
    }
}

static void test_wdrf_keeps_the_watchdog_on(void)
{
    start_flags(true);
    reset_and_boot(BOARD_RESET_WATCHDOG);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(WDE, get("r_wdtcsr", 0), "on after the reset, 16 ms");
    run(TIME_OUT); /* the program has not cleared WDRF, so its wdt_disable() did nothing */
    TEST_ASSERT_EQUAL(3, get("r_boots", 0));
    run(TIME_OUT);
    TEST_ASSERT_EQUAL(4, get("r_boots", 0));
    set("p_keep_flags", 0, 0);
    run(4 * TIME_OUT);
    TEST_ASSERT_EQUAL_MESSAGE(5, get("r_boots", 0), "WDRF cleared first: it can be turned off");
}

/* -- sleep ----------------------------------------------------------------------------------------------------------------------- */

static void test_sleep_without_se_does_nothing_and_idle_wakes_by_interrupt(void)
{
    start(PROGRAM("reset_sleep"));
    board_measures_clear(board);
    run(100000);
    TEST_ASSERT_EQUAL(1, get("r_passed", 0));
    TEST_ASSERT_EQUAL(1, get("r_woken", 0));
    TEST_ASSERT_LESS_THAN_MESSAGE(20, get16("r_slept_ticks"), "awake a few us after the compare match");
    TEST_ASSERT_UINT64_WITHIN(500, 80000, board_measures(board)->sleep_cycles);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_reset_sets_its_flag);
    RUN_TEST(test_flags_stay_until_cleared_or_power_on);
    RUN_TEST(test_reset_gives_io_registers_their_initial_values);
    RUN_TEST(test_reset_lets_pins_float);
    RUN_TEST(test_reset_cuts_the_byte_being_sent);
    RUN_TEST(test_ram_survives_all_resets_but_power_on);
    RUN_TEST(test_power_on_noise_is_the_same_in_every_run);
    RUN_TEST(test_time_goes_on_through_a_reset);
    RUN_TEST(test_watchdog_resets_after_each_of_its_periods);
    RUN_TEST(test_wdr_restarts_the_period);
    RUN_TEST(test_interrupt_mode_interrupts_every_period);
    RUN_TEST(test_interrupt_and_reset_mode_interrupts_once_then_resets);
    RUN_TEST(test_setting_wdie_again_keeps_the_reset_away);
    RUN_TEST(test_prescaler_needs_the_timed_sequence_but_wde_does_not);
    RUN_TEST(test_sequence_ends_four_cycles_after_wdce);
    RUN_TEST(test_wdrf_keeps_the_watchdog_on);
    RUN_TEST(test_sleep_without_se_does_nothing_and_idle_wakes_by_interrupt);
    return UNITY_END();
}
