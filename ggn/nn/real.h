/*
 * The precision of a translation unit: `real` is float, or double where GGN_DOUBLE is defined.
 *
 * A source of nn, model or tests/support that includes this header itself is compiled twice by the Makefile, and every
 * program holds both: float trains and runs the product, double serves gradients and golden values. In double the functions
 * below carry the suffix _f64; one that is missing here is defined twice, and the linker says so. A file that only calls
 * them gets float, unless it defines GGN_DOUBLE before its first include.
 */
#ifndef GGN_NN_REAL_H
#define GGN_NN_REAL_H

#ifndef GGN_DOUBLE

typedef float real;
#define GGN_TYPED(name) name

#else

typedef double real;
#define GGN_TYPED(name) name##_f64

#define ggn_kernels_for GGN_TYPED(ggn_kernels_for)
#define ggn_kernels_best GGN_TYPED(ggn_kernels_best)
#define ggn_kernels_base GGN_TYPED(ggn_kernels_base)
#define ggn_kernels_avx2 GGN_TYPED(ggn_kernels_avx2)
#define ggn_kernels_avx512 GGN_TYPED(ggn_kernels_avx512)

#define ggn_weights_create GGN_TYPED(ggn_weights_create)
#define ggn_weights_init GGN_TYPED(ggn_weights_init)
#define ggn_weights_copy GGN_TYPED(ggn_weights_copy)
#define ggn_weights_pack GGN_TYPED(ggn_weights_pack)

#define ggn_exec_bytes GGN_TYPED(ggn_exec_bytes)
#define ggn_exec_create GGN_TYPED(ggn_exec_create)
#define ggn_exec_forward GGN_TYPED(ggn_exec_forward)
#define ggn_exec_backward GGN_TYPED(ggn_exec_backward)

#define ggn_ssim_create GGN_TYPED(ggn_ssim_create)
#define ggn_ssim_mean GGN_TYPED(ggn_ssim_mean)

#define ggn_train_options_default GGN_TYPED(ggn_train_options_default)
#define ggn_trainer_create GGN_TYPED(ggn_trainer_create)
#define ggn_trainer_destroy GGN_TYPED(ggn_trainer_destroy)
#define ggn_trainer_keep GGN_TYPED(ggn_trainer_keep)
#define ggn_trainer_state GGN_TYPED(ggn_trainer_state)
#define ggn_trainer_denoiser_step GGN_TYPED(ggn_trainer_denoiser_step)
#define ggn_trainer_classifier_step GGN_TYPED(ggn_trainer_classifier_step)
#define ggn_trainer_denoiser_losses GGN_TYPED(ggn_trainer_denoiser_losses)
#define ggn_trainer_answers GGN_TYPED(ggn_trainer_answers)
#define ggn_trainer_paper_step GGN_TYPED(ggn_trainer_paper_step)

#define ggn_tile_load_u8 GGN_TYPED(ggn_tile_load_u8)
#define ggn_tile_load_u16 GGN_TYPED(ggn_tile_load_u16)
#define ggn_tile_store_u16 GGN_TYPED(ggn_tile_store_u16)
#define ggn_inference_destroy GGN_TYPED(ggn_inference_destroy)
#define ggn_inference_denoise GGN_TYPED(ggn_inference_denoise)
#define ggn_inference_logit GGN_TYPED(ggn_inference_logit)

#endif

/* The larger one; a NaN where there is one. */
static inline real ggn_larger(real a, real b) { return a > b || a != a ? a : b; }

#endif
