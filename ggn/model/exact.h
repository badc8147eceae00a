/*
 * The three networks at work on one block in double precision: the answer of an inference (model/inference.h) without its
 * rounding.
 *
 * For measurements; slow. Between the networks it keeps what an inference keeps, denoised images of 16 bits. Blocks of the
 * network's own size only. Borrows the graphs until destroy, owns everything else. One call at a time per object.
 */
#ifndef GGN_MODEL_EXACT_H
#define GGN_MODEL_EXACT_H

#include <stdint.h>

#include "model/networks.h"

/* Of the networks' arithmetic: an inference's, or that of this file. */
enum ggn_precision { GGN_PRECISION_F32, GGN_PRECISION_F64 };

struct ggn_exact;

/* graph, learned: [GGN_NETS]; learned: parameters and running statistics as struct ggn_weights of floats holds them
 * (params, [n_learned]). NULL on failure. */
struct ggn_exact *ggn_exact_create(const struct ggn_hyper *hyper, const struct ggn_graph *graph, const float *const *learned,
                                   struct base_err *err);
void ggn_exact_destroy(struct ggn_exact *exact);

/* As ggn_inference_denoise and ggn_inference_logit. */
void ggn_exact_denoise(struct ggn_exact *exact, const uint8_t *noisy, uint16_t *denoised);
double ggn_exact_logit(struct ggn_exact *exact, const uint8_t *const *noisy, const uint16_t *const *denoised,
                       const uint8_t *noise_map, const float *scalars);

#endif
