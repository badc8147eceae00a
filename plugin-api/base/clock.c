#include "base/clock.h"

#include <dirent.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

static double read_s(clockid_t id)
{
    struct timespec t = {0}; /* a child may have ended just now */
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double base_clock_wall_s(void) { return read_s(CLOCK_MONOTONIC); }

static double seconds(struct timeval t) { return (double)t.tv_sec + 1e-6 * (double)t.tv_usec; }

/* Of the children of thread `tid` that have not been waited for. */
static double living_s(const char *tid)
{
    char path[64];
    clockid_t id;
    double sum_s = 0.0;
    int pid;
    snprintf(path, sizeof path, "/proc/self/task/%.20s/children", tid);
    FILE *file = fopen(path, "re");
    while (file && fscanf(file, "%d", &pid) == 1)
        if (clock_getcpuclockid(pid, &id) == 0)
            sum_s += read_s(id);
    if (file)
        fclose(file);
    return sum_s;
}

static double children_s(void)
{
    struct rusage ended;
    double sum_s = getrusage(RUSAGE_CHILDREN, &ended) == 0 ? seconds(ended.ru_utime) + seconds(ended.ru_stime) : 0.0;
    DIR *threads = opendir("/proc/self/task");
    for (const struct dirent *e; threads && (e = readdir(threads));)
        sum_s += e->d_name[0] == '.' ? 0.0 : living_s(e->d_name);
    if (threads)
        closedir(threads);
    return sum_s;
}

double base_clock_process_s(void) { return read_s(CLOCK_PROCESS_CPUTIME_ID) + children_s(); }

double base_clock_thread_s(void) { return read_s(CLOCK_THREAD_CPUTIME_ID); }
