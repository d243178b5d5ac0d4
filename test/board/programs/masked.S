; Sections of a known number of cycles: masked ones, nested interrupts, stack.
#include <avr/io.h>

    .global __do_clear_bss ; the start-up code clears .bss only when asked for
    .section .bss
    .global done
done: .skip 1

    .text
    .global main, masked_end, __vector_1, __vector_2
main:
    ldi r16, 0x05 ; INT0 and INT1: any edge
    sts EICRA, r16
    ldi r16, 0x03
    out _SFR_IO_ADDR(EIMSK), r16
    sei
    rcall deep
    cli         ; masked from here:
    .rept 20
    nop         ; 20 cycles
    .endr
masked_end:
    sei         ; and 1
    ldi r16, 1
    sts done, r16
1:  rjmp 1b

deep:
    .rept 10
    push r0
    .endr
    .rept 10
    pop r0
    .endr
    ret

__vector_1: ; 4 entry, 3 JMP, 10, 1 SEI, 20, 4 RETI
    .rept 10
    nop
    .endr
    sei
    .rept 20
    nop
    .endr
    reti

__vector_2: ; 4 entry, 3 JMP, 5, 4 RETI
    .rept 5
    nop
    .endr
    reti
