/*
 * The three networks at work on one block: noisy image → denoised image, window of both → logit of "still noisy".
 *
 * A new image costs one pass of the denoiser, a window two of the generator and one of the discriminator (3.885 GMAC at the
 * published size); the caller keeps the denoised images, 16 bits per value. A judge owns activations for one image and one
 * window (ggn_judge_bytes, ≤ 64 MB at the published size) and borrows the model; nothing is allocated after create. One call
 * at a time per judge; any number of judges on one model. The result depends on the window alone, never on other blocks.
 * Images are planar (see model/window.h), of any size: blocks unlike the network's size are cut into tiles or continued by
 * reflection, and the noisiest tile speaks for the block.
 */
#ifndef GGN_MODEL_JUDGE_H
#define GGN_MODEL_JUDGE_H

#include "base/threads.h"
#include "model/model.h"

/* Of the products inside convolutions; sums are float either way. */
enum ggn_precision {
    GGN_PRECISION_F32,
    GGN_PRECISION_BF16,
    GGN_PRECISION_F64 /* no judge's: model/exact.h */
};
extern const char *const ggn_precision_names[]; /* "f32", "bf16", NULL */
/* How this processor makes bfloat16 products: "AVX512-BF16", or "software" (the same numbers, slowly). */
const char *ggn_precision_bf16_by(void);
int ggn_precision_is_slow(enum ggn_precision precision);

struct ggn_judge;

size_t ggn_judge_bytes(const struct ggn_model *model, enum ggn_precision precision, int threads);
/* `threads` may be NULL: the calling thread alone. NULL on failure. */
struct ggn_judge *ggn_judge_create(const struct ggn_model *model, enum ggn_precision precision, struct base_threads *threads,
                                   struct base_err *err);
void ggn_judge_destroy(struct ggn_judge *judge);

/* noisy [3][height][width] display codes → denoised, 16-bit fixed point. */
void ggn_judge_denoise(struct ggn_judge *judge, const uint8_t *noisy, uint16_t *denoised, int width, int height);
/* noisy, denoised: S images each, noisiest first. picture: [height][width], the noise picture of the newest image, or NULL:
 * it has none; a model that takes no picture does not look. The raw logit of the discriminator; calibrate it with
 * ggn_policy_p. NaN or infinite when the model's weights overflow on this window. */
double ggn_judge_logit(struct ggn_judge *judge, const uint8_t *const *noisy, const uint16_t *const *denoised,
                       const uint8_t *picture, int width, int height);
/* The noise feature map of the last tile that was judged, for pictures: 0 of the denoised window, 1 of the noisy one. Rows
 * are *row apart. Borrowed until the next call. */
const float *ggn_judge_feature_map(const struct ggn_judge *judge, int which, int *row);

#endif
