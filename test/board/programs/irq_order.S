; Two requests, compare A and compare B of Timer1, stand when SEI comes. The handlers note how far the main program got.
#include <avr/io.h>

    .global __do_clear_bss ; the start-up code clears .bss only when asked for
    .section .bss
    .global main_at_a, main_at_b, order, done
main_at_a: .skip 1
main_at_b: .skip 1
order: .skip 1 ; 1: A came first
done: .skip 1

    .text
    .global main, __vector_11, __vector_12
main:
    clr r18
    clr r20
    ldi r16, 0x06
    sts TIMSK1, r16
    ldi r16, 1 << WGM12 | 1 << CS10 ; both registers 0: both match
    sts TCCR1B, r16
    nop
    nop
    clr r17
    sts TCCR1B, r17
    sei
    inc r20
    inc r20
    inc r20
    inc r20
    ldi r16, 1
    sts done, r16
1:  rjmp 1b

__vector_11:
    sts main_at_a, r20
    cpi r18, 0
    brne 1f
    ldi r17, 1
    sts order, r17
1:  inc r18
    reti

__vector_12:
    sts main_at_b, r20
    inc r18
    reti
