/* Unity on the AVR: its report leaves through USART0 at 1,000,000 bits/s, where test/avr/run.c reads it. Included ahead
 * of every source of such a test by the Makefile. */
#ifndef REPORT_H
#define REPORT_H

#ifndef __ASSEMBLER__
void report_char(char character);

#define UNITY_OUTPUT_CHAR(character) report_char((char)(character))

/* Runs a test whose name lies in flash: there is not enough RAM for all names at once. */
void report_run(void (*test)(void), const char *name_in_flash, unsigned line);

#define RUN_TEST(test)                                                   \
    do {                                                                 \
        static const char name_[] __attribute__((__progmem__)) = #test; \
        report_run(test, name_, __LINE__);                               \
    } while (0)
#endif

#endif
