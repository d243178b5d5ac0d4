#include <avr/io.h>
#include <avr/pgmspace.h>
#include "report.h"
#include "unity.h"

#define LONGEST_NAME 110

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

void report_run(void (*test)(void), const char *name_in_flash, unsigned line)
{
    static char name[LONGEST_NAME + 1];
    strlcpy_P(name, name_in_flash, sizeof name);
    Unity.CurrentTestName = name;
    Unity.CurrentTestLineNumber = line;
    Unity.NumberOfTests++;
    if (TEST_PROTECT()) {
        setUp();
        test();
    }
    if (TEST_PROTECT()) {
        tearDown();
    }
    UnityConcludeTest();
}
