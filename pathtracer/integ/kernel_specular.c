#include "integ/run.h"

PT_KERNEL_DEFINE(specular, PT_FX_SET_SPECULAR)
