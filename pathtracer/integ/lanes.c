#include "integ/lanes.h"

#include <stdatomic.h>
#include <stddef.h>

extern const struct pt_lanes pt_lanes_base, pt_lanes_avx2, pt_lanes_avx512;

const struct pt_lanes *pt_lanes_for(enum base_isa isa)
{
    if (!base_isa_available(isa))
        return NULL;
#if defined(__x86_64__)
    if (isa == BASE_ISA_AVX512)
        return &pt_lanes_avx512;
    if (isa == BASE_ISA_AVX2)
        return &pt_lanes_avx2;
#endif
    return &pt_lanes_base;
}

const struct pt_lanes *pt_lanes_best(void)
{
    static _Atomic(const struct pt_lanes *) chosen;
    const struct pt_lanes *lanes = atomic_load_explicit(&chosen, memory_order_relaxed);
    if (!lanes) {
        lanes = pt_lanes_for(base_isa_best()); /* whoever comes first: all choose the same */
        atomic_store_explicit(&chosen, lanes, memory_order_relaxed);
    }
    return lanes;
}
