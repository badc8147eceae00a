/*
 * Pearson's χ² test of directions against a density over the sphere, on a grid uniform in (cos θ, φ).
 */
#ifndef PT_CHI2_H
#define PT_CHI2_H

#include <math.h>
#include <stdio.h>

#include "scene/vec.h"

enum { CHI2_Z = 32, CHI2_PHI = 32, CHI2_CELLS = CHI2_Z * CHI2_PHI };

struct chi2 {
    double expected[CHI2_CELLS]; /* probability of each cell */
    double observed[CHI2_CELLS]; /* counts */
    double other;                /* counts of samples without direction (absorbed, delta) */
    double samples;
};

static inline int chi2_cell(pt_vec3 w)
{
    int z = (int)((w.z + 1.0f) * 0.5f * CHI2_Z);
    float phi = atan2f(w.y, w.x);
    int p = (int)((phi < 0.0f ? phi + 2.0f * PT_PI : phi) / (2.0f * PT_PI) * CHI2_PHI);
    z = z < 0 ? 0 : z >= CHI2_Z ? CHI2_Z - 1 : z;
    p = p >= CHI2_PHI ? CHI2_PHI - 1 : p;
    return z * CHI2_PHI + p;
}

/* Midpoint rule on sub² points of one cell. */
static inline double chi2_integrate(int cell, int sub, float (*pdf)(const void *data, pt_vec3 wi), const void *data)
{
    double sum = 0.0;
    for (int i = 0; i < sub; i++) {
        float z = -1.0f + 2.0f * ((float)(cell / CHI2_PHI * sub + i) + 0.5f) / (float)(CHI2_Z * sub);
        float r = sqrtf(fmaxf(0.0f, 1.0f - z * z));
        for (int j = 0; j < sub; j++) {
            float phi = 2.0f * PT_PI * ((float)(cell % CHI2_PHI * sub + j) + 0.5f) / (float)(CHI2_PHI * sub);
            sum += (double)pdf(data, v3(r * cosf(phi), r * sinf(phi), z));
        }
    }
    return sum * 4.0 * 3.14159265358979 / CHI2_CELLS / (sub * sub);
}

/* Integrates pdf(data, wi) over every cell, more finely until refining no longer changes it. */
static inline void chi2_expect(struct chi2 *c, float (*pdf)(const void *data, pt_vec3 wi), const void *data)
{
    for (int i = 0; i < CHI2_CELLS; i++) {
        double coarse = chi2_integrate(i, 6, pdf, data), fine = chi2_integrate(i, 14, pdf, data);
        for (int sub = 32; sub <= 160 && fabs(fine - coarse) > 2e-3 * fine + 1e-6; sub *= 2) {
            coarse = fine;
            fine = chi2_integrate(i, sub, pdf, data);
        }
        c->expected[i] = fine;
    }
}

/* Sum of the expected probabilities. */
static inline double chi2_mass(const struct chi2 *c)
{
    double sum = 0.0;
    for (int i = 0; i < CHI2_CELLS; i++)
        sum += c->expected[i];
    return sum;
}

/* Upper tail of the χ² distribution: Wilson and Hilferty 1931. */
static inline double chi2_tail(double x, double dof)
{
    double t = 2.0 / (9.0 * dof);
    return 0.5 * erfc((cbrt(x / dof) - (1.0 - t)) / sqrt(t) / sqrt(2.0));
}

/* p-value; cells that expect fewer than 10 are pooled, and samples without direction are one more category. */
static inline double chi2_p_value(const struct chi2 *c)
{
    double statistic = 0.0, pooled_e = 0.0, pooled_o = 0.0;
    int dof = -1;
    for (int i = 0; i < CHI2_CELLS; i++) {
        double e = c->expected[i] * c->samples;
        if (e < 10.0) {
            pooled_e += e;
            pooled_o += c->observed[i];
            continue;
        }
        statistic += (c->observed[i] - e) * (c->observed[i] - e) / e;
        dof++;
    }
    double rest = (1.0 - chi2_mass(c)) * c->samples;
    pooled_e += rest > 0.0 ? rest : 0.0;
    pooled_o += c->other;
    if (pooled_e > 10.0) {
        statistic += (pooled_o - pooled_e) * (pooled_o - pooled_e) / pooled_e;
        dof++;
    } else if (pooled_o > 10.0 + pooled_e + 6.0 * sqrt(pooled_e + 1.0)) {
        return 0.0;
    }
    return dof > 0 ? chi2_tail(statistic, dof) : 1.0;
}

#endif
