#include "integ/run.h"

PT_KERNEL_DEFINE(all, PT_FX_ALL)
