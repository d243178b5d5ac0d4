/* See wide.h. Cycles with call and return: add, subtract 96; multiply about 20 + 45 per zero-free byte of x and 13 per
 * product of two bytes: 420 for a 32-bit x. Little-endian, arguments by the avr-gcc calling convention. */

        .section .text.wide_add, "ax", @progbits
        .global wide_add
        .type wide_add, @function
wide_add:
        movw    r30, r24
        movw    r26, r22
        ldi     r18, 8
        clc
1:      ld      r19, Z
        ld      r20, X+
        adc     r19, r20
        st      Z+, r19
        dec     r18             /* leaves the carry alone */
        brne    1b
        ret

        .section .text.wide_subtract, "ax", @progbits
        .global wide_subtract
        .type wide_subtract, @function
wide_subtract:
        movw    r30, r24
        movw    r26, r22
        ldi     r18, 8
        clc
1:      ld      r19, Z
        ld      r20, X+
        sbc     r19, r20
        st      Z+, r19
        dec     r18
        brne    1b
        ret

        .section .text.wide_multiply, "ax", @progbits
        .global wide_multiply
        .type wide_multiply, @function
wide_multiply:                  /* r24 product, r22 x, r20 y */
        push    r28
        push    r29
        push    r16
        movw    r30, r24
        clr     r18
        ldi     r19, 8
1:      st      Z+, r18
        dec     r19
        brne    1b
        ldi     r19, 8          /* bytes of y that still count */
2:      movw    r26, r22
        ld      r18, X+         /* a byte of x */
        movw    r22, r26
        tst     r18
        breq    4f
        movw    r30, r24        /* product from this byte on */
        movw    r28, r20
        mov     r16, r19
        clr     r27             /* carry byte */
        clr     r26             /* zero */
3:      ld      r0, Y+
        mul     r18, r0
        add     r0, r27
        adc     r1, r26
        ld      r27, Z
        add     r0, r27
        adc     r1, r26
        st      Z+, r0
        mov     r27, r1
        dec     r16
        brne    3b
4:      adiw    r24, 1
        dec     r19
        brne    2b
        clr     r1
        pop     r16
        pop     r29
        pop     r28
        ret
