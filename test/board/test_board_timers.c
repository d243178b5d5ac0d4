/* Timer0, Timer1 and Timer2 against DS40002061 chapters 15 to 18: cycle-stamped edges, flags and counts. A timer that
 * is started at cycle s with clock / 1 takes the value v at s + v. */
#include "remote.h"

enum {
    TIFR0 = 0x35,
    TIFR1 = 0x36,
    TIFR2 = 0x37,
    GTCCR = 0x43,
    TCCR0A = 0x44,
    TCCR0B = 0x45,
    TCNT0 = 0x46,
    OCR0A = 0x47,
    OCR0B = 0x48,
    DDRB = 0x24,
    PORTB = 0x25,
    PIND = 0x29,
    TIMSK0 = 0x6E,
    TIMSK1 = 0x6F,
    TIMSK2 = 0x70,
    TCCR1A = 0x80,
    TCCR1B = 0x81,
    TCCR1C = 0x82,
    TCNT1 = 0x84,
    ICR1 = 0x86,
    OCR1A = 0x88,
    OCR1B = 0x8A,
    TCCR2A = 0xB0,
    TCCR2B = 0xB1,
    TCNT2 = 0xB2,
    OCR2A = 0xB3,
};
enum { TOV = 0x01, OCFA = 0x02, OCFB = 0x04, ICF = 0x20 };
enum { VECTOR_CAPT1 = 10, VECTOR_COMPA1, VECTOR_COMPB1, VECTOR_OVF1 };

/* TCCR1A and TCCR1B of some modes; TCCR1B without a clock. */
#define COM1A(n) (uint8_t)((n) << 6)
#define COM1B(n) (uint8_t)((n) << 4)
#define MODE_A(n) ((n)&3)
#define MODE_B(n) (((n) >> 2 & 3) << 3)
enum { CLK_1 = 1, CLK_8, CLK_64, CLK_256, CLK_1024, T1_FALLING, T1_RISING };

#define OC0A BOARD_PIN('D', 6)
#define OC0B BOARD_PIN('D', 5)
#define OC1A BOARD_PIN('B', 1)
#define OC1B BOARD_PIN('B', 2)
#define OC2A BOARD_PIN('B', 3)
#define OC2B BOARD_PIN('D', 3)
#define ICP1 BOARD_PIN('B', 0)
#define T0 BOARD_PIN('D', 4)
#define T1 BOARD_PIN('D', 5)

void setUp(void)
{
    start_remote();
}

void tearDown(void)
{
    board_free(board);
}

/* Compare registers are written in mode 0, then the mode; returns the cycle of the start. */
static uint64_t start_timer1(int mode, uint8_t com, uint16_t ocr1a, uint16_t ocr1b, uint8_t clock)
{
    write16(OCR1A, ocr1a);
    write16(OCR1B, ocr1b);
    write(TCCR1A, (uint8_t)(com | MODE_A(mode)));
    return write(TCCR1B, (uint8_t)(MODE_B(mode) | clock));
}

/* -- fast PWM, 16.9.3 -------------------------------------------------------------------------------------------------- */

static void test_mode_15_non_inverting_rises_at_bottom_and_falls_after_the_match(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 999, 49, CLK_1);
    run_until_after(s, 2500);
    ASSERT_EDGES(OC1B, s, {1000, 1}, {1050, 0}, {2000, 1}, {2050, 0});
}

static void test_mode_15_inverting_rises_after_the_match_and_falls_at_bottom(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(3), 999, 49, CLK_1);
    run_until_after(s, 2500);
    ASSERT_EDGES(OC1B, s, {50, 1}, {1000, 0}, {1050, 1}, {2000, 0}, {2050, 1});
}

static void test_mode_15_takes_new_compare_values_at_bottom_only(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 999, 49, CLK_1);
    run_until_after(s, 1010);
    write16(OCR1A, 499);
    write16(OCR1B, 99);
    run_until_after(s, 2800);
    ASSERT_EDGES(OC1B, s, {1000, 1}, {1050, 0}, {2000, 1}, {2100, 0}, {2500, 1}, {2600, 0});
}

static void test_mode_14_takes_ocr1b_at_bottom_only_and_icr1_at_once(void)
{
    uint64_t s;
    watch_output(OC1B);
    write(TCCR1A, MODE_A(14));
    write(TCCR1B, MODE_B(14));
    write16(ICR1, 999);
    write(TCCR1B, 0);
    write(TCCR1A, 0);
    s = start_timer1(14, COM1B(2), 0, 799, CLK_1);
    run_until_after(s, 1010);
    write16(OCR1B, 49);
    write16(ICR1, 899);
    run_until_after(s, 2000);
    ASSERT_EDGES(OC1B, s, {1000, 1}, {1800, 0}, {1900, 1}, {1950, 0});
}

static void test_modes_5_6_7_turn_at_their_fixed_tops(void)
{
    static const uint16_t top[3] = {0xFF, 0x1FF, 0x3FF};
    watch_output(OC1B);
    for (int i = 0; i < 3; i++) {
        uint64_t s;
        board_edges_clear(board);
        write(TCCR1B, 0);
        write(TCCR1A, 0);
        write16(TCNT1, 0);
        s = start_timer1(5 + i, COM1B(2), 0, 9, CLK_1);
        run_until_after(s, top[i] + 50u);
        ASSERT_EDGES(OC1B, s, {top[i] + 1u, 1}, {top[i] + 11u, 0});
    }
}

static void test_a_compare_value_read_back_is_the_buffered_one(void)
{
    start_timer1(15, 0, 9999, 49, CLK_1);
    write16(OCR1A, 0x1234);
    TEST_ASSERT_EQUAL_HEX16(0x1234, read16(OCR1A));
}

static void test_leaving_pwm_makes_the_compare_registers_direct(void)
{
    uint64_t s;
    watch_output(OC1B);
    start_timer1(15, COM1B(2), 9999, 4999, CLK_1);
    write(TCCR1B, 0);
    write(TCCR1A, 0);
    write16(OCR1A, 499);
    write16(OCR1B, 9);
    write16(TCNT1, 490);
    write(TCCR1A, COM1B(2) | MODE_A(15));
    s = write(TCCR1B, MODE_B(15) | CLK_1);
    run_until_after(s, 600);
    ASSERT_EDGES(OC1B, s, {10, 1}, {20, 0}, {510, 1}, {520, 0});
}

static void test_ocr1b_above_top_never_falls_when_non_inverting(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 199, 200, CLK_1);
    run_until_after(s, 2000);
    ASSERT_EDGES(OC1B, s, {200, 1});
}

static void test_ocr1b_above_top_never_rises_when_inverting(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(3), 199, 200, CLK_1);
    run_until_after(s, 2000);
    assert_no_edges(OC1B);
}

static void test_ocr1b_at_bottom_gives_a_spike_of_one_tick(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 199, 0, CLK_1);
    run_until_after(s, 450);
    ASSERT_EDGES(OC1B, s, {200, 1}, {201, 0}, {400, 1}, {401, 0});
}

static void test_ocr1b_at_top_is_constant_in_both_polarities(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 199, 199, CLK_1);
    run_until_after(s, 2000);
    ASSERT_EDGES(OC1B, s, {200, 1});
    write(TCCR1A, COM1B(3) | MODE_A(15));
    run(400); /* falls at the next BOTTOM */
    board_edges_clear(board);
    run(2000);
    assert_no_edges(OC1B);
    TEST_ASSERT_EQUAL(0, board_pin_level(board, OC1B));
}

static void test_mode_15_toggles_oc1a_at_top_and_leaves_oc1b_alone_with_com_1(void)
{
    uint64_t s;
    watch_output(OC1A);
    watch_output(OC1B);
    s = start_timer1(15, COM1A(1) | COM1B(1), 199, 49, CLK_1);
    run_until_after(s, 650);
    ASSERT_EDGES(OC1A, s, {200, 1}, {400, 0}, {600, 1});
    assert_no_edges(OC1B);
}

static void test_overflow_in_fast_pwm_comes_when_top_is_reached(void)
{
    uint64_t s;
    write(TIMSK1, TOV);
    allow_interrupts();
    s = start_timer1(15, 0, 999, 49, CLK_1);
    TEST_ASSERT_EQUAL_UINT64(s + 999, flag_cycle(VECTOR_OVF1));
}

static void test_overflow_in_fast_pwm_comes_when_top_is_left_if_asked_for(void)
{
    uint64_t s;
    board_fast_pwm_tov(board, BOARD_TOV_LEAVING_TOP);
    write(TIMSK1, TOV);
    allow_interrupts();
    s = start_timer1(15, 0, 999, 49, CLK_1);
    TEST_ASSERT_EQUAL_UINT64(s + 1000, flag_cycle(VECTOR_OVF1));
}

static void test_overflow_interrupts_are_counted_once_a_period(void)
{
    uint64_t s;
    write(TIMSK1, TOV);
    allow_interrupts();
    s = start_timer1(15, COM1B(2), 999, 49, CLK_1);
    run_until_after(s, 100 * 1000 + 500);
    TEST_ASSERT_EQUAL(100, get("counts", VECTOR_OVF1));
}

/* -- compare outputs, 16.8 ---------------------------------------------------------------------------------------------- */

static void test_a_disconnected_output_shows_port_while_the_latch_keeps_its_level(void)
{
    uint64_t s;
    uint64_t off;
    uint64_t on;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 1999, 499, CLK_1);
    run_until_after(s, 2010);
    off = write(TCCR1A, MODE_A(15)) - s;
    run_until_after(s, 4600); /* two matches and a BOTTOM pass by */
    on = write(TCCR1A, COM1B(2) | MODE_A(15)) - s;
    run_until_after(s, 6550);
    ASSERT_EDGES(OC1B, s, {2000, 1}, {off, 0}, {on, 1}, {6500, 0});
}

static void test_an_output_needs_its_ddr_bit(void)
{
    uint64_t s;
    uint64_t on;
    board_record(board, OC1B, true);
    s = start_timer1(15, COM1B(2), 999, 499, CLK_1);
    run_until_after(s, 1010);
    on = write(DDRB, 1 << 2) - s;
    run_until_after(s, 1550);
    ASSERT_EDGES(OC1B, s, {on, 1}, {1500, 0});
}

static void test_writing_port_leaves_a_connected_output_alone(void)
{
    uint64_t s;
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 999, 499, CLK_1);
    run_until_after(s, 1010);
    write(PORTB, 0xFF);
    write(PORTB, 0);
    run_until_after(s, 1550);
    ASSERT_EDGES(OC1B, s, {1000, 1}, {1500, 0});
}

static void test_set_on_compare_makes_one_edge_and_no_other(void)
{
    uint64_t s;
    watch_output(OC1A);
    s = start_timer1(4, COM1A(3), 199, 0, CLK_1);
    run_until_after(s, 2000);
    ASSERT_EDGES(OC1A, s, {200, 1});
}

static void test_clear_on_compare_makes_one_edge_and_no_other(void)
{
    uint64_t s;
    watch_output(OC1A);
    write(TCCR1A, COM1A(3));
    write(TCCR1C, 0x80); /* the latch is high */
    write(TCCR1A, COM1A(2));
    board_edges_clear(board);
    s = start_timer1(4, COM1A(2), 199, 0, CLK_1);
    run_until_after(s, 2000);
    ASSERT_EDGES(OC1A, s, {200, 0});
}

static void test_foc_strobes_set_clear_and_toggle_without_a_flag(void)
{
    uint64_t set_at, clear_at, toggle_at;
    watch_output(OC1B);
    write(TCCR1A, COM1B(3));
    set_at = write(TCCR1C, 0x40);
    write(TCCR1A, COM1B(2));
    clear_at = write(TCCR1C, 0x40);
    write(TCCR1A, COM1B(1));
    toggle_at = write(TCCR1C, 0x40);
    ASSERT_EDGES(OC1B, set_at, {0, 1}, {clear_at - set_at, 0}, {toggle_at - set_at, 1});
    TEST_ASSERT_EQUAL_HEX8(0, read(TIFR1));
}

static void test_foc_does_nothing_in_pwm(void)
{
    watch_output(OC1B);
    write(TCCR1A, COM1B(3) | MODE_A(15));
    write(TCCR1B, MODE_B(15));
    write(TCCR1C, 0x40);
    run(10);
    assert_no_edges(OC1B);
}

static void test_foc_strobes_timer2(void)
{
    uint64_t s;
    watch_output(OC2A);
    write(TCCR2A, 0xC0);
    s = write(TCCR2B, 0x80);
    run(10);
    ASSERT_EDGES(OC2A, s, {0, 1});
}

/* -- counting, 16.9 ---------------------------------------------------------------------------------------------------- */

static void test_ctc_toggles_each_period(void)
{
    uint64_t s;
    watch_output(OC1A);
    s = start_timer1(4, COM1A(1), 99, 0, CLK_1);
    run_until_after(s, 350);
    ASSERT_EDGES(OC1A, s, {100, 1}, {200, 0}, {300, 1});
}

static void test_ctc_with_the_compare_value_already_passed_runs_on_to_max(void)
{
    uint64_t s;
    watch_output(OC1A);
    write16(TCNT1, 200);
    s = start_timer1(4, COM1A(1), 99, 0, CLK_1);
    run_until_after(s, 65336 + 250);
    ASSERT_EDGES(OC1A, s, {65336 + 100, 1}, {65336 + 200, 0});
    TEST_ASSERT_EQUAL_HEX8(TOV, read(TIFR1) & TOV);
}

static void test_ctc_12_takes_icr1_as_top(void)
{
    uint64_t s;
    watch_output(OC1A);
    write(TCCR1B, MODE_B(12));
    write16(ICR1, 299);
    s = start_timer1(12, COM1A(1), 99, 0, CLK_1);
    run_until_after(s, 800);
    ASSERT_EDGES(OC1A, s, {100, 1}, {400, 0}, {700, 1});
    TEST_ASSERT_EQUAL_HEX8(ICF, read(TIFR1) & ICF);
}

static void test_normal_mode_overflows_when_it_becomes_zero(void)
{
    uint64_t s;
    write(TIMSK1, TOV);
    allow_interrupts();
    write16(TCNT1, 0xFF00);
    s = start_timer1(0, 0, 0, 0, CLK_1);
    TEST_ASSERT_EQUAL_UINT64(s + 0x100, flag_cycle(VECTOR_OVF1));
}

static void test_a_compare_flag_comes_one_tick_after_the_match(void)
{
    uint64_t s;
    write(TIMSK1, OCFB);
    allow_interrupts();
    s = start_timer1(0, 0, 0, 499, CLK_1);
    TEST_ASSERT_EQUAL_UINT64(s + 500, flag_cycle(VECTOR_COMPB1));
}

static void test_writing_tcnt1_blocks_the_compare_of_the_next_tick(void)
{
    uint64_t s;
    watch_output(OC1B);
    write16(TCNT1, 50);
    s = start_timer1(4, COM1B(1), 99, 50, CLK_1);
    run_until_after(s, 200);
    ASSERT_EDGES(OC1B, s, {50 + 51, 1}); /* not at 1 */
}

static void test_writing_tcnt1_at_top_runs_on_to_max(void)
{
    start_timer1(4, 0, 99, 50, 0);
    write16(TCNT1, 99);
    write(TCCR1B, MODE_B(4) | CLK_1);
    run(200);
    TEST_ASSERT_GREATER_THAN(150, read16(TCNT1));
}

static void test_tcnt1_preset_while_stopped_is_kept(void)
{
    uint64_t s;
    watch_output(OC1A);
    write16(TCNT1, 0x1234);
    run(100);
    TEST_ASSERT_EQUAL_HEX16(0x1234, read16(TCNT1));
    s = start_timer1(4, COM1A(1), 0x1240, 0, CLK_1);
    run_until_after(s, 100);
    ASSERT_EDGES(OC1A, s, {0x1240 - 0x1234 + 1, 1});
}

static void test_a_stopped_timer_keeps_its_count(void)
{
    uint16_t count;
    start_timer1(0, 0, 0, 0, CLK_1);
    run(1000);
    write(TCCR1B, 0);
    count = read16(TCNT1);
    TEST_ASSERT_GREATER_THAN(1000, count);
    run(1000);
    TEST_ASSERT_EQUAL(count, read16(TCNT1));
}

static void test_mode_10_phase_correct_is_symmetric_about_top(void)
{
    uint64_t s;
    watch_output(OC1B);
    write(TCCR1A, MODE_A(10));
    write(TCCR1B, MODE_B(10));
    write16(ICR1, 100);
    write(TCCR1B, 0);
    write(TCCR1A, 0);
    s = start_timer1(10, COM1B(3), 0, 60, CLK_1);
    run_until_after(s, 380);
    /* Up through 60 (left at 61), down through 60 (taken at 140, left at 141); period 200. */
    ASSERT_EDGES(OC1B, s, {61, 1}, {141, 0}, {261, 1}, {341, 0});
}

static void test_phase_correct_overflows_at_bottom(void)
{
    uint64_t s;
    write(TIMSK1, TOV);
    allow_interrupts();
    s = start_timer1(11, 0, 500, 0, CLK_1);
    TEST_ASSERT_EQUAL_UINT64(s + 1000, flag_cycle(VECTOR_OVF1));
}

static void test_phase_correct_loads_at_top_and_phase_and_frequency_correct_at_bottom(void)
{
    static const int mode[2] = {11, 9};
    static const uint64_t falls_at[2] = {2000 - 700, 2000 - 300}; /* the value's way down */
    watch_output(OC1B);
    for (int i = 0; i < 2; i++) {
        uint64_t s;
        write(TCCR1B, 0);
        write(TCCR1A, 0);
        write16(TCNT1, 0);
        write16(OCR1B, 0); /* constant low */
        s = start_timer1(mode[i], COM1B(3), 1000, 300, CLK_1);
        board_edges_clear(board);
        write16(OCR1B, 700);
        run_until_after(s, 1900);
        ASSERT_EDGES(OC1B, s, {301, 1}, {falls_at[i] + 1, 0});
    }
}

static void test_input_capture_takes_the_count_and_sets_its_flag(void)
{
    uint64_t s;
    board_pin_drive(board, ICP1, 0);
    s = start_timer1(0, 0, 0, 0, CLK_1 | 0x40);
    board_pin_drive_at(board, ICP1, 1, s + 500);
    run_until_after(s, 600);
    TEST_ASSERT_EQUAL(503, read16(ICR1));
    TEST_ASSERT_EQUAL_HEX8(ICF, read(TIFR1) & ICF);
}

/* -- registers ---------------------------------------------------------------------------------------------------------- */

static void set_three_flags(void)
{
    start_timer1(0, 0, 10, 20, 0);
    write16(TCNT1, 0xFFF0);
    write(TCCR1B, CLK_1);
    run(100);
    write(TCCR1B, 0);
    TEST_ASSERT_EQUAL_HEX8(TOV | OCFA | OCFB, read(TIFR1));
}

static void test_writing_a_one_clears_that_flag_only(void)
{
    set_three_flags();
    write(TIFR1, OCFB);
    TEST_ASSERT_EQUAL_HEX8(TOV | OCFA, read(TIFR1));
}

static void test_sbi_on_tifr1_clears_its_bit_only(void)
{
    set_three_flags();
    command(CMD_SBI_TIFR1);
    run_to_label("bit_done", 100);
    TEST_ASSERT_EQUAL_HEX8(TOV | OCFB, read(TIFR1));
}

static void test_cbi_on_tifr1_clears_nothing(void)
{
    set_three_flags();
    command(CMD_CBI_TIFR1);
    run_to_label("bit_done", 100);
    TEST_ASSERT_EQUAL_HEX8(TOV | OCFA | OCFB, read(TIFR1));
}

static void test_a_request_withdrawn_by_its_flag_comes_again_at_the_next_match(void)
{
    start_timer1(4, 0, 999, 0, CLK_1);
    write(TIMSK1, OCFA);
    run(1500);
    write(TIFR1, OCFA);
    run(3000);
    allow_interrupts();
    run(30);
    TEST_ASSERT_EQUAL(1, get("counts", VECTOR_COMPA1));
}

static void test_all_16_bit_registers_share_one_byte_for_the_high_half(void)
{
    write(TCNT1 + 1, 0x34);
    write(OCR1A, 0x56);
    TEST_ASSERT_EQUAL_HEX16(0x3456, read16(OCR1A));
    write16(TCNT1, 0xABCD);
    write(OCR1B + 1, 0x11);
    read(TCNT1); /* a read in between: TEMP is 0xAB now */
    write(OCR1B, 0x22);
    TEST_ASSERT_EQUAL_HEX16(0xAB22, read16(OCR1B));
}

static void test_reading_a_compare_register_leaves_the_shared_byte_alone(void)
{
    write16(OCR1A, 0x5678);
    write(OCR1B + 1, 0x11);
    read(OCR1A);
    write(OCR1B, 0x22);
    TEST_ASSERT_EQUAL_HEX16(0x1122, read16(OCR1B));
}

static void test_the_high_byte_alone_changes_nothing(void)
{
    write16(OCR1A, 0x1234);
    write(OCR1A + 1, 0x77);
    TEST_ASSERT_EQUAL_HEX16(0x1234, read16(OCR1A));
}

static void test_reading_tcnt1_low_freezes_its_high_byte(void)
{
    uint8_t low;
    write16(TCNT1, 0x01F0);
    write(TCCR1B, CLK_8);
    low = read(TCNT1);
    run(2000);
    TEST_ASSERT_EQUAL_HEX8(0x01, read(TCNT1 + 1));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT8(0xF0, low);
    TEST_ASSERT_EQUAL_HEX8(0x02, read16(TCNT1) >> 8);
}

static void test_icr1_is_writable_only_while_it_is_top(void)
{
    write16(ICR1, 0x1234);
    TEST_ASSERT_EQUAL_HEX16(0, read16(ICR1));
    write(TCCR1B, MODE_B(12));
    write16(ICR1, 0x1234);
    TEST_ASSERT_EQUAL_HEX16(0x1234, read16(ICR1));
}

/* -- clocks, 17 ---------------------------------------------------------------------------------------------------------- */

static void test_prescaled_clocks_tick_at_multiples_since_the_prescaler_reset(void)
{
    static const struct {
        uint8_t clock;
        uint64_t division;
    } row[4] = {{CLK_8, 8}, {CLK_64, 64}, {CLK_256, 256}, {CLK_1024, 1024}};
    watch_output(OC1A);
    for (int i = 0; i < 4; i++) {
        uint64_t zero;
        write(TCCR1B, 0);
        write16(TCNT1, 0);
        start_timer1(4, COM1A(1), 4, 0, 0);
        zero = write(GTCCR, 0x01);
        board_edges_clear(board);
        write(TCCR1B, (uint8_t)(MODE_B(4) | row[i].clock));
        run_until_after(zero, 30 * row[i].division);
        {
            size_t count;
            uint64_t missed; /* ticks before the clock was chosen */
            const board_edge_t *edge = board_edges(board, &count);
            TEST_ASSERT_GREATER_OR_EQUAL(4, count);
            TEST_ASSERT_EQUAL_UINT64(0, (edge[0].cycle - zero) % row[i].division);
            missed = (edge[0].cycle - zero) / row[i].division - 5;
            TEST_ASSERT_LESS_OR_EQUAL_UINT64(100 / row[i].division + 1, missed);
            for (size_t n = 1; n < count; n++)
                TEST_ASSERT_EQUAL_UINT64(5 * row[i].division, edge[n].cycle - edge[n - 1].cycle);
        }
    }
}

static void test_tsm_halts_timers_0_and_1_until_it_is_cleared(void)
{
    uint64_t s;
    watch_output(OC1A);
    write(GTCCR, 0x81);
    start_timer1(4, COM1A(1), 4, 0, CLK_8);
    run(1000);
    assert_no_edges(OC1A);
    s = write(GTCCR, 0);
    run_until_after(s, 100);
    ASSERT_EDGES(OC1A, s, {40, 1}, {80, 0});
}

static void test_the_t1_pin_clocks_at_rising_edges_three_cycles_late(void)
{
    uint64_t s;
    board_pin_drive(board, T1, 0);
    watch_output(OC1B);
    s = start_timer1(15, COM1B(2), 3, 1, T1_RISING);
    for (uint64_t i = 0; i < 9; i++) {
        board_pin_drive_at(board, T1, 1, s + 100 + 16 * i);
        board_pin_drive_at(board, T1, 0, s + 108 + 16 * i);
    }
    run_until_after(s, 300);
    /* Edges 1, 2, 3 count to TOP, edge 4 returns to BOTTOM, edge 6 leaves the match. */
    ASSERT_EDGES(OC1B, s, {103 + 3 * 16, 1}, {103 + 5 * 16, 0}, {103 + 7 * 16, 1});
    TEST_ASSERT_EQUAL(1, read16(TCNT1));
}

static void test_the_t1_pin_clocks_at_falling_edges(void)
{
    uint64_t s;
    board_pin_drive(board, T1, 1);
    watch_output(OC1A);
    s = start_timer1(4, COM1A(1), 0, 0, T1_FALLING);
    board_pin_drive_at(board, T1, 0, s + 100);
    board_pin_drive_at(board, T1, 1, s + 150);
    board_pin_drive_at(board, T1, 0, s + 200);
    run_until_after(s, 300);
    ASSERT_EDGES(OC1A, s, {103, 1}, {203, 0});
}

static void test_a_megahertz_on_t1_is_counted_exactly(void)
{
    uint64_t s;
    board_pin_clock(board, T1, 1e6);
    s = start_timer1(0, 0, 0, 0, T1_RISING);
    run_until_after(s, 160000);
    TEST_ASSERT_UINT_WITHIN(5, 10000, read16(TCNT1)); /* some more until it is read */
}

static void test_timer2_wired_to_t1_clocks_timer1(void)
{
    board_pin_wire(board, OC2A, T1);
    write(DDRB, 1 << 3);
    start_timer1(0, 0, 0, 0, T1_RISING);
    write(OCR2A, 7);
    write(TCCR2A, 0x42);
    write(TCCR2B, 1);
    run(16 * 1000);
    TEST_ASSERT_UINT_WITHIN(5, 1000, read16(TCNT1));
}

/* -- 8-bit timers, 15 and 18 ------------------------------------------------------------------------------------------- */

static void test_timer2_makes_one_megahertz(void)
{
    uint64_t s;
    watch_output(OC2A);
    write(OCR2A, 7);
    write(TCCR2A, 0x42);
    s = write(TCCR2B, 1);
    run_until_after(s, 38);
    ASSERT_EDGES(OC2A, s, {8, 1}, {16, 0}, {24, 1}, {32, 0});
}

static void test_timer0_ctc_with_the_compare_value_already_passed_runs_on_to_max(void)
{
    uint64_t s;
    watch_output(OC0A);
    write(OCR0A, 50);
    write(TCNT0, 100);
    write(TCCR0A, 0x42);
    s = write(TCCR0B, 1);
    run_until_after(s, 156 + 110);
    ASSERT_EDGES(OC0A, s, {156 + 51, 1}, {156 + 102, 0});
    TEST_ASSERT_EQUAL_HEX8(TOV, read(TIFR0) & TOV);
}

static void test_timer0_fast_pwm_drives_both_outputs(void)
{
    uint64_t s;
    watch_output(OC0A);
    watch_output(OC0B);
    write(OCR0A, 99);
    write(OCR0B, 9);
    write(TCCR0A, 0xB3); /* OC0A non-inverting, OC0B inverting */
    s = write(TCCR0B, 1);
    run_until_after(s, 400);
    ASSERT_EDGES(OC0A, s, {256, 1}, {356, 0});
    ASSERT_EDGES(OC0B, s, {10, 1}, {256, 0}, {266, 1});
}

static void test_timer0_mode_7_takes_ocr0a_as_top_and_buffers_it(void)
{
    uint64_t s;
    watch_output(OC0B);
    write(OCR0A, 199);
    write(OCR0B, 9);
    write(TCCR0A, 0x23);
    s = write(TCCR0B, 0x09);
    run_until_after(s, 210);
    write(OCR0A, 99);
    run_until_after(s, 520);
    ASSERT_EDGES(OC0B, s, {200, 1}, {210, 0}, {400, 1}, {410, 0}, {500, 1}, {510, 0});
}

static void test_timer0_phase_correct_counts_510_ticks_a_period(void)
{
    uint64_t s;
    watch_output(OC0A);
    write(OCR0A, 100);
    write(TCCR0A, 0xC1);
    s = write(TCCR0B, 1);
    run_until_after(s, 900);
    ASSERT_EDGES(OC0A, s, {101, 1}, {411, 0}, {611, 1});
}

static void test_timer0_and_timer1_share_a_prescaler_and_timer2_has_its_own(void)
{
    uint64_t zero1, zero2;
    watch_output(OC0A);
    watch_output(OC1A);
    watch_output(OC2A);
    write(OCR0A, 0);
    write(OCR2A, 0);
    write(TCCR0A, 0x42);
    write(TCCR2A, 0x42);
    write(TCCR0B, CLK_1024);
    write(TCCR2B, 7);
    start_timer1(4, COM1A(1), 0, 0, CLK_1024);
    zero1 = write(GTCCR, 0x01);
    run(100);
    zero2 = write(GTCCR, 0x02);
    board_edges_clear(board);
    run_until_after(zero1, 2100);
    run_until_after(zero2, 2100);
    {
        size_t count;
        const board_edge_t *edge = board_edges(board, &count);
        TEST_ASSERT_EQUAL(6, count);
        for (size_t i = 0; i < count; i++)
            TEST_ASSERT_EQUAL_UINT64(0, (edge[i].cycle - (edge[i].pin == OC2A ? zero2 : zero1)) % 1024);
    }
}

static void test_timer2_has_seven_divisions(void)
{
    static const uint64_t division[8] = {0, 1, 8, 32, 64, 128, 256, 1024};
    watch_output(OC2A);
    write(OCR2A, 4);
    write(TCCR2A, 0x42);
    for (uint8_t clock = 1; clock < 8; clock++) {
        size_t count;
        const board_edge_t *edge;
        write(TCCR2B, clock);
        run(100);
        board_edges_clear(board);
        run(12 * division[clock]);
        edge = board_edges(board, &count);
        TEST_ASSERT_GREATER_OR_EQUAL(2, count);
        TEST_ASSERT_EQUAL_UINT64(5 * division[clock], edge[count - 1].cycle - edge[count - 2].cycle);
    }
}

static void test_the_t0_pin_clocks_timer0(void)
{
    board_pin_drive(board, T0, 0);
    write(TCCR0B, 7);
    for (uint64_t i = 0; i < 10; i++) {
        board_pin_drive_at(board, T0, 1, board_cycle(board) + 20 + 20 * i);
        board_pin_drive_at(board, T0, 0, board_cycle(board) + 30 + 20 * i);
    }
    run(300);
    TEST_ASSERT_EQUAL(10, read(TCNT0));
}

static void test_each_timer_interrupts_through_its_own_vectors(void)
{
    static const struct {
        uint16_t mask;
        int vector;
    } timer[3] = {{TIMSK0, 14}, {TIMSK1, 11}, {TIMSK2, 7}};
    write(TCCR0B, 1);
    write(TCCR1B, 1);
    write(TCCR2B, 1);
    run(70000);
    for (int i = 0; i < 3; i++)
        for (int flag = 0; flag < 3; flag++) {
            int vector = timer[i].vector + (flag == 0 ? 2 : flag - 1);
            write(timer[i].mask, (uint8_t)(1 << flag));
            allow_interrupts();
            run(100);
            write(timer[i].mask, 0);
            TEST_ASSERT_NOT_EQUAL(0, get("counts", (unsigned)vector));
            for (unsigned other = 0; other < 26; other++) {
                if ((int)other != vector)
                    TEST_ASSERT_EQUAL(0, get("counts", other));
                set("counts", other, 0);
            }
        }
}

/* -- laziness must not show ----------------------------------------------------------------------------------------------- */

static void test_a_timer_nobody_watches_ends_up_like_a_watched_one(void)
{
    uint8_t count[2], flags[2];
    uint16_t count1[2];
    int level[2], level1[2];
    for (int watched = 0; watched < 2; watched++) {
        board_free(board);
        start_remote();
        board_record(board, OC2A, watched);
        board_record(board, OC1A, watched);
        write(DDRB, 0x0E);
        write(OCR2A, 6);
        write(TCCR2A, 0x42);
        write(TCCR2B, 1);
        start_timer1(15, COM1A(1) | COM1B(2), 12344, 99, CLK_1);
        run(1234567);
        level[watched] = board_pin_level(board, OC2A);
        level1[watched] = board_pin_level(board, OC1A);
        count[watched] = read(TCNT2);
        count1[watched] = read16(TCNT1);
        flags[watched] = read(TIFR1);
    }
    TEST_ASSERT_EQUAL(level[1], level[0]);
    TEST_ASSERT_EQUAL(level1[1], level1[0]);
    TEST_ASSERT_EQUAL(count[1], count[0]);
    TEST_ASSERT_EQUAL(count1[1], count1[0]);
    TEST_ASSERT_EQUAL(flags[1], flags[0]);
}

/* Two boards get the same random writes; on one the pins are recorded, so that each edge must be made in its time.
 * Interrupts must come in the same cycles on both, or their programs fall apart. */
typedef struct {
    board_t *board;
    uint32_t edges, late;
} punctual_t;

static void see_whether_in_time(void *ctx, board_edge_t edge)
{
    punctual_t *seen = ctx;
    seen->edges++;
    if (edge.cycle != board_cycle(seen->board))
        seen->late++;
}

static uint32_t random_below(uint32_t *state, uint32_t limit)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) % limit;
}

static void random_write(uint32_t choice, uint32_t n)
{
    switch (choice) {
    case 0: write(TCCR1A, (uint8_t)n); break;
    case 1: write(TCCR1B, (uint8_t)((n & 0x18) | (n & 0x100 ? CLK_8 : CLK_1))); break;
    case 2: write16(OCR1A, (uint16_t)(n % 300)); break;
    case 3: write16(OCR1B, (uint16_t)(n % 300)); break;
    case 4: write16(ICR1, (uint16_t)(n % 300)); break;
    case 5: write16(TCNT1, (uint16_t)(n % 400)); break;
    case 6: write(TIFR1, (uint8_t)n); break;
    case 7: write(TCCR1C, (uint8_t)n); break;
    case 8: write(TIMSK1, n & (TOV | OCFA | OCFB | ICF)); break;
    }
}

static void test_random_writes_leave_a_watched_and_an_unwatched_timer_alike(void)
{
    uint32_t state = 1;
    board_t *both[2];
    punctual_t seen_edges = {NULL, 0, 0};
    board_free(board);
    for (int i = 0; i < 2; i++) {
        start_remote();
        both[i] = board;
        write(DDRB, 0x06);
        board_record(board, OC1A, i);
        board_record(board, OC1B, i);
        allow_interrupts();
    }
    seen_edges.board = board;
    board_on_edge(board, see_whether_in_time, &seen_edges);
    for (int round = 0; round < 3000; round++) {
        uint32_t choice = random_below(&state, 9);
        uint32_t n = random_below(&state, 0x10000);
        uint32_t wait = random_below(&state, round % 50 ? 2000 : 200000);
        uint16_t seen[2];
        for (int i = 0; i < 2; i++) {
            board = both[i];
            random_write(choice, n);
            run(wait);
        }
        for (board_pin_t pin = OC1A; pin <= OC1B; pin++)
            TEST_ASSERT_EQUAL(board_pin_level(both[0], pin), board_pin_level(both[1], pin));
        for (int i = 0; i < 2; i++) {
            board = both[i];
            seen[i] = (uint16_t)(read(TIFR1) << 8);
            seen[i] = (uint16_t)(seen[i] | read(TCNT1));
        }
        TEST_ASSERT_EQUAL_HEX16(seen[1], seen[0]);
        TEST_ASSERT_EQUAL_UINT64(board_cycle(both[1]), board_cycle(both[0]));
    }
    TEST_ASSERT_GREATER_THAN(5000, seen_edges.edges);
    TEST_ASSERT_EQUAL(0, seen_edges.late);
    board_free(both[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_mode_15_non_inverting_rises_at_bottom_and_falls_after_the_match);
    RUN_TEST(test_mode_15_inverting_rises_after_the_match_and_falls_at_bottom);
    RUN_TEST(test_mode_15_takes_new_compare_values_at_bottom_only);
    RUN_TEST(test_mode_14_takes_ocr1b_at_bottom_only_and_icr1_at_once);
    RUN_TEST(test_modes_5_6_7_turn_at_their_fixed_tops);
    RUN_TEST(test_a_compare_value_read_back_is_the_buffered_one);
    RUN_TEST(test_leaving_pwm_makes_the_compare_registers_direct);
    RUN_TEST(test_ocr1b_above_top_never_falls_when_non_inverting);
    RUN_TEST(test_ocr1b_above_top_never_rises_when_inverting);
    RUN_TEST(test_ocr1b_at_bottom_gives_a_spike_of_one_tick);
    RUN_TEST(test_ocr1b_at_top_is_constant_in_both_polarities);
    RUN_TEST(test_mode_15_toggles_oc1a_at_top_and_leaves_oc1b_alone_with_com_1);
    RUN_TEST(test_overflow_in_fast_pwm_comes_when_top_is_reached);
    RUN_TEST(test_overflow_in_fast_pwm_comes_when_top_is_left_if_asked_for);
    RUN_TEST(test_overflow_interrupts_are_counted_once_a_period);
    RUN_TEST(test_a_disconnected_output_shows_port_while_the_latch_keeps_its_level);
    RUN_TEST(test_an_output_needs_its_ddr_bit);
    RUN_TEST(test_writing_port_leaves_a_connected_output_alone);
    RUN_TEST(test_set_on_compare_makes_one_edge_and_no_other);
    RUN_TEST(test_clear_on_compare_makes_one_edge_and_no_other);
    RUN_TEST(test_foc_strobes_set_clear_and_toggle_without_a_flag);
    RUN_TEST(test_foc_does_nothing_in_pwm);
    RUN_TEST(test_foc_strobes_timer2);
    RUN_TEST(test_ctc_toggles_each_period);
    RUN_TEST(test_ctc_with_the_compare_value_already_passed_runs_on_to_max);
    RUN_TEST(test_ctc_12_takes_icr1_as_top);
    RUN_TEST(test_normal_mode_overflows_when_it_becomes_zero);
    RUN_TEST(test_a_compare_flag_comes_one_tick_after_the_match);
    RUN_TEST(test_writing_tcnt1_blocks_the_compare_of_the_next_tick);
    RUN_TEST(test_writing_tcnt1_at_top_runs_on_to_max);
    RUN_TEST(test_tcnt1_preset_while_stopped_is_kept);
    RUN_TEST(test_a_stopped_timer_keeps_its_count);
    RUN_TEST(test_mode_10_phase_correct_is_symmetric_about_top);
    RUN_TEST(test_phase_correct_overflows_at_bottom);
    RUN_TEST(test_phase_correct_loads_at_top_and_phase_and_frequency_correct_at_bottom);
    RUN_TEST(test_input_capture_takes_the_count_and_sets_its_flag);
    RUN_TEST(test_writing_a_one_clears_that_flag_only);
    RUN_TEST(test_sbi_on_tifr1_clears_its_bit_only);
    RUN_TEST(test_cbi_on_tifr1_clears_nothing);
    RUN_TEST(test_a_request_withdrawn_by_its_flag_comes_again_at_the_next_match);
    RUN_TEST(test_all_16_bit_registers_share_one_byte_for_the_high_half);
    RUN_TEST(test_reading_a_compare_register_leaves_the_shared_byte_alone);
    RUN_TEST(test_the_high_byte_alone_changes_nothing);
    RUN_TEST(test_reading_tcnt1_low_freezes_its_high_byte);
    RUN_TEST(test_icr1_is_writable_only_while_it_is_top);
    RUN_TEST(test_prescaled_clocks_tick_at_multiples_since_the_prescaler_reset);
    RUN_TEST(test_tsm_halts_timers_0_and_1_until_it_is_cleared);
    RUN_TEST(test_the_t1_pin_clocks_at_rising_edges_three_cycles_late);
    RUN_TEST(test_the_t1_pin_clocks_at_falling_edges);
    RUN_TEST(test_a_megahertz_on_t1_is_counted_exactly);
    RUN_TEST(test_timer2_wired_to_t1_clocks_timer1);
    RUN_TEST(test_timer2_makes_one_megahertz);
    RUN_TEST(test_timer0_ctc_with_the_compare_value_already_passed_runs_on_to_max);
    RUN_TEST(test_timer0_fast_pwm_drives_both_outputs);
    RUN_TEST(test_timer0_mode_7_takes_ocr0a_as_top_and_buffers_it);
    RUN_TEST(test_timer0_phase_correct_counts_510_ticks_a_period);
    RUN_TEST(test_timer0_and_timer1_share_a_prescaler_and_timer2_has_its_own);
    RUN_TEST(test_timer2_has_seven_divisions);
    RUN_TEST(test_the_t0_pin_clocks_timer0);
    RUN_TEST(test_each_timer_interrupts_through_its_own_vectors);
    RUN_TEST(test_a_timer_nobody_watches_ends_up_like_a_watched_one);
    RUN_TEST(test_random_writes_leave_a_watched_and_an_unwatched_timer_alike);
    return UNITY_END();
}
