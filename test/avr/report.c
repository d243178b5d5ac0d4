#include <avr/io.h>
#include "report.h"

void report_char(char character)
{
    if (!(UCSR0B & _BV(TXEN0))) {
        UBRR0 = 0; /* with U2X0 clear: F_CPU / 16 */
        UCSR0B = _BV(TXEN0);
    }
    while (!(UCSR0A & _BV(UDRE0))) {
    }
    UDR0 = (uint8_t)character;
}
