#include "integ/run.h"

PT_KERNEL_DEFINE(no_media, PT_FX_SET_NO_MEDIA)
