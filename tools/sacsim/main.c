/* sacsim: SAC's firmware on a simulated Arduino Nano. docs/simulator.md is its manual. */
#include "console.h"
#include "network.h"
#include "options.h"
#include "session.h"
#include "signals.h"

int main(int argc, char **argv)
{
    options_t options;
    int code;

    options_parse(&options, argc, argv);
    code = options.nodes > 0 ? network_run(&options) : session_run(&options);
    console_restore();
    if (code < 0) {
        signals_end_by(-code);
    }
    return code;
}
