/* Dies when it is loaded. */
#include "stub.h"

#include <stdlib.h>

static const struct lull_criterion stub = STUB("crash-on-load");

__attribute__((constructor)) static void loaded(void) { abort(); }

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &stub : NULL; }
