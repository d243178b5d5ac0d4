/* See wide.h. Cycles with call and return: add, subtract 96; multiply 300; set 25; divide about 140 per byte of the
 * quotient; root 1,200; shift 50 and 11 a bit; copy 80; fraction 65. Little-endian, arguments by the avr-gcc calling
 * convention; wide_set and wide_copy leave r20 to r25 as they are. */

        .section .text.wide_copy, "ax", @progbits
        .global wide_copy
        .type wide_copy, @function
wide_copy:
        movw    r30, r24
        movw    r26, r22
        ldi     r18, 8
1:      ld      r19, X+
        st      Z+, r19
        dec     r18
        brne    1b
        ret

        .section .text.wide_set, "ax", @progbits
        .global wide_set
        .type wide_set, @function
wide_set:                       /* r24 x, r20-r23 value */
        movw    r30, r24
        st      Z, r20
        std     Z + 1, r21
        std     Z + 2, r22
        std     Z + 3, r23
        std     Z + 4, r1
        std     Z + 5, r1
        std     Z + 6, r1
        std     Z + 7, r1
        ret

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

        .section .text.wide_change, "ax", @progbits
        .global wide_change
        .type wide_change, @function
wide_change:                    /* r24 x, r22 change, r20 add */
        tst     r20
        brne    1f
        jmp     wide_subtract
1:      jmp     wide_add

/* \a... += x * y, the carry as far as there are registers. */
.macro add_product zero, x, y, a, b, c
        mul     \x, \y
        add     \a, r0
        adc     \b, r1
        .ifnb \c
        adc     \c, \zero
        .endif
.endm

/* Byte by byte of the product, in place: in r24, r25, r18, r19 the bytes of x that count for it, in r26, r27, r17 the sum of
 * their products. */
        .section .text.wide_multiply, "ax", @progbits
        .global wide_multiply
        .type wide_multiply, @function
wide_multiply:                  /* r24 x, r20-r23 factor */
        push    r16
        push    r17
        push    r28
        movw    r30, r24
        clr     r16
        clr     r17
        clr     r25
        movw    r18, r16
        movw    r26, r16
        ldi     r28, 8          /* bytes */
1:      ld      r24, Z
        add_product r16, r24, r20, r26, r27, r17
        add_product r16, r25, r21, r26, r27, r17
        add_product r16, r18, r22, r26, r27, r17
        add_product r16, r19, r23, r26, r27, r17
        st      Z+, r26
        mov     r26, r27
        mov     r27, r17
        clr     r17
        mov     r19, r18
        mov     r18, r25
        mov     r25, r24
        dec     r28
        brne    1b
        clr     r1
        pop     r28
        pop     r17
        pop     r16
        ret

/* Bit by bit: the remainder takes in one bit of x, and the divisor is taken off where it can be. */
        .section .text.wide_divide, "ax", @progbits
        .global wide_divide
        .type wide_divide, @function
wide_divide:                    /* r24 x, r20-r23 divisor; returns the remainder in r22-r25 */
        movw    r30, r24
        adiw    r30, 8          /* behind the highest byte */
        movw    r26, r22        /* divisor in r20, r21, r26, r27 */
        clr     r22             /* remainder */
        clr     r23
        clr     r24
        clr     r25
        ldi     r19, 8          /* bytes */
1:      ld      r18, -Z
        tst     r25
        brne    6f
        cp      r18, r20        /* with the next byte the remainder is still less: the quotient has a zero */
        cpc     r22, r21
        cpc     r23, r26
        cpc     r24, r27
        brsh    6f
        mov     r25, r24
        mov     r24, r23
        mov     r23, r22
        mov     r22, r18
        st      Z, r1
        rjmp    5f
6:      ldi     r18, 8
        mov     r0, r18
        ld      r18, Z
2:      lsl     r18
        rol     r22
        rol     r23
        rol     r24
        rol     r25
        brcs    3f
        cp      r22, r20
        cpc     r23, r21
        cpc     r24, r26
        cpc     r25, r27
        brlo    4f
3:      sub     r22, r20
        sbc     r23, r21
        sbc     r24, r26
        sbc     r25, r27
        inc     r18
4:      dec     r0
        brne    2b
        st      Z, r18
5:      dec     r19
        brne    1b
        ret

/* Two bits of x make one of the root. In r22-r26 twice the root so far, in r17-r21 what it leaves of x. */
        .section .text.wide_root, "ax", @progbits
        .global wide_root
        .type wide_root, @function
wide_root:                      /* r24 x; returns r22-r25 */
        push    r16
        push    r17
        movw    r30, r24
        adiw    r30, 7
        ld      r0, Z+
        clr     r17
        clr     r18
        clr     r19
        movw    r20, r18
        movw    r22, r18
        movw    r24, r18
        clr     r26
        sbrc    r0, 7
        rjmp    4f              /* below 0 */
        ldi     r27, 8          /* bytes */
1:      ld      r0, -Z
        ldi     r16, 4          /* pairs of bits */
2:      lsl     r0
        rol     r17
        rol     r18
        rol     r19
        rol     r20
        rol     r21
        lsl     r0
        rol     r17
        rol     r18
        rol     r19
        rol     r20
        rol     r21
        lsl     r22
        rol     r23
        rol     r24
        rol     r25
        rol     r26
        inc     r22             /* twice the root, and one: what a bit more takes */
        cp      r17, r22
        cpc     r18, r23
        cpc     r19, r24
        cpc     r20, r25
        cpc     r21, r26
        brlo    3f
        sub     r17, r22
        sbc     r18, r23
        sbc     r19, r24
        sbc     r20, r25
        sbc     r21, r26
        inc     r22
        inc     r22
3:      dec     r22
        dec     r16
        brne    2b
        dec     r27
        brne    1b
        lsr     r26
        ror     r25
        ror     r24
        ror     r23
        ror     r22
4:      pop     r17
        pop     r16
        ret

        .section .text.wide_shift, "ax", @progbits
        .global wide_shift
        .type wide_shift, @function
wide_shift:                     /* r24 x, r22 bits */
        tst     r22
        breq    5f
        movw    r30, r24
        ld      r18, Z
        ldd     r19, Z + 1
        ldd     r20, Z + 2
        ldd     r21, Z + 3
        ldd     r24, Z + 4
        ldd     r25, Z + 5
        ldd     r26, Z + 6
        ldd     r27, Z + 7
        brmi    3f
2:      lsr     r27
        ror     r26
        ror     r25
        ror     r24
        ror     r21
        ror     r20
        ror     r19
        ror     r18
        dec     r22
        brne    2b
        rjmp    4f
3:      lsl     r18
        rol     r19
        rol     r20
        rol     r21
        rol     r24
        rol     r25
        rol     r26
        rol     r27
        inc     r22
        brne    3b
4:      st      Z, r18
        std     Z + 1, r19
        std     Z + 2, r20
        std     Z + 3, r21
        std     Z + 4, r24
        std     Z + 5, r25
        std     Z + 6, r26
        std     Z + 7, r27
5:      ret

        .section .text.wide_bits, "ax", @progbits
        .global wide_bits
        .type wide_bits, @function
wide_bits:                      /* r24 x */
        movw    r30, r24
        adiw    r30, 8
        ldi     r24, 64
1:      ld      r18, -Z
        tst     r18
        brne    2f
        subi    r24, 8
        brne    1b
        ret
2:      lsl     r18
        brcs    3f
        dec     r24
        rjmp    2b
3:      ret

/* Products of bytes i of x and j of y with i + j >= 3, summed in r26 (lost), r27, r30, r31, r23: those of the same i + j
 * together, so that a carry goes no further than one byte. Bytes of x that are done with make room. */
        .section .text.wide_fraction, "ax", @progbits
        .global wide_fraction
        .type wide_fraction, @function
wide_fraction:                  /* r22-r25 x, r18-r21 y (kept); returns r22-r25 */
        mul     r22, r21
        movw    r26, r0
        clr     r22             /* zero from here on */
        clr     r30
        clr     r31
        add_product r22, r23, r20, r26, r27, r30
        add_product r22, r24, r19, r26, r27, r30
        add_product r22, r25, r18, r26, r27, r30
        add_product r22, r23, r21, r27, r30, r31
        add_product r22, r24, r20, r27, r30, r31
        add_product r22, r25, r19, r27, r30, r31
        clr     r23
        add_product r22, r24, r21, r30, r31, r23
        add_product r22, r25, r20, r30, r31, r23
        add_product r22, r25, r21, r31, r23
        clr     r1
        mov     r22, r27
        mov     r25, r23
        mov     r24, r31
        mov     r23, r30
        ret
