/* For the tests of the whole image: a board that runs build/sac.elf, a user who types, an oscilloscope on clk and dir.
 *
 * Units:   cycles of 62.5 ns (16 a microsecond), also called ticks; intervals are measured between rising edges of clk.
 * Errors:  everything here that can go wrong fails the running test and says what was expected, what was seen, and at
 *          which pulse, cycle or byte they part.
 * One board at a time: image_power_on() makes it, image_off() (in tearDown) takes it away. Others that were made before stay,
 * and the oscilloscope sees the pulses of all of them. */
#ifndef TEST_IMAGE_H
#define TEST_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <unity.h>
#include "board/bus.h"
#include "settings.h"

#define US 16ull /* cycles */
#define MS (1000 * US)
#define SECOND (1000 * MS)
#define BAUD 38400u /* factory */

#define CLK BOARD_PIN('B', 2)
#define DIR BOARD_PIN('B', 5)
#define RST BOARD_PIN('B', 0)
#define OPSA BOARD_PIN('C', 5)
#define OPSB BOARD_PIN('C', 2)
#define TX_EN BOARD_PIN('D', 7)

enum { STANDBY, ACCEL, CRUISE, DECEL, STOP };

extern board_t *board;
extern bus_t *image_bus; /* not NULL: it runs the board, and others with it (no image_trace() then) */

void image_fail(const char *format, ...) __attribute__((format(printf, 1, 2), __noreturn__));

/* -- power ------------------------------------------------------------------------------------------------------- */

void image_power_on(void); /* stands where the settings have been loaded: they can be written with IMAGE_SET */
void image_power_on_with(const uint8_t *eeprom); /* the same, with these contents */
void image_load_settings(void);                  /* after a reset: on to there */
void image_prompt(void);   /* on to the first prompt; what was printed and recorded until then is forgotten */
void image_boot(void);     /* both */
void image_boot_again(void); /* after a reset: on to the first prompt */
void image_off(void);

/* One parameter in RAM before anything has read it; the firmware's struct has no padding on either machine. */
#define IMAGE_SET(member, value) \
    image_poke_setting(offsetof(settings_t, member), sizeof(((settings_t *)0)->member), (uint32_t)(value))
void image_poke_setting(size_t offset, size_t bytes, uint32_t value);

uint8_t image_peek(const char *symbol); /* a byte in RAM */

/* -- the user ---------------------------------------------------------------------------------------------------- */

void image_send(const char *text);       /* appended to what the peer sends; time does not pass */
void image_sent(void);                   /* time passes until the peer's last stop bit and what it causes is over */
const char *image_ask(const char *line); /* types the line and CR; what is printed between its echo and the prompt */
void image_do(const char *line);         /* the same; it must be taken without a word */
void image_refused(const char *line, const char *answer); /* the same; the answer must be this one, CR LF apart */
const char *image_take_text(void); /* all that was printed since the last line was asked; it is forgotten then */
void image_run(uint64_t cycles);
void image_idle(uint64_t most_cycles); /* until the motor stands, nothing is pending and the gap is over */
bool image_idles(uint64_t most_cycles);      /* whether it does so in that time */
void image_until_state(uint8_t state, uint64_t most_cycles);
void image_until_pulses(size_t count, uint64_t most_cycles);
int32_t image_position(void); /* as `p` shows it; it must show STANDBY and no fault */
int32_t image_position_and_faults(unsigned *faults); /* the same, where there may be some (engine.h) */

/* Row n of the queue as `q` prints it, CR LF apart. The display is asked for once: *display = image_display("q"). */
const char *image_row(const char *display, unsigned n);
const char *image_display(const char *line); /* as image_ask(), in a buffer of its own that lives until the next one */
void image_assert_row(unsigned n, const char *expected);
void image_assert_holds(const char *text, const char *part);

/* -- the oscilloscope -------------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t cycle; /* rising edge of clk */
    uint8_t dir;    /* level at that moment */
} pulse_t;

typedef struct {
    pulse_t *pulse;
    size_t count;
    size_t capacity;
    bool keep;             /* false: pulses are counted and measured, not kept; true after image_prompt() */
    int64_t position;      /* low dir counts up */
    uint64_t interval_min; /* ~0 if there was none */
    uint64_t high_min, high_max, low_min;
    uint64_t dir_setup_min; /* from a change of dir to the next rising edge */
    uint64_t dir_hold_min;  /* from a falling edge of clk to a change of dir */
    uint64_t last_rise, last_fall, last_dir;
} train_t;

extern train_t train; /* since image_train_clear() */
void image_on_edge(void *ctx, board_edge_t edge); /* for who takes the board's edges himself, and passes on these */
void image_train_clear(void);
uint64_t image_interval(size_t k); /* from pulse k to pulse k + 1 */

void image_assert_pulses(size_t expected);
void image_assert_interval(size_t k, double ticks, double tolerance);
void image_assert_intervals(size_t first, size_t count, double ticks, double tolerance); /* all the same */
void image_assert_no_pulse_for(uint64_t cycles);
/* `value` lies within `tolerance` of `expected`; what names it. */
void image_assert_near(const char *what, double expected, double value, double tolerance);

/* The state byte: every change with its cycle, since image_trace(true). */
typedef struct {
    uint64_t cycle;
    uint8_t state;
} change_t;
extern change_t changes[];
extern size_t change_count;
void image_trace(bool on);
void image_assert_states(const char *expected); /* e.g. "ACDP0": ACCEL CRUISE DECEL STOP STANDBY */

#endif
