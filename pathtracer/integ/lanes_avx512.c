#if defined(__x86_64__)
#define PT_LANES_NAME avx512
#include "integ/lanes_body.h"
#else
typedef int pt_lanes_none; /* a translation unit holds something */
#endif
