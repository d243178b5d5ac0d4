/* The registers of Timer1, datasheet 16.11. */
#include "timer.h"

#define REG_TCCR1A 0x80
#define REG_TCCR1B 0x81
#define REG_TCCR1C 0x82
#define REG_TCNT1L 0x84
#define REG_TCNT1H 0x85
#define REG_ICR1L 0x86
#define REG_ICR1H 0x87
#define REG_OCR1AL 0x88
#define REG_OCR1AH 0x89
#define REG_OCR1BL 0x8A
#define REG_OCR1BH 0x8B

#define FOC_A 0x80
#define FOC_B 0x40

static counter_t *timer1(board_t *b)
{
    return &b->timers->timer[1];
}

/* Table 16-4: WGM13:0 */
static void apply_control(counter_t *t, uint64_t cycle)
{
    static const struct {
        wave_t wave;
        top_from_t from;
        uint16_t fixed_top;
    } mode[16] = {
        {WAVE_NORMAL, TOP_FIXED, 0xFFFF}, {WAVE_PHASE, TOP_FIXED, 0x00FF},  {WAVE_PHASE, TOP_FIXED, 0x01FF},
        {WAVE_PHASE, TOP_FIXED, 0x03FF},  {WAVE_CTC, TOP_OCRA, 0},          {WAVE_FAST, TOP_FIXED, 0x00FF},
        {WAVE_FAST, TOP_FIXED, 0x01FF},   {WAVE_FAST, TOP_FIXED, 0x03FF},   {WAVE_PHASE_FREQ, TOP_ICR, 0},
        {WAVE_PHASE_FREQ, TOP_OCRA, 0},   {WAVE_PHASE, TOP_ICR, 0},         {WAVE_PHASE, TOP_OCRA, 0},
        {WAVE_CTC, TOP_ICR, 0},           {WAVE_NORMAL, TOP_FIXED, 0xFFFF}, {WAVE_FAST, TOP_ICR, 0},
        {WAVE_FAST, TOP_OCRA, 0},
    };
    uint8_t a = REG(t->board, REG_TCCR1A);
    int wgm = (a & 3) | (REG(t->board, REG_TCCR1B) >> 1 & 0x0C);
    /* Tables 16-2, 16-3: COM1A = 1 toggles in these PWM modes */
    bool may_toggle = wgm == 14 || wgm == 15 || wgm == 9 || wgm == 11;

    timer_set_wave(t, mode[wgm].wave, mode[wgm].from, mode[wgm].fixed_top);
    timer_set_output(t, 0, a >> 6 & 3, may_toggle, cycle);
    timer_set_output(t, 1, a >> 4 & 3, false, cycle);
}

/* Table 16-5: CS12:0 */
static void apply_clock(counter_t *t)
{
    static const int shift[6] = {0, 0, 3, 6, 8, 10};
    int cs = REG(t->board, REG_TCCR1B) & 7;

    if (cs == 0) {
        timer_set_clock(t, CLOCK_STOPPED, 0);
    } else if (cs >= 6) {
        timer_set_clock(t, CLOCK_EXTERNAL, 0);
        t->external_rising = cs == 7;
    } else {
        timer_set_clock(t, CLOCK_INTERNAL, shift[cs]);
    }
}

static void write_control(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    counter_t *t = timer1(b);

    timer_sync(t, cycle);
    switch (address) {
    case REG_TCCR1A:
        REG(b, address) = value;
        apply_control(t, cycle);
        break;
    case REG_TCCR1B:
        REG(b, address) = value;
        apply_control(t, cycle);
        apply_clock(t);
        break;
    case REG_TCCR1C: /* strobes, read as 0 */
        if (value & FOC_A)
            timer_force_compare(t, 0, cycle);
        if (value & FOC_B)
            timer_force_compare(t, 1, cycle);
        break;
    }
    timer_plan(t);
}

/* 16.3: the high byte waits in TEMP, one for all, until the low byte is written: then both arrive together. */
static void write_high(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    (void)address;
    (void)cycle;
    timer1(b)->temp = value;
}

static void write_low(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    counter_t *t = timer1(b);
    uint16_t both = (uint16_t)(t->temp << 8 | value);

    timer_sync(t, cycle);
    switch (address) {
    case REG_TCNT1L: timer_write_count(t, both); break;
    case REG_ICR1L: /* 16.6: writable only while it is TOP */
        if (t->top_from == TOP_ICR) {
            t->icr = both;
            t->top = both;
        }
        break;
    case REG_OCR1AL: timer_write_compare(t, 0, both); break;
    case REG_OCR1BL: timer_write_compare(t, 1, both); break;
    }
    timer_plan(t);
}

/* Reading the low byte of TCNT1 or ICR1 takes the high byte into TEMP; OCR1x is read without TEMP. */
static uint8_t read_low(board_t *b, uint16_t address, uint64_t cycle)
{
    counter_t *t = timer1(b);
    uint16_t both;

    timer_sync(t, cycle);
    both = address == REG_TCNT1L ? t->count : t->icr;
    t->temp = (uint8_t)(both >> 8);
    return (uint8_t)both;
}

static uint8_t read_high(board_t *b, uint16_t address, uint64_t cycle)
{
    (void)address;
    (void)cycle;
    return timer1(b)->temp;
}

static uint8_t read_compare(board_t *b, uint16_t address, uint64_t cycle)
{
    uint16_t both = timer1(b)->compare[address >= REG_OCR1BL].buffer;
    (void)cycle;
    return (uint8_t)(address & 1 ? both >> 8 : both);
}

void timer16_init(counter_t *t)
{
    board_t *b = t->board;

    timer_init(t);
    for (uint16_t address = REG_TCCR1A; address <= REG_TCCR1C; address++)
        reg_on_write(b, address, write_control);
    for (uint16_t low = REG_TCNT1L; low <= REG_OCR1BL; low += 2) {
        reg_on_write(b, low, write_low);
        reg_on_write(b, (uint16_t)(low + 1), write_high);
        reg_on_read(b, low, low < REG_OCR1AL ? read_low : read_compare);
        reg_on_read(b, (uint16_t)(low + 1), low < REG_OCR1AL ? read_high : read_compare);
    }
}
