/* How the main loop sleeps without missing what an interrupt left for it to do.
 *
 * An interrupt that makes work for the main loop writes any value but 0 to wake_flag. The main loop clears it, polls
 * everything, and calls wake_sleep() when no poll found work: if the flag has been raised since, it returns at once.
 * The step interrupt need not as long as it goes on: wake_sleep() returns after each. Where it ends, because the ring has
 * run empty, it raises the flag: nothing comes after it.
 * Shared:  wake_flag is written by interrupts (non-zero) and by the main loop (zero): a single byte.
 * Context: wake_sleep() in the main loop, with interrupts enabled. Errors: none.
 * Tests:   test/image (a command typed while the processor sleeps starts at once). */
#ifndef BASE_WAKE_H
#define BASE_WAKE_H

#include <stdint.h>

extern volatile uint8_t wake_flag;

/* Until the next interrupt, unless wake_flag is raised; the time base's own count every 1.024 ms only. */
void wake_sleep(void);

#endif
