/* Two criteria in one library, neither called like the library. */
#include "stub.h"

static const struct lull_criterion stubs[2] = {STUB("first-of-pair"), STUB("second-of-pair")};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index < 2 ? &stubs[index] : NULL; }
