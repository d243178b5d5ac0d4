/* step_port_hurry() of motion/step_port.h: the software port is deaf from here on, and what it was receiving is dropped.
 * The main loop runs, so none of the port's interrupts does: nobody hears again before ports_listen(). 11 cycles with
 * interrupts masked. Changes r26 alone, which block.S relies on. */
#include <avr/io.h>

        .section .text.step_port_hurry, "ax", @progbits
        .global step_port_hurry
        .type step_port_hurry, @function
step_port_hurry:
        ldi     r26, 0
        cli
        sts     PCMSK2, r26
        lds     r26, TIMSK0
        andi    r26, ~(1 << OCIE0B)
        sts     TIMSK0, r26
        sbi     _SFR_IO_ADDR(PCIFR), PCIF2      /* an edge just before it was masked */
        sei
        ret
        .size step_port_hurry, . - step_port_hurry
