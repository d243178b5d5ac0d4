; Does what a test tells it, one command at a time, so that the test itself reads as the list of register accesses.
; The test sets `address` and `value`, then `command`, which the program clears when it takes it up.
#include <avr/io.h>

    .global __do_clear_bss ; the start-up code clears .bss only when asked for
    .section .bss
    .global command, address, value, counts
command: .skip 1
address: .skip 2
value: .skip 1
counts: .skip 26 ; interrupts by vector

    .text
    .global main, write_done, read_done, nops, sleeping, woken, bit_done
main:
idle:
    lds r24, command
    tst r24
    breq idle
    lds ZL, address
    lds ZH, address + 1
    lds r16, value
    clr r17
    sts command, r17
    cpi r24, 1
    breq do_write
    cpi r24, 2
    breq do_read
    cpi r24, 3
    breq do_sei
    cpi r24, 4
    breq do_cli
    cpi r24, 5
    brne 1f
    rjmp do_nops
1:  cpi r24, 6
    brne 1f
    rjmp do_sleep
1:  cpi r24, 7
    brne 1f
    rjmp do_sbi_tifr1
1:  cpi r24, 8
    brne 1f
    rjmp do_sbi_pinb
1:  cpi r24, 9
    brne 1f
    rjmp do_out_in
1:  cpi r24, 10
    brne idle
    rjmp do_cbi_tifr1

do_write:
    st Z, r16
write_done:
    rjmp idle

do_read:
    ld r16, Z
read_done:
    sts value, r16
    rjmp idle

do_sei:
    sei
    nop
    rjmp idle

do_cli:
    cli
    rjmp idle

do_sleep: ; SMCR is the test's affair
    sei
sleeping:
    sleep
woken:
    rjmp idle

do_sbi_tifr1:
    sbi _SFR_IO_ADDR(TIFR1), OCF1A
    rjmp bit_done
do_cbi_tifr1:
    cbi _SFR_IO_ADDR(TIFR1), OCF1A
    rjmp bit_done
do_sbi_pinb:
    sbi _SFR_IO_ADDR(PINB), 5
bit_done:
    rjmp idle

do_out_in: ; PINB at once after PORTB, then with one cycle between
    clr r18
    ldi r19, 0x20
    out _SFR_IO_ADDR(PORTB), r18
    nop
    nop
    out _SFR_IO_ADDR(PORTB), r19
    in r20, _SFR_IO_ADDR(PINB)
    out _SFR_IO_ADDR(PORTB), r18
    nop
    nop
    out _SFR_IO_ADDR(PORTB), r19
    nop
    in r21, _SFR_IO_ADDR(PINB)
    sts address, r20
    sts value, r21
    rjmp bit_done

do_nops: ; one cycle each: an interrupt is entered in the very cycle of its flag
nops:
    .rept 4000
    nop
    .endr
    jmp idle

    .altmacro
    .macro handler n
    .global __vector_\n
__vector_\n:
    push r24
    in r24, _SFR_IO_ADDR(SREG)
    push r24
    lds r24, counts + \n
    inc r24
    sts counts + \n, r24
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    reti
    .endm
    .set n, 1
    .rept 25
    handler %n
    .set n, n + 1
    .endr
