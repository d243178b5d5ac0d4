/* Directions, pull-ups and idle levels of all posts, from the table in board.h. */
#include "board.h"
#include "motion/step_port.h"
#include "pins_port.h"
#include "queue/ops_port.h"
#include <avr/io.h>

/* All inputs have their pull-up on (manual lines 217, 678). */
void pins_init(void)
{
    uint8_t ddr_b = 0, ddr_c = 0, ddr_d = 0;
    uint8_t port_b = 0, port_c = 0, port_d = 0;
#define DDR_IN(port, bit) port_##port |= 1 << (bit)
#define DDR_OUT(port, bit) ddr_##port |= 1 << (bit)
#define ddr_B ddr_b
#define ddr_C ddr_c
#define ddr_D ddr_d
#define port_B port_b
#define port_C port_c
#define port_D port_d
#define POST(name, port, bit, nano, direction, remark) DDR_##direction(port, bit);
    BOARD_POSTS(POST)
#undef POST
    port_c |= 1 << 2; /* OPSB, the inverse of OPSA */
    port_d |= 1 << 1 | 1 << 6; /* idle serial lines are high */
    PORTB = port_b;
    PORTC = port_c;
    PORTD = port_d;
    /* S/W Tx belongs to OC0A from the beginning; its latch is high before the pin drives (section 15.5.3). */
    TCCR0A = 1 << COM0A1 | 1 << COM0A0;
    TCCR0B = 1 << FOC0A;
    DDRB = ddr_b;
    DDRC = ddr_c;
    DDRD = ddr_d;

    EICRA = 1 << ISC11 | 1 << ISC01; /* INT0, Estop, and INT1, sync: falling edges (section 13.2.1) */
    EIFR = 1 << INTF0;
    EIMSK = 1 << INT0;

    /* 1 MHz on OC2A from Timer2 alone: CTC, toggle every 8 cycles (datasheet section 18.7.2). */
    OCR2A = 7;
    TCCR2A = 1 << COM2A0 | 1 << WGM21;
    TCCR2B = 1 << CS20;
}

/* A one written to PINx toggles its bit of PORTx (datasheet 14.2.2): no other pin is touched, whatever interrupts do. */
void step_port_microsteps(uint8_t pins)
{
    const uint8_t ms3 = (uint8_t)(pins << 2);
    const uint8_t ms1_ms2 = (uint8_t)(ms3 << 1);
    PINC = (PORTC ^ ms1_ms2) & (1 << 3 | 1 << 4);
    PINB = (PORTB ^ ms3) & 1 << 4;
}

void ops_port_set(bool executing)
{
    /* Single-bit instructions: no other bit of the port is touched. */
    if (executing) {
        PORTC &= (uint8_t)~(1 << 2);
        PORTC |= 1 << 5;
    } else {
        PORTC &= (uint8_t)~(1 << 5);
        PORTC |= 1 << 2;
    }
}
