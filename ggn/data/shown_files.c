#include "data/shown_files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "picture/png.h"

int ggn_shown_write(const char *dir, int view, const char *name, int width, int height, const uint8_t *rgb,
                    struct base_err *err)
{
    char path[4096];
    int n = snprintf(path, sizeof path, "%s/v%d/%s.png", dir, view, name);
    return n > 0 && n < (int)sizeof path ? pic_write_png(path, width, height, 3, rgb, err)
                                         : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
}

int ggn_shown_write_block(const char *dir, int view, const struct ggn_shown_block *b, const char *what, int frames,
                          const uint8_t *rgb, struct base_err *err)
{
    char name[64];
    snprintf(name, sizeof name, "b%u-%s", b->id, what);
    return ggn_shown_write(dir, view, name, (int)(b->x1 - b->x0), frames * (int)(b->y1 - b->y0), rgb, err);
}

int ggn_shown_takes_level(const struct ggn_shown_request *q, const struct ggn_shown_block *b, double spp)
{
    double last = b->n_levels > 0 ? b->levels[b->n_levels - 1] : 0.0;
    return spp >= q->spp_min && spp <= q->spp_max && b->n_levels < GGN_SHOWN_MAX_LEVELS &&
           (last == 0.0 || log2(spp / last) >= 0.999 * q->spacing);
}

int ggn_shown_enough_levels(const char *dir, const struct ggn_shown_block *b, struct base_err *err)
{
    if (b->n_levels >= 3)
        return 0;
    return base_fail(err, BASE_EINVAL,
                     "%s: block %u has %d levels to show; record more, or halves, or widen --spp-min and --spp-max", dir,
                     b->id, b->n_levels);
}

/* Uniform, up to 48 codes either way. A linear congruence does for noise that is only looked at (Numerical Recipes). */
int ggn_shown_make_heavy(const uint8_t *rgb, size_t n, uint8_t **out, struct base_err *err)
{
    uint32_t state = 1;
    *out = malloc(n);
    if (!*out)
        return base_fail_nomem(err, "picture of a catch trial");
    for (size_t i = 0; i < n; i++) {
        state = state * 1664525u + 1013904223u;
        int v = rgb[i] + (int)(state >> 16) % 97 - 48;
        (*out)[i] = (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v);
    }
    return 0;
}

int ggn_shown_write_reference(const char *dir, int view, const struct ggn_shown_block *b, int frames, const uint8_t *rgb,
                              struct base_err *err)
{
    uint8_t *noisy;
    int rc = ggn_shown_write_block(dir, view, b, "reference", frames, rgb, err);
    if (!rc)
        rc = ggn_shown_make_heavy(rgb, 3 * (size_t)(b->x1 - b->x0) * (b->y1 - b->y0) * (size_t)frames, &noisy, err);
    if (rc)
        return rc;
    rc = ggn_shown_write_block(dir, view, b, "heavy", frames, noisy, err);
    free(noisy);
    return rc;
}
