/* Changes the floating-point control register when it is loaded, as code linked with -ffast-math does. */
#include "stub.h"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

static const struct lull_criterion stub = STUB("fp-on-load");

__attribute__((constructor)) static void loaded(void)
{
#if defined(__SSE__)
    _mm_setcsr(_mm_getcsr() | 0x8040);
#endif
}

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &stub : NULL; }
