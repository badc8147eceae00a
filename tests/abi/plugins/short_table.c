/* Its table ends before version 1.0 does. */
#include "stub.h"

static const struct lull_criterion stub = {.struct_size = 32, .id = "short-table"};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &stub : NULL; }
