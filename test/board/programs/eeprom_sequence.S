; The timed write sequence with 0 to 5 cycles between the two writes, EECR written by OUT: DS40002061 section 8.6.3,
; EEMPE is cleared by hardware after four cycles. r_started[n] is EECR just after the attempt with n cycles of NOP.
#include <avr/io.h>

    .section .bss
    .global r_started
r_started: .skip 6
    .global r_without ; EECR after EEPE alone
r_without: .skip 1
    .global r_together ; EECR after EEMPE and EEPE in one write
r_together: .skip 1
    .global r_mpe ; EECR 1, 2, 3, 4, 5 cycles after EEMPE was written
r_mpe: .skip 5
    .global r_done
r_done: .skip 1

    .macro wait_ready
1:  sbic _SFR_IO_ADDR(EECR), EEPE
    rjmp 1b
    .endm

    .macro attempt n
    wait_ready
    ldi r16, \n
    out _SFR_IO_ADDR(EEARL), r16
    out _SFR_IO_ADDR(EEDR), r16
    out _SFR_IO_ADDR(EECR), r17
    .rept \n
    nop
    .endr
    out _SFR_IO_ADDR(EECR), r18
    in r16, _SFR_IO_ADDR(EECR)
    sts r_started + \n, r16
    .endm

    .macro look n
    rcall settle
    out _SFR_IO_ADDR(EECR), r17
    .rept \n - 1
    nop
    .endr
    in r16, _SFR_IO_ADDR(EECR)
    sts r_mpe + \n - 1, r16
    .endm

    .section .text
    .global main
main:
    ldi r17, 1 << EEMPE
    ldi r18, 1 << EEPE
    clr r16
    out _SFR_IO_ADDR(EEARH), r16

    out _SFR_IO_ADDR(EECR), r18
    in r16, _SFR_IO_ADDR(EECR)
    sts r_without, r16
    wait_ready
    ldi r16, (1 << EEMPE) | (1 << EEPE)
    out _SFR_IO_ADDR(EECR), r16
    in r16, _SFR_IO_ADDR(EECR)
    sts r_together, r16
    wait_ready

    attempt 0
    attempt 1
    attempt 2
    attempt 3
    attempt 4
    attempt 5
    wait_ready

    look 1
    look 2
    look 3
    look 4
    look 5

    ldi r16, 1
    sts r_done, r16
forever:
    rjmp forever

settle: ; until EEMPE has certainly gone
    nop
    nop
    nop
    nop
    ret
