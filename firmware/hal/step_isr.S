/* The step interrupt: counts periods, and at the end of a segment loads the next one into Timer1's buffers.
 *
 * Cycles, interrupt entry (4) and the jump in the vector table (2) included:
 *   period counted                      22
 *   period counted, low byte wrapped    31
 *   segment loaded                      89, with a change of dir or gear 123
 *   segment loaded one to three periods early, waits included: at most 160
 *   ring empty                          85
 * (measured: make bench BENCH=isr)
 *
 * It is the only interrupt that is never interrupted: r24 rests in GPIOR1, SREG in GPIOR2. The counter is in GPIOR0, and
 * in step_count_high.
 * Where it takes longer than Estop can wait it looks for Estop itself, and takes the clock from the timer.
 * The registers written here are double-buffered: they take effect when the running period ends (datasheet section
 * 16.9.3), so an interrupt that comes late by less than a period moves no edge. */
#include <avr/io.h>
#include "motion/segment.h"

#define io(reg) _SFR_IO_ADDR(reg)
#define HOLD_PERIODS 4
#define MODE15_STOPPED (1 << WGM13 | 1 << WGM12) /* without a clock */

        .section .segments, "aw", @nobits
        .global segments
        .type segments, @object
        .size segments, 256
segments:
        .skip 256

        .section .bss
        .global step_clock, step_head, step_tail, step_flags, step_hold, step_held, step_idle, step_late, step_count_high, motion_state
step_clock:   .skip 1
step_head:    .skip 1
step_tail:    .skip 1
step_flags:   .skip 1
step_hold:    .skip 1
step_held:    .skip 1
step_idle:    .skip 1
step_late:    .skip 1
step_count_high: .skip 1
motion_state: .skip 1

/* The segment at Z into the timer's buffers: high bytes first (TEMP, datasheet section 16.3). */
.macro buffers
        ldd     r24, Z + 1
        sts     OCR1AH, r24
        ldd     r24, Z + 0
        sts     OCR1AL, r24
        ldd     r24, Z + 3
        sts     OCR1BH, r24
        ldd     r24, Z + 2
        sts     OCR1BL, r24
.endm

/* Estop may not wait for the end of this interrupt: no clock, and its own interrupt comes next. */
.macro look_for_estop
        sbic    io(EIFR), INTF0
        rcall   stop_clock
.endm

/* Counters, tail, dir and state for the segment at Z, which has been loaded or is about to be. */
.macro account
        ldd     r24, Z + 4
        out     io(GPIOR0), r24
        ldd     r24, Z + 5
        sts     step_count_high, r24
        mov     r24, r30
        subi    r24, -SEGMENT_BYTES
        sts     step_tail, r24
        look_for_estop
        lds     r24, step_flags
        sbrc    r24, SEGMENT_SET_DIR_BIT
        rcall   set_dir
        ldd     r24, Z + 6
        sts     step_flags, r24
        andi    r24, SEGMENT_STATE_MASK
        sts     motion_state, r24
.endm

        .section .text.step_isr, "ax", @progbits
        .global TIMER1_OVF_vect
        .type TIMER1_OVF_vect, @function
TIMER1_OVF_vect:
        out     io(GPIOR1), r24
        in      r24, io(SREG)
        out     io(GPIOR2), r24
        in      r24, io(GPIOR0)
        dec     r24
        out     io(GPIOR0), r24
        breq    low_byte_over
return:
        look_for_estop                  /* a section with interrupts off may begin right behind this interrupt */
        in      r24, io(GPIOR2)
        out     io(SREG), r24
        in      r24, io(GPIOR1)
        reti

low_byte_over:
        lds     r24, step_count_high
        subi    r24, 1
        brcs    segment_over
        sts     step_count_high, r24    /* 256 more: GPIOR0 is 0 already */
        rjmp    return

empty:
        rjmp    ring_empty

segment_over:
        lds     r24, step_flags
        andi    r24, SEGMENT_EARLY_MASK
        brne    early
        push    r30
        push    r31
        lds     r30, step_tail
        ldi     r31, hi8(segments)
        look_for_estop
        lds     r24, step_head
        cp      r24, r30
        breq    empty
load:
        buffers
        sbic    io(TIFR1), TOV1
        rjmp    load_late
loaded:
        account
leave:
        pop     r31
        pop     r30
        in      r24, io(GPIOR2)
        out     io(SREG), r24
        in      r24, io(GPIOR1)
        reti

        /* Too short a period to reload in: the count ended early, and the periods still due are waited for here. The
         * first wait comes before anything else, so that a late interrupt misses none. */
early:
        sbis    io(EIMSK), INT0         /* called by Estop: there is nothing to wait for */
        rjmp    stop_early
1:      sbic    io(EIFR), INTF0
        rjmp    stop_early
        sbis    io(TIFR1), TOV1
        rjmp    1b
        sbi     io(TIFR1), TOV1         /* clears the flag, and only this one (datasheet 14.4.3) */
        push    r30
        push    r31
        lds     r30, step_tail
        lds     r31, step_head
        cp      r31, r30
        breq    near_early_empty
        look_for_estop
        ldi     r31, hi8(segments)
        cpi     r24, 1 << SEGMENT_EARLY_SHIFT
        breq    load
        /* What would be too long for the last period is done before it. T = two more waits, not one. */
        bst     r24, SEGMENT_EARLY_SHIFT
        account
next_wait:
2:      sbic    io(EIFR), INTF0
        rjmp    stop_early_again
        sbis    io(TIFR1), TOV1
        rjmp    2b
        sbi     io(TIFR1), TOV1
        brtc    3f
        clt
        rjmp    2b
3:      tst     r31
        breq    near_run_out
        buffers
        sbic    io(TIFR1), TOV1
        rcall   late
        look_for_estop
        rjmp    leave
load_late:
        rcall   late
        rjmp    loaded
late:
        ldi     r24, 1
        sts     step_late, r24
        ret
near_early_empty:
        rjmp    early_empty
near_run_out:
        rjmp    run_out

        /* dir belongs to the segment whose only period has just begun: the last pulse before it has fallen. */
set_dir:                                /* r24: its flags; Z: the segment after it */
        sbrc    r24, SEGMENT_DIR_BIT
        sbi     io(PORTB), 5
        sbrs    r24, SEGMENT_DIR_BIT
        cbi     io(PORTB), 5
        look_for_estop
        subi    r30, SEGMENT_BYTES
        ldd     r24, Z + 7
        subi    r30, -SEGMENT_BYTES
        sbrc    r24, SEGMENT_MS1_BIT
        sbi     io(PORTC), 3
        sbrs    r24, SEGMENT_MS1_BIT
        cbi     io(PORTC), 3
        sbrc    r24, SEGMENT_MS2_BIT
        sbi     io(PORTC), 4
        sbrs    r24, SEGMENT_MS2_BIT
        cbi     io(PORTC), 4
        sbrc    r24, SEGMENT_MS3_BIT
        sbi     io(PORTB), 4
        sbrs    r24, SEGMENT_MS3_BIT
        cbi     io(PORTB), 4
        lds     r24, step_flags
        ret

stop_clock:
        push    r24
        ldi     r24, MODE15_STOPPED
        sts     TCCR1B, r24
        pop     r24
        ret

        /* Estop while periods are waited for: those still due are left to be counted as usual. */
stop_early:
        rcall   stop_clock
        push    r30
        push    r31
        lds     r30, step_tail
        lds     r24, step_flags
        andi    r24, SEGMENT_EARLY_MASK
        lsr     r24
        lsr     r24
        lsr     r24
        rjmp    uncount
stop_early_again:
        rcall   stop_clock
        ldi     r24, 1
        brtc    uncount
        ldi     r24, 2
uncount:                                /* r24: periods due, r30: what was to be loaded */
        out     io(GPIOR0), r24
        ldi     r31, 0
        sts     step_count_high, r31
        ldi     r31, hi8(segments)
        sts     step_tail, r30
        subi    r30, SEGMENT_BYTES
        ldd     r24, Z + 6
        andi    r24, ~SEGMENT_EARLY_MASK
        std     Z + 6, r24
        sts     step_flags, r24
        rjmp    leave

        /* Planned motion is not over but the planner is behind: the interval is repeated, so that no pulse is lost. Several
         * at once, or short periods would leave no time to plan. */
early_empty:                            /* r24: the early bits; one period has been waited for */
        look_for_estop
        lds     r31, step_hold
        subi    r31, HOLD_PERIODS
        brcs    1f
        sts     step_hold, r31
        lds     r31, step_held
        subi    r31, -HOLD_PERIODS
        sts     step_held, r31
        ldi     r31, HOLD_PERIODS - 1   /* as early as before (step_count_high is 0) */
        out     io(GPIOR0), r31
        rjmp    leave
1:      ldi     r31, 0                  /* no segment: silence, when what is due has been played */
        bst     r24, SEGMENT_EARLY_SHIFT
        cpi     r24, 1 << SEGMENT_EARLY_SHIFT
        breq    run_out
        rjmp    next_wait
ring_empty:
        lds     r24, step_flags
        sbrc    r24, SEGMENT_SET_DIR_BIT
        rcall   set_dir
        andi    r24, ~(1 << SEGMENT_SET_DIR_BIT)
        sts     step_flags, r24
        look_for_estop
        lds     r24, step_hold
        ldi     r31, HOLD_PERIODS
        cp      r24, r31
        brsh    2f
        mov     r31, r24
        tst     r24
        breq    run_out
2:      out     io(GPIOR0), r31         /* (step_count_high is 0) */
        sub     r24, r31
        sts     step_hold, r24
        lds     r24, step_held
        add     r24, r31
        sts     step_held, r24
        rjmp    leave
run_out:
        ldi     r24, hi8(SEGMENT_SILENT)
        sts     OCR1BH, r24
        sts     OCR1BL, r24
        ldi     r30, 0
        sts     motion_state, r30
        sts     TIMSK1, r30             /* from here on nobody counts: the main loop stops the timer */
        ldi     r24, 1
        sts     step_idle, r24
        sts     wake_flag, r24          /* it may be about to sleep */
        rjmp    leave
        .size TIMER1_OVF_vect, . - TIMER1_OVF_vect

/* Estop. First of all the timer stands still, and with it everything that could move clk. Then what has been is counted,
 * and a pulse that has begun is completed: the clock comes back for it, and what follows it is silence that nobody
 * counts, until the main loop takes the clock for good. That this interrupt is off (EIMSK) tells everybody that Estop
 * has struck. No instruction here changes SREG. */
        .global INT0_vect
        .type INT0_vect, @function
INT0_vect:
        push    r24
        ldi     r24, MODE15_STOPPED
        sts     TCCR1B, r24
        ldi     r24, 0
        out     io(EIMSK), r24          /* a held command is not released any more either */
        lds     r24, TIMSK1
        sbrs    r24, TOIE1
        rjmp    1f
        sbis    io(TIFR1), TOV1
        rjmp    1f
        sbi     io(TIFR1), TOV1
        rcall   TIMER1_OVF_vect         /* the step interrupt was about to come */
        cli
1:      ldi     r24, 0
        sts     TIMSK1, r24
        ldi     r24, hi8(SEGMENT_SILENT)
        sbis    io(PINB), 2
        rjmp    2f
        sts     OCR1AH, r24             /* and long: what is over when the main loop comes is this period */
        sts     OCR1AL, r24
        sts     OCR1BH, r24
        sts     OCR1BL, r24
        lds     r24, step_clock
        sts     TCCR1B, r24
        ldi     r24, MODE15_STOPPED
        nop
        nop
        nop
        sbis    io(PINB), 2             /* it was in its last tick, and is counted already */
        sts     TCCR1B, r24
2:      sts     wake_flag, r24          /* not 0 */
        pop     r24
        reti
        .size INT0_vect, . - INT0_vect

/* The sync pin has fallen: the timer stands ready but for its clock. Enabled only then, and for one edge. */
        .global INT1_vect
        .type INT1_vect, @function
INT1_vect:
        push    r24
        lds     r24, step_clock
        sts     TCCR1B, r24
        cbi     io(EIMSK), INT1
        pop     r24
        reti
        .size INT1_vect, . - INT1_vect
