#include "integ/run.h"

PT_KERNEL_DEFINE(contact, PT_FX_SET_CONTACT)
