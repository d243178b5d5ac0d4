/* Interrupt entry, external interrupts, pins, sleep, measures, crashes and loading: DS40002061 chapters 7, 10, 12, 13
 * and 14. */
#include "remote.h"

#include <string.h>
#include <time.h>

enum {
    PINB = 0x23,
    DDRB = 0x24,
    PORTB = 0x25,
    PINC = 0x26,
    PORTC = 0x28,
    DDRD = 0x2A,
    PORTD = 0x2B,
    TIFR1 = 0x36,
    PCIFR = 0x3B,
    EIFR = 0x3C,
    EIMSK = 0x3D,
    SMCR = 0x53,
    MCUCR = 0x55,
    PCICR = 0x68,
    EICRA = 0x69,
    PCMSK2 = 0x6D,
    TIMSK1 = 0x6F,
    TCCR1A = 0x80,
    TCCR1B = 0x81,
    TCNT1 = 0x84,
    OCR1A = 0x88,
};
enum { VECTOR_INT0 = 1, VECTOR_INT1 = 2, VECTOR_PCINT2 = 5, VECTOR_OVF1 = 13 };
enum { LOW_LEVEL, ANY_EDGE, FALLING, RISING };

#define INT0_PIN BOARD_PIN('D', 2)
#define INT1_PIN BOARD_PIN('D', 3)
#define PCINT20_PIN BOARD_PIN('D', 4)
#define LED BOARD_PIN('B', 5)

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    board_free(board);
}

/* -- interrupt entry, 7.7.1 --------------------------------------------------------------------------------------------- */

/* Timer1 will overflow so many cycles after the returned one. */
static uint64_t overflow_in(uint16_t cycles)
{
    write(TIMSK1, 0x01);
    write16(TCNT1, (uint16_t)-cycles);
    return write(TCCR1B, 1);
}

static uint64_t run_to_vector(int vector)
{
    TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_to_pc(board, (uint16_t)(vector * 4), 10000));
    return board_cycle(board);
}

static void test_an_interrupt_is_entered_in_four_cycles(void)
{
    uint64_t s;
    start_remote();
    allow_interrupts();
    s = overflow_in(1000);
    command(CMD_NOPS);
    TEST_ASSERT_EQUAL_UINT64(s + 1000 + 4, run_to_vector(VECTOR_OVF1));
}

static void test_the_return_address_is_the_next_instruction(void)
{
    uint64_t s;
    uint64_t begin;
    uint16_t sp;
    start_remote();
    allow_interrupts();
    s = overflow_in(1000);
    command(CMD_NOPS);
    begin = run_to_label("nops", 100);
    run_to_vector(VECTOR_OVF1);
    sp = board_peek16(board, 0x5D);
    TEST_ASSERT_EQUAL(address_of("nops") / 2u + (s + 1000 - begin),
                      board_peek8(board, (uint16_t)(sp + 1)) << 8 | board_peek8(board, (uint16_t)(sp + 2)));
}

static void test_an_interrupt_out_of_sleep_takes_four_cycles_more(void)
{
    uint64_t s;
    start_remote();
    write(SMCR, 0x01);
    s = overflow_in(1000);
    command(CMD_SLEEP);
    TEST_ASSERT_EQUAL_UINT64(s + 1000 + 8, run_to_vector(VECTOR_OVF1));
    run_to_label("woken", 1000); /* then the instruction after SLEEP */
}

static void test_one_instruction_runs_after_sei_and_after_reti_and_the_lower_vector_comes_first(void)
{
    start(PROGRAM("irq_order"));
    run_until("done", 1, 1000);
    TEST_ASSERT_EQUAL(1, get("order", 0));
    TEST_ASSERT_EQUAL(1, get("main_at_a", 0));
    TEST_ASSERT_EQUAL(2, get("main_at_b", 0));
}

static void test_a_flag_is_cleared_when_its_vector_is_entered(void)
{
    start_remote();
    allow_interrupts();
    overflow_in(500);
    run(2000);
    TEST_ASSERT_EQUAL(1, get("counts", VECTOR_OVF1));
    TEST_ASSERT_EQUAL_HEX8(0, read(TIFR1) & 0x01);
}

static void test_a_masked_request_waits_for_sei(void)
{
    start_remote();
    overflow_in(500);
    run(2000);
    TEST_ASSERT_EQUAL(0, get("counts", VECTOR_OVF1));
    allow_interrupts();
    run(200);
    TEST_ASSERT_EQUAL(1, get("counts", VECTOR_OVF1));
}

/* -- external interrupts, 13 --------------------------------------------------------------------------------------------- */

/* Interrupts of INT0 and INT1 after a low pulse of so many cycles, in one sense mode. */
static void pulse(board_pin_t pin, int sense, uint64_t cycles)
{
    int n = pin - INT0_PIN;
    start_remote();
    board_pin_drive(board, pin, 1);
    run(10);
    write(EICRA, (uint8_t)(sense << (2 * n)));
    write(EIMSK, (uint8_t)(1 << n));
    write(EIFR, 3);
    allow_interrupts();
    board_pin_drive(board, pin, 0);
    run(cycles);
}

static void test_int0_and_int1_take_the_edges_they_are_told_to(void)
{
    static const struct {
        int sense;
        uint8_t while_low, after;
    } row[3] = {{ANY_EDGE, 1, 2}, {FALLING, 1, 1}, {RISING, 0, 1}};
    for (int n = 0; n < 2; n++)
        for (int i = 0; i < 3; i++) {
            unsigned vector = (unsigned)(VECTOR_INT0 + n);
            pulse((board_pin_t)(INT0_PIN + n), row[i].sense, 1000);
            TEST_ASSERT_EQUAL(row[i].while_low, get("counts", vector));
            board_pin_drive(board, (board_pin_t)(INT0_PIN + n), 1);
            run(1000);
            TEST_ASSERT_EQUAL(row[i].after, get("counts", vector));
            board_free(board);
            board = NULL;
        }
}

static void test_a_low_level_interrupts_again_and_again_until_it_goes(void)
{
    for (unsigned n = 0; n < 2; n++) {
        uint8_t seen;
        pulse((board_pin_t)(INT0_PIN + n), LOW_LEVEL, 1000);
        seen = get("counts", VECTOR_INT0 + n);
        TEST_ASSERT_GREATER_THAN(10, seen);
        board_pin_drive(board, (board_pin_t)(INT0_PIN + n), 1);
        run(50);
        seen = get("counts", VECTOR_INT0 + n);
        run(5000);
        TEST_ASSERT_EQUAL(seen, get("counts", VECTOR_INT0 + n));
        board_free(board);
        board = NULL;
    }
}

static void test_an_edge_on_int0_is_entered_after_the_synchroniser(void)
{
    uint64_t edge;
    pulse(INT0_PIN, RISING, 100);
    edge = board_cycle(board) + 200;
    board_pin_drive_at(board, INT0_PIN, 1, edge);
    command(CMD_NOPS);
    TEST_ASSERT_EQUAL_UINT64(edge + 2 + 4, run_to_vector(VECTOR_INT0));
}

static void test_an_edge_while_disabled_is_remembered_until_its_flag_is_cleared(void)
{
    pulse(INT0_PIN, FALLING, 100);
    write(EIMSK, 0);
    board_pin_drive(board, INT0_PIN, 1);
    run(10);
    board_pin_drive(board, INT0_PIN, 0);
    run(10);
    TEST_ASSERT_EQUAL_HEX8(1, read(EIFR));
    write(EIFR, 1);
    write(EIMSK, 1);
    run(100);
    TEST_ASSERT_EQUAL(1, get("counts", VECTOR_INT0));
}

static void test_a_pin_change_interrupts_at_both_edges_of_the_chosen_pins(void)
{
    uint64_t edge;
    start_remote();
    board_pin_drive(board, PCINT20_PIN, 1);
    board_pin_drive(board, BOARD_PIN('D', 7), 1);
    run(10);
    write(PCMSK2, 1 << 4);
    write(PCICR, 1 << 2);
    allow_interrupts();
    board_pin_drive(board, BOARD_PIN('D', 7), 0);
    run(100);
    TEST_ASSERT_EQUAL(0, get("counts", VECTOR_PCINT2));
    edge = board_cycle(board) + 200;
    board_pin_drive_at(board, PCINT20_PIN, 0, edge);
    command(CMD_NOPS);
    TEST_ASSERT_EQUAL_UINT64(edge + 4 + 4, run_to_vector(VECTOR_PCINT2));
    board_pin_drive_at(board, PCINT20_PIN, 1, edge + 500);
    run(5000);
    TEST_ASSERT_EQUAL(2, get("counts", VECTOR_PCINT2));
    TEST_ASSERT_EQUAL_HEX8(0, read(PCIFR));
}

/* -- pins, 14 -------------------------------------------------------------------------------------------------------------- */

static void test_a_write_appears_on_the_pad_at_the_end_of_the_instruction(void)
{
    uint64_t high, low;
    start_remote();
    watch_output(LED);
    high = write(PORTB, 0x20);
    low = write(PORTB, 0x00);
    ASSERT_EDGES(LED, high, {0, 1}, {low - high, 0});
}

static void test_a_pad_is_read_back_one_cycle_late(void)
{
    start_remote();
    write(DDRB, 0x20);
    command(CMD_OUT_IN);
    run_to_label("bit_done", 100);
    TEST_ASSERT_EQUAL_HEX8(0x00, get("address", 0) & 0x20); /* OUT, IN */
    TEST_ASSERT_EQUAL_HEX8(0x20, get("value", 0) & 0x20);   /* OUT, NOP, IN */
}

static void test_sbi_on_pinb_toggles_its_bit_only(void)
{
    start_remote();
    write(DDRB, 0xFF);
    write(PORTB, 0xC0);
    command(CMD_SBI_PINB);
    run_to_label("bit_done", 100);
    TEST_ASSERT_EQUAL_HEX8(0xE0, read(PORTB));
}

static void test_writing_ones_to_pinb_toggles_those_bits(void)
{
    start_remote();
    write(PORTB, 0xC1);
    write(PINB, 0x43);
    TEST_ASSERT_EQUAL_HEX8(0x82, read(PORTB));
}

static void test_an_input_reads_what_drives_it_or_else_its_pull_up(void)
{
    start_remote();
    write(PORTC, 0x01);
    TEST_ASSERT_EQUAL_HEX8(0x01, read(PINC));
    board_pin_drive(board, BOARD_PIN('C', 0), 0);
    board_pin_drive(board, BOARD_PIN('C', 1), 1);
    TEST_ASSERT_EQUAL_HEX8(0x02, read(PINC));
    board_pin_drive(board, BOARD_PIN('C', 0), -1);
    TEST_ASSERT_EQUAL_HEX8(0x03, read(PINC));
    write(MCUCR, 0x10);
    TEST_ASSERT_EQUAL_HEX8(0x02, read(PINC));
}

static void test_a_planned_drive_happens_at_its_cycle_in_any_order_of_planning(void)
{
    uint64_t s;
    start_remote();
    board_record(board, INT0_PIN, true);
    s = board_cycle(board);
    board_pin_drive_at(board, INT0_PIN, 0, s + 137);
    board_pin_drive_at(board, INT0_PIN, 1, s + 101);
    board_pin_drive_at(board, INT0_PIN, 1, s + 139);
    run(200);
    ASSERT_EDGES(INT0_PIN, s, {101, 1}, {137, 0}, {139, 1});
}

static void test_a_square_wave_keeps_its_rate_without_drift(void)
{
    size_t count;
    const board_edge_t *edge;
    uint64_t s;
    start_remote();
    board_record(board, INT0_PIN, true);
    s = board_cycle(board);
    board_pin_clock(board, INT0_PIN, 700000);
    run(1600000);
    edge = board_edges(board, &count);
    TEST_ASSERT_EQUAL(140000, count);
    TEST_ASSERT_UINT64_WITHIN(1, s + 1600000, edge[count - 1].cycle);
    board_pin_clock(board, INT0_PIN, 0);
    board_edges_clear(board);
    run(1000);
    assert_no_edges(INT0_PIN);
}

static void test_a_wire_passes_edges_on_at_once(void)
{
    uint64_t s;
    start_remote();
    watch_output(LED);
    board_record(board, INT1_PIN, true);
    board_pin_wire(board, LED, INT1_PIN);
    s = write(PORTB, 0x20);
    ASSERT_EDGES(INT1_PIN, s, {0, 1});
}

static void count_edges(void *ctx, board_edge_t edge)
{
    TEST_ASSERT_EQUAL(LED, edge.pin);
    TEST_ASSERT_EQUAL_UINT64(edge.cycle, board_cycle(board));
    ++*(int *)ctx;
}

static void test_a_callback_gets_the_edges_in_place_of_the_list(void)
{
    int edges = 0;
    start_remote();
    watch_output(LED);
    board_on_edge(board, count_edges, &edges);
    write(PORTB, 0x20);
    write(PORTB, 0);
    TEST_ASSERT_EQUAL(2, edges);
    assert_no_edges(LED);
}

/* -- sleep, 10 --------------------------------------------------------------------------------------------------------------- */

static void test_sleep_takes_no_real_time(void)
{
    clock_t begin;
    start_remote();
    write(SMCR, 0x01);
    command(CMD_SLEEP);
    begin = clock();
    run(60 * BOARD_CPU_HZ);
    TEST_ASSERT_LESS_THAN(CLOCKS_PER_SEC, clock() - begin);
    TEST_ASSERT_UINT64_WITHIN(1000, 60 * BOARD_CPU_HZ, board_measures(board)->sleep_cycles);
}

static void test_sleep_without_se_does_nothing(void)
{
    start_remote();
    board_measures_clear(board);
    command(CMD_SLEEP);
    run_to_label("woken", 100);
    TEST_ASSERT_EQUAL_UINT64(0, board_measures(board)->sleep_cycles);
}

static void test_timers_run_on_while_idle(void)
{
    uint64_t s;
    start_remote();
    watch_output(BOARD_PIN('B', 1));
    write(SMCR, 0x01);
    write16(OCR1A, 0x1FFF);
    write(TCCR1A, 0x40);
    s = write(TCCR1B, 0x09);
    command(CMD_SLEEP);
    run_until_after(s, 0x5000);
    ASSERT_EDGES(BOARD_PIN('B', 1), s, {0x2000, 1}, {0x4000, 0});
}

/* -- measures ---------------------------------------------------------------------------------------------------------------- */

static void start_masked(void)
{
    start(PROGRAM("masked"));
    board_pin_drive(board, INT0_PIN, 0);
    board_pin_drive(board, INT1_PIN, 0);
    run(100);
    board_measures_clear(board);
}

static void test_a_masked_section_is_measured_where_it_ends(void)
{
    start(PROGRAM("masked"));
    run_until("done", 1, 1000);
    TEST_ASSERT_EQUAL(21, board_measures(board)->masked_max);
    TEST_ASSERT_EQUAL_HEX16(address_of("masked_end"), board_measures(board)->masked_max_pc);
}

static void test_the_lowest_stack_pointer_is_kept(void)
{
    start(PROGRAM("masked"));
    run_until("done", 1, 1000);
    TEST_ASSERT_EQUAL_HEX16(0x08FF - 2 - 2 - 10, board_measures(board)->stack_low); /* main's call, deep's, pushes */
}

static void test_the_cycles_of_an_interrupt_include_entry_and_reti(void)
{
    start_masked();
    board_pin_drive(board, INT1_PIN, 1);
    run(200);
    TEST_ASSERT_EQUAL_UINT64(1, board_measures(board)->isr[VECTOR_INT1].count);
    TEST_ASSERT_EQUAL_UINT64(4 + 3 + 5 + 4, board_measures(board)->isr[VECTOR_INT1].cycles);
    TEST_ASSERT_EQUAL(16, board_measures(board)->isr_masked_max);
    TEST_ASSERT_EQUAL(VECTOR_INT1, board_measures(board)->isr_masked_vector);
}

static void test_a_nested_interrupt_counts_for_itself_only(void)
{
    start_masked();
    board_pin_drive(board, INT0_PIN, 1);
    run(8);
    board_pin_drive(board, INT1_PIN, 1); /* waits for SEI in the handler of INT0 */
    run(200);
    TEST_ASSERT_EQUAL_UINT64(4 + 3 + 10 + 1 + 20 + 4, board_measures(board)->isr[VECTOR_INT0].cycles);
    TEST_ASSERT_EQUAL_UINT64(16, board_measures(board)->isr[VECTOR_INT1].cycles);
    TEST_ASSERT_EQUAL(4 + 3 + 10 + 1, board_measures(board)->isr_masked_max);
    TEST_ASSERT_EQUAL(VECTOR_INT0, board_measures(board)->isr_masked_vector);
    TEST_ASSERT_UINT_WITHIN(6, 14, board_measures(board)->isr[VECTOR_INT1].latency_max);
}

/* -- crashes ------------------------------------------------------------------------------------------------------------------- */

static void assert_crash(uint8_t way, const char *says)
{
    start(PROGRAM("crash"));
    run(5000); /* .bss is cleared */
    set("way", 0, way);
    TEST_ASSERT_EQUAL(BOARD_CRASHED, board_run_for(board, 100000));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(board_crash(board), says), board_crash(board));
    TEST_ASSERT_EQUAL(BOARD_CRASHED, board_run_for(board, 1));
    board_reset(board, BOARD_RESET_EXTERNAL);
    set("way", 0, 0);
    TEST_ASSERT_EQUAL(BOARD_RAN, board_run_for(board, 1000));
    TEST_ASSERT_NULL(board_crash(board));
}

static void test_an_illegal_opcode_is_a_crash(void)
{
    assert_crash(1, "illegal opcode");
}

static void test_a_jump_out_of_the_program_is_a_crash(void)
{
    assert_crash(2, "jump out of the program to 0x6000");
}

static void test_a_stack_that_meets_bss_is_a_crash(void)
{
    assert_crash(3, "below the end of .bss 0x01c9");
}

static void test_a_pop_above_ram_is_a_crash(void)
{
    assert_crash(4, "outside memory");
}

static void test_a_stack_pointer_above_ram_is_a_crash(void)
{
    assert_crash(5, "above RAM");
}

static void test_a_stack_pointer_written_by_halves_counts_when_it_is_whole(void)
{
    start(PROGRAM("crash"));
    run(5000); /* .bss is cleared */
    set("way", 0, 6);
    run(100);
    TEST_ASSERT_EQUAL_HEX16(0x07F0, board_measures(board)->stack_low);
}

/* -- loading and running --------------------------------------------------------------------------------------------------------- */

static void test_an_image_with_a_nobits_section_before_data_is_loaded(void)
{
    start(PROGRAM("segments"));
    run_until("done", 1, 10000);
    TEST_ASSERT_EQUAL_HEX16(0x0100, address_of("ring"));
    TEST_ASSERT_EQUAL_HEX16(0x0200, address_of("greeting"));
    TEST_ASSERT_EQUAL_HEX32(0x78563412, board_peek32(board, address_of("greeting")));
}

static void test_a_missing_image_and_a_missing_symbol_are_refused(void)
{
    uint16_t address;
    TEST_ASSERT_NULL(board_new("no/such.elf", NULL));
    start_remote();
    TEST_ASSERT_FALSE(board_symbol(board, "no_such_symbol", &address));
}

static void test_memory_is_poked_and_peeked_in_three_widths(void)
{
    start_remote();
    board_poke32(board, 0x300, 0x12345678);
    TEST_ASSERT_EQUAL_HEX32(0x12345678, board_peek32(board, 0x300));
    TEST_ASSERT_EQUAL_HEX16(0x3456, board_peek16(board, 0x301));
    board_poke16(board, 0x300, 0xABCD);
    board_poke8(board, 0x303, 0xEF);
    TEST_ASSERT_EQUAL_HEX32(0xEF34ABCD, board_peek32(board, 0x300));
}

static void test_several_boards_run_side_by_side_and_alike(void)
{
    size_t count[2];
    const board_edge_t *edge[2];
    board_t *both[2];
    for (int i = 0; i < 2; i++) {
        start_remote();
        watch_output(BOARD_PIN('B', 3));
        write(0xB3, 7);
        write(0xB0, 0x42);
        write(0xB1, 1);
        both[i] = board;
    }
    for (int n = 0; n < 100; n++)
        for (int i = 0; i < 2; i++)
            board_run_for(both[i], (uint64_t)(i ? 7 : 1000));
    board_run_to(both[1], board_cycle(both[0]));
    for (int i = 0; i < 2; i++)
        edge[i] = board_edges(both[i], &count[i]);
    TEST_ASSERT_EQUAL(count[0], count[1]);
    TEST_ASSERT_GREATER_THAN(1000, count[0]);
    for (size_t i = 0; i < count[0]; i++) {
        TEST_ASSERT_EQUAL_UINT64(edge[0][i].cycle, edge[1][i].cycle);
        TEST_ASSERT_EQUAL(edge[0][i].level, edge[1][i].level);
    }
    board_free(both[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_interrupt_is_entered_in_four_cycles);
    RUN_TEST(test_the_return_address_is_the_next_instruction);
    RUN_TEST(test_an_interrupt_out_of_sleep_takes_four_cycles_more);
    RUN_TEST(test_one_instruction_runs_after_sei_and_after_reti_and_the_lower_vector_comes_first);
    RUN_TEST(test_a_flag_is_cleared_when_its_vector_is_entered);
    RUN_TEST(test_a_masked_request_waits_for_sei);
    RUN_TEST(test_int0_and_int1_take_the_edges_they_are_told_to);
    RUN_TEST(test_a_low_level_interrupts_again_and_again_until_it_goes);
    RUN_TEST(test_an_edge_on_int0_is_entered_after_the_synchroniser);
    RUN_TEST(test_an_edge_while_disabled_is_remembered_until_its_flag_is_cleared);
    RUN_TEST(test_a_pin_change_interrupts_at_both_edges_of_the_chosen_pins);
    RUN_TEST(test_a_write_appears_on_the_pad_at_the_end_of_the_instruction);
    RUN_TEST(test_a_pad_is_read_back_one_cycle_late);
    RUN_TEST(test_sbi_on_pinb_toggles_its_bit_only);
    RUN_TEST(test_writing_ones_to_pinb_toggles_those_bits);
    RUN_TEST(test_an_input_reads_what_drives_it_or_else_its_pull_up);
    RUN_TEST(test_a_planned_drive_happens_at_its_cycle_in_any_order_of_planning);
    RUN_TEST(test_a_square_wave_keeps_its_rate_without_drift);
    RUN_TEST(test_a_wire_passes_edges_on_at_once);
    RUN_TEST(test_a_callback_gets_the_edges_in_place_of_the_list);
    RUN_TEST(test_sleep_takes_no_real_time);
    RUN_TEST(test_sleep_without_se_does_nothing);
    RUN_TEST(test_timers_run_on_while_idle);
    RUN_TEST(test_a_masked_section_is_measured_where_it_ends);
    RUN_TEST(test_the_lowest_stack_pointer_is_kept);
    RUN_TEST(test_the_cycles_of_an_interrupt_include_entry_and_reti);
    RUN_TEST(test_a_nested_interrupt_counts_for_itself_only);
    RUN_TEST(test_an_illegal_opcode_is_a_crash);
    RUN_TEST(test_a_jump_out_of_the_program_is_a_crash);
    RUN_TEST(test_a_stack_that_meets_bss_is_a_crash);
    RUN_TEST(test_a_pop_above_ram_is_a_crash);
    RUN_TEST(test_a_stack_pointer_above_ram_is_a_crash);
    RUN_TEST(test_a_stack_pointer_written_by_halves_counts_when_it_is_whole);
    RUN_TEST(test_an_image_with_a_nobits_section_before_data_is_loaded);
    RUN_TEST(test_a_missing_image_and_a_missing_symbol_are_refused);
    RUN_TEST(test_memory_is_poked_and_peeked_in_three_widths);
    RUN_TEST(test_several_boards_run_side_by_side_and_alike);
    return UNITY_END();
}
