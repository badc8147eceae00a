#include "nn/winograd.h"

#include <string.h>

int ggn_wino_suits(int n_in, int n_out, int h, int w)
{
    return n_in >= 6 && n_out >= 6 && ggn_wino_tiles(h, w) >= 24;
}

int ggn_wino_tiles(int h, int w)
{
    return ((h + 3) / 4) * ((w + 3) / 4);
}

int ggn_wino_blocks(int tiles)
{
    int blocks = (tiles + GGN_WINO_TILES - 1) / GGN_WINO_TILES;
    return blocks >= 4 ? blocks : tiles > GGN_WINO_TILES ? 4 : 2; /* something for every thread */
}

size_t ggn_wino_scratch(int n_in)
{
    const size_t room = GGN_WINO_TILES + 16;
    return 36 * room + 16 * room + (size_t)GGN_WINO_OC * 36 * GGN_WINO_TILES + 36 * ((size_t)n_in * GGN_WINO_TILES + 16);
}

/* G g Gᵀ of `tile` weights side by side: in[9][tile], out[36] with stride `stride`. */
static void pack_tile(float *out, size_t stride, const float *in, int tile)
{
    static const double g[6][3] = {{1.0 / 4, 0, 0},
                                   {-1.0 / 6, -1.0 / 6, -1.0 / 6},
                                   {-1.0 / 6, 1.0 / 6, -1.0 / 6},
                                   {1.0 / 24, 1.0 / 12, 1.0 / 6},
                                   {1.0 / 24, -1.0 / 12, 1.0 / 6},
                                   {0, 0, 1}};

    for (int o = 0; o < tile; o++) {
        double half[6][3];
        for (int i = 0; i < 6; i++)
            for (int x = 0; x < 3; x++)
                half[i][x] = g[i][0] * (double)in[x * tile + o] + g[i][1] * (double)in[(3 + x) * tile + o] +
                             g[i][2] * (double)in[(6 + x) * tile + o];
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                out[(size_t)(6 * i + j) * stride + (size_t)o] =
                    (float)(half[i][0] * g[j][0] + half[i][1] * g[j][1] + half[i][2] * g[j][2]);
    }
}

void ggn_wino_pack(float *u, const float *packed, int n_in, int n_out, int tile_oc)
{
    const size_t stride = (size_t)n_in * (size_t)n_out;

    for (int oc = 0, tile; oc < n_out; oc += tile) {
        for (tile = tile_oc; tile > n_out - oc;)
            tile /= 2;
        for (int i = 0; i < n_in; i++, packed += 9 * tile)
            pack_tile(u + (size_t)oc * (size_t)n_in + (size_t)(i * tile), stride, packed, tile);
    }
}

ggn_wino_fn *ggn_wino_for(enum ggn_isa isa)
{
#if defined(__x86_64__)
    return isa == GGN_ISA_AVX512 ? ggn_wino_conv_avx512 : NULL;
#else
    (void)isa;
    return NULL;
#endif
}
