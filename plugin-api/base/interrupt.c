#include "base/interrupt.h"

#include <fcntl.h>
#include <poll.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

#include "base/guard.h"

volatile sig_atomic_t base_interrupted;

static const int requests[] = {SIGINT, SIGTERM, SIGHUP, SIGXCPU};
enum { REQUESTS = sizeof requests / sizeof requests[0], BAD_OUTPUT = 2, BY_SIGNAL = 128 };

static void on_request(int number)
{
    if (number != SIGXCPU || !base_interrupted)
        base_interrupted = base_interrupted + 1;
}

void base_interrupt_begin(void)
{
    signal(SIGXFSZ, SIG_IGN);
    base_guard_enable();
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) < 0)
            (void)!open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY); /* whoever uses it fails as before */
}

int base_interrupt_end(const char *program, int status)
{
    struct pollfd reader = {.fd = STDOUT_FILENO, .events = POLLOUT};
    if (!fflush(stdout) && !ferror(stdout))
        return status;
    if (poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR)) /* the error number may be that of another write */
        return status ? status : BY_SIGNAL + SIGPIPE;
    if (program)
        fprintf(stderr, "%s: cannot write standard output\n", program);
    return status ? status : BAD_OUTPUT;
}

void base_interrupt_catch(void)
{
    struct sigaction before, action = {.sa_handler = on_request};
    sigemptyset(&action.sa_mask);
    for (int i = 0; i < REQUESTS; i++) {
        action.sa_flags = requests[i] == SIGXCPU ? SA_RESTART : (int)SA_RESETHAND; /* SIGXCPU comes again each second */
        if (requests[i] != SIGHUP || sigaction(SIGHUP, NULL, &before) != 0 || before.sa_handler != SIG_IGN)
            sigaction(requests[i], &action, NULL);
    }
    signal(SIGPIPE, SIG_IGN);
}

void base_interrupt_ignore(void)
{
    for (int i = 0; i < REQUESTS; i++)
        signal(requests[i], SIG_IGN);
}
