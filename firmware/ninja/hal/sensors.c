/* The centre sensors, and the pins that nobody else has. */
#include <avr/io.h>
#include "ninja/hal/pins.h"
#include "ninja/sensor_port.h"

/* Coils are off while their pins become outputs: the output latches are low after a reset. */
void sensor_port_init(void)
{
    PORTB = 0xFF;
    PORTC = (uint8_t)~PINS_COILS_Y;
    PORTD = (uint8_t)~PINS_COILS_X;
    DDRC = PINS_COILS_Y;
    DDRD = PINS_COILS_X;
}

bool sensor_port_beyond(uint8_t axis)
{
    return (PINB >> PINS_SENSOR_X >> axis & 1) == 0;
}
