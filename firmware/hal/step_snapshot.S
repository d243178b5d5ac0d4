/* step_port_snapshot() of motion/step_port.h: a struct of five bytes is returned in r18 to r22, which the compiler makes
 * by way of a frame. step_timer.c asserts where its members are. 9 cycles with interrupts masked. */
#include <avr/io.h>

#define io(reg) _SFR_IO_ADDR(reg)

        .section .text.step_port_snapshot, "ax", @progbits
        .global step_port_snapshot
        .type step_port_snapshot, @function
step_port_snapshot:
        in      r25, io(SREG)
        cli
        in      r19, io(GPIOR0)
        lds     r20, step_count_high
        in      r22, io(TIFR1)
        in      r21, io(PINB)
        lds     r18, step_tail
        out     io(SREG), r25
        cpi     r19, 1                  /* the low byte is counted down 1 to 256 times */
        adc     r20, r1
        andi    r22, 1 << TOV1
        bst     r21, 2
        clr     r21
        bld     r21, 0
        ret
        .size step_port_snapshot, . - step_port_snapshot
