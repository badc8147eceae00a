/*
 * Loaded before a program by cli/out_of_memory.sh: each of the first ROUNDS allocations of every call in the program, or in the library
 * that reads and writes JSON for it, fails once. Not by starting the program again: it forks there, the child is refused the memory
 * and goes on to its end, the parent waits and has it. Of child K the folder $OOM_FOLDER holds K.out and K.err; `log` has K and its
 * wait status.
 *
 * With OOM_FROM=N nothing is forked: from the Nth allocation after the program's first one on, whoever asks, all fail; OOM_COUNT=FILE
 * gets their number.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { ROUNDS = 3, SITES = 4096, PATIENCE_S = 60 };
static struct {
    void *caller;
    int times;
} site[SITES];
static int in_child, number, busy;

static void *next_of(const char *name)
{
    void *f = dlsym(RTLD_NEXT, name);
    if (!f)
        abort();
    return f;
}

static int concerns(void *caller)
{
    Dl_info info;
    return dladdr(caller, &info) && info.dli_fname && (strstr(info.dli_fname, "bin/") || strstr(info.dli_fname, "libcjson"));
}

static void to_file(int fd, const char *folder, const char *kind)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%d.%s", folder, number, kind);
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (file < 0 || dup2(file, fd) < 0)
        _exit(99);
    close(file);
}

static long count, from;

static int is_over(void *caller)
{
    if (!from && concerns(caller))
        from = atol(getenv("OOM_FROM"));
    return from && __sync_add_and_fetch(&count, 1) >= from;
}

__attribute__((destructor)) static void tell(void)
{
    const char *path = getenv("OOM_COUNT");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (file) {
        fprintf(file, "%ld\n", count);
        fclose(file);
    }
}

/* In a child that is to go on without the memory: 1. */
static int refused(void *caller)
{
    const char *folder = getenv("OOM_FOLDER");
    size_t s = ((size_t)caller >> 1) % SITES;
    if (!busy && getenv("OOM_FROM")) {
        busy = !from;
        const int over = is_over(caller);
        busy = 0;
        return over;
    }
    if (busy || in_child || !folder || !concerns(caller))
        return 0;
    while (site[s].caller && site[s].caller != caller)
        s = (s + 1) % SITES;
    site[s].caller = caller;
    if (site[s].times++ >= ROUNDS)
        return 0;
    busy = 1;
    number++;
    pid_t child = fork();
    if (child == 0) {
        in_child = 1;
        alarm(PATIENCE_S);
        to_file(1, folder, "out");
        to_file(2, folder, "err");
        busy = 0;
        errno = ENOMEM;
        return 1;
    }
    int status = -1;
    char line[64], path[512];
    waitpid(child, &status, 0);
    snprintf(path, sizeof path, "%s/log", folder);
    int log = open(path, O_WRONLY | O_CREAT | O_APPEND, 0666);
    int n = snprintf(line, sizeof line, "%d %d\n", number, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
    if (log < 0 || write(log, line, (size_t)n) != n)
        abort();
    close(log);
    busy = 0;
    return 0;
}

void *malloc(size_t size)
{
    static void *(*next)(size_t);
    if (!next)
        next = (void *(*)(size_t))next_of("malloc");
    return refused(__builtin_return_address(0)) ? NULL : next(size);
}

void *calloc(size_t count, size_t size)
{
    static void *(*next)(size_t, size_t);
    if (!next)
        next = (void *(*)(size_t, size_t))next_of("calloc");
    return refused(__builtin_return_address(0)) ? NULL : next(count, size);
}

void *realloc(void *old, size_t size)
{
    static void *(*next)(void *, size_t);
    if (!next)
        next = (void *(*)(void *, size_t))next_of("realloc");
    return refused(__builtin_return_address(0)) ? NULL : next(old, size);
}
