/* What encoder.c and encoder_isr.S share. */
#ifndef HAL_ENCODER_H
#define HAL_ENCODER_H

#define ENCODER_PINS 3 /* PC0 and PC1 */

#ifndef __ASSEMBLER__
#include <stdint.h>

/* Edges, modulo 256; the low two bits are where in the line the encoder stands. Written by the interrupt. */
extern volatile uint8_t encoder_edges;
#endif

#endif
