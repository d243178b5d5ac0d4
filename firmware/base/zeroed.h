/* AT_BOOT_ZERO(variable): what an _init() says of a variable that begins as 0.
 *
 * On the target the start-up code has cleared all of RAM by then and nothing is left to do. The tests on the host begin
 * many times: there the variable is cleared.
 * Context: boot. Errors: none. */
#ifndef BASE_ZEROED_H
#define BASE_ZEROED_H

#ifdef __AVR__
#define AT_BOOT_ZERO(variable) ((void)0)
#else
#include <string.h>
#define AT_BOOT_ZERO(variable) ((void)memset(&(variable), 0, sizeof(variable)))
#endif

#endif
