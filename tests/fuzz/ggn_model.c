/* Model files from hostile bytes; a model that loads is asked for a decision. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "model/judge.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Most mutations die at the checksum; mended ones get further. */
static void mend(uint8_t *p, size_t size)
{
    uint64_t h = 0xcbf29ce484222325u;

    for (size_t i = 0; i < size; i++)
        h = (h ^ (i >= 48 && i < 56 ? 0 : p[i])) * 0x100000001b3u;
    for (int i = 0; i < 8; i++)
        p[48 + i] = (uint8_t)(h >> 8 * i);
    for (int i = 0; i < 8; i++)
        p[16 + i] = (uint8_t)((uint64_t)size >> 8 * i);
}

static void decide(const struct ggn_model *m)
{
    struct ggn_judge *j = ggn_judge_create(m, GGN_PRECISION_F32, NULL, NULL);
    size_t values = 3 * (size_t)m->hyper.height * (size_t)m->hyper.width, images = (size_t)m->hyper.window;
    uint8_t *noisy = calloc(values, 1);
    uint16_t *denoised = calloc(values, sizeof *denoised);
    const uint8_t **n = calloc(images, sizeof *n);
    const uint16_t **d = calloc(images, sizeof *d);

    if (j && noisy && denoised && n && d) {
        ggn_judge_denoise(j, noisy, denoised, m->hyper.width, m->hyper.height);
        for (size_t i = 0; i < images; i++) {
            n[i] = noisy;
            d[i] = denoised;
        }
        ggn_judge_logit(j, n, d, NULL, m->hyper.width, m->hyper.height);
    }
    ggn_judge_destroy(j);
    free(noisy);
    free(denoised);
    free(n);
    free(d);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct ggn_model *m = NULL;
    uint8_t *copy = malloc(size + 1);

    if (!copy)
        return 0;
    memcpy(copy, data, size);
    for (int mended = 0; mended < 2; mended++) {
        if (mended && size >= 64) {
            mend(copy, size);
            mend(copy, size); /* the size is part of what the checksum covers */
        }
        if (ggn_model_load_memory("fuzz", copy, size, &m, NULL) == 0) {
            if (m->hyper.height * m->hyper.width <= 64 * 64)
                decide(m);
            ggn_model_destroy(m);
        }
    }
    free(copy);
    return 0;
}
