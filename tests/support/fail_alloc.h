/*
 * Makes the k-th allocation of the process fail, once. For inclusion by one file of a test program: it defines malloc, calloc
 * and realloc in front of the C library's (or the sanitizer's). Single-threaded use: arm, call, disarm.
 */
#ifndef TESTS_SUPPORT_FAIL_ALLOC_H
#define TESTS_SUPPORT_FAIL_ALLOC_H

#include <stddef.h>
#include <string.h>

static long fail_countdown; /* 0: disarmed */
static int fail_happened;

static void fail_arm(long k)
{
    fail_countdown = k;
    fail_happened = 0;
}

/* Returns whether an allocation did fail. */
static int fail_disarm(void)
{
    fail_countdown = 0;
    return fail_happened;
}

static int fail_now(void)
{
    if (fail_countdown == 0 || --fail_countdown > 0)
        return 0;
    fail_happened = 1;
    return 1;
}

extern void *dlsym(void *handle, const char *name);

/* ISO C has no conversion from dlsym's pointer to a function; POSIX promises that the bytes are the same. */
static void fail_find(const char *name, void *function)
{
    void *found = dlsym((void *)-1L, name); /* RTLD_NEXT */
    memcpy(function, &found, sizeof found);
}

/* Visible to the shared libraries as well, which -fvisibility=hidden would keep them from being; not under the address sanitizer, to
 * which what a library forgets after a failure would be a leak of ours. */
#ifndef __SANITIZE_ADDRESS__
#pragma GCC visibility push(default)
#endif
void *malloc(size_t size);
void *calloc(size_t count, size_t size);
void *realloc(void *old, size_t size);
#ifndef __SANITIZE_ADDRESS__
#pragma GCC visibility pop
#endif

void *malloc(size_t size)
{
    static void *(*next)(size_t);
    if (!next)
        fail_find("malloc", &next);
    return fail_now() ? NULL : next(size);
}

void *calloc(size_t count, size_t size)
{
    static void *(*next)(size_t, size_t);
    static int finding;
    static _Alignas(16) char early[4096]; /* dlsym itself may ask for memory */
    static size_t early_used;
    if (!next) {
        size_t bytes = (count * size + 15) & ~(size_t)15;
        if (finding)
            return early_used + bytes <= sizeof early ? early + (early_used += bytes) - bytes : NULL;
        finding = 1;
        fail_find("calloc", &next);
    }
    return fail_now() ? NULL : next(count, size);
}

void *realloc(void *old, size_t size)
{
    static void *(*next)(void *, size_t);
    if (!next)
        fail_find("realloc", &next);
    return fail_now() ? NULL : next(old, size);
}

#endif
