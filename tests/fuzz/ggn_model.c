/* Model files, of networks and of baselines, from hostile bytes; a model that loads is asked for a decision. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "baselines/baseline.h"
#include "model/inference.h"
#include "sight/measure.h"
#include "model/stopper.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Tracing each byte of a checksum would take most of the time. */
#ifdef __clang__
#define UNTRACED __attribute__((no_sanitize("coverage")))
#else
#define UNTRACED
#endif

static UNTRACED uint64_t hash(uint64_t h, const uint8_t *p, size_t size)
{
    for (size_t i = 0; i < size; i++)
        h = (h ^ p[i]) * 0x100000001b3u;
    return h;
}

/* Most mutations die at the checksum; mended ones get further. The checksum is at 48 and counts as zeros there; the size, at
 * 16, is part of what it covers. */
static void mend(uint8_t *p, size_t size)
{
    static const uint8_t zeros[8];
    for (int i = 0; i < 8; i++)
        p[16 + i] = (uint8_t)((uint64_t)size >> 8 * i);
    uint64_t h = hash(hash(hash(0xcbf29ce484222325u, p, 48), zeros, 8), p + 56, size - 56);
    for (int i = 0; i < 8; i++)
        p[48 + i] = (uint8_t)(h >> 8 * i);
}

static void decide(const struct ggn_model *m)
{
    struct ggn_inference *j = ggn_inference_create(m, NULL, NULL);
    size_t values = 3 * (size_t)m->hyper.height * (size_t)m->hyper.width, images = (size_t)m->hyper.window;
    uint8_t *noisy = calloc(values, 1);
    uint16_t *denoised = calloc(values, sizeof *denoised);
    const uint8_t **n = calloc(images, sizeof *n);
    const uint16_t **d = calloc(images, sizeof *d);

    if (j && noisy && denoised && n && d) {
        ggn_inference_denoise(j, noisy, denoised, m->hyper.width, m->hyper.height);
        for (size_t i = 0; i < images; i++) {
            n[i] = noisy;
            d[i] = denoised;
        }
        static const float told[GGN_SCALARS];
        ggn_inference_logit(j, n, d, NULL, told, m->hyper.width, m->hyper.height);
    }
    ggn_inference_destroy(j);
    free(noisy);
    free(denoised);
    free(n);
    free(d);
}

static void judge_by(const struct ggn_baseline *b)
{
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(b, NULL);
    const int w = b->width + 3, h = b->height; /* two tiles */
    uint8_t *codes = calloc(3 * (size_t)w * (size_t)h, 1);
    double *look = calloc(ggn_baseline_feature_count(b, w, h), sizeof *look);
    const double *looks[GGN_WINDOW_MAX];

    for (int i = 0; i < b->window; i++)
        looks[i] = look;
    if (r && codes && look) {
        ggn_baseline_extract(r, codes, w, h, look);
        ggn_baseline_logit(r, looks, w, h);
    }
    ggn_baseline_reader_destroy(r);
    free(codes);
    free(look);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct ggn_container c;
    struct ggn_model *m = NULL;
    struct ggn_baseline b;
    uint8_t *copy = malloc(size + 1);

    if (!copy)
        return 0;
    memcpy(copy, data, size);
    for (int mended = 0; mended < 2; mended++) {
        if (mended && size >= 64)
            mend(copy, size);
        char *file = malloc(size + 1);
        if (file)
            memcpy(file, copy, size);
        if (!file || ggn_container_parse(&c, "fuzz", file, size, NULL))
            continue;
        if (ggn_model_parse(&c, "fuzz", &m, NULL) == 0) {
            if (m->hyper.height * m->hyper.width <= 64 * 64)
                decide(m);
            ggn_model_destroy(m);
        }
        if (ggn_baseline_parse(&b, &c, "fuzz", GGN_BASELINES, NULL) == 0) {
            if (b.height * b.width <= 64 * 64)
                judge_by(&b);
            ggn_baseline_release(&b);
        }
        ggn_container_release(&c);
    }
    free(copy);
    return 0;
}
