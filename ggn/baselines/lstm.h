/*
 * The recurrent network of Buisine et al. 2021: LSTM 512, 128, 32 (logistic sigmoid for cell and output, hard sigmoid for
 * the gates), dropout 0.4 after each, one sigmoid unit. With 100 inputs it has 1,604,257 parameters. Trained by Adam on
 * cross-entropy with balanced classes, batches of 64.
 *
 * Float, seeded, one BLAS thread: the same calls give the same weights. One call at a time per object.
 */
#ifndef GGN_BASELINES_LSTM_H
#define GGN_BASELINES_LSTM_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct ggn_lstm;

/* inputs per time step, steps per sequence. NULL on failure. */
struct ggn_lstm *ggn_lstm_create(int inputs, int steps, uint32_t seed, struct base_err *err);
void ggn_lstm_destroy(struct ggn_lstm *lstm);
size_t ggn_lstm_parameters(const struct ggn_lstm *lstm);

/* One pass over n sequences, each [steps][inputs], in an order drawn from `epoch`. Returns the mean loss. */
double ggn_lstm_epoch(struct ggn_lstm *lstm, const double *const *sequences, const unsigned char *label, size_t n,
                      uint32_t epoch);
/* Probability of label 1. */
double ggn_lstm_predict(struct ggn_lstm *lstm, const double *sequence);

/* For tests: the loss of one sequence without dropout, and d loss / d parameters into grad [parameters]. */
double ggn_lstm_gradient(struct ggn_lstm *lstm, const double *sequence, int label, float *grad);
/* The parameters, in one array. Borrowed. */
float *ggn_lstm_weights(struct ggn_lstm *lstm);

#endif
