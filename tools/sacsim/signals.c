#include "signals.h"

#include <signal.h>
#include <stddef.h>

void signals_handle(int number, void (*handler)(int))
{
    struct sigaction action = {.sa_handler = handler}; /* without SA_RESTART: sleeps and writes are to end */
    struct sigaction before;

    sigaction(number, NULL, &before);
    if (before.sa_handler != SIG_IGN) {
        sigaction(number, &action, NULL);
    }
}

void signals_handle_ends(void (*handler)(int))
{
    static const int ends[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};

    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
        signals_handle(ends[i], handler);
    }
}

void signals_end_by(int number)
{
    signal(number, SIG_DFL);
    raise(number);
}
