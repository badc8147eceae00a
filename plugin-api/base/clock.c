#include "base/clock.h"

#include <time.h>

static double read_s(clockid_t id)
{
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double base_clock_wall_s(void) { return read_s(CLOCK_MONOTONIC); }

double base_clock_process_s(void) { return read_s(CLOCK_PROCESS_CPUTIME_ID); }

double base_clock_thread_s(void) { return read_s(CLOCK_THREAD_CPUTIME_ID); }
