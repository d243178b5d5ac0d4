/* The vector table, and what comes before main(): instead of the C library's start-up code, which has a vector for every
 * interrupt of the chip.
 *
 * The table ends with the last interrupt that is used. The places of some that never will be hold the first
 * instructions after a reset. (Unused places before it stay free; nobody comes there.)
 *
 * First of all after a reset its cause is kept, and the watchdog gets its period. After a watchdog reset the watchdog runs
 * on with its shortest period, 16 ms, and cannot be stopped while WDRF is set: who does not clear WDRF at once is reset
 * again and again. From here on it always runs: 16,384 of its cycles, 0.125 s.
 * A bootloader may have come before: the stack pointer and r1, the compiler's zero, are set, nothing else is relied on.
 * In image.ld the C library's __do_clear_bss and then main() follow.
 * Source: ATmega328P datasheet DS40002061, 11.8.2 (watchdog), 11.9 (MCUSR, WDTCSR), 12.4 (vectors: two words each). */
#include <avr/io.h>

        .section .vectors, "ax", @progbits
        .global __vectors
__vectors:
        jmp     start
        .org    4 * INT0_vect_num
        jmp     INT0_vect
        .org    4 * INT1_vect_num
        jmp     INT1_vect
        .org    4 * PCINT1_vect_num
        jmp     PCINT1_vect
        .org    4 * PCINT2_vect_num
        jmp     PCINT2_vect
        .org    4 * WDT_vect_num        /* and of Timer2's and Timer1's but the overflow: */
start:  clr     r1
        out     _SFR_IO_ADDR(SREG), r1
        ldi     r28, lo8(RAMEND)
        ldi     r29, hi8(RAMEND)
        out     _SFR_IO_ADDR(SPH), r29
        out     _SFR_IO_ADDR(SPL), r28
        in      r24, _SFR_IO_ADDR(MCUSR)
        sts     boot_port_flags, r24
        out     _SFR_IO_ADDR(MCUSR), r1
        wdr
        jmp     start_watchdog
        .org    4 * TIMER1_OVF_vect_num
        jmp     TIMER1_OVF_vect
        .org    4 * TIMER0_COMPA_vect_num
        jmp     TIMER0_COMPA_vect
        .org    4 * TIMER0_COMPB_vect_num
        jmp     TIMER0_COMPB_vect
        .org    4 * TIMER0_OVF_vect_num
        jmp     TIMER0_OVF_vect
        .org    4 * USART_RX_vect_num
        jmp     USART_RX_vect
        .org    4 * USART_UDRE_vect_num
        jmp     USART_UDRE_vect
        .org    4 * USART_TX_vect_num
        jmp     USART_TX_vect

        .global __do_clear_bss, main    /* the linker takes along what is named */
        .section .init3, "ax", @progbits
start_watchdog:
        ldi     r24, (1 << WDCE) | (1 << WDE)
        sts     WDTCSR, r24
        ldi     r24, (1 << WDE) | (1 << WDP1) | (1 << WDP0)
        sts     WDTCSR, r24             /* within four cycles */
