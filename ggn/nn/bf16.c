#include "nn/bf16.h"

#include <string.h>

int ggn_bf16_available(void)
{
#if defined(__x86_64__)
    return ggn_isa_best() == GGN_ISA_AVX512 && __builtin_cpu_supports("avx512bf16");
#else
    return 0;
#endif
}

size_t ggn_bf16_pack_size(int n_in, int n_out)
{
    return (size_t)((n_in + 1) / 2) * (size_t)n_out * 9;
}

/* Round to nearest even; weights are finite. */
static uint32_t round_bf16(float x)
{
    uint32_t u;
    memcpy(&u, &x, sizeof u);
    return (u + 0x7fff + (u >> 16 & 1)) >> 16;
}

void ggn_bf16_pack(uint32_t *out, const float *packed, int n_in, int n_out, int tile_oc)
{
    for (int oc = 0, tile; oc < n_out; oc += tile) {
        for (tile = tile_oc; tile > n_out - oc;)
            tile /= 2;
        for (int i = 0; i < n_in; i += 2) {
            for (int k = 0; k < 9 * tile; k++)
                *out++ = round_bf16(packed[k]) | (i + 1 < n_in ? round_bf16(packed[9 * tile + k]) << 16 : 0);
            packed += (i + 1 < n_in ? 18 : 9) * tile;
        }
    }
}

size_t ggn_bf16_scratch(int n_in, int row, long pixels)
{
    return (size_t)((n_in + 1) / 2) * ((size_t)pixels + 2 * (size_t)row + 2 * 64);
}
