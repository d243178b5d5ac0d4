#include "boot.h"
#include "base/timebase_port.h"
#include "boot_port.h"
#include "cli/terminal_port.h"

enum { POWER_ON = 1 << 0, BROWN_OUT = 1 << 2, WATCHDOG = 1 << 3 };

#define ESCAPE 0x1B
#define ESCAPES 3
/* 1.016 s; the version line is out 5 ms after their beginning. */
#define WINDOW_32MS 31

static status_t cause;
static bool open; /* the window */

status_t boot_cause_of(uint8_t flags)
{
    if (flags & POWER_ON) {
        return STATUS_OK;
    }
    if (flags & WATCHDOG) {
        return STATUS_WATCHDOG;
    }
    return flags & BROWN_OUT ? STATUS_BROWN_OUT : STATUS_OK;
}

void boot_init(void)
{
    cause = boot_cause_of(boot_port_flags);
    open = cause == STATUS_OK;
    if (open && boot_port_rst_low()) {
        boot_restore_factory();
    }
}

status_t boot_cause(void)
{
    return cause;
}

/* Among what has been typed in the window, and will be executed after it. */
static bool escape_typed(void)
{
    uint8_t left = ESCAPES;
    for (uint8_t i = 0; i < terminal_port_waiting(); i++) {
        left = terminal_port_peek(i) == ESCAPE ? (uint8_t)(left - 1) : ESCAPES;
        if (left == 0) {
            return true;
        }
    }
    return false;
}

bool boot_over(void)
{
    if (open && timebase_32ms() >= WINDOW_32MS) {
        open = false;
        if (escape_typed()) {
            boot_restore_factory();
            boot_start();
        }
    }
    return !open;
}
