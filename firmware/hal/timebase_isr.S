; Counts the overflows of Timer0 for timebase.c.
;
; Interruptible from its first instruction (9 cycles after the flag): the next overflow is 16,384 cycles away.
; 29 cycles; 51 with a carry, and 8 for each further one.

#include <avr/io.h>

#define IO_SREG _SFR_IO_ADDR(SREG)

.section .text

.global TIMER0_OVF_vect
TIMER0_OVF_vect:
    sei
    push r24
    in   r24, IO_SREG
    push r24
    lds  r24, timebase_overflows
    inc  r24
    sts  timebase_overflows, r24
    brne counted
    push r30
    push r31
    ldi  r30, lo8(timebase_overflows + 1)
    ldi  r31, hi8(timebase_overflows + 1)
carry:
    ld   r24, Z
    inc  r24
    st   Z+, r24
    brne carried
    cpi  r30, lo8(timebase_overflows + 4)
    brne carry
carried:
    pop  r31
    pop  r30
counted:
    pop  r24
    out  IO_SREG, r24
    pop  r24
    reti
