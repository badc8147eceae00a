/*
 * Decisions: per-block histories of images and the workspace that turns a history into a probability.
 *
 * A new image costs one pass of the denoiser, a decision two of the generator and one of the discriminator (3.885 GMAC at
 * the published size); the older denoised images are kept in the history, 16 bits per value. Numbers depend on the images
 * pushed and on nothing else: not on threads, other blocks or earlier calls.
 *
 * A history is plain memory of the caller (ggn_history_bytes, ≤ 2.2 MB at the published size), one block's, one call at a
 * time. An infer object is one thread's workspace (ggn_infer_bytes, ≤ 64 MB at the published size); create one per worker;
 * after create nothing is allocated. The model is shared and only read.
 */
#ifndef GGN_MODEL_INFER_H
#define GGN_MODEL_INFER_H

#include "base/threads.h"
#include "model/model.h"

enum ggn_precision { GGN_PRECISION_F32, GGN_PRECISION_BF16 };

size_t ggn_history_bytes(const struct ggn_hyper *hyper);
void ggn_history_clear(void *history);
/* Images held, at most the window. */
int ggn_history_count(const void *history);
/* Samples per pixel of image i, oldest first. */
uint64_t ggn_history_spp(const void *history, const struct ggn_hyper *hyper, int i);
/* Whether `bytes` bytes from outside (a checkpoint) are a history of this shape. */
int ggn_history_valid(const void *history, size_t bytes, const struct ggn_hyper *hyper);

struct ggn_infer;

size_t ggn_infer_bytes(const struct ggn_model *model, enum ggn_precision precision, int workers);
/* `threads`: NULL (a call uses the calling thread only) or a pool over which one decision is spread. NULL on failure.
 * GGN_PRECISION_BF16 is f32 on processors without AVX512-BF16 (ggn_infer_has_bf16). */
struct ggn_infer *ggn_infer_create(const struct ggn_model *model, enum ggn_precision precision, struct ggn_threads *threads,
                                   struct ggn_err *err);
void ggn_infer_destroy(struct ggn_infer *infer);
int ggn_infer_has_bf16(void);

/* Appends the image (3 planes of height × width bytes, see model/preprocess.h) at `spp`, dropping the oldest when the window
 * is full. A history that already ends at this spp stays as it is, so that asking twice changes nothing. */
void ggn_infer_push(struct ggn_infer *infer, void *history, const uint8_t *rgb, uint64_t spp);

/* Probability that the last image is still noisy, calibrated; *logit (may be NULL) before calibration. GGN_EINVAL while the
 * window is not full. Weights that overflow give p = 1 and a logit that is not finite. */
int ggn_infer_decide(struct ggn_infer *infer, const void *history, double *p_noisy, double *logit);

/* One denoised image, for caching windows during training: float planes without gaps, 0..1. */
void ggn_infer_denoise(struct ggn_infer *infer, const uint8_t *rgb, float *out);

#endif
