; Goes wrong in the way that the test chooses.
#include <avr/io.h>

    .global __do_clear_bss ; the start-up code clears .bss only when asked for
    .section .bss
    .global way
way: .skip 1
    .skip 200

    .text
    .global main, illegal
main:
    lds r24, way
    cpi r24, 1
    breq illegal
    cpi r24, 2
    breq far
    cpi r24, 3
    breq pushes
    cpi r24, 4
    breq pops
    rjmp main
illegal:
    .word 0x9404
far:
    ldi ZL, lo8(0x3000)
    ldi ZH, hi8(0x3000)
    ijmp
pushes:
    push r0
    rjmp pushes
pops:
    pop r0
    rjmp pops
