/* The step interrupt: counts periods, and at the end of a segment loads the next one into Timer1's buffers.
 *
 * Cycles, interrupt entry (4) and the jump in the vector table (3) included:
 *   period counted                      23
 *   period counted, low byte wrapped    30
 *   segment loaded                      92, with a change of dir 103
 *   segment loaded one to three periods early, waits included: at most 160
 *   ring empty                          86
 * (measured: make bench BENCH=isr)
 *
 * It is the only interrupt that is never interrupted: SREG rests in GPIOR2, the counter in GPIOR0 (low) and GPIOR1.
 * The registers written here are double-buffered: they take effect when the running period ends (datasheet section
 * 16.9.3), so an interrupt that comes late by less than a period moves no edge. */
#include <avr/io.h>
#include "motion/segment.h"

#define io(reg) _SFR_IO_ADDR(reg)

        .section .segments, "aw", @nobits
        .global segments
        .type segments, @object
        .size segments, 256
segments:
        .skip 256

        .section .bss
        .global step_head, step_tail, step_flags, step_hold, step_held, step_idle, step_late, motion_state
step_head:    .skip 1
step_tail:    .skip 1
step_flags:   .skip 1
step_hold:    .skip 1
step_held:    .skip 1
step_idle:    .skip 1
step_late:    .skip 1
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

/* Counters, tail, dir and state for the segment at Z, which has been loaded or is about to be. */
.macro account
        ldd     r24, Z + 4
        out     io(GPIOR0), r24
        ldd     r24, Z + 5
        out     io(GPIOR1), r24
        mov     r24, r30
        subi    r24, -SEGMENT_BYTES
        sts     step_tail, r24
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
        push    r24
        in      r24, io(SREG)
        out     io(GPIOR2), r24
        in      r24, io(GPIOR0)
        dec     r24
        out     io(GPIOR0), r24
        breq    low_byte_over
return:
        in      r24, io(GPIOR2)
        out     io(SREG), r24
        pop     r24
        reti

low_byte_over:
        in      r24, io(GPIOR1)
        subi    r24, 1
        brcs    segment_over
        out     io(GPIOR1), r24         /* 256 more: GPIOR0 is 0 already */
        rjmp    return

segment_over:
        lds     r24, step_flags
        andi    r24, SEGMENT_EARLY_MASK
        brne    early
        push    r30
        push    r31
        lds     r30, step_tail
        ldi     r31, hi8(segments)
        lds     r24, step_head
        cp      r24, r30
        breq    1f
        rjmp    load
1:      ldi     r24, 0
        rjmp    ring_empty

        /* Too short a period to reload in: the count ended early, and the periods still due are waited for here. The
         * first wait comes before anything else, so that a late interrupt misses none. */
early:
        sbis    io(TIFR1), TOV1
        rjmp    early
        sbi     io(TIFR1), TOV1         /* clears the flag, and only this one (datasheet 14.4.3) */
        push    r30
        push    r31
        lds     r30, step_tail
        lds     r31, step_head
        cp      r31, r30
        brne    2f
        rjmp    early_empty
2:      ldi     r31, hi8(segments)
        cpi     r24, 1 << SEGMENT_EARLY_SHIFT
        brne    2f
        rjmp    load
2:
        /* What would be too long for the last period is done before it. T = two more waits, not one. */
        bst     r24, SEGMENT_EARLY_SHIFT
        account
3:      sbis    io(TIFR1), TOV1
        rjmp    3b
        sbi     io(TIFR1), TOV1
        brtc    4f
        clt
        rjmp    3b
4:
        buffers
        sbic    io(TIFR1), TOV1
        rjmp    late
leave:
        pop     r31
        pop     r30
        rjmp    return

load:
        buffers
        sbic    io(TIFR1), TOV1
        rjmp    account_late
        account
        rjmp    leave

account_late:
        account
late:
        ldi     r24, 1
        sts     step_late, r24
        rjmp    leave

        /* dir belongs to the segment whose only period has just begun: the last pulse before it has fallen. */
set_dir:
        sbrc    r24, SEGMENT_DIR_BIT
        sbi     io(PORTB), 5
        sbrs    r24, SEGMENT_DIR_BIT
        cbi     io(PORTB), 5
        ret

early_empty:
        lsr     r24
        lsr     r24
        lsr     r24
        dec     r24                     /* one has been waited for */
ring_empty:                             /* r24: periods of the segment that are still due */
        mov     r31, r24
        lds     r24, step_flags
        sbrc    r24, SEGMENT_SET_DIR_BIT
        rcall   set_dir
        andi    r24, ~(SEGMENT_EARLY_MASK | (1 << SEGMENT_SET_DIR_BIT))
        sts     step_flags, r24
        ldi     r30, 0
        out     io(GPIOR1), r30
        out     io(GPIOR0), r31
        tst     r31
        breq    1f
        rjmp    leave                   /* they are counted as usual */
1:
        /* Planned motion is not over but the planner is behind: repeat the interval, so that no pulse is lost. */
        lds     r24, step_hold
        subi    r24, 1
        brcs    run_out
        sts     step_hold, r24
        lds     r24, step_held
        inc     r24
        sts     step_held, r24
        ldi     r24, 1
        out     io(GPIOR0), r24
        rjmp    leave
run_out:
        ldi     r24, hi8(SEGMENT_SILENT)
        sts     OCR1BH, r24
        sts     OCR1BL, r24
        sts     motion_state, r30
        sts     TIMSK1, r30             /* from here on nobody counts: the main loop stops the timer */
        ldi     r24, 1
        sts     step_idle, r24
        sts     wake_flag, r24
        rjmp    leave
        .size TIMER1_OVF_vect, . - TIMER1_OVF_vect
