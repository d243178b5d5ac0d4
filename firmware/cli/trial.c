#include "cli/trial.h"
#include "base/timebase_port.h"
#include "cli/terminal_port.h"
#include "eeprom/store.h"

#define MINUTE_262MS 229
/* So much longer what is being printed may take: with a new rate in the midst of it the receiver would lose the bytes'
 * boundaries, and what it is told next. */
#define PRINTING_262MS 8

static enum { NONE, ASKED, ON } trial;
static uint8_t since; /* it has been ON */

void trial_begin(bool changed)
{
    trial = (uint8_t)changed; /* NONE, ASKED */
}

uint8_t trial_on(void)
{
    return trial & ON;
}

void trial_confirm(void)
{
    trial = NONE;
    store_keep_path();
}

bool trial_failed(void)
{
    if (trial == NONE || store_busy()) {
        return false;
    }
    const uint8_t now = timebase_262ms();
    if (trial == ASKED) {
        since = now;
        if (terminal_port_waiting() == 0) { /* what was sent by the path before has been executed */
            trial = ON;
        }
    }
    const uint8_t elapsed = (uint8_t)(now - since);
    if (elapsed < MINUTE_262MS || (elapsed < MINUTE_262MS + PRINTING_262MS && !terminal_port_idle())) {
        return false;
    }
    trial = NONE;
    store_take_back_path();
    return true;
}
