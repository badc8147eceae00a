/* What a kernel gives against an oracle: numbers to begin with, and how near is near enough. */
#ifndef TESTS_SUPPORT_GGN_NN_NEAR_H
#define TESTS_SUPPORT_GGN_NN_NEAR_H

#include "support/ggn_cmocka.h"

#include <math.h>

#include "nn/hash.h"
#include "nn/kernels.h"

static const double F32_TOLERANCE = 2e-5, F64_TOLERANCE = 1e-12; /* of sums of up to some thousand products of order 1 */

/* In [-1, 1). */
static inline double rnd(uint32_t k, uint32_t s) { return 2 * ggn_hash_unit(k, s) - 1; }

static inline void near(const char *what, enum base_isa isa, uint32_t seed, double got, double want, double scale,
                        double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fmax(fabs(want), scale)))
        fail_msg("%s on %s, seed %u: %.9g, expected %.9g", what, base_isa_name(isa), seed, got, want);
}

#endif
