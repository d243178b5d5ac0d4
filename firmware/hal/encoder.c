/* The encoder's edges, counted by encoder_isr.S, to lines.
 * Source: ATmega328P datasheet DS40002061, 13.2.4, 13.2.6 (PCICR, PCMSK1). */
#include "hal/encoder.h"
#include <avr/io.h>
#include "queue/encoder_port.h"

volatile uint8_t encoder_edges;
static uint8_t taken;

void encoder_init(void)
{
    const uint8_t pins = PINC & ENCODER_PINS;
    taken = pins ^ pins >> 1;
    encoder_edges = taken;
    PCMSK1 = ENCODER_PINS;
    PCICR = _BV(PCIE1) | _BV(PCIE2); /* the software port's stays set */
}

int8_t encoder_take(void)
{
    const int8_t lines = (int8_t)(encoder_edges - taken) / 4;
    taken = (uint8_t)(taken + 4 * lines);
    return lines;
}
