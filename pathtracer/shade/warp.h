/*
 * Maps from the unit square to the shapes that scattering needs, with their densities. Inputs are in [0, 1).
 *
 * Sines and cosines are short polynomials on [-π/4, π/4]: faster than the C library's, and the same bytes wherever the
 * program is built.
 */
#ifndef PT_SHADE_WARP_H
#define PT_SHADE_WARP_H

#include "scene/vec.h"

/* |x| <= π/4; absolute error below 1e-7. Taylor series. */
static inline void pt_sincos_quarter(float x, float *s, float *c)
{
    float x2 = x * x;
    *s = x * (1.0f + x2 * (-1.6666667e-1f + x2 * (8.3333333e-3f + x2 * (-1.9841270e-4f + x2 * 2.7557319e-6f))));
    *c = 1.0f + x2 * (-0.5f + x2 * (4.1666667e-2f + x2 * (-1.3888889e-3f + x2 * 2.4801587e-5f)));
}

/* Sine and cosine of 2πu, u in [0, 1]. */
static inline void pt_sincos_turn(float u, float *s, float *c)
{
    float quarters = 4.0f * u;
    int q = (int)(quarters + 0.5f);
    float sq, cq;
    pt_sincos_quarter((quarters - (float)q) * (0.5f * PT_PI), &sq, &cq);
    float ss = (q & 1) ? cq : sq, cc = (q & 1) ? sq : cq;
    *s = (q & 2) ? -ss : ss;
    *c = ((q + 1) & 2) ? -cc : cc;
}

/* Cosine-weighted hemisphere around +z; pdf_solid = z/π. Malley's method. The angle is found by doubling a quarter of it
 * twice: no branch, which would be mispredicted every other time. */
static inline pt_vec3 pt_sample_cosine(float u0, float u1)
{
    float s, c, r = sqrtf(u0), rest = 1.0f - u0;
    pt_sincos_quarter((u1 - 0.5f) * (0.5f * PT_PI), &s, &c);
    float s2 = 2.0f * s * c, c2 = 1.0f - 2.0f * s * s;
    return v3(r * (1.0f - 2.0f * s2 * s2), r * (2.0f * s2 * c2), sqrtf(rest > 1e-12f ? rest : 1e-12f));
}

#endif
