/* Frames of a shot between two quotes: what their blocks need by what the two say. */
#include <math.h>

#include "lull/host_draft.h"

static const double FADE = 0.8408964152537145; /* 2^(-1/4) */

/* A block moves when what it needs has changed by more than the quotes may be wrong. */
static int has_moved(const struct lull_host_stop_at *a, const struct lull_host_stop_at *b)
{
    return a->low > b->high || b->low > a->high;
}

uint32_t lull_host_quote_between(const struct lull_host_quote_block *a, const struct lull_host_quote_block *b,
                                 uint32_t count, uint32_t columns, uint32_t block)
{
    const long width = (long)columns, height = (long)count / width, x = (long)block % width, y = (long)block / width;
    const double own = fmax(1.0, fmax(a[block].stop.spp, b[block].stop.spp));
    double most = own;
    for (long v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
        for (long u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            const struct lull_host_stop_at *before = &a[v * width + u].stop, *after = &b[v * width + u].stop;
            if (has_moved(before, after))
                most = fmax(most, fmax(before->spp, after->spp));
        }
    return (uint32_t)ceil(sqrt(own * most));
}

void lull_host_quote_fade(uint32_t *spp, const uint32_t *beside, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t least = (uint32_t)ceil(FADE * beside[i]);
        if (spp[i] < least)
            spp[i] = least;
    }
}
