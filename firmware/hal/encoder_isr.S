; The encoder's interrupt: one edge on EnA or EnB, or several.
;
; As the others it masks only itself (PCIE1; the software port's PCIE2 stays set), allows interrupts at once and does its work
; interruptible; a change of the pins meanwhile leaves its flag, and calls it again. That comes before the step interrupt,
; whose number is higher: what is masked at the end and at the next beginning adds up, and must be less than 32 cycles.
;
;   flag raised to `sei`     13 cycles with interrupts masked
;   `cli` to end of `reti`   9 cycles masked
;   whole run                54 cycles
;
; The pins' Gray code (EnB EnA: 00 01 11 10) is made binary; its difference to the two low bits of the count, modulo 4,
; is 1 for an edge clockwise, 3 for one back, 0 for one that is over already. 2 is two edges at once: none is counted.

#include <avr/io.h>
#include "hal/encoder.h"

#define ADDRESS(name) _SFR_MEM_ADDR(name)
#define IO_SREG _SFR_IO_ADDR(SREG)

.section .text

.global PCINT1_vect
PCINT1_vect:
    push r24                    ; 9 cycles since the flag was raised
    ldi  r24, 1 << PCIE2        ; 10
    sei                         ; 11
    sts  ADDRESS(PCICR), r24    ; 13: behind `sei` none comes before this
    in   r24, IO_SREG
    push r24
    push r25
    in   r24, _SFR_IO_ADDR(PINC)
    andi r24, ENCODER_PINS
    mov  r25, r24
    lsr  r25
    eor  r24, r25
    lds  r25, encoder_edges
    sub  r24, r25
    sbrs r24, 0
    rjmp none
    inc  r25
    sbrc r24, 1
    subi r25, 2
    sts  encoder_edges, r25
    ldi  r24, 1
    sts  wake_flag, r24
none:
    pop  r25
    pop  r24
    out  IO_SREG, r24           ; interrupts stay allowed; nothing below changes flags
    ldi  r24, 1 << PCIE1 | 1 << PCIE2
    cli
    sts  ADDRESS(PCICR), r24    ; 2 cycles masked
    pop  r24                    ; 4
    reti                        ; 8
