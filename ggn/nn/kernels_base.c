/* The kernels for any processor: vectors of 16 bytes through the compiler's vector extension. And the choice of a table. */
#include "nn/real.h"

#include "nn/kernels_body.h"

const struct ggn_kernels *ggn_kernels_for(enum base_isa isa)
{
    static const struct ggn_kernels *const table[BASE_ISA_COUNT] = {
        [BASE_ISA_BASE] = &ggn_kernels_base,
#if defined(__x86_64__)
        [BASE_ISA_AVX2] = &ggn_kernels_avx2,
        [BASE_ISA_AVX512] = &ggn_kernels_avx512,
#endif
    };
    return base_isa_available(isa) ? table[isa] : NULL;
}

const struct ggn_kernels *ggn_kernels_best(void) { return ggn_kernels_for(base_isa_best()); }
