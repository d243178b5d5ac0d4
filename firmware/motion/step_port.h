/* What the motion engine needs of the hardware; implemented by hal/step_timer.c, faked in the host tests.
 *
 * Context: main loop only.
 * Source:  datasheet DS40002061 chapter 16. */
#ifndef MOTION_STEP_PORT_H
#define MOTION_STEP_PORT_H

#include <stdbool.h>
#include <stdint.h>

void step_port_init(void);

/* Which clock the timer is started with from now on: the CPU's, or rising edges of the xclk post, at most 6.4 MHz. That one
 * may stand still at any time: then nothing moves, and nobody waits for it. */
void step_port_clock(bool external);

/* Level of the dir pin, at once. Only in standstill. */
void step_port_dir(bool level);

/* Levels of MS1 (bit 0), MS2, MS3, at once. Only in standstill. */
void step_port_microsteps(uint8_t pins);

/* Begins to play the ring, which holds at least one segment, after a short silent lead of STEP_PORT_LEAD_TICKS. */
void step_port_start(void);
#define STEP_PORT_LEAD_TICKS 16u

/* The same, but the timer stands ready until step_port_release() or a falling edge of the sync pin. */
void step_port_hold(void);
void step_port_release(void); /* with nothing held, nothing happens */
bool step_port_held(void);    /* it stands ready still */

/* Stops the timer at once, except that a pulse which has begun or is about to is completed first. No edge comes after
 * the return; step_port_snapshot() then tells where it stopped. */
void step_port_halt(void);

/* Before a segment with SEGMENT_HURRIED_BIT is put into the ring: its periods bear no start edge's interrupt, which goes
 * before the step interrupt. */
void step_port_hurry(void);
uint8_t step_port_hurries(void); /* not 0: such a segment is running, or in the ring */

/* Waits until all of the ring has been played: for a few microseconds of pulses only. */
void step_port_finish(void);

/* Where the step interrupt is, read in one atomic section. */
typedef struct {
    uint8_t tail;         /* step_tail */
    uint16_t to_count;    /* periods of the loaded segment not yet begun (less those waited for early) */
    bool pulse_high;      /* clk is high: the running period's pulse has been made */
    bool period_over;     /* a period has ended that the interrupt has not counted yet */
} step_snapshot_t;
step_snapshot_t step_port_snapshot(void);

/* Ticks since the running period began. */
uint16_t step_port_counter(void);

/* Turns the silent one-period segment at `offset`, the last but for silence, into one that ends with a pulse (or, with
 * SEGMENT_SILENT, does not), and drops what follows it in the ring. False if it has begun, or is about to: nothing is changed then. */
bool step_port_arm(uint8_t offset, uint16_t top, uint16_t match, uint8_t flags);

/* Adds one period to the segment at `offset` and drops what follows it. False if its end is too near. */
bool step_port_extend(uint8_t offset);

/* Lets the segment at `offset` end after at most `periods` more periods and drops what follows it. Returns how many of
 * its periods were dropped. */
uint16_t step_port_shorten(uint8_t offset, uint16_t periods);

#endif
