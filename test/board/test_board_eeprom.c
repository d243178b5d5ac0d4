/* EEPROM against DS40002061 sections 8.4 and 8.6: what the datasheet dictates for the programs eeprom_*. */
#include "program.h"

#include <string.h>

enum { EEPE = 0x02, EEMPE = 0x04 }; /* EECR */

#define WRITE_CYCLES 54400u /* 3.4 ms, table 8-2 */
#define HALF_CYCLES 28800u  /* 1.8 ms */

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    board_free(board);
}

/* -- the timed sequence ---------------------------------------------------------------------------------------------- */

static void test_write_starts_only_within_four_cycles_of_eempe(void)
{
    start(PROGRAM("eeprom_sequence"));
    run_until("r_done", 1, 1000000);
    for (unsigned nops = 0; nops < 6; nops++) {
        bool in_time = nops + 1 <= 4; /* cycles between the two writes */
        TEST_ASSERT_EQUAL_HEX8(in_time ? EEPE : 0, get("r_started", nops));
        TEST_ASSERT_EQUAL_HEX8(in_time ? nops : 0xFF, board_eeprom(board)[nops]);
    }
}

static void test_write_needs_eempe_written_before(void)
{
    start(PROGRAM("eeprom_sequence"));
    run_until("r_done", 1, 1000000);
    TEST_ASSERT_EQUAL_HEX8(0, get("r_without", 0));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(EEMPE, get("r_together", 0), "EEPE in the same write does not count");
}

static void test_eempe_falls_after_four_cycles(void)
{
    start(PROGRAM("eeprom_sequence"));
    run_until("r_done", 1, 1000000);
    for (unsigned i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_HEX8(EEMPE, get("r_mpe", i));
    TEST_ASSERT_EQUAL_HEX8(0, get("r_mpe", 4));
}

/* -- reading, writing ------------------------------------------------------------------------------------------------- */

static void start_access(void)
{
    start(PROGRAM("eeprom_access"));
    board_eeprom(board)[5] = 0x5A;
    board_eeprom(board)[7] = 0x77;
    board_eeprom(board)[8] = 0x00;
    board_eeprom(board)[9] = 0xF6;
}

static void test_read_halts_the_processor_for_four_cycles(void)
{
    start_access();
    uint64_t before = run_to_label("before_read", 10000);
    TEST_ASSERT_EQUAL_UINT64(before + 2 + 4, run_to_label("after_read", 100));
    run_to_label("before_write", 100);
    TEST_ASSERT_EQUAL_HEX8(0x5A, get("r_read", 0));
}

static void test_write_halts_for_two_cycles_and_is_busy_for_3400_us(void)
{
    start_access();
    uint64_t before = run_to_label("before_write", 10000);
    TEST_ASSERT_EQUAL_UINT64(before + 2 + 2, run_to_label("after_write", 100));
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0xFF, board_eeprom(board)[6], "not yet written");
    uint64_t written = run_to_label("written", 100000);
    TEST_ASSERT_UINT64_WITHIN(3, before + 2 + WRITE_CYCLES + 3, written); /* the polling loop's period is 4 cycles */
    TEST_ASSERT_EQUAL_HEX8(0x3C, board_eeprom(board)[6]);
}

static void test_nothing_but_waiting_works_while_busy(void)
{
    start_access();
    run_to_label("written", 100000);
    TEST_ASSERT_EQUAL_HEX8(EEPE, get("r_busy", 0) & EEPE);
    TEST_ASSERT_EQUAL_MESSAGE(6, get("r_address", 0), "EEAR cannot be changed");
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0x3C, get("r_read_busy", 0), "a read is not done");
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0x3C, board_eeprom(board)[6], "a second write is ignored");
    TEST_ASSERT_EQUAL_HEX8(0x77, board_eeprom(board)[7]);
    TEST_ASSERT_EQUAL(1, board_eeprom_writes(board, 6));
    TEST_ASSERT_EQUAL(0, board_eeprom_writes(board, 7));
}

static void test_erase_only_and_write_only_take_1800_us(void)
{
    start_access();
    uint64_t erasing = run_to_label("erasing", 100000);
    uint64_t erased = run_to_label("erased", 100000);
    TEST_ASSERT_UINT64_WITHIN(4, erasing - 2 + HALF_CYCLES + 3, erased);
    TEST_ASSERT_EQUAL_HEX8(0xFF, board_eeprom(board)[8]);
    uint64_t programming = run_to_label("programming", 100);
    uint64_t programmed = run_to_label("programmed", 100000);
    TEST_ASSERT_UINT64_WITHIN(4, programming - 2 + HALF_CYCLES + 3, programmed);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0xF6 & 0x0F, board_eeprom(board)[9], "bits are only cleared");
}

static void test_libc_routines_work(void)
{
    start(PROGRAM("eeprom_libc"));
    run_until("r_done", 1, 1000000);
    for (unsigned i = 0; i < 8; i++)
        TEST_ASSERT_EQUAL_HEX8(0x11 * i, get("r_block", i));
    TEST_ASSERT_EQUAL_MESSAGE(1, board_eeprom_writes(board, 0x3F1), "the update wrote nothing");
}

static void test_ready_interrupt_is_level_triggered(void)
{
    start(PROGRAM("eeprom_ready"));
    run_until("r_done", 1, 10000000);
    TEST_ASSERT_EQUAL(11, get("r_calls", 0));
    TEST_ASSERT_UINT64_WITHIN(3000, 10 * WRITE_CYCLES, board_cycle(board));
    for (unsigned i = 0; i < 10; i++)
        TEST_ASSERT_EQUAL_HEX8(0x80 + i, board_eeprom(board)[0x100 + i]);
}

/* -- power -------------------------------------------------------------------------------------------------------------- */

static void test_power_cut_tears_the_cell_being_written(void)
{
    start_access();
    uint64_t began = run_to_label("after_write", 10000) - 2;
    board_eeprom_torn_byte(board, 0x99);
    board_eeprom_cut_at(board, began + WRITE_CYCLES - 1);
    run(began + WRITE_CYCLES + 10 - board_cycle(board));
    TEST_ASSERT_EQUAL_HEX8(0x99, board_eeprom(board)[6]);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0x01, board_peek8(board, 0x54), "MCUSR: a power-on reset");
    run_until("r_done", 1, 1000000);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0x3C, board_eeprom(board)[6], "the program has begun again");
    TEST_ASSERT_EQUAL(2, board_eeprom_writes(board, 6));
}

static void test_power_cut_between_writes_tears_nothing(void)
{
    start_access();
    uint64_t began = run_to_label("after_write", 10000) - 2;
    board_eeprom_cut_at(board, began + WRITE_CYCLES + 1);
    run(began + WRITE_CYCLES + 10 - board_cycle(board));
    TEST_ASSERT_EQUAL_HEX8(0x3C, board_eeprom(board)[6]);
    TEST_ASSERT_EQUAL_HEX8(0x01, board_peek8(board, 0x54));
}

static void test_reset_does_not_stop_a_write(void)
{
    const board_reset_t cause[] = {BOARD_RESET_EXTERNAL, BOARD_RESET_BROWN_OUT, BOARD_RESET_WATCHDOG};
    for (unsigned i = 0; i < 3; i++) {
        start_access();
        uint64_t began = run_to_label("after_write", 10000) - 2;
        run(1000);
        board_reset(board, cause[i]);
        run(began + WRITE_CYCLES - 10 - board_cycle(board)); /* the program finds EEPE set: its accesses do nothing */
        TEST_ASSERT_EQUAL_HEX8(0xFF, board_eeprom(board)[6]);
        run(50);
        TEST_ASSERT_EQUAL_HEX8(0x3C, board_eeprom(board)[6]);
        TEST_ASSERT_EQUAL(1, board_eeprom_writes(board, 6));
        board_free(board);
        board = NULL;
    }
}

static void test_cells_come_from_the_caller_or_erased(void)
{
    uint8_t cells[BOARD_EEPROM_BYTES];
    memset(cells, 0x42, sizeof cells);
    board = board_new(PROGRAM("eeprom_access"), cells);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(cells, board_eeprom(board), sizeof cells);
    board_free(board);
    start(PROGRAM("eeprom_access"));
    TEST_ASSERT_EACH_EQUAL_HEX8(0xFF, board_eeprom(board), BOARD_EEPROM_BYTES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_write_starts_only_within_four_cycles_of_eempe);
    RUN_TEST(test_write_needs_eempe_written_before);
    RUN_TEST(test_eempe_falls_after_four_cycles);
    RUN_TEST(test_read_halts_the_processor_for_four_cycles);
    RUN_TEST(test_write_halts_for_two_cycles_and_is_busy_for_3400_us);
    RUN_TEST(test_nothing_but_waiting_works_while_busy);
    RUN_TEST(test_erase_only_and_write_only_take_1800_us);
    RUN_TEST(test_libc_routines_work);
    RUN_TEST(test_ready_interrupt_is_level_triggered);
    RUN_TEST(test_power_cut_tears_the_cell_being_written);
    RUN_TEST(test_power_cut_between_writes_tears_nothing);
    RUN_TEST(test_reset_does_not_stop_a_write);
    RUN_TEST(test_cells_come_from_the_caller_or_erased);
    return UNITY_END();
}
