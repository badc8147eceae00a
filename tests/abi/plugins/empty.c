/* A library without a criterion. */
#include "stub.h"

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    (void)index;
    return NULL;
}
