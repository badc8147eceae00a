#include "nn/bf16.h"

#include "base/half.h"

int ggn_bf16_available(void)
{
#if defined(__x86_64__)
    return ggn_isa_best() == GGN_ISA_AVX512 && __builtin_cpu_supports("avx512bf16");
#else
    return 0;
#endif
}

void ggn_bf16_pack(uint32_t *out, const float *packed, int n_in, int n_out, int tile_oc)
{
    for (int oc = 0, tile; oc < n_out; oc += tile) {
        tile = n_out - oc < tile_oc ? n_out - oc : tile_oc;
        for (int i = 0; i < n_in; i += 2) {
            const int pair = i + 1 < n_in;
            for (int k = 0; k < 9 * tile; k++)
                *out++ = base_f32_to_bf16(packed[k]) | (pair ? (uint32_t)base_f32_to_bf16(packed[9 * tile + k]) << 16 : 0);
            packed += (pair ? 18 : 9) * tile;
        }
    }
}

size_t ggn_bf16_scratch(int n_in, int row, long pixels)
{
    return (size_t)((n_in + 1) / 2) * ((size_t)pixels + 2 * (size_t)row + 2 * 64);
}
