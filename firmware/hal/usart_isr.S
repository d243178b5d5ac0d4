; The two interrupts of USART0.
;
; A step interrupt may be due every 32 cycles, and Estop and sync at any moment, so these mask only themselves (RXCIE0 and
; UDRIE0 alike), allow interrupts at once and do their work interruptible. Both flags would otherwise call the interrupt
; again at once: they stay raised until the data register was read or written.
;
;   flag raised to `sei`     13 cycles with interrupts masked (entry 4, vector jump 3, 6 here)
;   `cli` to end of `reti`   9 cycles masked
;   whole run                receive 78 cycles (overrun 102), transmit 77
;
; What UCSR0B is afterwards follows from the transmit ring alone: UDRIE0 is set unless that is empty. So nobody has to
; read it, and usart.c may write it at any time.
; Shared: usart.h says who writes which index.
; Source: ATmega328P datasheet DS40002061, 20.7.3 (receiver error flags: read UCSR0A before UDR0), 20.11.3.

#include <avr/io.h>
#include "hal/usart.h"

#define ADDRESS(name) _SFR_MEM_ADDR(name)
#define IO_SREG _SFR_IO_ADDR(SREG)

; Z: the receive ring's next free slot, r25: the head after it; to `full` if there is none. r24 is left alone.
.macro FREE_SLOT
    lds  r30, usart_rx_head
    mov  r25, r30
    inc  r25
    cpi  r25, USART_RX_BYTES
    brne . + 2                  ; over the next instruction
    ldi  r25, 0
    lds  r31, usart_rx_tail
    cp   r25, r31
    breq full
    ldi  r31, 0
    subi r30, lo8(-(usart_rx_bytes))
    sbci r31, hi8(-(usart_rx_bytes))
.endm

.section .text

.macro ENTER                    ; cycles since the flag was raised
    push r24                    ; 9
    ldi  r24, USART_CONTROL     ; 10
    sts  ADDRESS(UCSR0B), r24   ; 12
    sei                         ; 13
    in   r24, IO_SREG
    push r24
    push r25
    push r30
    push r31
.endm

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
    sts  usart_rx_head, r25
    ldi  r24, 1
    sts  wake_flag, r24
done:
    lds  r25, usart_tx_tail
    lds  r24, usart_tx_head
    cp   r24, r25
    pop  r31
    pop  r30
    pop  r25
    pop  r24                    ; SREG
    brne more
    out  IO_SREG, r24
    ldi  r24, USART_CONTROL | (1 << RXCIE0)
leave:                          ; cycles masked
    cli
    sts  ADDRESS(UCSR0B), r24   ; 2
    pop  r24                    ; 4
    reti                        ; 8
more:
    out  IO_SREG, r24
    ldi  r24, USART_CONTROL | (1 << RXCIE0) | (1 << UDRIE0)
    rjmp leave

; In a full ring the newest byte becomes USART_DAMAGED: the main loop cannot be reading that one.
full:
    subi r30, 1
    brcc . + 2                  ; over the next instruction
    ldi  r30, USART_RX_BYTES - 1
    ldi  r31, 0
    subi r30, lo8(-(usart_rx_bytes))
    sbci r31, hi8(-(usart_rx_bytes))
    ldi  r24, USART_DAMAGED
    st   Z, r24
    rjmp done

; Bytes were lost before this one (overrun): USART_DAMAGED goes before it. Or this one is not what was sent (framing
; error): USART_DAMAGED goes in its place, because the byte itself might read as the end of a line and set the rest of
; the line free to be executed.
damaged:
    sbrc r25, FE0
    ldi  r24, USART_DAMAGED
    sbrc r25, FE0
    rjmp good
    FREE_SLOT
    sts  usart_rx_head, r25
    ldi  r25, USART_DAMAGED
    st   Z, r25
    rjmp good

; -- transmit ---------------------------------------------------------------------------------------------------------

; The data register is empty. With the last byte the interrupt stays masked until the main loop puts another one.
.global USART_UDRE_vect
USART_UDRE_vect:
    ENTER
    lds  r25, usart_tx_tail
    lds  r24, usart_tx_head
    cp   r24, r25
    brne . + 2                  ; over the next instruction
    rjmp done
    mov  r30, r25
    ldi  r31, 0
    subi r30, lo8(-(usart_tx_bytes))
    sbci r31, hi8(-(usart_tx_bytes))
    ld   r30, Z
    sts  ADDRESS(UDR0), r30
    inc  r25
    andi r25, USART_TX_BYTES - 1
    sts  usart_tx_tail, r25
    ldi  r30, 1
    sts  wake_flag, r30
    rjmp done
