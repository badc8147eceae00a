#include "render/denoised.h"

#include <stdlib.h>

void pt_denoised_release(struct pt_denoised *d)
{
    free(d->rgb);
    free(d->denoised);
    free(d->weight);
    *d = (struct pt_denoised){0};
}

uint32_t pt_denoised_planes(enum pt_picture picture)
{
    return (picture != PT_PICTURE_NOISY ? PT_FILM_ALBEDO | PT_FILM_NORMAL : 0) |
           (picture == PT_PICTURE_BLEND ? PT_FILM_HALF : 0);
}

int pt_denoised_make(const struct pt_render *r, enum pt_picture picture, const char *library, int (*cancelled)(void *data),
                     struct pt_denoised *out, struct base_err *err)
{
    const size_t n = r->film.pixels;
    struct lull_error e = {.struct_size = sizeof e};
    struct pt_host_view view;
    *out = (struct pt_denoised){.rgb = malloc(3 * n * sizeof(float)),
                                .denoised = malloc(3 * n * sizeof(float)),
                                .weight = malloc(n * sizeof(float))};
    int rc = out->rgb && out->denoised && out->weight ? 0 : base_fail_nomem(err, "the denoised picture");
    if (!rc) {
        const struct lull_host_denoising how = {.struct_size = sizeof how,
                                                .flags = picture == PT_PICTURE_DENOISED ? LULL_DENOISE_FULL : 0,
                                                .threads = (uint32_t)base_threads_count(r->threads),
                                                .library = library,
                                                .cancelled = cancelled};
        const struct lull_host_picture made = {
            .struct_size = sizeof made, .rgb = out->rgb, .denoised = out->denoised, .weight = out->weight};
        rc = pt_host_result(lull_host_denoise(r->frame, pt_host_show(&r->film, r->blocks, &view), &how, &made, &e), &e, err);
    }
    for (size_t i = 0; !rc && i < n; i++)
        out->weight_mean += (double)out->weight[i] / (double)n;
    if (rc)
        pt_denoised_release(out);
    return rc;
}
