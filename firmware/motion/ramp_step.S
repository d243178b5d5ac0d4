/* ramp_step() of ramp.h for the AVR: the harmonic ramp's steady state, about 330 cycles with call and return.
 *
 *   mid2 += spacing2;  slope += curve;  rest -= spacing2 * q8 (old) + slope * mid2 (new);
 *   while rest is not within half of mid2: rest -+= mid2, slope and curve +-= 1;
 *   q8 += slope;  next2 += spacing2;  return q8 << group_log2
 *
 * All modulo 2^32; the C version in ramp.c is what runs on the host, and the tests compare the two. */
#include "motion/ramp_offsets.h"

/* r4-r7 -= r18-r21 * r22-r25, r3 = 0 */
.macro multiply_subtract
        mul     r18, r22
        sub     r4, r0
        sbc     r5, r1
        sbc     r6, r3
        sbc     r7, r3
        mul     r18, r23
        sub     r5, r0
        sbc     r6, r1
        sbc     r7, r3
        mul     r19, r22
        sub     r5, r0
        sbc     r6, r1
        sbc     r7, r3
        mul     r18, r24
        sub     r6, r0
        sbc     r7, r1
        mul     r19, r23
        sub     r6, r0
        sbc     r7, r1
        mul     r20, r22
        sub     r6, r0
        sbc     r7, r1
        mul     r18, r25
        sub     r7, r0
        mul     r19, r24
        sub     r7, r0
        mul     r20, r23
        sub     r7, r0
        mul     r21, r22
        sub     r7, r0
.endm

.macro load4 first, offset
        ldd     r\first, Y + \offset
        .if \first == 18
        ldd     r19, Y + \offset + 1
        ldd     r20, Y + \offset + 2
        ldd     r21, Y + \offset + 3
        .elseif \first == 22
        ldd     r23, Y + \offset + 1
        ldd     r24, Y + \offset + 2
        ldd     r25, Y + \offset + 3
        .elseif \first == 4
        ldd     r5, Y + \offset + 1
        ldd     r6, Y + \offset + 2
        ldd     r7, Y + \offset + 3
        .elseif \first == 8
        ldd     r9, Y + \offset + 1
        ldd     r10, Y + \offset + 2
        ldd     r11, Y + \offset + 3
        .endif
.endm

        .section .text.ramp_step, "ax", @progbits
        .global ramp_step
        .type ramp_step, @function
ramp_step:
        push    r3
        push    r4
        push    r5
        push    r6
        push    r7
        push    r8
        push    r9
        push    r10
        push    r11
        push    r28
        push    r29
        movw    r28, r24
        clr     r3

        load4   18, RAMP_SPACING2
        load4   8, RAMP_NEXT2
        add     r8, r18
        adc     r9, r19
        adc     r10, r20
        adc     r11, r21
        std     Y + RAMP_NEXT2, r8
        std     Y + RAMP_NEXT2 + 1, r9
        std     Y + RAMP_NEXT2 + 2, r10
        std     Y + RAMP_NEXT2 + 3, r11
        load4   8, RAMP_Q8
        movw    r22, r8
        movw    r24, r10
        load4   4, RAMP_REST
        multiply_subtract

        load4   22, RAMP_MID2
        add     r22, r18
        adc     r23, r19
        adc     r24, r20
        adc     r25, r21
        std     Y + RAMP_MID2, r22
        std     Y + RAMP_MID2 + 1, r23
        std     Y + RAMP_MID2 + 2, r24
        std     Y + RAMP_MID2 + 3, r25

        load4   18, RAMP_SLOPE
        ldd     r0, Y + RAMP_CURVE
        add     r18, r0
        ldd     r0, Y + RAMP_CURVE + 1
        adc     r19, r0
        ldd     r0, Y + RAMP_CURVE + 2
        adc     r20, r0
        ldd     r0, Y + RAMP_CURVE + 3
        adc     r21, r0
        multiply_subtract

        /* half of mid2 in r26, r27, r30, r31; r1:r0 counts corrections */
        movw    r26, r22
        movw    r30, r24
        lsr     r31
        ror     r30
        ror     r27
        ror     r26
        clr     r0
        clr     r1
1:      cp      r26, r4                 /* rest > half? */
        cpc     r27, r5
        cpc     r30, r6
        cpc     r31, r7
        brge    2f
        sub     r4, r22
        sbc     r5, r23
        sbc     r6, r24
        sbc     r7, r25
        sec                             /* r1:r0 += 1 */
        adc     r0, r3
        adc     r1, r3
        rjmp    1b
2:      add     r26, r4                 /* rest < -half?  rest + half < 0 */
        adc     r27, r5
        adc     r30, r6
        adc     r31, r7
        brpl    4f
        add     r4, r22
        adc     r5, r23
        adc     r6, r24
        adc     r7, r25
        sec
        sbc     r0, r3
        sbc     r1, r3
        movw    r26, r22
        movw    r30, r24
        lsr     r31
        ror     r30
        ror     r27
        ror     r26
        rjmp    2b
4:      std     Y + RAMP_REST, r4
        std     Y + RAMP_REST + 1, r5
        std     Y + RAMP_REST + 2, r6
        std     Y + RAMP_REST + 3, r7
        /* sign-extend the corrections into r4-r7 */
        movw    r4, r0
        clr     r6
        sbrc    r5, 7
        com     r6
        mov     r7, r6
        /* slope: it was used up as a factor, so once more */
        load4   18, RAMP_CURVE
        load4   22, RAMP_SLOPE
        add     r18, r4
        adc     r19, r5
        adc     r20, r6
        adc     r21, r7
        std     Y + RAMP_CURVE, r18
        std     Y + RAMP_CURVE + 1, r19
        std     Y + RAMP_CURVE + 2, r20
        std     Y + RAMP_CURVE + 3, r21
        add     r22, r18
        adc     r23, r19
        adc     r24, r20
        adc     r25, r21
        std     Y + RAMP_SLOPE, r22
        std     Y + RAMP_SLOPE + 1, r23
        std     Y + RAMP_SLOPE + 2, r24
        std     Y + RAMP_SLOPE + 3, r25
        add     r22, r8
        adc     r23, r9
        adc     r24, r10
        adc     r25, r11
        std     Y + RAMP_Q8, r22
        std     Y + RAMP_Q8 + 1, r23
        std     Y + RAMP_Q8 + 2, r24
        std     Y + RAMP_Q8 + 3, r25
        ldd     r18, Y + RAMP_GROUP_LOG2
5:      subi    r18, 1
        brcs    6f
        lsl     r22
        rol     r23
        rol     r24
        rol     r25
        rjmp    5b
6:      clr     r1
        pop     r29
        pop     r28
        pop     r11
        pop     r10
        pop     r9
        pop     r8
        pop     r7
        pop     r6
        pop     r5
        pop     r4
        pop     r3
        ret
        .size ramp_step, . - ramp_step
