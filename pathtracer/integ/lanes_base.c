#define PT_LANES_NAME base
#include "integ/lanes_body.h"
