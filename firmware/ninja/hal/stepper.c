/* Both motors, by compare matches of Timer1, which runs freely at 0.5 us a tick.
 *
 * A wait ends at a compare match; the next one is counted from there, whenever the interrupt comes. Waits of 65,536
 * ticks and more are a rest of 32,768 to 65,535 and chunks of 32,768: no match is ever set closer than 1 ms ahead, so
 * none is missed.
 * Shared:  between the main loop and the interrupt; who writes what stands at each variable. The main loop writes
 *          those that are the interrupt's only while it is disabled (OCIE1A is 0).
 * Source:  ATmega328P datasheet DS40002061, 16.9.1 (normal mode), 16.3 (16-bit registers). */
#include <avr/interrupt.h>
#include <avr/io.h>
#include "base/atomic.h"
#include "base/wake.h"
#include "ninja/hal/pins.h"
#include "ninja/receive_port.h"
#include "ninja/stepper_port.h"

#define WAITS 8 /* a power of two: so many steps less one the main loop may be late */
#define CHUNK_LOG2 15
#define CHUNK_TICKS (1u << CHUNK_LOG2)
#define LATE_TICKS 200 /* 100 us: then it is looked again for a wait that is late */

typedef struct {
    uint16_t ticks;
    uint8_t chunks; /* of CHUNK_TICKS, besides */
    uint8_t action;
} wait_t;

static volatile wait_t waits[WAITS];
static volatile uint8_t head;  /* main loop: where the next wait goes */
static volatile uint8_t tail;  /* interrupt: where the next one is taken; equal: none */
static volatile bool halted;   /* main loop sets it, start clears it */
static uint8_t chunks;         /* interrupt: left of the present wait */
static uint8_t action;         /* interrupt: what follows it; 0: nothing, it is a wait for the main loop */
static volatile uint16_t counts[AXES]; /* interrupt: steps */

static const uint8_t patterns[4] = {0x3, 0x6, 0xC, 0x9}; /* AB, BC, CD, DA */

static uint8_t pattern(uint8_t axis)
{
    return patterns[counts[axis] & 3];
}

/* All coils of an axis change at once. */

static void set_x(uint8_t coils)
{
    PORTD = (uint8_t)((PORTD & ~PINS_COILS_X) | coils << PINS_COILS_X_SHIFT);
}

static void set_y(uint8_t coils)
{
    PORTC = (uint8_t)((PORTC & ~PINS_COILS_Y) | coils);
}

static void count(uint8_t axis, uint8_t bits)
{
    counts[axis] = (uint16_t)(counts[axis] + ((bits & STEPPER_NEGATIVE) != 0 ? UINT16_MAX : 1));
}

/* -- the interrupt ------------------------------------------------------------------------------------------------- */

static void end(void)
{
    set_x(0);
    set_y(0);
    TIMSK1 = 0;
    wake_flag = 1;
}

static void load(const volatile wait_t *wait)
{
    OCR1A = (uint16_t)(OCR1A + wait->ticks);
    chunks = wait->chunks;
    action = wait->action;
}

ISR(TIMER1_COMPA_vect)
{
    if (chunks != 0) {
        chunks--;
        OCR1A = (uint16_t)(OCR1A + CHUNK_TICKS);
        return;
    }
    if (halted || (action & STEPPER_END) != 0 || receive_port_halts()) {
        end();
        return;
    }
    if ((action & STEPPER_STEP << 2 * AXIS_X) != 0) {
        count(AXIS_X, action >> 2 * AXIS_X);
        set_x(pattern(AXIS_X));
    }
    if ((action & STEPPER_STEP << 2 * AXIS_Y) != 0) {
        count(AXIS_Y, action >> 2 * AXIS_Y);
        set_y(pattern(AXIS_Y));
    }
    if (tail == head) {
        action = 0;
        OCR1A = (uint16_t)(OCR1A + LATE_TICKS);
        return;
    }
    load(&waits[tail]);
    tail = (tail + 1) & (WAITS - 1);
}

/* -- the main loop's ----------------------------------------------------------------------------------------------- */

void stepper_port_init(void)
{
    TCCR1A = 0;
    TCCR1B = _BV(CS11);
}

static wait_t to_wait(const stepper_wait_t *from)
{
    wait_t wait = {.chunks = (uint8_t)(from->ticks >> CHUNK_LOG2), .action = from->action};
    if (wait.chunks != 0) {
        wait.chunks--;
    }
    wait.ticks = (uint16_t)(from->ticks - ((uint32_t)wait.chunks << CHUNK_LOG2));
    return wait;
}

void stepper_port_start(uint8_t axes, const stepper_wait_t *first)
{
    const volatile wait_t wait = to_wait(first);
    tail = head;
    halted = false;
    const uint8_t state = atomic_begin();
    OCR1A = TCNT1;
    if ((axes & 1 << AXIS_X) != 0) {
        set_x(pattern(AXIS_X));
    }
    if ((axes & 1 << AXIS_Y) != 0) {
        set_y(pattern(AXIS_Y));
    }
    load(&wait);
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
    atomic_end(state);
}

bool stepper_port_room(void)
{
    return (uint8_t)((head + 1) & (WAITS - 1)) != tail;
}

void stepper_port_put(const stepper_wait_t *from)
{
    const wait_t wait = to_wait(from);
    volatile wait_t *slot = &waits[head];
    slot->ticks = wait.ticks;
    slot->chunks = wait.chunks;
    slot->action = wait.action;
    head = (head + 1) & (WAITS - 1);
}

void stepper_port_halt(void)
{
    halted = true;
}

bool stepper_port_runs(void)
{
    return TIMSK1 != 0;
}

uint16_t stepper_port_count(uint8_t axis)
{
    return counts[axis];
}
