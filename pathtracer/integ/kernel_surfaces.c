#include "integ/run.h"

PT_KERNEL_DEFINE(surfaces, PT_FX_SET_SURFACES)
