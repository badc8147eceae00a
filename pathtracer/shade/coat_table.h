/*
 * Directional albedos of a dielectric coating, as the coated materials need them (bsdf_coated_diffuse.h).
 *
 * A table is one block of floats made when the scene is built: rows for one or several roughnesses (one when the material's
 * roughness is constant), each with the internal diffuse reflectance, then A(μ), then the interface's own reflection albedo,
 * both at PT_COAT_NODES values of sqrt(μ). Anisotropic interfaces use the geometric mean of their alphas.
 */
#ifndef PT_SHADE_COAT_TABLE_H
#define PT_SHADE_COAT_TABLE_H

#include <stddef.h>

#include "scene/vec.h"

enum {
    PT_COAT_NODES = 32,
    PT_COAT_ROW = 1 + 2 * PT_COAT_NODES,
    PT_COAT_HEADER = 3,        /* rows, smallest sqrt(alpha), rows - 1 over the range of sqrt(alpha) */
    PT_COAT_TEXTURED_ROWS = 12 /* rows when the roughness varies over the surface */
};

static inline float pt_coat_alpha(float ax, float ay) { return ax == ay ? ax : sqrtf(ax * ay); }

/* Floats of a table with `rows` rows. */
static inline size_t pt_coat_table_floats(int rows) { return (size_t)PT_COAT_HEADER + (size_t)rows * PT_COAT_ROW; }

/*
 * Fills table[pt_coat_table_floats(rows)] for relative index eta > 0, layer thickness >= 0 (mean free paths) and roughness
 * alpha in [alpha_min, alpha_max]; rows = 1 takes alpha_min. alpha 0 is a smooth interface. Deterministic; some milliseconds
 * per row.
 */
void pt_coat_table_build(float *table, int rows, float eta, float thickness, float alpha_min, float alpha_max);

/* Row pair and blend for alpha. */
static inline const float *pt_coat_rows(const float *table, float alpha, int *next, float *t)
{
    int rows = (int)table[0], row = 0;
    *next = 0;
    *t = 0.0f;
    if (rows > 1) {
        float x = fmaxf(0.0f, (sqrtf(alpha) - table[1]) * table[2]);
        row = x < (float)(rows - 1) ? (int)x : rows - 2;
        *t = fminf(x - (float)row, 1.0f);
        *next = PT_COAT_ROW;
    }
    return table + PT_COAT_HEADER + row * PT_COAT_ROW;
}

/* Flux returned to the base from diffuse light below the interface, in [0, 1). */
static inline float pt_coat_internal(const float *table, float alpha)
{
    int next;
    float t;
    const float *row = pt_coat_rows(table, alpha, &next, &t);
    return next ? (1.0f - t) * row[0] + t * row[next] : row[0];
}

/* mu in [0, 1]: *base gets A(mu), *spec the albedo of the interface's reflection. */
static inline void pt_coat_lookup(const float *table, float alpha, float mu, float *base, float *spec)
{
    int next;
    float t, x = sqrtf(mu) * (float)(PT_COAT_NODES - 1);
    const float *row = pt_coat_rows(table, alpha, &next, &t);
    int i = x < (float)(PT_COAT_NODES - 1) ? (int)x : PT_COAT_NODES - 2;
    float s = fminf(x - (float)i, 1.0f);
    const float *a = row + 1 + i, *e = a + PT_COAT_NODES;
    *base = (1.0f - s) * a[0] + s * a[1];
    *spec = (1.0f - s) * e[0] + s * e[1];
    if (next) {
        a += next;
        e += next;
        *base = (1.0f - t) * *base + t * ((1.0f - s) * a[0] + s * a[1]);
        *spec = (1.0f - t) * *spec + t * ((1.0f - s) * e[0] + s * e[1]);
    }
}

#endif
