/* Sets the watchdog as the test asks, with or without the timed sequence, and waits in IDLE; counts its interrupts. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdint.h>

#define NOINIT __attribute__((section(".noinit")))

volatile uint8_t p_wdtcsr NOINIT; /* written by the timed sequence, unless p_plain */
volatile uint8_t p_plain NOINIT;  /* 1: written at once */
volatile uint8_t p_feed NOINIT;   /* 1: WDR in a loop */
volatile uint8_t p_rearm NOINIT;  /* 1: the interrupt sets WDIE again */
volatile uint8_t r_boots NOINIT;
volatile uint8_t r_mcusr NOINIT;
volatile uint8_t r_wdtcsr;
volatile uint8_t r_interrupts;
volatile uint8_t r_ready;

__attribute__((naked, used, section(".init3"))) void look_first(void)
{
    r_mcusr = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

ISR(WDT_vect)
{
    r_interrupts++;
    r_wdtcsr = WDTCSR;
    if (p_rearm == 1) {
        WDTCSR |= 1 << WDIE;
    }
}

int main(void)
{
    r_boots++;
    if (r_mcusr & (1 << WDRF)) {
        r_ready = 2; /* the watchdog has bitten: stay here */
        for (;;) {
            sleep_mode();
        }
    }
    uint8_t wanted = p_wdtcsr;
    if (p_plain == 1) {
        WDTCSR = wanted;
    } else {
        __asm__ __volatile__("wdr\n\tsts %0, %1\n\tsts %0, %2"
                             :
                             : "n"(_SFR_MEM_ADDR(WDTCSR)), "r"((uint8_t)((1 << WDCE) | (1 << WDE))), "r"(wanted));
    }
    r_wdtcsr = WDTCSR;
    r_ready = 1;
    sei();
    for (;;) {
        if (p_feed == 1) {
            wdt_reset();
        } else {
            sleep_mode();
        }
    }
}
