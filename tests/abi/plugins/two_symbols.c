/* Exports a helper beside the entry. */
#include "stub.h"

static const struct lull_criterion stub = STUB("two-symbols");

LULL_EXPORT int helper_that_should_be_static(void);
int helper_that_should_be_static(void) { return 1; }

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &stub : NULL; }
