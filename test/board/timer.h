/* The counting machine that the three timers share; their register layouts are in timer8.c and timer16.c.
 *
 * A timer is lazy. Its state is true at cycle `at`; timer_sync() brings it up to a later cycle, tick by tick only where
 * something happens. An event is planned only for the next tick that somebody can see: an enabled interrupt, or an edge
 * of a pin that is watched.
 *
 * Vocabulary of datasheet 15.2 and 16.2: BOTTOM is 0, MAX all ones, TOP where the mode turns or returns. A tick is an
 * edge of the timer clock: the counter leaves one value and takes the next. What a compare match does (flag, pin) happens
 * at the tick that leaves the matching value (figures 16-10, 16-11). */
#ifndef BOARD_TIMER_H
#define BOARD_TIMER_H

#include "board_internal.h"

#define FLAG_TOV 0x01
#define FLAG_OCA 0x02
#define FLAG_OCB 0x04
#define FLAG_ICF 0x20

typedef enum {
    WAVE_NORMAL,     /* to MAX */
    WAVE_CTC,        /* to TOP, back to BOTTOM */
    WAVE_FAST,       /* the same, PWM, buffers load at BOTTOM */
    WAVE_PHASE,      /* up and down, buffers load at TOP */
    WAVE_PHASE_FREQ, /* up and down, buffers load at BOTTOM */
} wave_t;

typedef enum { TOP_FIXED, TOP_OCRA, TOP_ICR } top_from_t;

typedef enum { PIN_KEEPS, PIN_CLEARS, PIN_SETS, PIN_TOGGLES } pin_action_t;

typedef enum { CLOCK_STOPPED, CLOCK_INTERNAL, CLOCK_EXTERNAL } clock_source_t;

typedef struct {
    uint64_t zero; /* cycle at which it was 0 */
    bool held;     /* GTCCR TSM with the reset bit */
} prescaler_t;

typedef struct {
    uint16_t ocr;               /* what the comparator sees */
    uint16_t buffer;            /* what the program wrote; in non-PWM modes the same */
    bool connected;             /* COM: the latch replaces the PORT bit */
    bool latch;                 /* keeps its level while disconnected */
    pin_action_t at_match;      /* counting up, or in single-slope modes */
    pin_action_t at_match_down; /* double-slope modes, counting down */
    pin_action_t at_bottom;     /* fast PWM */
    board_pin_t pin;
    int vector;
} compare_t;

typedef struct {
    board_t *board;
    int number;
    uint16_t max;
    uint16_t reg_tifr, reg_timsk;
    event_slot_t slot;
    event_fn event;
    int vector_overflow;

    clock_source_t source;
    bool external_rising;
    int shift; /* log2 of the division */
    prescaler_t *prescaler;

    uint64_t at;
    uint16_t count;
    bool down;
    bool blocked; /* a write to TCNT keeps the next tick from matching, 16.7.2 */

    wave_t wave;
    top_from_t top_from;
    uint16_t top;
    uint16_t icr;
    compare_t compare[2];

    uint8_t temp; /* Timer1: the byte that its 16-bit registers share, 16.3 */
} counter_t;

struct timers {
    counter_t timer[3];
    prescaler_t shared;  /* Timer0 and Timer1 */
    prescaler_t timer2s; /* Timer2's own */
    board_tov_t tov;
    struct {
        uint64_t due[8];
        int count;
    } edge[3]; /* T0, T1, ICP1 on their way through the synchroniser */
};

/* timer.c: the machine */
void timer_init(counter_t *t);
void timer_sync(counter_t *t, uint64_t cycle);
void timer_plan(counter_t *t);
void timer_external_tick(counter_t *t, uint64_t cycle);
void timer_write_count(counter_t *t, uint16_t value);
void timer_write_compare(counter_t *t, int channel, uint16_t value);
/* com: COMnx1:0; may_toggle: the mode in which PWM's COM = 1 toggles OCnA */
void timer_set_wave(counter_t *t, wave_t wave, top_from_t from, uint16_t fixed_top);
void timer_set_output(counter_t *t, int channel, int com, bool may_toggle, uint64_t cycle);
void timer_force_compare(counter_t *t, int channel, uint64_t cycle);
void timer_set_clock(counter_t *t, clock_source_t source, int shift);
void timer_set_flags(counter_t *t, uint8_t flags, uint64_t cycle);
static inline bool timer_is_pwm(const counter_t *t)
{
    return t->wave >= WAVE_FAST;
}

/* timer8.c, timer16.c: registers */
void timer8_init(counter_t *t);
void timer16_init(counter_t *t);

/* timers.c: edges of T0 and T1, ICP1 */
void timers_clock_edges(board_t *b);

#endif
