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
    cpi r24, 5
    breq above
    cpi r24, 6
    breq halves
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

    .macro stack address ; as avr-gcc writes it, the high byte first
    ldi r16, hi8(\address)
    out _SFR_IO_ADDR(SPH), r16
    ldi r16, lo8(\address)
    out _SFR_IO_ADDR(SPL), r16
    .endm
above:
    stack 0x0A00
1:  rjmp 1b
halves:
    stack 0x0801
    stack 0x07F0 ; by way of 0x0701
1:  rjmp 1b
