/* Two criteria with one id. */
#include "stub.h"

static const struct lull_criterion stubs[2] = {STUB("twin"), STUB("twin")};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index < 2 ? &stubs[index] : NULL; }
