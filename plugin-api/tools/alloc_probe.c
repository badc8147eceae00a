/* SPDX-License-Identifier: MIT
 *
 * Counts this process's allocations and what of them is not freed, and lets them fail. The library under test finds these
 * functions before the C library's. Not in sanitizer builds, which bring their own. mallinfo2 would also count what a thread
 * keeps for its next allocation.
 */
#include "check.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
#define COUNTED 0
#else
#define COUNTED 1
#endif
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef COUNTED
#define COUNTED 0
#endif
#endif

#if COUNTED
#include <errno.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stdlib.h>

static atomic_long allocations;
static atomic_long live, live_bytes; /* not freed; bytes as the C library has rounded them up */
static atomic_long left = -1;        /* until they fail; -1 = never */

/* glibc's own, under the names that it keeps for interposers */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);

static int refused(void)
{
    atomic_fetch_add_explicit(&allocations, 1, memory_order_relaxed);
    long l = atomic_load_explicit(&left, memory_order_relaxed);
    if (l < 0)
        return 0;
    if (l > 0) {
        atomic_store_explicit(&left, l - 1, memory_order_relaxed);
        return 0;
    }
    errno = ENOMEM;
    return 1;
}

static void *counted(void *memory)
{
    if (memory) {
        atomic_fetch_add_explicit(&live, 1, memory_order_relaxed);
        atomic_fetch_add_explicit(&live_bytes, (long)malloc_usable_size(memory), memory_order_relaxed);
    }
    return memory;
}

static void forget(size_t size)
{
    atomic_fetch_sub_explicit(&live, 1, memory_order_relaxed);
    atomic_fetch_sub_explicit(&live_bytes, (long)size, memory_order_relaxed);
}

#define INTERPOSE __attribute__((visibility("default"), used))

INTERPOSE void *malloc(size_t size) { return refused() ? NULL : counted(__libc_malloc(size)); }

INTERPOSE void *calloc(size_t count, size_t size) { return refused() ? NULL : counted(__libc_calloc(count, size)); }

INTERPOSE void *realloc(void *memory, size_t size)
{
    if (refused())
        return NULL;
    const int had = memory != NULL;
    const size_t before = malloc_usable_size(memory);
    void *made = __libc_realloc(memory, size);
    if (had && (made || size == 0)) /* else the old one stays */
        forget(before);
    return counted(made);
}

INTERPOSE void free(void *memory)
{
    if (memory)
        forget(malloc_usable_size(memory));
    __libc_free(memory);
}

INTERPOSE void *aligned_alloc(size_t alignment, size_t size)
{
    return refused() ? NULL : counted(__libc_memalign(alignment, size));
}

INTERPOSE void *memalign(size_t alignment, size_t size);
INTERPOSE void *memalign(size_t alignment, size_t size)
{
    return refused() ? NULL : counted(__libc_memalign(alignment, size));
}

INTERPOSE int posix_memalign(void **memory, size_t alignment, size_t size)
{
    void *made = refused() ? NULL : counted(__libc_memalign(alignment, size));
    if (!made)
        return ENOMEM;
    *memory = made;
    return 0;
}

long lc_alloc_count(void) { return atomic_load(&allocations); }

void lc_alloc_live(long *count, long *bytes)
{
    *count = atomic_load(&live);
    *bytes = atomic_load(&live_bytes);
}

void lc_alloc_fail_after(long k) { atomic_store(&left, k); }
#else
/* AddressSanitizer ends the process when it is asked for more memory than there is; malloc returns NULL. */
__attribute__((visibility("default"), used)) const char *__asan_default_options(void);
const char *__asan_default_options(void) { return "allocator_may_return_null=1"; }

long lc_alloc_count(void) { return -1; }

void lc_alloc_live(long *count, long *bytes) { *count = *bytes = 0; }

void lc_alloc_fail_after(long k) { (void)k; }
#endif
