; Counts the overflows of Timer0 for timebase.c: 28 cycles every 2,048. Interruptible from its first instruction, because
; it is over long before the next overflow.

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
    breq carry
counted:
    pop  r24
    out  IO_SREG, r24
    pop  r24
    reti

carry:
    push r30
    push r31
    ldi  r30, lo8(timebase_overflows + 1)
    ldi  r31, hi8(timebase_overflows + 1)
1:  ld   r24, Z
    inc  r24
    st   Z+, r24
    brne 2f
    cpi  r30, lo8(timebase_overflows + 4)
    brne 1b
2:  pop  r31
    pop  r30
    rjmp counted
