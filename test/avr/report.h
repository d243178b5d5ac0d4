/* Unity on the AVR: its report leaves through USART0 at 1,000,000 bits/s, where test/avr/run.c reads it. Included ahead
 * of every source of such a test by the Makefile. */
#ifndef REPORT_H
#define REPORT_H

void report_char(char character);

#define UNITY_OUTPUT_CHAR(character) report_char((char)(character))

#endif
