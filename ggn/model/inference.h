/*
 * The three networks at work on one block: noisy image → denoised image, window of both → logit of "still noisy".
 *
 * A new image costs one pass of the denoiser, a window two of the generator and one of the discriminator (3.885 GMAC at the
 * published size); the caller keeps the denoised images, 16 bits per value. An inference owns activations for one image and
 * one window (ggn_inference_bytes, ≤ 64 MB at the published size) and borrows the model; nothing is allocated after create.
 * One call at a time per inference; any number of inferences on one model. The result depends on the window alone, never on
 * other blocks. Images are planar (see model/window.h), of any size: blocks unlike the network's size are cut into tiles or
 * continued by reflection, and the noisiest tile counts.
 */
#ifndef GGN_MODEL_INFERENCE_H
#define GGN_MODEL_INFERENCE_H

#include "base/threads.h"
#include "model/model.h"

/* Of the networks' arithmetic. */
enum ggn_precision { GGN_PRECISION_F32, GGN_PRECISION_F64 };

struct ggn_inference;

size_t ggn_inference_bytes(const struct ggn_model *model, int threads);
/* `threads` may be NULL: the calling thread alone. NULL on failure. */
struct ggn_inference *ggn_inference_create(const struct ggn_model *model, struct base_threads *threads,
                                           struct base_err *err);
void ggn_inference_destroy(struct ggn_inference *inference);

/* noisy [3][height][width] display codes → denoised, 16-bit fixed point. */
void ggn_inference_denoise(struct ggn_inference *inference, const uint8_t *noisy, uint16_t *denoised, int width, int height);
/* noisy, denoised: S images each, noisiest first. noise_map: [height][width], the noise map of the newest image, or NULL:
 * it has none; a model without it ignores it. scalars: [GGN_SCALARS], for a model that reads them (hyper.scalars), else
 * ignored. The raw logit of the discriminator; calibrate it with ggn_policy_p. NaN or infinite when the model's weights
 * overflow on this window. */
double ggn_inference_logit(struct ggn_inference *inference, const uint8_t *const *noisy, const uint16_t *const *denoised,
                           const uint8_t *noise_map, const float *scalars, int width, int height);

/* The same in double, without its rounding: for measurements; slow. graph, learned: [GGN_NETS]; graphs are borrowed until
 * destroy, learned are params [n_learned] of struct ggn_weights of floats. */
struct ggn_inference *ggn_inference_create_f64(const struct ggn_hyper *hyper, const struct ggn_graph *graph,
                                               const float *const *learned, struct base_err *err);
void ggn_inference_destroy_f64(struct ggn_inference *inference);
void ggn_inference_denoise_f64(struct ggn_inference *inference, const uint8_t *noisy, uint16_t *denoised, int width,
                               int height);
double ggn_inference_logit_f64(struct ggn_inference *inference, const uint8_t *const *noisy, const uint16_t *const *denoised,
                               const uint8_t *noise_map, const float *scalars, int width, int height);

#endif
