/* Watchdog timer of the simulated board: DS40002061 sections 11.8 and 11.9.2, WDTON unprogrammed.
 *
 * Its oscillator has exactly the typical 128 kHz (125 cycles). The counter runs on at a time-out and stands still at 0
 * while the watchdog is stopped; another prescaler takes effect at the next multiple of its period since the last WDR. */
#include "board_internal.h"

#include <stdlib.h>

enum { WDTCSR = 0x60, MCUSR = 0x54 };
enum { WDE = 0x08, WDCE = 0x10, WDP3 = 0x20, WDIE = 0x40, WDIF = 0x80, WDP210 = 0x07 };
enum { WDRF = 0x08 };

#define OSCILLATOR_CYCLES 125u /* CPU cycles of one of its periods */
#define CHANGE_CYCLES 4u

struct watchdog {
    uint64_t cleared;       /* when the counter was last 0 */
    uint64_t changed_until; /* WDCE falls at this edge; a write at the same edge still finds it set */
};

static bool runs(const board_t *b)
{
    return REG(b, WDTCSR) & (WDE | WDIE);
}

static uint64_t period(const board_t *b)
{
    uint8_t control = REG(b, WDTCSR);
    uint32_t select = (control & WDP210) | (control & WDP3 ? 8u : 0u);
    if (select > 9)
        select = 9; /* reserved */
    return ((uint64_t)2048 << select) * OSCILLATOR_CYCLES;
}

static void timed_out(board_t *b, uint64_t cycle);

/* The next time-out after this cycle. */
static void plan(board_t *b, uint64_t cycle)
{
    if (!runs(b)) {
        event_cancel(b, EVENT_WATCHDOG);
        return;
    }
    uint64_t cleared = b->watchdog->cleared;
    uint64_t n = period(b);
    event_at(b, EVENT_WATCHDOG, cleared + ((cycle - cleared) / n + 1) * n, timed_out);
}

static void request(board_t *b, uint64_t cycle)
{
    uint8_t both = WDIE | WDIF;
    irq_set(b, VECTOR_WDT, (REG(b, WDTCSR) & both) == both, cycle);
}

static void timed_out(board_t *b, uint64_t cycle)
{
    uint8_t control = REG(b, WDTCSR);

    if (control & WDE && (!(control & WDIE) || control & WDIF)) {
        board_reset(b, BOARD_RESET_WATCHDOG);
        return;
    }
    REG(b, WDTCSR) = control | WDIF;
    request(b, cycle);
    plan(b, cycle);
}

static void acknowledged(board_t *b, int vector, uint64_t cycle)
{
    (void)vector;
    uint8_t control = (uint8_t)(REG(b, WDTCSR) & ~WDIF);
    if (control & WDE)
        control &= (uint8_t)~WDIE; /* the next time-out resets */
    REG(b, WDTCSR) = control;
    request(b, cycle);
}

static uint8_t read_control(board_t *b, uint16_t address, uint64_t cycle)
{
    uint8_t kept = REG(b, address) & (uint8_t)~WDCE; /* simavr stores what a hook returns */
    return (uint8_t)(kept | (cycle < b->watchdog->changed_until ? WDCE : 0));
}

static void write_control(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    struct watchdog *w = b->watchdog;
    const uint8_t guarded = WDP3 | WDP210 | WDE;
    uint8_t old = REG(b, address);
    bool ran = runs(b);
    uint8_t kept = old & guarded;

    if ((value & (WDCE | WDE)) == (WDCE | WDE)) {
        w->changed_until = cycle + CHANGE_CYCLES;
        kept |= WDE;
    } else {
        if (cycle <= w->changed_until)
            kept = value & guarded;
        else
            kept |= value & WDE; /* on at any time, off by the sequence alone */
        w->changed_until = 0;
    }
    if (REG(b, MCUSR) & WDRF)
        kept |= WDE;
    REG(b, address) = (uint8_t)(kept | (value & WDIE) | (old & WDIF & ~value));
    if (!ran)
        w->cleared = cycle;
    request(b, cycle);
    plan(b, cycle);
}

void watchdog_wdr(board_t *b, uint64_t cycle)
{
    b->watchdog->cleared = cycle;
    plan(b, cycle);
}

void watchdog_init(board_t *b)
{
    b->watchdog = calloc(1, sizeof *b->watchdog);
    if (!b->watchdog)
        abort();
    reg_on_read(b, WDTCSR, read_control);
    reg_on_write(b, WDTCSR, write_control);
    irq_on_ack(b, VECTOR_WDT, acknowledged);
}

void watchdog_reset(board_t *b)
{
    b->watchdog->cleared = board_time(b);
    b->watchdog->changed_until = 0;
    REG(b, WDTCSR) = 0;
    request(b, board_time(b));
    plan(b, board_time(b));
}

void watchdog_force(board_t *b)
{
    REG(b, WDTCSR) |= WDE;
    plan(b, board_time(b));
}

void watchdog_free(board_t *b)
{
    free(b->watchdog);
    b->watchdog = NULL;
}
