/* For the tests of the Ninja's image: a board that runs build/ninja.elf with a head on it, somebody who types at 4,800
 * baud, an oscilloscope on the coils. What image.h offers for any image may be used besides: time, typing, failing.
 *
 * Units:   cycles of 62.5 ns; steps. Axes as in firmware/ninja/stepper_port.h: AXIS_X is azimuth, AXIS_Y altitude.
 * Errors:  what goes wrong fails the running test: a pattern that is not n modulo 4 (n: steps of that motor since
 *          power-up, those up less those down), a transmitter at work, a step that the head's motor could not follow.
 * One board at a time: ninja_power_on() makes it, ninja_off() (in tearDown) takes it away. */
#ifndef TEST_IMAGE_NINJA_H
#define TEST_IMAGE_NINJA_H

#include "image.h"
#include "board/head.h"
#include "ninja/path.h"

#define NINJA_BAUD 4800u
#define NINJA_BIT (16000000ull / NINJA_BAUD)
#define NINJA_START_INTERVAL (SECOND / NINJA_START_STEPS_PER_S)
#define NINJA_JITTER (20 * US) /* of a step: interrupts before it */

typedef enum { NINJA_ON, NINJA_OFF, NINJA_UP, NINJA_DOWN } ninja_what_t; /* coils on, off; a step */
typedef struct {
    uint64_t cycle;
    uint8_t axis;
    ninja_what_t what;
} ninja_event_t;

extern head_t *ninja_head;
extern const char *const ninja_names[]; /* of ninja_what_t */

/* -- power ------------------------------------------------------------------------------------------------------- */

void ninja_power_on(const head_options_t *options);
/* A head at its centre: on to where it has been centred; what was recorded until then is forgotten. */
void ninja_home(void);
void ninja_reset(void); /* the button; the patterns begin at A+B again, and draw the rotors there */
void ninja_off(void);

/* -- typing -------------------------------------------------------------------------------------------------------- */

/* What is typed arrives, and what can be executed at once has been. */
void ninja_type(const char *text);
/* Appends a byte to what is being sent: the cycle at which its stop bit ends. */
uint64_t ninja_send(uint8_t byte);

/* -- the oscilloscope ---------------------------------------------------------------------------------------------- */

/* All since ninja_forget(), in order; those of one cycle X first. */
const ninja_event_t *ninja_events(size_t *count);
void ninja_forget(void);
size_t ninja_count(uint8_t axis, ninja_what_t what);
uint64_t ninja_cycle(uint8_t axis, ninja_what_t what, size_t which); /* of the event number `which` of these */
uint64_t ninja_last(uint8_t axis, ninja_what_t what);
void ninja_await(uint8_t axis, ninja_what_t what, size_t count, uint64_t most); /* so many of these; to a millisecond */
int ninja_made(uint8_t axis); /* steps up less steps down */

/* -- the head ------------------------------------------------------------------------------------------------------ */

bool ninja_current(void);            /* flows through some coil */
void ninja_rest(uint64_t most);      /* time passes until none has flowed for 350 ms */
int ninja_platform(uint8_t axis);    /* where it stands; nothing may have been lost on the way */
void ninja_assert_at(int x, int y);

#endif
