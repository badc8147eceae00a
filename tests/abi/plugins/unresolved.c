/* Needs a function that nobody has. */
#include "stub.h"

static const struct lull_criterion stub = STUB("unresolved");

extern int function_that_nobody_has(void);

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index == 0 || function_that_nobody_has() ? &stub : NULL;
}
