; First of all after a reset: its cause is kept, the watchdog gets its period.
;
; After a watchdog reset the watchdog runs on with its shortest period, 16 ms, and cannot be stopped while WDRF is set:
; who does not clear WDRF at once is reset again and again. From here on it always runs: 16,384 of its cycles, 0.125 s.
; The start-up code executes .init3 between setting the stack and clearing .bss (avr-libc, "Memory Sections").
; Source: ATmega328P datasheet DS40002061, 11.8.2 (watchdog), 11.9 (MCUSR, WDTCSR).

#include <avr/io.h>

.section .init3, "ax", @progbits
.global reset_init
reset_init:
    in   r24, _SFR_IO_ADDR(MCUSR)
    sts  boot_port_flags, r24
    out  _SFR_IO_ADDR(MCUSR), r1
    wdr
    ldi  r24, (1 << WDCE) | (1 << WDE)
    sts  _SFR_MEM_ADDR(WDTCSR), r24
    ldi  r24, (1 << WDE) | (1 << WDP1) | (1 << WDP0)
    sts  _SFR_MEM_ADDR(WDTCSR), r24 ; within four cycles
