#include "integ/kernel_sets.h"
#include "integ/path.h"

PT_KERNEL_DEFINE(all, PT_FX_ALL)
