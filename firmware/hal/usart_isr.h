/* What usart_receive.S and usart_transmit.S share: how their interrupts begin. An assembler's header.
 *
 * Context: interrupts of USART0. Errors: none. Source: ATmega328P datasheet DS40002061, 20.11.3; why: usart_receive.S. */
#ifndef HAL_USART_ISR_H
#define HAL_USART_ISR_H

#define ADDRESS(name) _SFR_MEM_ADDR(name)
#define IO_SREG _SFR_IO_ADDR(SREG)

/* usart_busy: UCSR0B while one of them is at work. The image says what it is: with the transmitter or without. */
.macro ENTER                    ; cycles since the flag was raised
    push r24                    ; 9
    ldi  r24, lo8(usart_busy)   ; 10
    sts  ADDRESS(UCSR0B), r24   ; 12
    sei                         ; 13
    in   r24, IO_SREG
    push r25
    push r30
    push r31
    push r24
.endm

#endif
