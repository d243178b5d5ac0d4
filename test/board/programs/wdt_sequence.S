; The window of the watchdog's timed sequence: WDCE and WDE, then 0 to 4 cycles, then the wanted value by STS (2 cycles).
; DS40002061 section 11.9.2: hardware clears WDCE after four cycles. r_csr[n] is WDTCSR after the attempt with n cycles
; between the two instructions.
#include <avr/io.h>

    .section .bss
    .global r_csr
r_csr: .skip 5
    .global r_done
r_done: .skip 1

    .section .text
    .macro attempt n
    wdr
    sts WDTCSR, r17
    sts WDTCSR, r19 ; off
    sts WDTCSR, r17
    .rept \n
    nop
    .endr
    sts WDTCSR, r18
    lds r16, WDTCSR
    sts r_csr + \n, r16
    .endm

    .global main
main:
    clr r19
    out _SFR_IO_ADDR(MCUSR), r19
    ldi r17, (1 << WDCE) | (1 << WDE)
    ldi r18, (1 << WDP2) | (1 << WDP1)
    attempt 0
    attempt 1
    attempt 2
    attempt 3
    attempt 4
    wdr
    sts WDTCSR, r17
    sts WDTCSR, r19
    ldi r16, 1
    sts r_done, r16
forever:
    rjmp forever
