#include "integ/lanes.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

extern const struct pt_lanes pt_lanes_base, pt_lanes_avx2, pt_lanes_avx512;

const struct pt_lanes *pt_lanes_for(int i)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (i == 1)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &pt_lanes_avx2 : NULL;
    if (i == 2)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                       __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                       __builtin_cpu_supports("fma")
                   ? &pt_lanes_avx512
                   : NULL;
#endif
    return i == 0 ? &pt_lanes_base : NULL;
}

static const struct pt_lanes *choose(void)
{
    const char *wish = getenv("PT_ISA");
    const struct pt_lanes *best = &pt_lanes_base;
    for (int i = 0; i < PT_LANES_COUNT; i++) {
        const struct pt_lanes *lanes = pt_lanes_for(i);
        best = lanes ? lanes : best;
        if (wish && strcmp(wish, best->name) == 0)
            break;
    }
    return best;
}

const struct pt_lanes *pt_lanes_best(void)
{
    static _Atomic(const struct pt_lanes *) chosen;
    const struct pt_lanes *lanes = atomic_load_explicit(&chosen, memory_order_relaxed);
    if (!lanes) {
        lanes = choose(); /* whoever comes first: all choose the same */
        atomic_store_explicit(&chosen, lanes, memory_order_relaxed);
    }
    return lanes;
}
