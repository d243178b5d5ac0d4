; Cycles of reads and writes, measured between the labels; busy, ignored and AND-ing writes. DS40002061 section 8.6.3.
#include <avr/io.h>

    .section .bss
    .global r_read ; cell 5, preset by the test
r_read: .skip 1
    .global r_busy ; EECR during the write
r_busy: .skip 1
    .global r_address ; EEARL after an attempt to change it during the write
r_address: .skip 1
    .global r_read_busy ; EEDR after an attempt to read during the write
r_read_busy: .skip 1
    .global r_done
r_done: .skip 1

    .section .text
    .macro wait_ready
1:  sbic _SFR_IO_ADDR(EECR), EEPE
    rjmp 1b
    .endm

    .global main
main:
    clr r16
    out _SFR_IO_ADDR(EEARH), r16
    ldi r16, 5
    out _SFR_IO_ADDR(EEARL), r16
    .global before_read
before_read:
    sbi _SFR_IO_ADDR(EECR), EERE
    .global after_read
after_read:
    in r16, _SFR_IO_ADDR(EEDR)
    sts r_read, r16

    ; erase and write: cell 6 = 0x3C
    ldi r16, 6
    out _SFR_IO_ADDR(EEARL), r16
    ldi r16, 0x3C
    out _SFR_IO_ADDR(EEDR), r16
    sbi _SFR_IO_ADDR(EECR), EEMPE
    .global before_write
before_write:
    sbi _SFR_IO_ADDR(EECR), EEPE
    .global after_write
after_write:
    in r16, _SFR_IO_ADDR(EECR)
    sts r_busy, r16
    ldi r16, 7
    out _SFR_IO_ADDR(EEARL), r16 ; ignored
    in r16, _SFR_IO_ADDR(EEARL)
    sts r_address, r16
    sbi _SFR_IO_ADDR(EECR), EERE ; ignored: EEDR keeps what was written
    in r16, _SFR_IO_ADDR(EEDR)
    sts r_read_busy, r16
    ldi r16, 0xA5
    out _SFR_IO_ADDR(EEDR), r16
    sbi _SFR_IO_ADDR(EECR), EEMPE
    sbi _SFR_IO_ADDR(EECR), EEPE ; ignored
    wait_ready
    .global written
written:
    nop

    ; erase only: cell 8; write only: cell 9
    ldi r16, 8
    out _SFR_IO_ADDR(EEARL), r16
    ldi r16, 1 << EEPM0
    out _SFR_IO_ADDR(EECR), r16
    sbi _SFR_IO_ADDR(EECR), EEMPE
    sbi _SFR_IO_ADDR(EECR), EEPE
    .global erasing
erasing:
    wait_ready
    .global erased
erased:
    ldi r16, 9
    out _SFR_IO_ADDR(EEARL), r16
    ldi r16, 0x0F
    out _SFR_IO_ADDR(EEDR), r16
    ldi r16, 1 << EEPM1
    out _SFR_IO_ADDR(EECR), r16
    sbi _SFR_IO_ADDR(EECR), EEMPE
    sbi _SFR_IO_ADDR(EECR), EEPE
    .global programming
programming:
    wait_ready
    .global programmed
programmed:
    ldi r16, 1
    sts r_done, r16
forever:
    rjmp forever
