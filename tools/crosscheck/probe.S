/* Plays probe_periods.def on OC1B the way the firmware's step engine does: Timer1, fast PWM with OCR1A as TOP, OC1B
 * inverting, periods changed by the overflow interrupt through the double buffers, silent periods by an OCR1B that is
 * never reached, start and stop with the clock off in mode 0.
 *
 * Units:   timer clocks = CPU cycles.
 * Purpose: what the datasheet says about it is known beforehand, so it tells what a simulator makes of it. */
#define __SFR_OFFSET 0
#include <avr/io.h>

#define PULSE_TICKS 16
#define WAVE_STOPPED ((1 << COM1B1) | (1 << COM1B0))
#define WAVE_RUN_A (WAVE_STOPPED | (1 << WGM11) | (1 << WGM10))
#define WAVE_RUN_B ((1 << WGM13) | (1 << WGM12) | (1 << CS10))
#define ROW_BYTES 5

#define periods r2 /* left in this row, the last one excepted */
#define status r3
#define running r4
#define work r24
#define count r25

    .macro row top, match, periods_
    .byte (\top) >> 8, (\top) & 0xff, (\match) >> 8, (\match) & 0xff, \periods_
    .endm
#define TRAIN(preset) .byte (preset) >> 8, (preset) & 0xff
#define PULSES(ticks, n) row (ticks) - 1, (ticks) - 1 - PULSE_TICKS, n
#define SILENT(ticks, n) row (ticks) - 1, 0xffff, n
#define STOP() row 0, 0, 0

    .data
trains:
#include "probe_periods.def"
trains_end:

    .text
    .global __do_copy_data
    .global main
main:
    ldi work, (1 << DDB2)
    out DDRB, work
    ldi work, WAVE_STOPPED
    sts TCCR1A, work
    ldi work, (1 << TOIE1)
    sts TIMSK1, work
    ldi XL, lo8(trains)
    ldi XH, hi8(trains)
next_train:
    ld r20, X+ /* TCNT1: written when OCR1A and OCR1B are there */
    ld r21, X+
    rcall write_row
    sts TCNT1H, r20
    sts TCNT1L, r21
    dec periods /* the first period of a train begins without an overflow */
    ldi work, (1 << TOV1)
    out TIFR1, work
    mov running, work
    sei
    ldi work, WAVE_RUN_A
    sts TCCR1A, work
    ldi work, WAVE_RUN_B
    sts TCCR1B, work
wait:
    cpse running, r1
    rjmp wait
    cli
    clr work /* some 1,800 cycles of standstill */
pause:
    nop
    nop
    nop
    nop
    dec work
    brne pause
    cpi XL, lo8(trains_end)
    brne next_train
halt:
    rjmp halt

write_row:
    ld work, X+
    sts OCR1AH, work
    ld work, X+
    sts OCR1AL, work
    ld work, X+
    sts OCR1BH, work
    ld work, X+
    sts OCR1BL, work
    ld periods, X+
    ret

    /* At BOTTOM of every period: 15 cycles, or the next row into the buffers. */
    .global TIMER1_OVF_vect
TIMER1_OVF_vect:
    in status, SREG
    dec periods
    breq load
    out SREG, status
    reti
load:
    ld count, X+
    sts OCR1AH, count
    ld count, X+
    sts OCR1AL, count
    ld count, X+
    sts OCR1BH, count
    ld count, X+
    sts OCR1BL, count
    ld periods, X+
    tst periods
    breq stop
    out SREG, status
    reti
stop:
    sts TCCR1B, r1
    ldi count, WAVE_STOPPED
    sts TCCR1A, count
    clr running
    out SREG, status
    reti
