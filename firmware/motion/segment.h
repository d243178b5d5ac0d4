/* Segments: what the planner hands to the step interrupt.
 *
 * A segment is `periods` timer periods of equal length. Each period of a pulse segment ENDS with one pulse on clk: the
 * pin rises `pulse width` before the period's end and falls at its end (Timer1 mode 15, inverting output: set at
 * OCR1B, cleared at BOTTOM). A silent segment never matches (OCR1B above TOP), so long intervals are silent periods
 * closed by one period with a pulse, and everything that changes an edge goes through double-buffered registers.
 *
 * The ring is single-producer (main loop: step_head), single-consumer (step interrupt: step_tail). Both are byte
 * offsets into the ring, which is one 256-byte page, so that an offset is the low byte of the address and wraps by
 * itself. The interrupt loads a segment at the beginning of the last period of the one before it: the segment at
 * step_tail - 8 is loaded, and is playing once one of its periods has been counted.
 *
 * Units:   ticks of Timer1 (62.5 ns, or those of the external clock).
 * Context: named at each variable.
 * Source:  datasheet DS40002061 section 16.9.3 (fast PWM), docs/design.md. */
#ifndef MOTION_SEGMENT_H
#define MOTION_SEGMENT_H

/* Shared with assembler: plain numbers. */
#define SEGMENT_STATE_MASK 0x07 /* motion_state_t that the segment belongs to */
#define SEGMENT_EARLY_SHIFT 3   /* so many periods (2 bits) before its end the reload is begun: they are short */
#define SEGMENT_EARLY_MASK 0x18
#define SEGMENT_HURRIED_BIT 4   /* two or three: see step_port_hurry() */
#define SEGMENT_CCW_BIT 5       /* its pulses count negative */
#define SEGMENT_DIR_BIT 6       /* level of the dir pin, taken if SET_DIR */
#define SEGMENT_SET_DIR_BIT 7   /* set dir and MS1 to MS3 at the segment's beginning; such a segment has one period */

/* The byte of the gear: how many of the smallest steps each of its pulses is (a power of two), and the levels of MS1 to MS3,
 * set with dir. */
#define SEGMENT_GEAR_MASK 0x07
#define SEGMENT_MS_SHIFT 3
#define SEGMENT_MS1_BIT 3
#define SEGMENT_MS2_BIT 4
#define SEGMENT_MS3_BIT 5

#define SEGMENT_BYTES 8
#define SEGMENT_COUNT 32
#define SEGMENT_SILENT 0xFFFF /* match value that is never reached */

/* Periods below these are not reloaded within themselves but one, two or three periods early: interrupt latency (28)
 * plus the cycles from the flag to the last register (53), with room. docs/design.md */
#define SEGMENT_EARLY1_BELOW_TICKS 82
#define SEGMENT_EARLY2_BELOW_TICKS 48
#define SEGMENT_EARLY3_BELOW_TICKS 40

#ifndef __ASSEMBLER__
#include <stdint.h>

typedef struct {
    uint16_t top;        /* OCR1A: period - 1 */
    uint16_t match;      /* OCR1B: top - pulse width, or SEGMENT_SILENT */
    uint8_t count_low;   /* periods to count: low 1..256 (0 = 256) ... */
    uint8_t count_high;  /* ... plus 256 times this */
    uint8_t flags;       /* SEGMENT_* above */
    uint8_t gear;        /* SEGMENT_GEAR_MASK and SEGMENT_MS* above */
} segment_t;

extern segment_t segments[SEGMENT_COUNT];
extern volatile uint8_t step_clock; /* written by the main loop: TCCR1B while the timer runs */
extern volatile uint8_t step_head;  /* written by the main loop: offset of the next free slot */
extern volatile uint8_t step_tail;  /* written by the interrupt: offset of the next segment to load */
extern volatile uint8_t step_flags; /* written by the interrupt: flags of the loaded segment */
extern volatile uint8_t step_hold;  /* main loop: how many pulses may be repeated when the ring is empty; interrupt: -- */
extern volatile uint8_t step_held;  /* interrupt: how many were; main loop clears it in an atomic section */
extern volatile uint8_t step_idle;  /* interrupt: 1 = the ring ran out and the timer plays silence uncounted */
extern volatile uint8_t step_late;  /* interrupt: 1 = a reload missed its period (latched) */
extern volatile uint8_t step_count_high; /* written by the interrupt: periods left, 256 each; GPIOR0 has the rest */
extern volatile uint8_t motion_state; /* motion_state_t; interrupt while it plays, main loop in standstill */

static inline segment_t *segment_at(uint8_t offset)
{
#ifdef __AVR__
    segment_t *segment; /* the ring is one page of RAM: an offset is the low byte of the address */
    __asm__("mov %A0, %1\n\tldi %B0, hi8(segments)" : "=d"(segment) : "r"(offset));
    return segment;
#else
    return &segments[offset / SEGMENT_BYTES];
#endif
}

#endif
#endif
