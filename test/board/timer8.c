/* The registers of Timer0 and Timer2, datasheet 15.9 and 18.11. */
#include "timer.h"

#define REG_TCCR0A 0x44
#define REG_TCCR2A 0xB0
/* Offsets from TCCRnA, the same in both. */
enum { TCCRA, TCCRB, TCNT, OCRA, OCRB };

#define FOC_A 0x80
#define FOC_B 0x40
#define WGM2 0x08

static counter_t *owner_of(board_t *b, uint16_t address)
{
    return &b->timers->timer[address >= REG_TCCR2A ? 2 : 0];
}

static uint16_t base_of(const counter_t *t)
{
    return t->number == 2 ? REG_TCCR2A : REG_TCCR0A;
}

/* Table 15-8: WGM02:0 */
static void apply_control(counter_t *t, uint64_t cycle)
{
    static const struct {
        wave_t wave;
        top_from_t from;
    } mode[8] = {
        {WAVE_NORMAL, TOP_FIXED}, {WAVE_PHASE, TOP_FIXED}, {WAVE_CTC, TOP_OCRA},     {WAVE_FAST, TOP_FIXED},
        {WAVE_NORMAL, TOP_FIXED}, {WAVE_PHASE, TOP_OCRA},  {WAVE_NORMAL, TOP_FIXED}, {WAVE_FAST, TOP_OCRA},
    };
    uint8_t a = REG(t->board, base_of(t) + TCCRA);
    uint8_t b = REG(t->board, base_of(t) + TCCRB);
    int wgm = (a & 3) | (b & WGM2 ? 4 : 0);

    timer_set_wave(t, mode[wgm].wave, mode[wgm].from, 0xFF);
    timer_set_output(t, 0, a >> 6 & 3, wgm & 4, cycle);
    timer_set_output(t, 1, a >> 4 & 3, false, cycle);
}

/* Tables 15-9 and 18-9: CSn2:0 */
static void apply_clock(counter_t *t)
{
    static const int shift0[6] = {0, 0, 3, 6, 8, 10};
    static const int shift2[8] = {0, 0, 3, 5, 6, 7, 8, 10};
    int cs = REG(t->board, base_of(t) + TCCRB) & 7;

    if (cs == 0) {
        timer_set_clock(t, CLOCK_STOPPED, 0);
    } else if (t->number == 0 && cs >= 6) {
        timer_set_clock(t, CLOCK_EXTERNAL, 0);
        t->external_rising = cs == 7;
    } else {
        timer_set_clock(t, CLOCK_INTERNAL, t->number == 2 ? shift2[cs] : shift0[cs]);
    }
}

static void write_register(board_t *board, uint16_t address, uint8_t value, uint64_t cycle)
{
    counter_t *t = owner_of(board, address);

    timer_sync(t, cycle);
    switch (address - base_of(t)) {
    case TCCRA:
        REG(board, address) = value;
        apply_control(t, cycle);
        break;
    case TCCRB:
        REG(board, address) = value & (uint8_t) ~(FOC_A | FOC_B); /* strobes read as 0 */
        apply_control(t, cycle);
        if (value & FOC_A)
            timer_force_compare(t, 0, cycle);
        if (value & FOC_B)
            timer_force_compare(t, 1, cycle);
        apply_clock(t);
        break;
    case TCNT: timer_write_count(t, value); break;
    case OCRA:
    case OCRB:
        REG(board, address) = value;
        timer_write_compare(t, address - base_of(t) - OCRA, value);
        break;
    }
    timer_plan(t);
}

static uint8_t read_count(board_t *board, uint16_t address, uint64_t cycle)
{
    counter_t *t = owner_of(board, address);
    timer_sync(t, cycle);
    return (uint8_t)t->count;
}

void timer8_init(counter_t *t)
{
    timer_init(t);
    for (uint16_t offset = TCCRA; offset <= OCRB; offset++)
        reg_on_write(t->board, (uint16_t)(base_of(t) + offset), write_register);
    reg_on_read(t->board, (uint16_t)(base_of(t) + TCNT), read_count);
}
