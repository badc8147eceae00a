/* Whether something that should be gone keeps its memory: bytes of the heap in use, to be compared before and after. Always 0 under
 * sanitizers, which look themselves. */
#ifndef TESTS_SUPPORT_GGN_HEAP_H
#define TESTS_SUPPORT_GGN_HEAP_H

#include <malloc.h>
#include <stddef.h>

static inline size_t ggn_heap_used(void)
{
    const struct mallinfo2 m = mallinfo2();
    return m.uordblks + m.hblkhd;
}

#endif
