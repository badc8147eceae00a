/*
 * OpenBLAS, loaded when a baseline is asked for and not with the program. Loaded with it, OpenBLAS starts a thread per
 * processor and takes 128 MB of addresses for each. Where there are none (ulimit -v) it looks for them for ever, in a call
 * or in a thread that the program's end waits for. Here it has no threads, what its calls work in is taken as it is loaded,
 * and no more calls run at a time than there is of that.
 */
#ifndef GGN_BASELINES_BLAS_H
#define GGN_BASELINES_BLAS_H

#include <cblas.h>

#include "base/err.h"

/* Loads it, once; it stays until the process ends. While it loads, OPENBLAS_NUM_THREADS is 1 where it was not set.
 * BASE_ENOMEM when there are no addresses for one call, BASE_EIO when it is not there. Thread-safe. */
int ggn_blas_open(struct base_err *err);

/* After ggn_blas_open has returned 0; thread-safe. C = op(A)·op(B) + beta·C of gap-free row-major matrices; op(A) is [m, k],
 * op(B) [k, n]. */
void ggn_blas_sgemm(enum CBLAS_TRANSPOSE ta, enum CBLAS_TRANSPOSE tb, int m, int n, int k, const float *a, const float *b,
                    float beta, float *c);
/* The singular values s[n] of a [n, n], which is overwritten; work has 64·n numbers. Not 0: they do not converge. */
int ggn_blas_singular_values(int n, double *a, double *s, double *work);
/* Of one sgemm; 1 until it is called. Not while others call. */
void ggn_blas_threads(int count);

#endif
