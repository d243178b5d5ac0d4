/* Timer1 under the step engine: fast PWM mode 15 on OC1B, inverting (see motion/segment.h and docs/design.md).
 *
 * Every section with interrupts off is short: the step interrupt may be due every 32 cycles. Timer1's 16-bit registers
 * share one TEMP byte, so the main loop touches them only with interrupts off or the timer stopped. */
#include "base/atomic.h"
#include "base/inline.h"
#include "motion/estop_port.h"
#include "motion/segment.h"
#include "motion/step_port.h"
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stddef.h>

#define MODE15_A (1 << COM1B1 | 1 << COM1B0 | 1 << WGM11 | 1 << WGM10)
#define MODE15_B (1 << WGM13 | 1 << WGM12)
#define RUNNING (MODE15_B | 1 << CS10)
#define LEAD_BEGIN 4 /* not at BOTTOM, where the buffers would be loaded */

/* Ticks between reading TCNT1 and the timer standing still, and a margin; of an external clock, of 2.5 cycles at least. */
#define FREEZE_TICKS 16
#define FREEZE_EXTERNAL_TICKS 6

/* So near its end a period is waited for: 6 cycles a poll are longer than that, and than one that is reloaded early. */
#define NEAR_END_TICKS 40
#define END_POLLS 15

/* An external clock is looked at up to 256 times, but for these only where no pulse is near. Not if so few ticks of a period
 * are not near its pulse: then a tick is 4 cycles or more, and two of them are the most that can be missed. */
#define HURRIED_ROUNDS 64
#define SAFE_TICKS 16

/* Ticks between reading TCNT1 and the last of the buffers written, and a margin. */
#define ARM_TICKS 64
/* Where periods are short there is no time to look at all this with interrupts off. */
#define ARM_LEAST_TICKS 256

/* Timer1's registers as they lie in the memory (datasheet, register summary): written one after the other they are
 * reached by a displacement, in instructions half as long. */
typedef struct {
    uint8_t control_a, control_b, control_c, reserved;
    uint16_t counter, capture, top, match;
} timer1_t;

static inline volatile timer1_t *timer1(void)
{
    volatile timer1_t *timer = (volatile timer1_t *)&TCCR1A;
    NEAR(timer);
    return timer;
}

/* Periods less one, from the bytes that are counted down: the low one 1..256 times, and so often 256 more. */
static inline uint16_t less_one(uint8_t low, uint8_t high)
{
    return (uint16_t)((uint16_t)high << 8 | (uint8_t)(low - 1));
}

static inline void set_less_one(segment_t *segment, uint16_t periods_less_one)
{
    segment->count_low = (uint8_t)(periods_less_one + 1);
    segment->count_high = (uint8_t)(periods_less_one >> 8);
}

/* Mode 0, no clock: the compare registers are written directly (section 16.7.3). */
NOINLINE void step_port_init(void)
{
    TIMSK1 = 0;
    TCCR1B = 0;
    TCCR1A = 0;
}

void step_port_clock(bool external)
{
    step_clock = external ? MODE15_B | 1 << CS12 | 1 << CS11 | 1 << CS10 : RUNNING;
}

void step_port_dir(bool level)
{
    /* Single-bit instructions: no other bit of the port is touched. */
    if (level)
        PORTB |= 1 << 5;
    else
        PORTB &= (uint8_t)~(1 << 5);
}

/* The timer stands ready: all but its clock. */
static void make_ready(void)
{
    volatile timer1_t *const timer = timer1();
    step_port_init();
    timer->top = STEP_PORT_LEAD_TICKS + LEAD_BEGIN - 1;
    timer->match = SEGMENT_SILENT;
    timer->counter = LEAD_BEGIN;
    timer->control_a = MODE15_A;
    timer->control_b = MODE15_B;

    uint8_t first = step_tail;
    segment_t *lead = segment_at((uint8_t)(first - SEGMENT_BYTES));
    lead->top = STEP_PORT_LEAD_TICKS - 1;
    lead->match = SEGMENT_SILENT;
    lead->flags = 0;
    const segment_t *s = segment_at(first);
    lead->gear = s->gear;
    timer->top = s->top;
    timer->match = s->match;
    GPIOR0 = s->count_low;
    step_count_high = s->count_high;
    step_flags = s->flags;
    motion_state = s->flags & SEGMENT_STATE_MASK;
    step_tail = (uint8_t)(first + SEGMENT_BYTES);
    step_idle = 0;
    TIFR1 = 1 << TOV1;
    TIMSK1 = 1 << TOIE1;
}

/* The INT1 interrupt is enabled while the timer is held, the INT0 interrupt until Estop has struck. */
void step_port_hold(void)
{
    make_ready();
    EIFR = 1 << INTF1; /* an edge before this moment does not count */
    uint8_t state = atomic_begin();
    if (EIMSK & 1 << INT0)
        EIMSK |= 1 << INT1;
    atomic_end(state);
}

void step_port_start(void)
{
    make_ready();
    uint8_t state = atomic_begin();
    if (EIMSK & 1 << INT0)
        TCCR1B = step_clock;
    atomic_end(state);
}

void step_port_release(void)
{
    uint8_t state = atomic_begin();
    if (EIMSK & 1 << INT1) {
        TCCR1B = step_clock;
        EIMSK &= (uint8_t)~(1 << INT1);
    }
    atomic_end(state);
}

bool step_port_held(void)
{
    return EIMSK & 1 << INT1;
}

bool estop_port_active(void)
{
    return !(EIMSK & 1 << INT0) || !(PIND & 1 << 2);
}

bool estop_port_poll(void)
{
    bool active = estop_port_active();
    if (active && PIND & 1 << 2) /* not one that strikes just now */
        EIMSK |= 1 << INT0;
    return active;
}

/* Where step_snapshot.S puts them. */
_Static_assert(offsetof(step_snapshot_t, tail) == 0 && offsetof(step_snapshot_t, to_count) == 1 &&
                   offsetof(step_snapshot_t, pulse_high) == 3 && offsetof(step_snapshot_t, period_over) == 4 && TOV1 == 0,
               "in r18 to r22");

uint16_t step_port_counter(void)
{
    uint8_t state = atomic_begin();
    uint16_t counter = TCNT1;
    atomic_end(state);
    return counter;
}

/* Interrupts are off, and the period that runs ends soon: takes the clock away right behind it. False: it has not ended, or
 * Estop has come and knows better. */
static inline __attribute__((always_inline)) bool freeze_behind_period(volatile timer1_t *timer)
{
    for (uint8_t polls = END_POLLS; polls && !(EIFR & 1 << INTF0); polls--) {
        if (TIFR1 & 1 << TOV1) {
            timer->control_b = MODE15_B;
            return true;
        }
    }
    return false;
}

/* With an external clock, near a pulse or in it: the clock is taken where clk is low, and comes back if a pulse begins just
 * then. What it is away are 5 cycles, and the pulse is longer by the edges missed meanwhile. A pulse that has begun is
 * completed with that clock, which may stand still: in the last of the rounds with the internal one, and silence follows. */
static bool freeze_external(volatile timer1_t *timer, uint16_t safe, uint8_t clock, uint8_t rounds)
{
    if (rounds) {
        if ((rounds > HURRIED_ROUNDS && safe >= SAFE_TICKS) || PINB & 1 << 2)
            return false;
    } else {
        clock = MODE15_B;
    }
    timer->control_b = MODE15_B;
    __asm__ __volatile__("nop\n\tnop"); /* until the pin can be read */
    if (PINB & 1 << 2)
        timer->control_b = clock;
    if (!(PINB & 1 << 2))
        return true;
    if (rounds)
        return false;
    timer->top = SEGMENT_SILENT; /* and long: what is over then is this period */
    timer->match = SEGMENT_SILENT;
    timer->control_b = RUNNING;
    while (PINB & 1 << 2)
        ;
    timer->control_b = MODE15_B;
    return true;
}

/* Takes the clock away at once, if no pulse is near. Turns interrupts off; what can be worked out before is, and must still
 * hold. `behind`: the period ends soon. */
static inline __attribute__((always_inline)) bool freeze_within_period(volatile timer1_t *timer, uint8_t tail, uint8_t clock,
                                                                       uint8_t rounds, bool *behind)
{
    const segment_t *s = segment_at((uint8_t)(tail - SEGMENT_BYTES));
    uint8_t count_low = GPIOR0;
    bool first = count_low == s->count_low && step_count_high == s->count_high; /* its first period is still to come */
    if (first)
        s = segment_at((uint8_t)(tail - 2 * SEGMENT_BYTES));
    uint8_t reach = clock == RUNNING ? FREEZE_TICKS : FREEZE_EXTERNAL_TICKS;
    uint16_t safe = s->match < reach ? 0 : (uint16_t)(s->match - reach);
    uint16_t near_end = (uint16_t)(s->top - NEAR_END_TICKS);
    cli();
    if (tail != step_tail || (first && count_low != GPIOR0) || EIFR & 1 << INTF0)
        return false;
    uint16_t now = timer->counter;
    if (TIFR1 & 1 << TOV1)
        return false;
    if (now < safe && !(PINB & 1 << 2)) { /* external clock: after the interrupt it may be the period before, in its pulse */
        timer->control_b = MODE15_B;
        return true;
    }
    if (clock != RUNNING)
        return freeze_external(timer, safe, clock, rounds);
    *behind = now > near_end;
    return false;
}

void step_port_halt(void)
{
    volatile timer1_t *const timer = timer1();
    uint8_t rounds = 0;
    EIMSK &= (uint8_t)~(1 << INT1); /* from here on what is held stays so */
    if (timer->control_b == MODE15_B)
        TIMSK1 = 0;
    /* Until nobody counts: stopped, or playing uncounted silence. That may happen in here as well. */
    while (TIMSK1 & 1 << TOIE1) {
        uint8_t tail = step_tail;
        uint8_t clock = timer->control_b;
        bool frozen = false;
        bool behind = false;
        rounds--;
        if (clock == RUNNING && segment_at((uint8_t)(tail - SEGMENT_BYTES))->top < SEGMENT_EARLY1_BELOW_TICKS) {
            cli(); /* there is time for nothing but this */
            behind = true;
        } else {
            frozen = freeze_within_period(timer, tail, clock, rounds, &behind);
        }
        if (behind)
            frozen = freeze_behind_period(timer);
        if (frozen)
            TIMSK1 = 0;
        sei();
    }
    for (uint16_t polls = 1; PINB & 1 << 2; polls++) /* Estop's last pulse */
        if (polls == 0)
            TCCR1B = RUNNING; /* the external clock stands still */
    TCCR1B = MODE15_B;
}

uint8_t step_port_hurries(void)
{
    uint8_t flags = 0;
    uint8_t head = step_head;
    uint8_t offset = (uint8_t)(step_tail - SEGMENT_BYTES);
    if (segment_at(offset)->count_low == GPIOR0)
        offset = (uint8_t)(offset - SEGMENT_BYTES); /* its first period may be still to come */
    for (; offset != head; offset = (uint8_t)(offset + SEGMENT_BYTES))
        flags |= segment_at(offset)->flags;
    return flags & 1 << SEGMENT_HURRIED_BIT;
}

void step_port_finish(void)
{
    while (TIMSK1 || (TCCR1B == RUNNING && !(TIFR1 & 1 << TOV1)))
        ;
}

bool step_port_arm(uint8_t offset, uint16_t top, uint16_t match, uint8_t flags)
{
    segment_t *s = segment_at(offset);
    const segment_t *before = segment_at((uint8_t)(offset - SEGMENT_BYTES));
    uint16_t rise = before->top; /* or the end, if it is silent: Estop must not wait for this either */
    if (before->match < rise)
        rise = before->match;
    uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
    uint8_t head = step_head;
    bool done = false;
    uint8_t state = atomic_begin();
    uint8_t tail = step_tail;
    if (tail != after) {
        done = (uint8_t)(after - tail) <= (uint8_t)(head - tail);
    } else if (rise >= ARM_LEAST_TICKS && TIMSK1 && !(TIFR1 & 1 << TOV1) && (uint16_t)(TCNT1 + ARM_TICKS) < rise) {
        /* Loaded, but the period before it is still running: into the buffers. */
        OCR1A = top;
        OCR1B = match;
        step_flags = flags;
        done = true;
    }
    if (done) {
        s->top = top;
        s->match = match;
        s->flags = flags;
        step_head = after;
    }
    atomic_end(state);
    return done;
}

bool step_port_extend(uint8_t offset)
{
    segment_t *s = segment_at(offset);
    uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
    uint8_t head = step_head;
    uint16_t extended = (uint16_t)(less_one(s->count_low, s->count_high) + 1);
    bool done = false;

    uint8_t state = atomic_begin();
    uint8_t tail = step_tail;
    if (tail == after) {
        uint8_t low = GPIOR0;
        if (low >= 16 && low != 255) {
            GPIOR0 = (uint8_t)(low + 1);
            done = true;
        }
    } else if ((uint8_t)(after - tail) <= (uint8_t)(head - tail)) {
        set_less_one(s, extended); /* here already: the interrupt may be about to load it */
        done = true;
    }
    if (done)
        step_head = after;
    atomic_end(state);
    if (done)
        set_less_one(s, extended);
    return done;
}

uint16_t step_port_shorten(uint8_t offset, uint16_t periods)
{
    segment_t *s = segment_at(offset);
    uint8_t after = (uint8_t)(offset + SEGMENT_BYTES);
    uint16_t planned = less_one(s->count_low, s->count_high);
    uint16_t wanted = (uint16_t)(periods - 1);
    uint16_t left = planned;

    uint8_t state = atomic_begin();
    uint8_t tail = step_tail;
    step_head = after;
    if (tail != after) {
        set_less_one(s, wanted); /* here already: the interrupt may be about to load it */
    } else {
        left = less_one(GPIOR0, step_count_high);
        if (left > wanted) {
            GPIOR0 = (uint8_t)periods;
            step_count_high = (uint8_t)(wanted >> 8);
        } else {
            left = wanted;
        }
    }
    atomic_end(state);
    left = (uint16_t)(left - wanted);
    set_less_one(s, (uint16_t)(planned - left));
    return left;
}
