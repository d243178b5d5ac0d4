; The receive interrupt of USART0, and the end of a run that the transmit interrupt (usart_transmit.S) shares with it.
;
; A step interrupt may be due every 32 cycles, and Estop and sync at any moment, so these mask only themselves (RXCIE0,
; UDRIE0 and TXCIE0 alike), allow interrupts at once and do their work interruptible. Both flags would otherwise call the interrupt
; again at once: they stay raised until the data register was read or written.
;
;   flag raised to `sei`     13 cycles with interrupts masked (entry 4, vector jump 3, 6 here)
;   `cli` to end of `reti`   9 cycles masked
;   whole run                receive 79 cycles (overrun 103), transmit 78
;
; What UCSR0B is afterwards follows from the transmit ring alone: UDRIE0 is set unless that is empty; the rest is
; usart_control and RXCIE0. So ports.c may write it at any time, and only who interrupts these has to read it, to put it back
; (soft_uart_isr.S).
; Shared: ports.h says who writes which index.
; Source: ATmega328P datasheet DS40002061, 20.7.3 (receiver error flags: read UCSR0A before UDR0), 20.11.3.

#include <avr/io.h>
#include "hal/ports.h"
#include "hal/usart_isr.h"

; Z: the receive ring's next free slot, r25: the head after it; to `full` if there is none. r24 is left alone.
.macro FREE_SLOT
    lds  r30, usart_port + PORT_RX_HEAD
    mov  r25, r30
    inc  r25
    cpi  r25, USART_RX_BYTES
    brne . + 2                  ; over the next instruction
    ldi  r25, 0
    lds  r31, usart_port + PORT_RX_TAIL
    cp   r25, r31
    breq full
    ldi  r31, 0
    subi r30, lo8(-(usart_port + PORT_RX))
    sbci r31, hi8(-(usart_port + PORT_RX))
.endm

.section .bss

.global usart_port
usart_port: .skip PORT_RX + USART_RX_BYTES

.section .text

; -- receive ----------------------------------------------------------------------------------------------------------

.global USART_RX_vect
USART_RX_vect:
    ENTER
    lds  r25, ADDRESS(UCSR0A)
    lds  r24, ADDRESS(UDR0)
    andi r25, (1 << FE0) | (1 << DOR0)
    brne damaged
good:
    FREE_SLOT
    st   Z, r24
    sts  usart_port + PORT_RX_HEAD, r25
    ldi  r24, 1
    sts  wake_flag, r24
.global usart_done
usart_done:
    lds  r25, usart_port + PORT_TX_TAIL
    lds  r24, usart_port + PORT_TX_HEAD
    cp   r24, r25
    lds  r24, usart_control
    breq . + 2                  ; over the next instruction
    ori  r24, 1 << UDRIE0
    ori  r24, 1 << RXCIE0
    pop  r25
    out  IO_SREG, r25           ; nothing below changes flags
    pop  r31
    pop  r30
    pop  r25                    ; cycles masked
    cli
    sts  ADDRESS(UCSR0B), r24   ; 2
    pop  r24                    ; 4
    reti                        ; 8

; One more in a counter that stays at 255.
.macro COUNT counter
    lds  r25, usart_port + \counter
    inc  r25
    brne . + 2                  ; over the next instruction
    dec  r25
    sts  usart_port + \counter, r25
.endm

; In a full ring the newest byte becomes PORT_DAMAGED: the main loop cannot be reading that one.
full:
    subi r30, 1
    brcc . + 2                  ; over the next instruction
    ldi  r30, USART_RX_BYTES - 1
    ldi  r31, 0
    subi r30, lo8(-(usart_port + PORT_RX))
    sbci r31, hi8(-(usart_port + PORT_RX))
    ldi  r24, PORT_DAMAGED
    st   Z, r24
    COUNT PORT_OVERRUNS
    rjmp usart_done

; Bytes were lost before this one (overrun): PORT_DAMAGED goes before it. Or this one is not what was sent (framing
; error): PORT_DAMAGED goes in its place, because the byte itself might read as the end of a line and set the rest of
; the line free to be executed.
damaged:
    sbrs r25, FE0
    rjmp lost
    ldi  r24, PORT_DAMAGED
    COUNT PORT_FRAMING
    rjmp good
lost:
    COUNT PORT_OVERRUNS
    FREE_SLOT
    sts  usart_port + PORT_RX_HEAD, r25
    ldi  r25, PORT_DAMAGED
    st   Z, r25
    rjmp good

