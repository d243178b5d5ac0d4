; The software port: a start edge on S/W Rx (PCINT2), a sample (compare match B of Timer0), a bit of S/W Tx (match A).
;
; Edges of S/W Tx are made by the compare match itself; its interrupt says what the next match does, and a late one moves
; no edge. Samples are taken when their interrupt comes: they aim before the middle of the bit, because the start edge and
; the sample can each be late by a step interrupt (22 cycles, at most 123) but never early.
;
; As the others these let interrupts in at once. The start edge goes before the step interrupt all the same: where that
; cannot bear it, the main loop takes both receiving interrupts away (step_hurry.S). It masks itself (PCMSK2; PCICR is a
; constant of encoder_isr.S); a match comes again only where the next one is written, and that is last of all.
;
; All the others together may take longer than a bit. A sample that they have held up so long finds the next one due, and
; takes it at once. An edge of S/W Tx would come a turn of Timer0 late, so those of USART0, which can wait longest, are off
; while a bit is sent; should that not do, the edge is made when it is found late (a step each reload, the encoder bouncing).
; Only then can the next match interrupt this one, behind its last store: a frame more of 8 bytes.
;
;                       flag raised to `sei`   `cli` to end of `reti`   whole run
;   start edge          15 cycles masked       9                        77
;   sample              11                     23                       76, with a byte 94, one that is lost 113
;   bit sent            18, with PCINT1 31     -                        91, with the next byte 114
;   in between TIMSK0 is changed: 6 cycles masked, at the start edge 13, at the stop bit 12 (a start edge missed: 16);
;   OCR0A is written: 8
;
; Source: ATmega328P datasheet DS40002061, 13.2.4 to 13.2.6 (pin changes), 15.5.3 (compare output), 15.9.

#include <avr/io.h>
#include "hal/ports.h"

#define ADDRESS(name) _SFR_MEM_ADDR(name)
#define IO(name) _SFR_IO_ADDR(name)
#define EARLY 11  /* ticks that a sample aims before the middle */
#define MISSED 6  /* ticks from where a start edge is found missed to the sample of its bit */
#define PASSED 64 /* up to so many ticks ago is past; farther is to come */

.section .bss

.global soft_uart
soft_uart: .skip SOFT_PORT + PORT_RX + SOFT_RX_BYTES

.section .text

.macro SAVE
    in   r25, IO(SREG)
    push r25
    push r30
    push r31
    ldi  r30, lo8(soft_uart)
    ldi  r31, hi8(soft_uart)
.endm

.macro RESTORE
    pop  r31
    pop  r30
    pop  r25
    out  IO(SREG), r25
    pop  r25
.endm

; An interrupt of Timer0 off; nobody else changes TIMSK0 meanwhile. r25 is lost.
.macro INTERRUPT_OFF bit
    cli
    lds  r25, ADDRESS(TIMSK0)
    andi r25, ~(1 << \bit)
    sts  ADDRESS(TIMSK0), r25
    sei
.endm

; -- receive ----------------------------------------------------------------------------------------------------------

.global PCINT2_vect
PCINT2_vect:                    ; cycles since the flag was raised
    push r24                    ; 9
    ldi  r24, 0                 ; 10
    sts  ADDRESS(PCMSK2), r24   ; 12
    sbi  IO(PCIFR), PCIF2       ; 14: an edge just before it was masked
    sei                         ; 15
    in   r24, IO(TCNT0)         ; 16: still before any other interrupt
    push r25
    SAVE
    sbic IO(PIND), PORT_SW_RX
    rjmp wait_for_start         ; the edge was a rising one, or a glitch is over
    ldd  r25, Z + SOFT_INTERVALS
    inc  r25                    ; half of them, 1 of 1, and of that one a half
    lsr  r25
    std  Z + SOFT_RX_INTERVALS, r25
    ldd  r25, Z + SOFT_INTERVAL + 1
    brcs . + 2                  ; over the next instruction
    lsr  r25
    add  r24, r25
    subi r24, EARLY
    ldi  r25, 0
    std  Z + SOFT_RX_BITS, r25
    std  Z + SOFT_RX_FRACTION, r25
    ldi  r25, 1 << OCF0B
    cli
    out  IO(OCR0B), r24
    out  IO(TIFR0), r25
    lds  r25, ADDRESS(TIMSK0)
    ori  r25, 1 << OCIE0B
    sts  ADDRESS(TIMSK0), r25
    in   r25, IO(TCNT0)
    sub  r25, r24
    dec  r25
    cpi  r25, PASSED
    brlo passed
    sei
    rjmp done
passed:                         ; by a long step interrupt: the sample is due
    sbi  IO(TIFR0), OCF0B
    in   r24, IO(PIND)
    sei
    rjmp sample

wait_for_start:
    RESTORE
wait_again:
    ldi  r24, 1 << PORT_SW_RX
    cli                         ; cycles masked
    sts  ADDRESS(PCMSK2), r24   ; 2
    pop  r24                    ; 4
    reti                        ; 8

.global TIMER0_COMPB_vect
TIMER0_COMPB_vect:
    push r24                    ; 9
    in   r24, IO(PIND)          ; 10
    sei                         ; 11
    push r25
    SAVE
sample:
    ldd  r25, Z + SOFT_RX_INTERVALS
    dec  r25
    brne sampled
    ldd  r25, Z + SOFT_RX_BITS
    subi r25, 1
    brcs start_bit
    breq stop_bit
    std  Z + SOFT_RX_BITS, r25
    bst  r24, PORT_SW_RX
    ldd  r25, Z + SOFT_RX_SHIFT
    lsr  r25
    bld  r25, 7
    std  Z + SOFT_RX_SHIFT, r25
next_bit:
    ldd  r25, Z + SOFT_INTERVALS
sampled:
    std  Z + SOFT_RX_INTERVALS, r25
    ldd  r24, Z + SOFT_INTERVAL
    ldd  r25, Z + SOFT_RX_FRACTION
    add  r25, r24
    std  Z + SOFT_RX_FRACTION, r25
    in   r24, IO(OCR0B)
    ldd  r25, Z + SOFT_INTERVAL + 1
    adc  r24, r25
    cli                         ; cycles masked
    out  IO(OCR0B), r24         ; 1
    in   r25, IO(TCNT0)
    sub  r25, r24
    dec  r25
    cpi  r25, PASSED
    brlo passed                 ; all other interrupts at once: longer than a bit
done:
    RESTORE
    pop  r24
    reti                        ; 22

start_bit:
    sbrc r24, PORT_SW_RX
    rjmp glitch
    ldi  r25, 9
    std  Z + SOFT_RX_BITS, r25
    rjmp next_bit
glitch:
    INTERRUPT_OFF OCIE0B
    rjmp wait_for_start

; The start edge is awaited from here on: a faster peer's next one may come at once. Where the line stays low, its end is a
; rising edge and no start. Others may have held this up until the stop bit was over: then the line was high when the sample
; was taken, and is low now. That edge is not waited for, but taken to have been a moment ago.
stop_bit:
    ldi  r25, 1 << PORT_SW_RX
    cli                         ; cycles masked
    sts  ADDRESS(PCMSK2), r25   ; 2
    sbrc r24, PORT_SW_RX
    sbic IO(PIND), PORT_SW_RX
    rjmp 1f                     ; 6
    ldi  r25, 0                 ; should the edge be noted all the same, PCINT2 does this again, and better
    sts  ADDRESS(PCMSK2), r25
    std  Z + SOFT_RX_BITS, r25
    in   r25, IO(TCNT0)
    subi r25, -MISSED
    out  IO(OCR0B), r25
    rjmp 2f
1:  lds  r25, ADDRESS(TIMSK0)
    andi r25, ~(1 << OCIE0B)
    sts  ADDRESS(TIMSK0), r25   ; 11
2:  sei                         ; 12
    sbrs r24, PORT_SW_RX
    rjmp framing_error
    ldd  r24, Z + SOFT_RX_SHIFT
store:
    ldd  r25, Z + SOFT_PORT + PORT_RX_HEAD
    push r25
    inc  r25
    andi r25, SOFT_RX_BYTES - 1
    push r24
    ldd  r24, Z + SOFT_PORT + PORT_RX_TAIL
    cp   r25, r24
    pop  r24
    breq full
    std  Z + SOFT_PORT + PORT_RX_HEAD, r25
    pop  r25
stored:
    add  r30, r25
    ldi  r25, 0
    adc  r31, r25
    subi r30, lo8(-(SOFT_PORT + PORT_RX))
    sbci r31, hi8(-(SOFT_PORT + PORT_RX))
    st   Z, r24
wake:
    ldi  r24, 1
    sts  wake_flag, r24
    rjmp done

full:                           ; the newest byte becomes PORT_DAMAGED: the main loop cannot be reading that one
    ldd  r24, Z + SOFT_PORT + PORT_OVERRUNS
    inc  r24
    breq . + 2                  ; over the next instruction
    std  Z + SOFT_PORT + PORT_OVERRUNS, r24
    pop  r25
    dec  r25
    andi r25, SOFT_RX_BYTES - 1
    ldi  r24, PORT_DAMAGED
    rjmp stored

framing_error:
    ldd  r24, Z + SOFT_PORT + PORT_FRAMING
    inc  r24
    breq . + 2                  ; over the next instruction
    std  Z + SOFT_PORT + PORT_FRAMING, r24
    ldi  r24, PORT_DAMAGED
    rjmp store

; -- transmit ---------------------------------------------------------------------------------------------------------

; The next match makes the line TCCR0A's: COM0A = 3 high, 2 low. Where intervals of the bit are left, it stays.
.global TIMER0_COMPA_vect
TIMER0_COMPA_vect:
    push r24                    ; 9
    lds  r24, ADDRESS(UCSR0B)   ; 11
    push r24                    ; 13
    lds  r24, usart_control     ; 15
    sei                         ; 16
    sts  ADDRESS(UCSR0B), r24   ; 18: behind `sei` none comes before this
    push r25
    SAVE
next_edge:
    ldd  r25, Z + SOFT_TX_INTERVALS
    dec  r25
    brne 3f
    ldd  r25, Z + SOFT_TX_BITS
    subi r25, 1
    breq 1f                     ; the stop bit comes
    brmi next_byte              ; it has just begun, or is over
    ldd  r24, Z + SOFT_TX_SHIFT
    lsr  r24
    std  Z + SOFT_TX_SHIFT, r24
    brcc 2f
1:  ldi  r24, 1 << COM0A1 | 1 << COM0A0
    rjmp edge
2:  ldi  r24, 1 << COM0A1
edge:
    out  IO(TCCR0A), r24
    std  Z + SOFT_TX_BITS, r25
    ldd  r25, Z + SOFT_INTERVALS
3:  std  Z + SOFT_TX_INTERVALS, r25
    ldd  r24, Z + SOFT_INTERVAL
    ldd  r25, Z + SOFT_TX_FRACTION
    add  r25, r24
    std  Z + SOFT_TX_FRACTION, r25
    in   r24, IO(OCR0A)
    ldd  r25, Z + SOFT_INTERVAL + 1
    adc  r24, r25
    cli                         ; cycles masked
    out  IO(OCR0A), r24         ; 1
    in   r25, IO(TCNT0)         ; 2
    sub  r25, r24
    dec  r25
    cpi  r25, PASSED
    brlo late                   ; 6: all other interrupts at once: longer than a bit
    sei                         ; 7
bit_sent:
    RESTORE
    pop  r24
    sts  ADDRESS(UCSR0B), r24
    pop  r24
    reti

late:                           ; the edge is made now, and the next one where it belongs
    sbi  IO(TIFR0), OCF0A
    sei
    ldi  r25, 1 << FOC0A | 1 << CS01
    out  IO(TCCR0B), r25
    rjmp next_edge

next_byte:                      ; r25: 0xFF or SOFT_TX_LAST - 1
    ldd  r24, Z + SOFT_PORT + PORT_TX_TAIL
    push r25
    ldd  r25, Z + SOFT_PORT + PORT_TX_HEAD
    cp   r24, r25
    pop  r25
    breq empty
    mov  r25, r24
    inc  r25
    andi r25, PORT_TX_BYTES - 1
    std  Z + SOFT_PORT + PORT_TX_TAIL, r25
    add  r30, r24
    ldi  r25, 0
    adc  r31, r25
    ldd  r24, Z + SOFT_PORT + PORT_TX
    ldi  r30, lo8(soft_uart)
    ldi  r31, hi8(soft_uart)
    std  Z + SOFT_TX_SHIFT, r24
    ldi  r24, 1
    sts  wake_flag, r24
    ldi  r25, 9                 ; 8 data bits to come after this start bit, then the stop bit
    rjmp 2b

empty:
    cpi  r25, SOFT_TX_LAST - 1
    breq over
    std  Z + SOFT_TX_BITS, r25
    ldi  r25, 1                 ; the stop bit lasts until the next match
    rjmp 3b
over:
    INTERRUPT_OFF OCIE0A
    ldd  r24, Z + SOFT_ENDED
    sbrc r24, 0
    cbi  IO(PORTD), PORT_TX_EN
    ldi  r24, 1
    sts  wake_flag, r24         ; who waits for the end of the output goes on
    rjmp bit_sent
