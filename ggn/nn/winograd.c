#include "nn/winograd.h"

/* Measured: with fewer channels the transforms cost more than the products they save, with fewer tiles too many lanes are
 * empty. 8 lanes pay sooner than 16: their products take twice the time, what moves values about does not. */
int ggn_wino_suits(int n_in, int n_out, int h, int w, int lanes)
{
    if (lanes > 8)
        return n_in >= 6 && n_out >= 6 && n_in * n_out >= 200 && ggn_wino_tiles(h, w) >= 24;
    return n_in >= 3 && n_out >= 3 && n_in * n_out >= 32 && ggn_wino_tiles(h, w) >= 9;
}

int ggn_wino_grad_suits(int n_in, int n_out, int h, int w, int lanes)
{
    return n_in >= 6 && n_out >= 6 && n_in * n_out >= 60 && ggn_wino_suits(n_in, n_out, h, w, lanes);
}

int ggn_wino_tiles(int h, int w) { return ((h + 3) / 4) * ((w + 3) / 4); }

void ggn_wino_cut(int tiles, int n_out, int *blocks, int *oc_group)
{
    const int least = (tiles + GGN_WINO_TILES - 1) / GGN_WINO_TILES;
    /* Something for every thread; where the tiles of one call suffice, no two tasks read the same weights. */
    *blocks = least > 1 ? (least < 4 ? 4 : least) : n_out < 64 ? 2 : 1;
    *oc_group = *blocks > 1 ? n_out : (n_out / 2 + GGN_TILE_MAX - 1) / GGN_TILE_MAX * GGN_TILE_MAX;
}

size_t ggn_wino_scratch(int n_in)
{
    const size_t room = GGN_WINO_TILES + 16;
    return 36 * room + 16 * room + (size_t)GGN_WINO_OC * 36 * GGN_WINO_TILES + 36 * ((size_t)n_in * GGN_WINO_TILES + 16);
}

/* G on three values: out[6] with stride `stride`. */
static inline __attribute__((always_inline)) void spread(float *restrict out, size_t stride, float a, float b, float c)
{
    out[0] = a * 0.25f;
    out[stride] = ((a + c) + b) * (-1.0f / 6);
    out[2 * stride] = ((a + c) - b) * (-1.0f / 6);
    out[3 * stride] = (a * (1.0f / 24) + c * (1.0f / 6)) + b * (1.0f / 12);
    out[4 * stride] = (a * (1.0f / 24) + c * (1.0f / 6)) - b * (1.0f / 12);
    out[5 * stride] = c;
}

/* G g Gᵀ of `tile` weights side by side: in[9][tile], out[36] with stride `stride`. */
static inline __attribute__((always_inline)) void pack_tile(float *restrict out, size_t stride, const float *restrict in,
                                                            const int tile)
{
    float half[6][3][GGN_TILE_MAX];
    for (int x = 0; x < 3; x++)
        for (int o = 0; o < tile; o++)
            spread(&half[0][x][o], 3 * GGN_TILE_MAX, in[x * tile + o], in[(3 + x) * tile + o], in[(6 + x) * tile + o]);
    for (int i = 0; i < 6; i++, out += 6 * stride)
        for (int o = 0; o < tile; o++)
            spread(out + o, stride, half[i][0][o], half[i][1][o], half[i][2][o]);
}

void ggn_wino_pack(float *u, const float *packed, int n_in, int n_out, int tile_oc)
{
    const size_t stride = (size_t)n_in * (size_t)n_out;
    for (int oc = 0, tile; oc < n_out; oc += tile) {
        tile = n_out - oc < tile_oc ? n_out - oc : tile_oc;
        for (int i = 0; i < n_in; i++, packed += 9 * tile) {
            float *to = u + (size_t)oc * (size_t)n_in + (size_t)(i * tile);
            if (tile == GGN_TILE_MAX)
                pack_tile(to, stride, packed, GGN_TILE_MAX);
            else if (tile == GGN_TILE_MAX / 2)
                pack_tile(to, stride, packed, GGN_TILE_MAX / 2);
            else
                pack_tile(to, stride, packed, tile);
        }
    }
}
