/* ramp_step() of ramp.h for the AVR: a ramp's steady state, with call and return about 310 cycles and 20 for each bit
 * of group_log2 (harmonic) or 550 to 650 cycles (linear), and 15 or 60 more for each correction.
 *
 *   slope += curve;  q += slope
 *   harmonic: mid2 += spacing2;  next2 += spacing2;  rest = k512 - q * mid2;
 *             while rest is not in 0..mid2 - 1: rest -+= mid2, one correction;
 *             return (q + rest / mid2) << group_log2, truncated; the rest of that is carried on
 *   linear:   t2 +-= q;  rest += group_c - q * t2;  t2 +-= q;
 *             while rest is not in 0..t2 - 1: t2 +-= 1, rest -+= t2, t2 +-= 1, one correction;  return q << 4
 *   q, slope and curve += corrections
 *
 * Modulo 2^32, t2 and rest modulo 2^64; the C version in ramp.c is what runs on the host. */
#include "motion/ramp_offsets.h"

.macro load4 a, b, c, d, offset
        ldd     \a, Z + \offset
        ldd     \b, Z + \offset + 1
        ldd     \c, Z + \offset + 2
        ldd     \d, Z + \offset + 3
.endm

.macro store4 a, b, c, d, offset
        std     Z + \offset, \a
        std     Z + \offset + 1, \b
        std     Z + \offset + 2, \c
        std     Z + \offset + 3, \d
.endm

/* r22-r25 += r18-r21 */
.macro add4
        add     r22, r18
        adc     r23, r19
        adc     r24, r20
        adc     r25, r21
.endm

        .section .text.ramp_step, "ax", @progbits
        .global ramp_step
        .type ramp_step, @function
ramp_step:
        push    r12
        push    r13
        push    r14
        push    r15
        push    r16
        push    r17
        movw    r30, r24
        load4   r22, r23, r24, r25, RAMP_SLOPE
        load4   r18, r19, r20, r21, RAMP_CURVE
        add4
        store4  r22, r23, r24, r25, RAMP_SLOPE
        load4   r18, r19, r20, r21, RAMP_Q8
        add4
        store4  r22, r23, r24, r25, RAMP_Q8
        ld      r18, Z
        tst     r18
        breq    harmonic
        rjmp    linear

        /* q in r22-r25, mid2 in r18-r21, rest in r12-r15, corrections in r26, r27, 0 in r16 */
harmonic:
        clr     r16
        load4   r18, r19, r20, r21, RAMP_NEXT2
        load4   r12, r13, r14, r15, RAMP_SPACING2
        add     r18, r12
        adc     r19, r13
        adc     r20, r14
        adc     r21, r15
        store4  r18, r19, r20, r21, RAMP_NEXT2
        load4   r18, r19, r20, r21, RAMP_MID2
        add     r18, r12
        adc     r19, r13
        adc     r20, r14
        adc     r21, r15
        store4  r18, r19, r20, r21, RAMP_MID2
        load4   r12, r13, r14, r15, RAMP_K512
        mul     r18, r22
        sub     r12, r0
        sbc     r13, r1
        sbc     r14, r16
        sbc     r15, r16
        mul     r18, r23
        sub     r13, r0
        sbc     r14, r1
        sbc     r15, r16
        mul     r19, r22
        sub     r13, r0
        sbc     r14, r1
        sbc     r15, r16
        mul     r18, r24
        sub     r14, r0
        sbc     r15, r1
        mul     r19, r23
        sub     r14, r0
        sbc     r15, r1
        mul     r20, r22
        sub     r14, r0
        sbc     r15, r1
        mul     r18, r25
        sub     r15, r0
        mul     r19, r24
        sub     r15, r0
        mul     r20, r23
        sub     r15, r0
        mul     r21, r22
        sub     r15, r0

        clr     r26
        clr     r27
        tst     r15
        brpl    2f
1:      sbiw    r26, 1
        add     r12, r18
        adc     r13, r19
        adc     r14, r20
        adc     r15, r21
        brmi    1b
2:      cp      r12, r18
        cpc     r13, r19
        cpc     r14, r20
        cpc     r15, r21
        brlo    3f
        adiw    r26, 1
        sub     r12, r18
        sbc     r13, r19
        sbc     r14, r20
        sbc     r15, r21
        rjmp    2b
3:      rcall   correct
        /* The bits that the group's pulses have, from the rest; what is left after that is carried on. */
        ldd     r17, Z + 4 + RAMP_GROUP_LOG2
4:      subi    r17, 1
        brcs    5f
        lsl     r22
        rol     r23
        rol     r24
        rol     r25
        lsl     r12
        rol     r13
        rol     r14
        rol     r15
        cp      r12, r18
        cpc     r13, r19
        cpc     r14, r20
        cpc     r15, r21
        brlo    4b
        sub     r12, r18
        sbc     r13, r19
        sbc     r14, r20
        sbc     r15, r21
        inc     r22
        rjmp    4b
5:      load4   r26, r27, r16, r17, RAMP_CARRY + 4
        add     r26, r12
        adc     r27, r13
        adc     r16, r14
        adc     r17, r15
        cp      r26, r18
        cpc     r27, r19
        cpc     r16, r20
        cpc     r17, r21
        brlo    6f
        sub     r26, r18
        sbc     r27, r19
        sbc     r16, r20
        sbc     r17, r21
        subi    r22, 0xFF               /* += 1 */
        sbci    r23, 0xFF
        sbci    r24, 0xFF
        sbci    r25, 0xFF
6:      store4  r26, r27, r16, r17, RAMP_CARRY + 4
        rjmp    leave
shift:  subi    r18, 1
        brcs    leave
        lsl     r22
        rol     r23
        rol     r24
        rol     r25
        rjmp    shift
leave:  clr     r1
        pop     r17
        pop     r16
        pop     r15
        pop     r14
        pop     r13
        pop     r12
        ret

/* Adds r27:r26 to curve, slope and q; returns q in r22-r25 and leaves 4 less in Z. */
correct:
        clr     r16
        sbrc    r27, 7
        com     r16
        adiw    r30, RAMP_CURVE - RAMP_Q8
        rcall   5f
        rcall   5f
5:      load4   r22, r23, r24, r25, RAMP_Q8
        add     r22, r26
        adc     r23, r27
        adc     r24, r16
        adc     r25, r16
        store4  r22, r23, r24, r25, RAMP_Q8
        sbiw    r30, RAMP_SLOPE - RAMP_Q8
        ret

        /* rest in r2-r9, t2 in r10-r17, q in r22-r25, 0 in r26 */
linear:
        push    r2
        push    r3
        push    r4
        push    r5
        push    r6
        push    r7
        push    r8
        push    r9
        push    r10
        push    r11
        clr     r26
        load4   r10, r11, r12, r13, RAMP_T2
        load4   r14, r15, r16, r17, RAMP_T2 + 4
        rcall   move_t2
        load4   r2, r3, r4, r5, RAMP_REST
        load4   r6, r7, r8, r9, RAMP_REST + 4
        load4   r18, r19, r20, r21, RAMP_GROUP_C
        add     r2, r18
        adc     r3, r19
        adc     r4, r20
        adc     r5, r21
        load4   r18, r19, r20, r21, RAMP_GROUP_C + 4
        adc     r6, r18
        adc     r7, r19
        adc     r8, r20
        adc     r9, r21
        adiw    r30, RAMP_Q8

.macro column t2, rest
        mul     r19, \t2
        add     r0, r27
        adc     r1, r26
        sub     \rest, r0
        adc     r1, r26
        mov     r27, r1
.endm
        /* rest -= q * t2, a byte of q after the other; after each, the lowest byte of rest is done with and moves into
         * r22-r25, the others move down. Carry in r27. */
        ldi     r20, 4
1:      ld      r19, Z+
        tst     r19
        breq    2f
        clr     r27
        column  r10, r2
        column  r11, r3
        column  r12, r4
        column  r13, r5
        column  r14, r6
        column  r15, r7
        column  r16, r8
        mul     r19, r17
        add     r0, r27
        sub     r9, r0
2:      mov     r22, r23
        mov     r23, r24
        mov     r24, r25
        mov     r25, r2
        mov     r2, r3
        mov     r3, r4
        mov     r4, r5
        mov     r5, r6
        mov     r6, r7
        mov     r7, r8
        mov     r8, r9
        dec     r20
        brne    1b
        movw    r8, r4
        movw    r6, r2
        movw    r2, r22
        movw    r4, r24
        sbiw    r30, RAMP_Q8 + 4
        load4   r22, r23, r24, r25, RAMP_Q8
        rcall   move_t2

        ldi     r20, 1                  /* 1, or -1 when slowing, in r20 and r21 */
        clr     r21
        ldd     r18, Z + RAMP_FASTER
        tst     r18
        brne    3f
        rcall   negate_one
3:      clr     r27
        ldi     r18, 255                /* corrections at most */
4:      tst     r9
        brpl    5f
        sbiw    r26, 1
        rcall   negate_one
        rcall   step_t2
        add     r2, r10
        adc     r3, r11
        adc     r4, r12
        adc     r5, r13
        adc     r6, r14
        adc     r7, r15
        adc     r8, r16
        adc     r9, r17
        rcall   step_t2
        rcall   negate_one
        rjmp    6f
5:      cp      r2, r10
        cpc     r3, r11
        cpc     r4, r12
        cpc     r5, r13
        cpc     r6, r14
        cpc     r7, r15
        cpc     r8, r16
        cpc     r9, r17
        brlo    7f
        adiw    r26, 1
        rcall   step_t2
        sub     r2, r10
        sbc     r3, r11
        sbc     r4, r12
        sbc     r5, r13
        sbc     r6, r14
        sbc     r7, r15
        sbc     r8, r16
        sbc     r9, r17
        rcall   step_t2
6:      dec     r18
        brne    4b
7:      store4  r2, r3, r4, r5, RAMP_REST
        store4  r6, r7, r8, r9, RAMP_REST + 4
        store4  r10, r11, r12, r13, RAMP_T2
        store4  r14, r15, r16, r17, RAMP_T2 + 4
        rcall   correct
        ldi     r18, 4
        pop     r11
        pop     r10
        pop     r9
        pop     r8
        pop     r7
        pop     r6
        pop     r5
        pop     r4
        pop     r3
        pop     r2
        rjmp    shift

negate_one:
        neg     r20
        com     r21
        ret

/* t2 += 1 or -1 */
step_t2:
        add     r10, r20
        adc     r11, r21
        adc     r12, r21
        adc     r13, r21
        adc     r14, r21
        adc     r15, r21
        adc     r16, r21
        adc     r17, r21
        ret

/* t2 += q, or -= when slowing */
move_t2:
        ldd     r18, Z + RAMP_FASTER
        tst     r18
        breq    8f
        add     r10, r22
        adc     r11, r23
        adc     r12, r24
        adc     r13, r25
        adc     r14, r26
        adc     r15, r26
        adc     r16, r26
        adc     r17, r26
        ret
8:      sub     r10, r22
        sbc     r11, r23
        sbc     r12, r24
        sbc     r13, r25
        sbc     r14, r26
        sbc     r15, r26
        sbc     r16, r26
        sbc     r17, r26
        ret
        .size ramp_step, . - ramp_step
