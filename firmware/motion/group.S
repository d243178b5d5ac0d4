/* group_plan() of group.h for the AVR. Cycles: 1,500 in a linear ramp, 1,850 in a harmonic one; 900 more where the number
 * of pulses is no power of two. The C version in group.c, where the reasons are, is what runs on the host. */
#include "base/registers.h"
#include "motion/group_layout.h"

/* r2, r3: the ramp; Y: a number of the block. A number is worked on in r22-r25; products take the other factor, which they
 * leave alone, in r18-r21. */

        .section .text.group_plan, "ax", @progbits
        .global group_plan
        .type group_plan, @function
group_plan:                     /* r24 ramp, r22 group, r20 block, r18 pulses */
        save_registers
        push    r22
        push    r23
        movw    r2, r24
        movw    r28, r20
        movw    r16, r18

/* Shape. r16, r17: pulses; r12-r15: their intervals' sum, later the part by which the velocity changes. T: linear. */
        movw    r30, r22
        ld      r22, Z          /* the mean, so far */
        ldd     r23, Z + GROUP_SUM + 1
        ldd     r24, Z + GROUP_SUM + 2
        ldd     r25, Z + GROUP_SUM + 3
        rcall   store
        rcall   times_pulses
        movw    r12, r22
        movw    r14, r24
        movw    r30, r2
        ld      r22, Z
        bst     r22, 0
        ldd     r22, Z + RAMP_RATE
        ldd     r23, Z + RAMP_RATE + 1
        ldd     r24, Z + RAMP_RATE + 2
        ldd     r25, Z + RAMP_RATE + 3
        brtc    1f
        call    wide_fraction
        lsr     r25             /* by 2^LINEAR_RATE_SHIFT */
        ror     r24
        ror     r23
        ror     r22
        mov     r25, r24
        mov     r24, r23
        mov     r23, r22
        clr     r22
        ror     r22
1:      movw    r18, r12
        movw    r20, r14
        call    wide_fraction
        clr     r12             /* by 2^8 */
        mov     r13, r22
        mov     r14, r23
        mov     r15, r24
        movw    r18, r12
        movw    r20, r14
        sbiw    r28, 4
        rcall   load
        adiw    r28, BLOCK_SLOPE - BLOCK_TOP
        rcall   multiply        /* slope */
        rcall   multiply        /* curve */
        rcall   multiply        /* third */
        sbiw    r28, BLOCK_THIRD + 4 - BLOCK_CURVE
        brts    4f

        /* Harmonic: the series. r4, r5: its fourth; r6, r7: its second; r8-r11: the term with the fourth. */
        call    wide_fraction
        movw    r26, r16
        ldi     r30, 6
        cpi     r26, 8
        cpc     r27, r1
        brsh    1f
        mov     r30, r26
        subi    r30, 2
1:      cpi     r26, 16
        cpc     r27, r1
        brlo    2f
        lsr     r27
        ror     r26
        inc     r30
        cpi     r30, 9
        brne    1b
2:      lsl     r30
        lsl     r30
        ldi     r31, 0
        subi    r30, lo8(-(group_series))
        sbci    r31, hi8(-(group_series))
        lpm     r4, Z+
        lpm     r5, Z+
        lpm     r6, Z+
        lpm     r7, Z
        movw    r20, r4
        rcall   upper_fraction
        movw    r30, r2
        ldd     r18, Z + RAMP_STEEP
        cpi     r18, 2
        brlo    3f
        movw    r8, r22
        movw    r10, r24
        movw    r18, r12
        movw    r20, r14
        call    wide_fraction
        call    wide_fraction
        movw    r20, r4
        rcall   upper_fraction
        add     r22, r8
        adc     r23, r9
        adc     r24, r10
        adc     r25, r11
3:      rcall   add_memory      /* the curve */
        movw    r20, r6
        rcall   upper_fraction
        sbiw    r28, BLOCK_CURVE - BLOCK_TOP
        rcall   add_memory
        rcall   store
        adiw    r28, BLOCK_CURVE - BLOCK_TOP - 4

4:      rcall   load            /* the curve, two or three times */
        rcall   add_memory
        brtc    5f
        rcall   add_memory
5:      rcall   store
        sbiw    r28, BLOCK_CURVE + 4 - BLOCK_SLOPE
        rcall   load
        lsr     r25
        ror     r24
        ror     r23
        ror     r22
        rcall   negate_if_faster
        sbiw    r28, BLOCK_SLOPE - BLOCK_TOP
        rcall   add_memory
        pop     r31
        pop     r30
        std     Z + GROUP_END, r22
        std     Z + GROUP_END + 1, r23
        std     Z + GROUP_END + 2, r24
        std     Z + GROUP_END + 3, r25
        rcall   load
        rcall   times_pulses
        st      Z, r22
        std     Z + GROUP_SUM + 1, r23
        std     Z + GROUP_SUM + 2, r24
        std     Z + GROUP_SUM + 3, r25

/* Runs. r14: pulses of one; r15: how many; r4-r7: slope; r8-r11: curve; r22-r25: third */
        movw    r30, r2
        ldd     r18, Z + RAMP_REST
        sbrc    r18, 0
        rjmp    leave
        movw    r20, r16
        clr     r14
        inc     r14
1:      sbrc    r20, 0
        rjmp    2f
        sbrc    r14, 7          /* RUN_MAX_PULSES */
        rjmp    2f
        lsr     r21
        ror     r20
        lsl     r14
        rjmp    1b
2:      mov     r15, r20
        adiw    r28, BLOCK_SLOPE
        cpi     r20, 2
        cpc     r21, r1
        brlo    3f
        movw    r18, r20
        clr     r20
        clr     r21
        ldi     r22, 0xFF
        ldi     r23, 0xFF
        movw    r24, r22
        call    __udivmodsi4    /* r22-r25 by r18-r21: quotient in the latter */
        rcall   scale
        rcall   scale
        sbiw    r28, 4
        rcall   scale           /* the curve twice */
        rcall   scale
        sbiw    r28, BLOCK_THIRD + 4 - BLOCK_SLOPE
3:      rcall   load
        movw    r4, r22
        movw    r6, r24
        adiw    r28, BLOCK_CURVE - BLOCK_SLOPE
        rcall   load
        movw    r8, r22
        movw    r10, r24
        adiw    r28, BLOCK_THIRD - BLOCK_CURVE
        rcall   load

        /* Shorter ones. r18-r20: most; r21: least run; r30, r31: least; r12, r13: span */
        movw    r30, r2
        ldd     r26, Z + RAMP_TICKS
        ldd     r27, Z + RAMP_TICKS + 1
        ldd     r12, Z + RAMP_SPLIT_TICKS
        ldi     r18, lo8(RUN_SLOPE_Q16)
        ldi     r19, hi8(RUN_SLOPE_Q16)
        ldi     r20, hlo8(RUN_SLOPE_Q16)
        cp      r26, r12
        cpc     r27, r1
        brsh    1f
        ldi     r18, lo8(RUN_SLOPE_Q16 / 4)
        ldi     r19, hi8(RUN_SLOPE_Q16 / 4)
        ldi     r20, hlo8(RUN_SLOPE_Q16 / 4)
        cpi     r16, UNSPLIT_LEAST
        cpc     r17, r1
        brsh    1f
        rjmp    leave
1:      ldd     r21, Z + RAMP_LEAST_RUN
        ldd     r16, Z + RAMP_STEEP
        ldd     r17, Z + RAMP_CYCLES_LOG2
        ldi     r30, RUN_PULSE_CYCLES
        mov     r13, r30
        ldi     r30, 0
        ldi     r31, 0
2:      subi    r30, lo8(-(2 * RUN_CYCLES))
        sbci    r31, hi8(-(2 * RUN_CYCLES))
        dec     r16
        brpl    2b
        rjmp    4f
3:      lsr     r13
        lsr     r31
        ror     r30
4:      dec     r17
        brpl    3b
        sub     r26, r13
        sbc     r27, r1
        brlo    6f
        breq    6f
        mul     r14, r26
        movw    r12, r0
        mul     r14, r27
        add     r13, r0
        clr     r1
5:      cp      r21, r14
        brsh    6f
        cp      r18, r4
        cpc     r19, r5
        cpc     r20, r6
        cpc     r1, r7
        brsh    6f
        cp      r12, r30
        cpc     r13, r31
        brlo    6f
        lsr     r14
        lsl     r15
        lsr     r13
        ror     r12
        lsr     r7
        ror     r6
        ror     r5
        ror     r4
        lsr     r25
        ror     r24
        ror     r23
        ror     r22
        lsr     r11
        ror     r10
        ror     r9
        ror     r8
        lsr     r11
        ror     r10
        ror     r9
        ror     r8
        rjmp    5b

6:      std     Y + BLOCK_RUNS - BLOCK_THIRD, r15
        std     Y + BLOCK_PULSES - BLOCK_THIRD, r14
        mov     r17, r15
        ldi     r21, 48
        cpi     r17, 4
        brne    1f
        ldi     r21, 36
1:      cpi     r17, 2
        brne    2f
        ldi     r21, 16
2:      clr     r20
        rcall   upper_fraction
        add     r22, r4
        adc     r23, r5
        adc     r24, r6
        adc     r25, r7
        rcall   negate_if_faster
        movw    r4, r22
        movw    r6, r24
        movw    r18, r8
        movw    r20, r10
        mov     r26, r17
        subi    r26, 2
        rcall   half_product
        movw    r12, r18        /* the bend */
        movw    r14, r20
        rcall   negate
        add     r22, r4
        adc     r23, r5
        adc     r24, r6
        adc     r25, r7
        movw    r18, r22
        movw    r20, r24
        sbiw    r28, BLOCK_THIRD - BLOCK_SLOPE
        rcall   store
        movw    r22, r8
        movw    r24, r10
        rcall   store
        inc     r26             /* the steps between the runs */
        rcall   half_product
        movw    r4, r22
        movw    r6, r24
        movw    r18, r12
        movw    r20, r14
        call    __muluhisi3
        ldi     r18, lo8(SIXTH_Q32)
        ldi     r19, hi8(SIXTH_Q32)
        ldi     r20, hlo8(SIXTH_Q32)
        ldi     r21, hhi8(SIXTH_Q32)
        call    wide_fraction
        add     r22, r4
        adc     r23, r5
        adc     r24, r6
        adc     r25, r7
        subi    r24, -1         /* a tick */
        sbci    r25, -1
        rcall   negate
        sbiw    r28, BLOCK_CURVE + 4 - BLOCK_TOP
        rcall   add_memory
        rcall   store

leave:
        restore_registers

scale:                          /* the number in memory; Y goes on to the next */
        rcall   load
multiply:
        call    wide_fraction
store:
        st      Y+, r22
        st      Y+, r23
        st      Y+, r24
        st      Y+, r25
        ret

load:
        ld      r22, Y
        ldd     r23, Y + 1
        ldd     r24, Y + 2
        ldd     r25, Y + 3
        ret

add_memory:
        ld      r0, Y
        add     r22, r0
        ldd     r0, Y + 1
        adc     r23, r0
        ldd     r0, Y + 2
        adc     r24, r0
        ldd     r0, Y + 3
        adc     r25, r0
        ret

times_pulses:                   /* the number stays in r18-r21 */
        movw    r18, r22
        movw    r20, r24
        movw    r26, r16
        jmp     __muluhisi3

upper_fraction:                 /* of a factor without its lower half */
        clr     r18
        clr     r19
        jmp     wide_fraction

half_product:                   /* r18-r21 by r26: the product in r18-r21, half of it, signed, in r22-r25 */
        clr     r27
        call    __muluhisi3
        movw    r18, r22
        movw    r20, r24
        asr     r25
        ror     r24
        ror     r23
        ror     r22
        ret

negate_if_faster:
        movw    r30, r2
        ldd     r0, Z + RAMP_FASTER
        sbrs    r0, 0
        ret
negate:
        com     r25
        com     r24
        com     r23
        neg     r22
        sbci    r23, -1
        sbci    r24, -1
        sbci    r25, -1
        ret
