#include "nn/kernels.h"

#include <stddef.h>

#include "nn/real.h"

const struct ggn_kernels *ggn_kernels_for(enum ggn_isa isa)
{
    static const struct ggn_kernels *const table[GGN_ISA_COUNT] = {
        [GGN_ISA_BASE] = &ggn_kernels_base,
#if defined(__x86_64__)
        [GGN_ISA_AVX2] = &ggn_kernels_avx2,
        [GGN_ISA_AVX512] = &ggn_kernels_avx512,
#endif
    };
    return ggn_isa_available(isa) ? table[isa] : NULL;
}

const struct ggn_kernels *ggn_kernels_best(void) { return ggn_kernels_for(ggn_isa_best()); }
