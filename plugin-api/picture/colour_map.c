#include "picture/colour_map.h"

#include <math.h>

enum { VIRIDIS_STEPS = 16, MAGMA_STEPS = 8 };

static const uint8_t viridis[VIRIDIS_STEPS + 1][3] = {
    {68, 1, 84},    {72, 21, 104},  {72, 40, 120},  {69, 58, 130},  {62, 74, 137},  {55, 91, 141},
    {48, 106, 142}, {42, 121, 142}, {33, 145, 140}, {31, 154, 138}, {34, 168, 132}, {53, 183, 121},
    {83, 197, 104}, {122, 209, 81}, {165, 219, 54}, {210, 226, 27}, {253, 231, 37},
};
static const uint8_t magma[MAGMA_STEPS + 1][3] = {
    {0, 0, 4},      {29, 17, 71},   {81, 18, 124},   {130, 38, 129},  {182, 54, 121},
    {230, 81, 100}, {251, 136, 97}, {254, 194, 135}, {252, 253, 191},
};
static const struct {
    int steps;
    const uint8_t (*knots)[3];
} maps[] = {[PIC_VIRIDIS] = {VIRIDIS_STEPS, viridis}, [PIC_MAGMA] = {MAGMA_STEPS, magma}};

void pic_colour(enum pic_colour_map map, double t, uint8_t rgb[3])
{
    const int steps = maps[map].steps;
    const double x = t > 0.0 ? steps * fmin(t, 1.0) : 0.0;
    const int i = x < steps - 1 ? (int)x : steps - 1;
    const uint8_t *low = maps[map].knots[i], *high = maps[map].knots[i + 1];
    for (int c = 0; c < 3; c++)
        rgb[c] = (uint8_t)lround((1.0 - (x - i)) * low[c] + (x - i) * high[c]);
}
