; Counts the overflows of Timer0 for timebase.c. Interruptible from its first instruction: the next overflow is 16,384
; cycles away.

#include <avr/io.h>

#define IO_SREG _SFR_IO_ADDR(SREG)

.section .text

.global TIMER0_OVF_vect
TIMER0_OVF_vect:
    sei
    push r24
    in   r24, IO_SREG
    push r24
    push r30
    push r31
    ldi  r30, lo8(timebase_overflows)
    ldi  r31, hi8(timebase_overflows)
next:
    ld   r24, Z
    inc  r24
    st   Z+, r24
    brne counted                ; no carry into the next byte
    cpi  r30, lo8(timebase_overflows + 4)
    brne next
counted:
    pop  r31
    pop  r30
    pop  r24
    out  IO_SREG, r24
    pop  r24
    reti
