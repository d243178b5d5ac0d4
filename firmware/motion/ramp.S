/* ramp_begin() and ramp_next() of ramp.h for the AVR. Cycles: the next group of a harmonic ramp 3,100, of a linear one 4,700,
 * group_plan() among them; to begin 1,900 and 8,300. The C version in ramp.c, where the reasons are, is what runs on the
 * host. */
#include "base/registers.h"
#include "motion/group_layout.h"

/* Y: the ramp; r16, r17: a group_t in the frame; r14, r15: the block; r12, r13: where the sum goes; r10, r11: pulses left;
 * r8, r9: the group's pulses. Others are each function's own. */

        .section .text.ramp_next, "ax", @progbits
        .global ramp_next
        .type ramp_next, @function
ramp_next:                      /* r24 ramp, r22 left, r20 sum, r18 block; returns r24 */
        save_registers frame=GROUP_SIZE
        adiw    r28, 1
        movw    r16, r28
        movw    r28, r24
        movw    r10, r22
        movw    r12, r20
        movw    r14, r18

again:  ldd     r24, Y + RAMP_LINEAR
        sbrs    r24, 0
        rjmp    harmonic
        ldd     r24, Y + RAMP_BOUNDED
        sbrs    r24, 0
        rjmp    linear
        ldi     r22, RAMP_LIMIT
        rcall   copy_member
        rcall   set_ticks
        rcall   choose_group_of_left

/* Intervals that are equal. */
bounded:
        movw    r30, r14
        std     Z + BLOCK_RUNS, r1
        rcall   times_pulses
        std     Y + RAMP_REST, r1
        rjmp    leave

linear: rcall   choose_units
        rcall   choose_group_of_left
        rcall   load_v
        movw    r4, r22
        movw    r6, r24
        ldd     r20, Y + RAMP_FASTER
        rcall   change_square
        sec                     /* roots are rounded down */
        rcall   set_interval_at_mean
        movw    r24, r16
        adiw    r24, GROUP_END
        movw    r22, r16
        call    wide_copy
        rjmp    plan

/* r2, r3: pulses left, or to the limit; r4-r7: v at the first pulse */
harmonic:
        movw    r2, r10
        rcall   load_v
        rcall   load_cap
        std     Y + RAMP_BOUNDED, r1
        cp      r18, r22
        cpc     r19, r23
        cpc     r20, r24
        cpc     r21, r25
        brsh    1f
        ldi     r26, 1
        std     Y + RAMP_BOUNDED, r26
        sub     r22, r18
        sbc     r23, r19
        sbc     r24, r20
        sbc     r25, r21
        rcall   load_step
        call    __udivmodsi4    /* r22-r25 by r18-r21: quotient in the latter */
        sec                     /* one more */
        cpc     r2, r18
        cpc     r3, r19
        cpc     r1, r20
        cpc     r1, r21
        brlo    1f
        movw    r2, r18
        sec
        adc     r2, r1
        adc     r3, r1
1:      movw    r24, r2
        rcall   choose_group
        rcall   load_v
        movw    r4, r22
        movw    r6, r24
        rcall   load_step
        ldd     r0, Y + RAMP_FASTER
        sbrc    r0, 0
        rjmp    2f
        com     r21
        com     r20
        com     r19
        neg     r18
        sbci    r19, -1
        sbci    r20, -1
        sbci    r21, -1
2:      movw    r26, r8
        call    __muluhisi3     /* r22-r25; leaves r18-r21 alone */
        add     r22, r4
        adc     r23, r5
        adc     r24, r6
        adc     r25, r7
        rcall   store_v
        ldd     r0, Y + RAMP_BOUNDED
        sbrs    r0, 0
        rjmp    3f
        rcall   load_cap
        movw    r4, r18
        movw    r6, r20
        movw    r22, r18
        movw    r24, r20
        rjmp    4f
3:      sub     r22, r18        /* velocities are those of pulses */
        sbc     r23, r19
        sbc     r24, r20
        sbc     r25, r21
4:      clc
        rcall   set_interval_at_mean
        ldd     r24, Y + RAMP_BOUNDED
        sbrc    r24, 0
        rjmp    bounded

plan:   movw    r30, r14
        std     Z + BLOCK_RUNS, r1
        movw    r24, r8
        sbiw    r24, 2
        brlo    1f
        movw    r24, r28
        movw    r22, r16
        movw    r20, r14
        movw    r18, r8
        call    group_plan
1:      ldd     r24, Y + RAMP_LINEAR
        sbrs    r24, 0
        rjmp    2f
        movw    r24, r16
        adiw    r24, GROUP_END
        movw    r22, r28
        subi    r22, lo8(-(RAMP_LIMIT))
        sbci    r23, hi8(-(RAMP_LIMIT))
        call    wide_subtract
        movw    r30, r16
        ldd     r24, Z + GROUP_END + 7
        ldd     r20, Y + RAMP_FASTER
        lsl     r24
        mov     r24, r20
        adc     r24, r1         /* lowest bit: within the limit */
        sbrs    r24, 0
        rjmp    beyond
2:      movw    r30, r14
        ldd     r24, Z + BLOCK_RUNS
        tst     r24
        breq    leave
        ldd     r24, Z + BLOCK_PULSES
        std     Y + RAMP_RUN_PULSES, r24

leave:  movw    r24, r12
        movw    r22, r16
        call    wide_copy
        movw    r24, r8
        restore_registers frame=GROUP_SIZE

/* Beyond the limit: fewer pulses, or all that is left at equal intervals, from this one on. */
beyond: ldi     r24, 1
        eor     r20, r24
        rcall   change_square
        movw    r24, r8
        sbiw    r24, 2
        ldd     r24, Y + RAMP_GROUP_LOG2
        dec     r24
        brsh    1f
        ldi     r24, 1
        std     Y + RAMP_BOUNDED, r24
        movw    r10, r8
        ldi     r24, GROUP_MAX_LOG2
1:      std     Y + RAMP_MOST_LOG2, r24
        rjmp    again

/* r20: whether v^2 grows by the change of all pulses, or shrinks by it; v follows, returned in r22-r25. The sum is lost. */
change_square:
        mov     r2, r20
        ldi     r22, RAMP_C
        rcall   copy_member
        rcall   times_pulses
        mov     r20, r2
        movw    r22, r16
        rcall   x_address
        call    wide_change
set_v:                          /* the root of x */
        rcall   x_address
        call    wide_root
store_v:
        std     Y + RAMP_V, r22
        std     Y + RAMP_V + 1, r23
        std     Y + RAMP_V + 2, r24
        std     Y + RAMP_V + 3, r25
        ret

load_v:
        ldd     r22, Y + RAMP_V
        ldd     r23, Y + RAMP_V + 1
        ldd     r24, Y + RAMP_V + 2
        ldd     r25, Y + RAMP_V + 3
        ret

load_cap:
        ldd     r18, Y + RAMP_LIMIT
        ldd     r19, Y + RAMP_LIMIT + 1
        ldd     r20, Y + RAMP_LIMIT + 2
        ldd     r21, Y + RAMP_LIMIT + 3
        ret

load_step:
        ldd     r18, Y + RAMP_STEP
        ldd     r19, Y + RAMP_STEP + 1
        ldd     r20, Y + RAMP_STEP + 2
        ldd     r21, Y + RAMP_STEP + 3
        ret

x_address:
        movw    r24, r28
        adiw    r24, RAMP_X
        ret

c_address:
        movw    r24, r28
        adiw    r24, RAMP_C
        ret

/* The sum becomes the ramp's number at r22. */
copy_member:
        clr     r23
        add     r22, r28
        adc     r23, r29
        movw    r24, r16
        jmp     wide_copy

/* The sum, by the pulses. */
times_pulses:
        movw    r24, r16
        movw    r20, r8
        clr     r22
        clr     r23
        jmp     wide_multiply

/* r8, r9: how many pulses the next group has, of those left, or of r24, r25. r2: the most doublings of a pulse, r3: so many;
 * r22, r23: their pulses; r26, r27: ticks; r30, r31: the most, halved by each doubling; r18-r21: change of the law's
 * variable a pulse; r4-r7: the most of all pulses, halved as well. */
choose_group_of_left:
        movw    r24, r10
choose_group:
        ldi     r22, 1
        ldi     r23, 0
        ldd     r26, Y + RAMP_TICKS
        ldd     r27, Y + RAMP_TICKS + 1
        std     Y + RAMP_REST, r1
        ldd     r18, Y + RAMP_SPLIT_TICKS
        cp      r26, r18
        cpc     r27, r1
        brsh    2f
        cpi     r24, 2 * REST_PULSES
        cpc     r25, r1
        brsh    1f
        std     Y + RAMP_REST, r22
        rjmp    2f
1:      subi    r24, REST_PULSES
        sbc     r25, r1
2:      cpi     r26, lo8(GROUP_MAX_TICKS / 2 + 1)
        ldi     r18, hi8(GROUP_MAX_TICKS / 2 + 1)
        cpc     r27, r18
        brlo    3f
        std     Y + RAMP_GROUP_LOG2, r1
        rjmp    9f
3:      rcall   load_step
        ldd     r4, Y + RAMP_V
        ldd     r5, Y + RAMP_V + 1
        ldd     r6, Y + RAMP_V + 2
        ldd     r7, Y + RAMP_V + 3
        ldd     r0, Y + RAMP_LINEAR
        sbrs    r0, 0
        rjmp    4f
        ldd     r18, Y + RAMP_C + 4
        ldd     r19, Y + RAMP_C + 5
        ldd     r20, Y + RAMP_C + 6
        ldd     r21, Y + RAMP_C + 7
        ldd     r4, Y + RAMP_X + 4
        ldd     r5, Y + RAMP_X + 5
        ldd     r6, Y + RAMP_X + 6
        ldd     r7, Y + RAMP_X + 7
        lsl     r4
        rol     r5
        rol     r6
        rol     r7
4:      ldd     r0, Y + RAMP_BOUNDED
        sbrs    r0, 0
        rjmp    5f
        clr     r18
        clr     r19
        movw    r20, r18
5:      clr     r30
        ldi     r31, hi8(GROUP_MAX_STEEP_TICKS)
        ldd     r2, Y + RAMP_STEEP
        ldi     r22, 1          /* by what part of its value the variable may change: a power of two */
        sbrc    r2, 1
        rjmp    6f
        ldi     r31, hi8(GROUP_MAX_TICKS)
        ldi     r22, 2
        cpi     r26, 128
        cpc     r27, r1
        brlo    6f
        ldi     r22, 3
6:      movw    r2, r26
7:      lsr     r7
        ror     r6
        ror     r5
        ror     r4
        lsr     r3
        ror     r2
        dec     r22
        brne    7b
        ldd     r0, Y + RAMP_FASTER
        sbrc    r0, 0
        rjmp    1f
        add     r26, r2         /* they grow, and the variable shrinks */
        adc     r27, r3
        movw    r2, r4
        movw    r22, r6
        lsr     r23
        ror     r22
        ror     r3
        ror     r2
        lsr     r23
        ror     r22
        ror     r3
        ror     r2
        sub     r4, r2
        sbc     r5, r3
        sbc     r6, r22
        sbc     r7, r23
1:      ldd     r2, Y + RAMP_GROUP_LOG2
        inc     r2
        ldd     r22, Y + RAMP_MOST_LOG2
        cp      r2, r22
        brlo    2f
        mov     r2, r22
2:      clr     r3
        ldi     r22, 1
        ldi     r23, 0
3:      cp      r3, r2
        brsh    4f
        lsr     r31
        ror     r30
        cp      r30, r26
        cpc     r31, r27
        brlo    4f
        lsr     r7
        ror     r6
        ror     r5
        ror     r4
        cp      r4, r18
        cpc     r5, r19
        cpc     r6, r20
        cpc     r7, r21
        brlo    4f
        lsl     r22
        rol     r23
        inc     r3
        rjmp    3b
4:      std     Y + RAMP_GROUP_LOG2, r3
        cp      r24, r22
        cpc     r25, r23
        brsh    9f
        ldd     r18, Y + RAMP_REST
        sbrc    r18, 0
        rjmp    8f
        ldd     r18, Y + RAMP_RUN_PULSES
        tst     r18
        breq    5f
        ldd     r19, Y + RAMP_STEEP
        sbrs    r19, 1
        rjmp    6f
        cpi     r24, ODD_GROUP_LEAST
        cpc     r25, r1
        brsh    6f
5:      lsr     r23
        ror     r22
        cp      r24, r22
        cpc     r25, r23
        brlo    5b
        rjmp    9f
6:      neg     r18             /* whole runs as before */
        and     r18, r24
        mov     r19, r18
        or      r19, r25
        breq    7f
        mov     r24, r18
        rjmp    8f
7:      ldi     r18, 1
        std     Y + RAMP_REST, r18
8:      movw    r22, r24
9:      movw    r8, r22
        ret

/* The sum becomes the interval at the mean of two velocities: r4-r7, and r22-r25 with the carry. */
set_interval_at_mean:
        adc     r22, r4
        adc     r23, r5
        adc     r24, r6
        adc     r25, r7

/* The sum becomes 2 K / v2, v2 in r22-r25. */
set_interval:
        movw    r18, r22
        movw    r20, r24
        movw    r22, r28
        subi    r22, lo8(-(RAMP_K2))
        sbci    r23, hi8(-(RAMP_K2))
        movw    r24, r16
        rcall   ramp_divide_k
        ldd     r22, Y + RAMP_K_LACKS
        neg     r22
        movw    r24, r16
        call    wide_shift

/* By this interval, the sum, the next group is chosen. */
set_ticks:
        movw    r30, r16
        ldd     r24, Z + 2
        ldd     r25, Z + 3
        ldd     r18, Z + 4
        ldd     r19, Z + 5
        or      r18, r19
        breq    1f
        ldi     r24, 0xFF
        ldi     r25, 0xFF
1:      std     Y + RAMP_TICKS, r24
        std     Y + RAMP_TICKS + 1, r25
        ret

/* x and c as fine as they can be. r2: by how many doublings velocity units grow. */
choose_units:
        rcall   x_address
        call    wide_bits
        mov     r2, r24
        rcall   c_address
        call    wide_bits
        cp      r24, r2
        brsh    1f
        mov     r24, r2
1:      subi    r24, 59
        brpl    2f
        inc     r24             /* half of it, towards zero */
2:      asr     r24
        mov     r2, r24
        breq    3f
        rcall   scale_k
        lsl     r2
        mov     r22, r2
        rcall   x_address
        call    wide_shift
        mov     r22, r2
        rcall   c_address
        call    wide_shift
        rjmp    set_v

/* K in velocity units that are r2 doublings larger, as far as it has room. r3: what it lacks; r4, r5: its address. */
scale_k:
        ldd     r3, Y + RAMP_K_LACKS
        sub     r3, r2
        movw    r4, r28
        ldi     r24, RAMP_K2
        add     r4, r24
        adc     r5, r1
        rcall   shift_up
        std     Y + RAMP_K_LACKS, r3
3:      ret

/* The number at r4, r5 by r3 doublings, or as many as it has room for; the others stay in r3. */
shift_up:
        movw    r24, r4
        call    wide_bits
        subi    r24, 64
        mov     r22, r3
        neg     r22
        cp      r22, r24
        brge    1f
        mov     r22, r24
1:      add     r3, r22
        movw    r24, r4
        jmp     wide_shift

        .global ramp_interval_q16
        .type ramp_interval_q16, @function
ramp_interval_q16:              /* r24 q16, r22 constants, r18-r21 v */
        lsl     r18
        rol     r19
        rol     r20
        rol     r21
        .global ramp_divide_k
        .type ramp_divide_k, @function
ramp_divide_k:                  /* r24 quotient, r22 k2_q16, r18-r21 divisor */
        push    r18
        push    r19
        call    wide_copy
        movw    r22, r20
        pop     r21
        pop     r20
        jmp     wide_divide

        .global ramp_square
        .type ramp_square, @function
ramp_square:                    /* r24 x, r20-r23 v */
        call    wide_set
        jmp     wide_multiply

/* ramp_begin() of ramp.h. r2: by how many doublings velocity units grow; r6, r7, r14, r15: v_most, then a divisor; r8, r9:
 * the constants; r10-r13: pulses; Y and r16, r17 as above. */
        .global ramp_begin
        .type ramp_begin, @function
ramp_begin:                     /* r24 ramp, r22 constants, r18-r21 v_most, r14-r17 pulses */
        save_registers frame=8
        movw    r10, r14
        movw    r12, r16
        adiw    r28, 1
        movw    r16, r28
        movw    r28, r24
        movw    r8, r22
        movw    r6, r18
        movw    r14, r20
        std     Y + RAMP_REST, r1
        std     Y + RAMP_BOUNDED, r1
        std     Y + RAMP_RUN_PULSES, r1
        std     Y + RAMP_K_LACKS, r1
        ldi     r24, 1
        std     Y + RAMP_LEAST_RUN, r24
        ldi     r24, GROUP_MAX_LOG2
        std     Y + RAMP_GROUP_LOG2, r24
        std     Y + RAMP_MOST_LOG2, r24
        movw    r30, r22
        ldd     r24, Z + CONSTANTS_CYCLES_LOG2
        std     Y + RAMP_CYCLES_LOG2, r24
        ldd     r24, Z + CONSTANTS_SPLIT_TICKS
        std     Y + RAMP_SPLIT_TICKS, r24
        movw    r24, r28
        adiw    r24, RAMP_K2
        call    wide_copy
        ldd     r24, Y + RAMP_LINEAR
        sbrc    r24, 0
        rjmp    begin_linear

        /* Harmonic. Steep: r4-r7: K / 2^17; a third: 2^18.6 */
        rcall   load_k
        ldd     r24, Y + RAMP_CYCLES_LOG2
        subi    r24, 10
1:      lsr     r23
        ror     r22
        ror     r21
        ror     r20
        inc     r24
        brne    1b
        movw    r4, r20
        movw    r6, r22
        rcall   load_step
        ldi     r26, 3
        ldi     r27, 0
        call    __muluhisi3     /* r22-r25; leaves r18-r21 alone */
        ldi     r26, 0
        cp      r4, r18
        cpc     r5, r19
        cpc     r6, r20
        cpc     r7, r21
        adc     r26, r1
        cp      r4, r22
        cpc     r5, r23
        cpc     r6, r24
        cpc     r7, r25
        adc     r26, r1
        std     Y + RAMP_STEEP, r26
        lsl     r18
        rol     r19
        rol     r20
        rol     r21
        std     Y + RAMP_X, r1
        std     Y + RAMP_X + 1, r1
        std     Y + RAMP_X + 2, r1
        std     Y + RAMP_X + 3, r1
        std     Y + RAMP_X + 4, r18
        std     Y + RAMP_X + 5, r19
        std     Y + RAMP_X + 6, r20
        std     Y + RAMP_X + 7, r21
        rcall   load_k
        rcall   x_address
        call    wide_divide
        rcall   set_rate
        cpi     r24, 33
        brlo    2f
        ldi     r18, 0xFF
        ldi     r19, 0xFF
        movw    r20, r18
        rcall   store_rate
2:      rcall   load_v
        rcall   load_cap
        cp      r22, r18
        cpc     r23, r19
        cpc     r24, r20
        cpc     r25, r21
        brlo    3f
        movw    r22, r18
        movw    r24, r20
3:      rcall   twice
        rjmp    begun

begin_linear:
        movw    r20, r6
        movw    r22, r14
        rcall   x_address
        call    wide_set
        call    wide_bits
        subi    r24, 30
        mov     r2, r24
        rcall   scale_k
        rcall   load_v
        mov     r18, r2
        rjmp    2f
1:      rcall   twice
        inc     r18
2:      tst     r18
        brne    1b
        rcall   store_v

        /* c, first in full steps. r3: by how many doublings smaller than in these units; r4, r5: its address. */
        mov     r3, r2
        lsl     r3
        neg     r3
        rcall   c_address
        movw    r4, r24
        rcall   load_step
        movw    r22, r20
        movw    r20, r18
        or      r18, r19
        or      r18, r22
        or      r18, r23
        breq    3f
        call    wide_set
        ldi     r20, lo8(LINEAR_SQUARE_Q15)
        ldi     r21, hi8(LINEAR_SQUARE_Q15)
        ldi     r22, hlo8(LINEAR_SQUARE_Q15)
        ldi     r23, hhi8(LINEAR_SQUARE_Q15)
        call    wide_multiply
        movw    r30, r8
        ldd     r6, Z + CONSTANTS_STEPS_PER_REV
        ldd     r7, Z + CONSTANTS_STEPS_PER_REV + 1
        clr     r14
        clr     r15
        ldi     r24, 15
        sub     r3, r24
        rjmp    4f
3:      movw    r20, r6
        movw    r22, r14
        rcall   ramp_square
        movw    r6, r10
        movw    r14, r12
4:      rcall   divide_scaled

        /* The rate. r4, r5: x; r6, r7, r14, r15: K / 128 */
        movw    r22, r4
        rcall   x_address
        movw    r4, r24
        call    wide_copy
        rcall   load_k
        movw    r6, r20
        movw    r14, r22
        mov     r3, r2
        lsl     r3
        ldi     r24, LINEAR_RATE_LOG2 - 14
        add     r3, r24
        rcall   divide_scaled
        rcall   divide
        rcall   set_rate
        ldd     r18, Y + RAMP_CYCLES_LOG2
        lsl     r18
        subi    r18, lo8(-(LINEAR_STEEP_LOG2 - 6))
        ldi     r19, 0
        cp      r18, r24
        adc     r19, r1
        subi    r18, lo8(-6)
        cp      r18, r24
        adc     r19, r1
        std     Y + RAMP_STEEP, r19

        rcall   load_v
        movw    r20, r22
        movw    r22, r24
        rcall   x_address
        rcall   ramp_square
        rcall   load_v
        ldd     r18, Y + RAMP_FASTER
        or      r18, r22
        or      r18, r23
        or      r18, r24
        or      r18, r25
        brne    5f
        rcall   c_address
        movw    r22, r24
        rcall   x_address
        call    wide_copy
        movw    r20, r10
        movw    r22, r12
        call    wide_multiply   /* exactly to a standstill */
        rcall   set_v
5:      rcall   choose_units
        rcall   load_v
        rcall   twice
        mov     r18, r22
        or      r18, r23
        or      r18, r24
        or      r18, r25
        brne    begun
        rcall   c_address
        call    wide_root
begun:  rcall   set_interval
        restore_registers frame=8

twice:  lsl     r22
        rol     r23
        rol     r24
        rol     r25
        ret

load_k:                         /* K / 128 */
        movw    r30, r8
        ldd     r20, Z + 3
        ldd     r21, Z + 4
        ldd     r22, Z + 5
        ldd     r23, Z + 6
        ret

/* The rate is x, as far as it has room; r24: bits of x. */
set_rate:
        rcall   x_address
        call    wide_bits
        ldd     r18, Y + RAMP_X
        ldd     r19, Y + RAMP_X + 1
        ldd     r20, Y + RAMP_X + 2
        ldd     r21, Y + RAMP_X + 3
store_rate:
        std     Y + RAMP_RATE, r18
        std     Y + RAMP_RATE + 1, r19
        std     Y + RAMP_RATE + 2, r20
        std     Y + RAMP_RATE + 3, r21
        ret

/* The number at r4, r5, doubled r3 times, by the divisor: of as many bits as there is room for. */
divide_scaled:
        rcall   shift_up
        rcall   divide
        mov     r22, r3
        neg     r22
        movw    r24, r4
        jmp     wide_shift

divide: movw    r20, r6
        movw    r22, r14
        movw    r24, r4
        jmp     wide_divide
