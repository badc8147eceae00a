#include "sequence/simulate.h"

#include <string.h>

void seq_simulate(const float *mean, const float *difference, size_t values, double scale, float *out)
{
    for (size_t i = 0; i < values; i++)
        out[i] = mean[i] + (float)scale * difference[i];
}

int seq_halves(const struct seq_block *b, const struct seq_record *r, float *mean, float *difference, struct base_err *err)
{
    const size_t pixels = (size_t)b->width * b->height;
    int rc = seq_mean(b, r, mean, err);
    if (rc || seq_has(r, SEQ_PLANE_HALF_F16))
        return rc ? rc : seq_half(b, r, difference, err);
    rc = seq_half_luminance(b, r, difference, err);
    for (size_t c = 1; c < 3 && !rc; c++)
        memcpy(difference + c * pixels, difference, pixels * sizeof *difference);
    return rc;
}

int seq_levels(double first, double last, double step, int geometric, uint32_t *spp, int room)
{
    int n = 0;
    for (double at = first; at <= last * (1.0 + 1e-9); at = geometric ? at * step : at + step) {
        uint32_t level = (uint32_t)lround(at);
        if (n > 0 && level <= spp[n - 1])
            continue;
        if (n == room)
            return room + 1;
        spp[n++] = level;
    }
    if (spp[n - 1] >= (uint32_t)last)
        return n;
    if (n < room)
        spp[n] = (uint32_t)last;
    return n + 1;
}
