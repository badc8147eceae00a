#include "integ/run.h"

PT_KERNEL_DEFINE(diffuse, PT_FX_SET_DIFFUSE)
