#include "base/clock.h"

#include <sys/resource.h>
#include <time.h>

static double read_s(clockid_t id)
{
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double base_clock_wall_s(void) { return read_s(CLOCK_MONOTONIC); }

static double seconds(struct timeval t) { return (double)t.tv_sec + 1e-6 * (double)t.tv_usec; }

double base_clock_process_s(void)
{
    struct rusage children;
    double ended_s =
        getrusage(RUSAGE_CHILDREN, &children) == 0 ? seconds(children.ru_utime) + seconds(children.ru_stime) : 0.0;
    return read_s(CLOCK_PROCESS_CPUTIME_ID) + ended_s;
}

double base_clock_thread_s(void) { return read_s(CLOCK_THREAD_CPUTIME_ID); }
