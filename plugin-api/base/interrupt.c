#include "base/interrupt.h"

#include <stddef.h>

volatile sig_atomic_t base_interrupted;

static const int requests[] = {SIGINT, SIGTERM, SIGHUP};
enum { REQUESTS = sizeof requests / sizeof requests[0] };

static void on_request(int number)
{
    (void)number;
    base_interrupted = 1;
}

void base_interrupt_begin(void) { signal(SIGXFSZ, SIG_IGN); }

void base_interrupt_catch(void)
{
    struct sigaction before, action = {.sa_handler = on_request, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    for (int i = 0; i < REQUESTS; i++)
        if (requests[i] != SIGHUP || sigaction(SIGHUP, NULL, &before) != 0 || before.sa_handler != SIG_IGN)
            sigaction(requests[i], &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

void base_interrupt_ignore(void)
{
    for (int i = 0; i < REQUESTS; i++)
        signal(requests[i], SIG_IGN);
}
