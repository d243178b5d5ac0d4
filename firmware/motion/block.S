/* block_append() of block.h for the AVR. Cycles: about 300 a call, 55 a run of one segment, 95 a run of two.
 * The C version in block.c is what runs on the host. */
#include "base/registers.h"
#include "motion/block_offsets.h"
#include "motion/segment.h"

#define TOP0 r2
#define TOP1 r3
#define TOP2 r4
#define TOP3 r5
#define SLOPE0 r6
#define SLOPE1 r7
#define SLOPE2 r8
#define SLOPE3 r9
#define CURVE0 r10
#define CURVE1 r11
#define CURVE2 r12
#define CURVE3 r13
#define CARRY0 r14
#define CARRY1 r15
#define WIDTH0 r16
#define WIDTH1 r17
#define RUNS r18
#define PULSES r19
#define FLAGS r20
#define SHAPE r21
#define COUNT r23
/* r24, r25: top of a segment; r22, r26, r27: scratch; Y: the block; Z: the ring's next free slot */

.macro load4 a, b, c, d, offset
        ldd     \a, Y + \offset
        ldd     \b, Y + \offset + 1
        ldd     \c, Y + \offset + 2
        ldd     \d, Y + \offset + 3
.endm

.macro store4 a, b, c, d, offset
        std     Y + \offset, \a
        std     Y + \offset + 1, \b
        std     Y + \offset + 2, \c
        std     Y + \offset + 3, \d
.endm

        .section .text.block_append, "ax", @progbits
        .global block_append
        .type block_append, @function
block_append:
        save_registers
        movw    r28, r24
        load4   TOP0, TOP1, TOP2, TOP3, BLOCK_TOP
        load4   SLOPE0, SLOPE1, SLOPE2, SLOPE3, BLOCK_SLOPE
        load4   CURVE0, CURVE1, CURVE2, CURVE3, BLOCK_CURVE
        load4   CARRY0, CARRY1, WIDTH0, WIDTH1, BLOCK_CARRY
        ldd     RUNS, Y + BLOCK_RUNS
        ldd     PULSES, Y + BLOCK_PULSES
        ldd     FLAGS, Y + BLOCK_FLAGS
        ldd     SHAPE, Y + BLOCK_SHAPE
        ldi     r31, hi8(segments)
        lds     r30, step_head

next_run:
        tst     RUNS
        breq    done
        lds     r22, step_tail
        mov     r23, r30
        sub     r23, r22
        cpi     r23, BLOCK_RING_MOST_BYTES + 1
        brlo    run
done:   rjmp    out
run:
        movw    r24, TOP2
        sbrs    SHAPE, BLOCK_SPLIT_BIT
        rjmp    unsplit
        mul     TOP0, PULSES
        movw    r26, r0
        mul     TOP1, PULSES
        clr     r22
        add     r27, r0
        adc     r1, r22
        add     CARRY0, r26
        adc     CARRY1, r27
        adc     r22, r1                 /* so many of a tick more */
        sbrs    SHAPE, BLOCK_FASTER_BIT
        rjmp    4f
        mov     COUNT, r22
        adiw    r24, 1
        rcall   put
        sbiw    r24, 1
        mov     COUNT, PULSES
        sub     COUNT, r22
        rcall   put
        rjmp    5f
4:      mov     COUNT, PULSES
        sub     COUNT, r22
        rcall   put
        mov     COUNT, r22
        adiw    r24, 1
        rcall   put
5:      add     TOP0, SLOPE0
        adc     TOP1, SLOPE1
        adc     TOP2, SLOPE2
        adc     TOP3, SLOPE3
        add     SLOPE0, CURVE0
        adc     SLOPE1, CURVE1
        adc     SLOPE2, CURVE2
        adc     SLOPE3, CURVE3
        dec     RUNS
        rjmp    next_run

        /* One value for all; periods too short to be reloaded in are counted short by those waited for. */
unsplit:
        add     CARRY0, TOP0
        adc     CARRY1, TOP1
        clr     r22
        adc     r24, r22
        mov     COUNT, PULSES
        mov     r22, FLAGS
        cpi     r24, SEGMENT_EARLY1_BELOW_TICKS - 1
        brsh    6f
        rcall   early
        cpi     r24, SEGMENT_EARLY2_BELOW_TICKS - 1
        brsh    6f
        rcall   early
        cpi     r24, SEGMENT_EARLY3_BELOW_TICKS - 1
        brsh    6f
        rcall   early
6:      sbrc    FLAGS, SEGMENT_HURRIED_BIT
        call    step_port_hurry
        rcall   put
        mov     FLAGS, r22
        rjmp    5b

early:
        dec     COUNT
        subi    FLAGS, -(1 << SEGMENT_EARLY_SHIFT)
        ret

        /* COUNT periods of r25:r24 + 1 ticks */
put:
        tst     COUNT
        breq    7f
        st      Z+, r24
        st      Z+, r25
        movw    r26, r24
        sub     r26, WIDTH0
        sbc     r27, WIDTH1
        st      Z+, r26
        st      Z+, r27
        st      Z+, COUNT
        clr     r26
        st      Z+, r26
        st      Z+, FLAGS
        ldd     r26, Y + BLOCK_GEAR
        st      Z, r26
        inc     r30
        sts     step_head, r30
7:      ret

out:
        std     Y + BLOCK_RUNS, RUNS
        clr     r1
        store4  TOP0, TOP1, TOP2, TOP3, BLOCK_TOP
        store4  SLOPE0, SLOPE1, SLOPE2, SLOPE3, BLOCK_SLOPE
        store4  CURVE0, CURVE1, CURVE2, CURVE3, BLOCK_CURVE
        std     Y + BLOCK_CARRY, CARRY0
        std     Y + BLOCK_CARRY + 1, CARRY1
        restore_registers
        .size block_append, . - block_append
