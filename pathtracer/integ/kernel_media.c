#include "integ/run.h"

PT_KERNEL_DEFINE(media, PT_FX_SET_MEDIA)
