; The transmit interrupts of USART0: the data register is empty, and the end of the network's packet. An image that only
; receives does without them.
;
; Shared: ports.h says who writes which index. How they run: usart_receive.S.

#include <avr/io.h>
#include "hal/ports.h"
#include "hal/usart_isr.h"

.global usart_busy
usart_busy = USART_CONTROL

.section .text

; -- transmit ---------------------------------------------------------------------------------------------------------

; The data register is empty. With the last byte the interrupt stays masked until the main loop puts another one.
.global USART_UDRE_vect
USART_UDRE_vect:
    ENTER
    lds  r25, usart_port + PORT_TX_TAIL
    lds  r24, usart_port + PORT_TX_HEAD
    cp   r24, r25
    brne . + 2                  ; over the next instruction
    rjmp usart_done
    mov  r30, r25
    ldi  r31, 0
    subi r30, lo8(-(usart_port + PORT_TX))
    sbci r31, hi8(-(usart_port + PORT_TX))
    ld   r30, Z
    sts  ADDRESS(UDR0), r30
    inc  r25
    andi r25, PORT_TX_BYTES - 1
    sts  usart_port + PORT_TX_TAIL, r25
    ldi  r30, 1
    sts  wake_flag, r30
    rjmp usart_done

; -- the end of the network's packet ----------------------------------------------------------------------------------

; Enabled once bus_port_end() has said that no byte follows: Tx En falls.
.global USART_TX_vect
USART_TX_vect:
    cbi  _SFR_IO_ADDR(PORTD), PORT_TX_EN
    reti
