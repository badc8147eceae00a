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
/* Of a network with so many inputs. */
size_t ggn_lstm_parameters(int inputs);
/* For ggn_lstm_logit only: one sequence at a time, with trained weights [ggn_lstm_parameters], borrowed until destroy; any
 * number may share them. */
struct ggn_lstm *ggn_lstm_reader(int inputs, int steps, const float *weights, struct base_err *err);

/* One pass over n sequences, each [steps][inputs], in an order drawn from `epoch`. Returns the mean loss. */
double ggn_lstm_epoch(struct ggn_lstm *lstm, const double *const *sequences, const unsigned char *label, size_t n,
                      uint32_t epoch);
/* Logit of the probability of label 1. sequence: [steps] pointers to [inputs]. Allocates nothing. */
double ggn_lstm_logit(struct ggn_lstm *lstm, const double *const *sequence);

/* For tests: the loss of one sequence without dropout, and d loss / d parameters into grad [parameters]. */
double ggn_lstm_gradient(struct ggn_lstm *lstm, const double *sequence, int label, float *grad);
/* The parameters of a network in training, in one array. Borrowed. */
float *ggn_lstm_weights(struct ggn_lstm *lstm);

#endif
